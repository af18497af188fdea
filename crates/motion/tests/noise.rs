//! Noise found in the data against the noise that was put in: χ²/dof of the right model is 1.

use jointscope_motion::{
    Body, BodyMotion, MotionSettings, Noise, NoiseSetting, Pose, Registration, Tracks,
    nalgebra::{Point3, Translation3, UnitQuaternion, Vector3},
};

/// Standard deviation put in, metres: half a per cent of the bodies' size, so that second-order terms stay below 1e-4.
const SIGMA: f64 = 0.001;
/// Edge of the bodies, metres.
const SIZE: f64 = 0.2;
/// Standard errors within which a mean must lie: fixed seeds are drawn once, and one in 16 000 draws lies farther.
const STANDARD_ERRORS: f64 = 4.0;
/// Shape registration: χ²/dof is 1 within this, which four standard errors of the bodies below reach.
const SHAPE: f64 = 0.005;
/// `chained` and `first` are judged after three rounds towards the mean shape, not at it; measured with eight times the
/// bodies below, χ²/dof is 1 within 0.3 % for them as well.
const UNSETTLED: f64 = 0.015;
/// Robust registration leaves out what is beyond 4.5 σ, which one clean sample in some thousands is by chance; of few
/// frames the scale of that limit is told badly, so that χ²/dof is asked for from twelve on.
const ROBUST: f64 = 0.01;
const ROBUST_FRAMES: usize = 12;
/// Clean bodies looked at, share of their samples that may be left out, ten times the share of Gaussian ones beyond
/// 4.5 σ, and share of the bodies whose noise may seem to differ between directions by chance.
const CLEAN_BODIES: usize = 400;
const LEFT_OUT: f64 = 1e-3;
const UNEVEN: f64 = 0.05;
/// Noise from third differences, whose median uses a third of the data's information: share of it.
const THIRD_DIFFERENCES: f64 = 0.05;
/// One estimate made twice from the same frames, as a share of it: rounding of sums of squares.
const SAME: f64 = 1e-9;
/// What rounding of coordinates near 1 m leaves of no noise, metres and radians.
const NONE: f64 = 1e-13;

/// Uniform and normal numbers from a counter (`SplitMix64`: G. Steele, D. Lea, C. Flood, 2014).
struct Random(u64);

impl Random {
    /// In (0, 1).
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64 + f64::EPSILON / 4.0
    }

    /// Standard normal, by the method of Box and Muller.
    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }

    fn normals(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal())
    }

    fn within(&mut self, reach: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| (2.0 * self.uniform() - 1.0) * reach)
    }
}

/// A smooth motion about a point a metre away; `speed` radians per frame.
fn truth(frame: usize, speed: f64) -> Pose {
    let s = frame as f64 * speed;
    let turn = UnitQuaternion::new(Vector3::new(0.5 * s.sin(), 0.8 * (0.7 * s).sin(), 0.4 * (1.3 * s).sin()));
    let place = Vector3::new(0.2 * (0.9 * s).sin(), 0.1 * s.cos(), 1.0 + 0.3 * (0.4 * s).sin());
    Pose::from_parts(Translation3::from(place), turn)
}

/// What a series of bodies looks like.
#[derive(Debug, Clone, Copy)]
struct Series {
    features: usize,
    frames: usize,
    /// Share of the samples that are missing.
    missing: f64,
}

impl Series {
    /// Samples of one body with noise, frame by frame.
    fn samples(self, seed: u64) -> Vec<Vec<Point3<f64>>> {
        let mut random = Random(seed);
        // A body that is thin by chance has no pose; these corners keep every one solid.
        let mut shape = vec![[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0]];
        shape.truncate(self.features);
        let mut shape: Vec<Point3<f64>> = shape.into_iter().map(|p| Point3::from(p) * (SIZE / 2.0)).collect();
        while shape.len() < self.features {
            shape.push(random.within(SIZE / 2.0).into());
        }
        let frame = |frame: usize| {
            let mut sample = |p: &Point3<f64>| {
                let seen = truth(frame, 0.1) * p + SIGMA * random.normals();
                if random.uniform() < self.missing { Point3::from([f64::NAN; 3]) } else { seen }
            };
            shape.iter().map(&mut sample).collect()
        };
        (0..self.frames).map(frame).collect()
    }

    /// The samples of one of many bodies.
    fn body(self, number: usize) -> Vec<Vec<Point3<f64>>> {
        self.samples((number * 1000 + self.features * 100 + self.frames) as u64)
    }

    /// χ² of the true noise that the estimates of `bodies` state, per degree of freedom, and its standard error.
    fn chi_squared(self, settings: &MotionSettings, bodies: usize) -> (f64, f64) {
        let ratios: Vec<f64> = (0..bodies)
            .map(|number| (estimate_by(&self.body(number), settings).expect("enough samples") / SIGMA).powi(2))
            .collect();
        let mean = ratios.iter().sum::<f64>() / bodies as f64;
        let variance = ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (bodies as f64 - 1.0);
        (mean, (variance / bodies as f64).sqrt())
    }
}

fn body(samples: &[Vec<Point3<f64>>]) -> Body {
    let labels = (0..samples[0].len()).map(|feature| feature.to_string()).collect();
    let tracks = Tracks::new(samples[0].len(), samples.concat()).expect("whole frames");
    Body::from_points("thing", labels, tracks).expect("seen")
}

fn estimate(samples: &[Vec<Point3<f64>>], registration: Registration) -> Option<f64> {
    estimate_by(samples, &MotionSettings { registration, ..MotionSettings::default() })
}

fn estimate_by(samples: &[Vec<Point3<f64>>], settings: &MotionSettings) -> Option<f64> {
    BodyMotion::of(&body(samples), settings).noise().position
}

/// From three features, the fewest, to many; from few frames to many; bodies so many that the standard error of their
/// mean is a quarter of [`SHAPE`].
const SERIES: [(Series, usize); 6] = [
    (Series { features: 3, frames: 40, missing: 0.0 }, 10_000),
    (Series { features: 8, frames: 5, missing: 0.0 }, 20_000),
    (Series { features: 20, frames: 50, missing: 0.0 }, 600),
    (Series { features: 6, frames: 40, missing: 0.1 }, 3000),
    (Series { features: 12, frames: 30, missing: 0.3 }, 2500),
    (Series { features: 20, frames: 40, missing: 0.5 }, 1500),
];

#[test]
fn chi_squared_per_degree_of_freedom_is_one_for_shape_registration() {
    for (series, bodies) in SERIES {
        let plain = MotionSettings { robust: false, ..MotionSettings::default() };
        let (mean, error) = series.chi_squared(&plain, bodies);
        assert!(STANDARD_ERRORS * error <= 1.1 * SHAPE, "too few bodies: {series:?} leaves {error:.5}");
        assert!((mean - 1.0).abs() <= SHAPE, "{series:?}: {mean:.5} ± {error:.5}");
    }
}

#[test]
fn chi_squared_per_degree_of_freedom_is_one_for_robust_registration_of_clean_bodies() {
    for (series, bodies) in SERIES.into_iter().filter(|(series, _)| series.frames >= ROBUST_FRAMES) {
        let (mean, error) = series.chi_squared(&MotionSettings::default(), bodies / 2);
        assert!(STANDARD_ERRORS * error <= 1.1 * ROBUST, "too few bodies: {series:?} leaves {error:.5}");
        assert!((mean - 1.0).abs() <= ROBUST, "{series:?}: {mean:.5} ± {error:.5}");
    }
}

#[test]
fn robust_registration_leaves_hardly_any_clean_sample_out() {
    for (series, _) in SERIES {
        let (mut wild, mut strays) = (0, 0);
        for number in 0..CLEAN_BODIES {
            let body = body(&series.body(number));
            let motion = BodyMotion::of(&body, &MotionSettings::default());
            wild += motion.wild_samples();
            strays += motion.strays().len();
        }
        let samples = (CLEAN_BODIES * series.frames * series.features) as f64 * (1.0 - series.missing);
        assert!(wild as f64 <= LEFT_OUT * samples, "{series:?}: {wild} of {samples} samples");
        assert_eq!(strays, 0, "{series:?}: features left out");
    }
}

#[test]
fn the_noise_of_clean_bodies_is_the_same_in_all_directions() {
    for (series, _) in SERIES {
        let told = |number: &usize| {
            let body = body(&series.body(*number));
            BodyMotion::of(&body, &MotionSettings::default()).depth_noise() != 1.0
        };
        let uneven = (0..CLEAN_BODIES).filter(told).count();
        assert!(uneven as f64 <= UNEVEN * CLEAN_BODIES as f64, "{series:?}: {uneven} of {CLEAN_BODIES} bodies");
    }
}

#[test]
fn chi_squared_per_degree_of_freedom_is_one_for_chained_and_first_too() {
    for (series, bodies) in SERIES {
        for registration in [Registration::Chained, Registration::First] {
            let settings = MotionSettings { registration, ..MotionSettings::default() };
            let (mean, error) = series.chi_squared(&settings, bodies / 8);
            assert!(STANDARD_ERRORS * error <= 1.1 * UNSETTLED, "too few bodies: {series:?} leaves {error:.5}");
            assert!((mean - 1.0).abs() <= UNSETTLED, "{registration:?}, {series:?}: {mean:.5} ± {error:.5}");
        }
    }
}

#[test]
fn frames_that_repeat_exactly_count_once() {
    for registration in [Registration::Shape, Registration::Chained, Registration::First] {
        for missing in [0.0, 0.2] {
            let samples = Series { features: 8, frames: 15, missing }.samples(5);
            let mut held = vec![samples[0].clone(); 40];
            held.extend(samples[1..].iter().enumerate().flat_map(|(i, row)| vec![row.clone(); 1 + i % 3]));
            let [once, repeated] = [samples, held].map(|s| estimate(&s, registration).expect("enough samples"));
            assert!((repeated / once - 1.0).abs() <= SAME, "{registration:?}: {once:e} m became {repeated:e} m");
        }
    }
}

#[test]
fn noise_that_is_known_is_not_estimated() {
    let settings = MotionSettings { noise: NoiseSetting::Known(0.25), ..MotionSettings::default() };
    let body = body(&Series { features: 8, frames: 15, missing: 0.0 }.samples(5));
    assert_eq!(BodyMotion::of(&body, &settings).noise(), Noise { position: Some(0.25), rotation: None });
}

#[test]
fn bodies_without_noise_have_none_whether_they_move_or_rest() {
    let shape: Vec<Point3<f64>> =
        [[0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.1], [0.1, 0.1, 0.1]].map(Point3::from).into();
    for features in [1, 2, 4] {
        // Of two features the line through both is fitted, which rounds.
        let none = if features == 2 { NONE } else { 0.0 };
        let at = |frame: usize| -> Vec<_> { shape[..features].iter().map(|p| truth(frame, 0.1) * p).collect() };
        let resting = vec![at(7); 12];
        let mut flickering = resting.clone();
        flickering[3][0].x = f64::NAN;
        for registration in [Registration::Shape, Registration::Chained, Registration::First] {
            let sigma = estimate(&resting, registration).expect("enough samples");
            assert!(sigma <= none, "{features} features, {registration:?}: {sigma:e} m");
            let sigma = estimate(&flickering, registration).expect("enough samples");
            assert!(sigma <= NONE, "{features} features, {registration:?}: {sigma:e} m");
        }
    }
    for registration in [Registration::Shape, Registration::Chained, Registration::First] {
        let moving: Vec<Vec<_>> = (0..20).map(|f| shape.iter().map(|p| truth(f, 0.1) * p).collect()).collect();
        let sigma = estimate(&moving, registration).expect("enough samples");
        assert!(sigma <= NONE, "moving, {registration:?}: {sigma:e} m");
    }
    let resting = Body::from_poses("tag", vec![Some(truth(3, 0.1)); 9]).expect("seen");
    let noise = BodyMotion::of(&resting, &MotionSettings::default()).noise();
    assert_eq!(noise, Noise { position: Some(0.0), rotation: Some(0.0) });
}

#[test]
fn noise_of_one_and_two_points_is_found_from_third_differences() {
    for features in [1, 2] {
        for missing in [0.0, 0.1] {
            let samples = Series { features, frames: 6000, missing }.samples(features as u64);
            let sigma = estimate(&samples, Registration::Shape).expect("enough samples");
            assert!((sigma / SIGMA - 1.0).abs() <= THIRD_DIFFERENCES, "{features}, {missing}: {sigma:e} m");
        }
    }
}

#[test]
fn noise_of_poses_is_found_for_positions_and_rotations_apart() {
    for (seed, (position, rotation)) in [(0.001, 0.02), (0.01, 0.002), (0.002, 0.1)].into_iter().enumerate() {
        let mut random = Random(seed as u64);
        let poses = (0..6000).map(|frame| {
            let mut pose = truth(frame, 0.02);
            pose.translation.vector += position * random.normals();
            pose.rotation *= UnitQuaternion::new(rotation * random.normals());
            (random.uniform() > 0.05).then_some(pose)
        });
        let body = Body::from_poses("tag", poses.collect()).expect("seen");
        let noise = BodyMotion::of(&body, &MotionSettings::default()).noise();
        for (found, true_noise) in [(noise.position, position), (noise.rotation, rotation)] {
            let ratio = found.expect("enough samples") / true_noise;
            assert!((ratio - 1.0).abs() <= THIRD_DIFFERENCES, "{position} m, {rotation} rad: {ratio} times the truth");
        }
    }
}

#[test]
fn a_body_that_slowly_changes_its_shape_is_told_from_noise_drift_of_one_feature_and_wild_samples() {
    let deformation = |stretch: f64, noise: f64, of_one: f64, wild: f64| {
        let mut random = Random(5);
        let shape: Vec<Vector3<f64>> = (0..10).map(|_| random.within(SIZE / 2.0)).collect();
        let mut positions = Vec::new();
        for frame in 0..120 {
            let swing = (0.05 * f64::from(frame)).sin();
            let pose = Pose::new(Vector3::new(0.3 * swing, 0.1, 1.0), Vector3::new(0.2, 0.8, -0.3) * swing);
            for (feature, place) in shape.iter().enumerate() {
                let mut place = *place;
                place.x *= 1.0 + stretch * swing;
                place.y += if feature == 0 { of_one * swing } else { 0.0 };
                place.z += if random.uniform() < 0.05 { wild } else { 0.0 };
                positions.push(pose * Point3::from(place) + random.normals() * noise);
            }
        }
        let labels = (0..10).map(|feature| feature.to_string()).collect();
        let body = Body::from_points("body", labels, Tracks::new(10, positions).expect("full")).expect("seen");
        BodyMotion::of(&body, &MotionSettings::default()).deformation().expect("told")
    };
    let soft = deformation(0.2, SIGMA, 0.0, 0.0);
    // A stretch by 20 % of 0.2 m: at least half of its standard deviation over features and time, of which poses take up
    // a part, and less than the most that any feature departs.
    let (least, most) = (0.5 * 0.2 * SIZE / 12_f64.sqrt() / 2_f64.sqrt(), 0.2 * SIZE / 2.0);
    assert!((least..most).contains(&soft.distance), "{soft:?}");
    assert!((0.8..1.2).contains(&(soft.noise / (3_f64.sqrt() * SIGMA))), "{soft:?}");
    for rigid in [
        deformation(0.0, SIGMA, 0.0, 0.0),
        deformation(0.0, SIGMA, 0.05, 0.0),
        deformation(0.0, SIGMA, 0.0, 0.05),
        deformation(0.0, 0.0, 0.0, 0.0),
    ] {
        assert!(rigid.distance < 0.7 * rigid.noise.max(1e-9), "{rigid:?}");
    }
}
