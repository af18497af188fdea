//! Noise found in the data against the noise that was put in: χ²/dof of the right model is 1.

use jointscope_motion::{
    Body, BodyMotion, MotionSettings, Noise, Pose, Registration, Tracks,
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
/// `chained` and `first` are judged after three rounds towards the mean shape, which full visibility makes enough:
/// as [`SHAPE`]. With 30 % missing samples what is left of their error adds a few per cent.
const UNSETTLED: f64 = 0.03;
/// Noise from third differences, whose median uses a third of the data's information: share of it.
const THIRD_DIFFERENCES: f64 = 0.05;
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

    /// χ² of the true noise that the estimates of `bodies` state, per degree of freedom, and its standard error.
    fn chi_squared(self, registration: Registration, bodies: usize) -> (f64, f64) {
        let ratios: Vec<f64> = (0..bodies)
            .map(|number| {
                let seed = (number * 1000 + self.features * 100 + self.frames) as u64;
                (estimate(&self.samples(seed), registration).expect("enough samples") / SIGMA).powi(2)
            })
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
    let settings = MotionSettings { registration, ..MotionSettings::default() };
    BodyMotion::of(&body(samples), &settings).noise().position
}

/// From three features, the fewest, to many; from few frames to many; bodies so many that four standard errors are
/// about [`SHAPE`].
const SERIES: [(Series, usize); 6] = [
    (Series { features: 3, frames: 40, missing: 0.0 }, 10_000),
    (Series { features: 8, frames: 5, missing: 0.0 }, 20_000),
    (Series { features: 20, frames: 50, missing: 0.0 }, 600),
    (Series { features: 6, frames: 40, missing: 0.1 }, 3000),
    (Series { features: 12, frames: 30, missing: 0.3 }, 2500),
    (Series { features: 20, frames: 40, missing: 0.5 }, 1500),
];

#[test]
fn probe_repeats() {
    for missing in [0.0, 0.3] { for registration in [Registration::Shape, Registration::Chained, Registration::First] {
        let series = Series { features: 8, frames: 10, missing };
        let (mut sum, mut once) = (0.0, 0.0);
        for number in 0..2000 {
            let samples = series.samples(number);
            once += (estimate(&samples, registration).unwrap() / SIGMA).powi(2);
            let held: Vec<_> = std::iter::repeat_n(&samples[0], 40).chain(&samples[1..]).cloned().collect();
            sum += (estimate(&held, registration).unwrap() / SIGMA).powi(2);
        }
        println!("{missing} {registration:?} once {} held {}", once / 2000.0, sum / 2000.0);
    } }
}
