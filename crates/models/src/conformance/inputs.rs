//! The motions about which models are asked.

use jointscope_motion::{Body, Pose, Tracks};
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};

/// Noise of the motions' samples, metres, and radians for poses: more than rounding, less than a tolerance.
const NOISE: f64 = 4e-4;
/// Frames of the motions.
const FRAMES: usize = 48;
/// Features of each body.
const FEATURES: usize = 7;

/// What was seen of one body.
#[derive(Debug, Clone)]
pub(super) enum Seen {
    /// Samples, frame after frame; NaN where missing.
    Points { features: usize, samples: Vec<Point3<f64>> },
    /// Poses by a tracker.
    Poses(Vec<Option<Pose>>),
    /// The world, for so many frames.
    World(usize),
}

impl Seen {
    pub(super) fn body(&self, name: &str) -> Body {
        let built = match self {
            Self::Points { features, samples } => {
                let labels = (0..*features).map(|feature| feature.to_string()).collect();
                Tracks::new(*features, samples.clone()).and_then(|tracks| Body::from_points(name, labels, tracks))
            }
            Self::Poses(poses) => Body::from_poses(name, poses.clone()),
            Self::World(frames) => Ok(Body::at_rest(name, *frames)),
        };
        built.expect("the suite's bodies are sound")
    }

    pub(super) fn moved(&self, world: &Pose) -> Self {
        match self {
            Self::Points { features, samples } => {
                Self::Points { features: *features, samples: samples.iter().map(|p| world * p).collect() }
            }
            Self::Poses(poses) => Self::Poses(poses.iter().map(|pose| Some(world * pose.as_ref()?)).collect()),
            Self::World(frames) => Self::World(*frames),
        }
    }

    /// Some of the features of a body of points, or all of them in another order.
    pub(super) fn choose(&self, which: impl Fn(usize) -> Vec<usize>) -> Self {
        let Self::Points { features, samples } = self else { return self.clone() };
        let which = which(*features);
        let rows = samples.chunks_exact(*features);
        let samples = rows.flat_map(|row| which.iter().map(|&feature| row[feature])).collect();
        Self::Points { features: which.len(), samples }
    }

    /// Only the frames for which `keep` holds; the others are there, but show nothing.
    fn only(mut self, keep: impl Fn(usize) -> bool) -> Self {
        match &mut self {
            Self::Points { features, samples } => {
                for (frame, row) in samples.chunks_exact_mut(*features).enumerate() {
                    if !keep(frame) {
                        row.fill(Point3::from([f64::NAN; 3]));
                    }
                }
            }
            Self::Poses(poses) => {
                for (frame, pose) in poses.iter_mut().enumerate() {
                    *pose = pose.filter(|_| keep(frame));
                }
            }
            Self::World(_) => {}
        }
        self
    }
}

/// Two bodies that a model is asked about.
#[derive(Debug, Clone)]
pub(super) struct Input {
    pub(super) name: String,
    /// Whether one body moves as seen from the other.
    pub(super) moves: bool,
    pub(super) reference: Seen,
    pub(super) moving: Seen,
}

impl Input {
    pub(super) fn map(&self, change: impl Fn(&Seen) -> Seen) -> Self {
        let Self { name, moves, .. } = self.clone();
        Self { name, moves, reference: change(&self.reference), moving: change(&self.moving) }
    }
}

/// Numbers that look random and are always the same: a Weyl sequence, mixed (`SplitMix64`: G. Steele, D. Lea, C. Flood,
/// 2014).
struct Numbers(u64);

impl Numbers {
    /// From 0 to 1.
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn within(&mut self, reach: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| (2.0 * self.share() - 1.0) * reach)
    }

    /// Nearly normal, of standard deviation `sigma`: a sum of twelve.
    fn noise(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| (0..12).map(|_| self.share() - 0.5).sum::<f64>() * sigma)
    }
}

/// How a body is looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Look {
    Points,
    /// A quarter of the samples is missing, and the moving body is hidden for some frames.
    Gaps,
    Poses,
    /// The moving body shows a single feature.
    Point,
}

/// A body of general shape, moving by `pose`, seen with noise.
fn look(look: Look, seed: u64, noise: f64, frames: usize, pose: &dyn Fn(usize) -> Pose) -> Seen {
    let mut numbers = Numbers(seed);
    let shape: Vec<_> =
        (0..FEATURES).map(|_| Point3::from(Vector3::new(0.4, 0.1, 1.2) + numbers.within(0.1))).collect();
    if look == Look::Poses {
        let tracked = |frame| {
            let mut seen = pose(frame) * Pose::translation(0.4, 0.1, 1.2);
            seen.translation.vector += numbers.noise(noise);
            seen.rotation *= UnitQuaternion::new(numbers.noise(noise));
            Some(seen)
        };
        return Seen::Poses((0..frames).map(tracked).collect());
    }
    let mut samples: Vec<_> = (0..frames)
        .flat_map(|frame| shape.iter().map(move |p| pose(frame) * p))
        .map(|p| p + numbers.noise(noise))
        .collect();
    if look == Look::Gaps {
        // The first frame stays whole, so that every feature has a start.
        for sample in samples.iter_mut().skip(FEATURES) {
            if numbers.share() < 0.25 {
                *sample = Point3::from([f64::NAN; 3]);
            }
        }
    }
    Seen::Points { features: FEATURES, samples }
}

/// Where the reference is.
fn base(frame: usize) -> Pose {
    let s = frame as f64 / FRAMES as f64;
    let turn = UnitQuaternion::new(Vector3::new(0.3 * (4.0 * s).sin(), -0.2 * s, 0.25 * (3.0 * s).cos()));
    Pose::from_parts(Translation3::new(0.1 * (5.0 * s).sin(), 0.15 * s, 0.05 * (6.0 * s).cos()), turn)
}

/// Where something is by the share of the recording that has passed.
type Path = fn(f64) -> Pose;

/// The kinds of motion, `reference_from_moving` by the share of the recording that has passed.
const MOTIONS: [(&str, Path); 7] = [
    ("a rigid pair", |_| Pose::identity()),
    ("a sliding pair", |s| Pose::translation(0.2 * s, -0.1 * s, 0.15 * s)),
    ("a turning pair", |s| about(Vector3::new(0.3, -0.5, 0.8), 1.8 * s, 0.0)),
    ("a screwing pair", |s| about(Vector3::new(0.3, -0.5, 0.8), 2.0 * s, 0.2 * s)),
    ("a pair in a plane", |s| {
        Pose::translation(0.2 * s, 0.15 * (5.0 * s).sin(), 0.0) * about(Vector3::z(), 1.2 * (4.0 * s).sin(), 0.0)
    }),
    ("a free pair", |s| {
        let turn = UnitQuaternion::new(Vector3::new((5.0 * s).sin(), 0.8 * s, 0.7 * (3.0 * s).sin()));
        Pose::from_parts(Translation3::new(0.3 * (4.0 * s).sin(), 0.2 * s * s, 0.2 * (6.0 * s).sin()), turn)
    }),
    ("a pair at rest", |_| Pose::identity()),
];

/// A turn about, and a slide along, an axis beside the moving body.
fn about(axis: Vector3<f64>, angle: f64, slide: f64) -> Pose {
    let axis = axis.normalize();
    let to_axis = Pose::translation(0.25, 0.0, 1.1);
    to_axis
        * Pose::translation(slide * axis.x, slide * axis.y, slide * axis.z)
        * Pose::rotation(axis * angle)
        * to_axis.inverse()
}

/// Every motion in every look, with noise.
pub(super) fn motions() -> Vec<Input> {
    let looks = [
        (Look::Points, "as points"),
        (Look::Gaps, "as points with gaps"),
        (Look::Poses, "as poses"),
        (Look::Point, "as a single point"),
    ];
    let mut inputs = Vec::new();
    for (kind, (name, motion)) in MOTIONS.into_iter().enumerate() {
        for (manner, (of, words)) in looks.into_iter().enumerate() {
            let seed = (kind * looks.len() + manner) as u64;
            let carrier = |frame: usize| if name == "a pair at rest" { base(0) } else { base(frame) };
            let pose = |frame: usize| carrier(frame) * motion(frame as f64 / (FRAMES - 1) as f64);
            let mut moving = look(of, 2 * seed, NOISE, FRAMES, &pose);
            if of == Look::Gaps {
                moving = moving.only(|frame| !(20..24).contains(&frame));
            } else if of == Look::Point {
                moving = moving.choose(|_| vec![0]);
            }
            let reference = look(of, 2 * seed + 1, NOISE, FRAMES, &carrier);
            let moves = motion(1.0) != Pose::identity();
            inputs.push(Input { name: format!("{name}, seen {words}"), moves, reference, moving });
        }
    }
    inputs
}

/// Inputs that leave a model little or nothing to judge.
pub(super) fn bad_inputs() -> Vec<Input> {
    let exact = 0.0;
    let turning = |frame: usize| base(frame) * MOTIONS[2].1(frame as f64 / FRAMES as f64);
    let sliding = |frame: usize| base(frame) * MOTIONS[1].1(frame as f64 / FRAMES as f64);
    let spinning = |frame: usize| base(frame) * about(Vector3::z(), 0.5 * frame as f64, 0.0);
    let points = |noise, frames, pose: &dyn Fn(usize) -> Pose| look(Look::Points, 9, noise, frames, pose);
    let reference = |frames| points(NOISE, frames, &base);
    let mut inputs = Vec::new();
    let mut add = |name: &str, reference: Seen, moving: Seen| {
        inputs.push(Input { name: name.into(), moves: true, reference, moving });
    };
    for frames in 1..=5 {
        let name = format!("a turning pair in {frames} frames");
        add(&name, reference(frames), points(NOISE, frames, &turning));
        add(&format!("{name}, without noise"), points(exact, frames, &base), points(exact, frames, &turning));
        let poses = |pose: &dyn Fn(usize) -> Pose| look(Look::Poses, 9, NOISE, frames, pose);
        add(&format!("{name}, as poses"), poses(&base), poses(&turning));
    }
    let still = |frames| points(exact, frames, &|_| base(3));
    add("a pair that rests exactly", still(FRAMES), still(FRAMES));
    add("a pair of poses that rests exactly", Seen::Poses(vec![Some(base(3)); 9]), Seen::Poses(vec![Some(base(5)); 9]));
    add("a body that moves as its reference does, exactly", points(exact, FRAMES, &base), points(exact, FRAMES, &base));
    add("a body that turns exactly", points(exact, FRAMES, &base), points(exact, FRAMES, &turning));
    add("a body that slides exactly", points(exact, FRAMES, &base), points(exact, FRAMES, &sliding));
    add("a body that spins many times", reference(FRAMES), points(NOISE, FRAMES, &spinning));
    add("a moving body seen from the world", Seen::World(FRAMES), points(NOISE, FRAMES, &turning));
    add("the world seen from a moving body", reference(FRAMES), Seen::World(FRAMES));
    for features in 1..=3 {
        let few = points(NOISE, FRAMES, &turning).choose(|_| (0..features).collect());
        add(&format!("a body of {features} features"), reference(FRAMES), few);
    }
    let same = still(FRAMES).choose(|_| vec![0]);
    add("a single feature that rests exactly", reference(FRAMES), same);
    let in_line = |spacing: f64| Seen::Points {
        features: 4,
        samples: (0..FRAMES)
            .flat_map(|frame| (0..4).map(move |i| turning(frame) * Point3::new(0.3, 0.2 + spacing * f64::from(i), 1.0)))
            .collect(),
    };
    add("collinear features", reference(FRAMES), in_line(0.1));
    add("features in one place", reference(FRAMES), in_line(0.0));
    add("a body seen in one frame", reference(FRAMES), points(NOISE, FRAMES, &turning).only(|frame| frame == 17));
    add("a body seen in two frames", reference(FRAMES), points(NOISE, FRAMES, &turning).only(|frame| frame % 30 == 5));
    add(
        "a body seen in every other frame",
        reference(FRAMES),
        points(NOISE, FRAMES, &turning).only(|frame| frame % 2 == 0),
    );
    let relay = |frame: usize, feature: usize| frame / (FRAMES / FEATURES) == feature;
    let mut one_by_one = points(NOISE, FRAMES, &turning);
    if let Seen::Points { samples, .. } = &mut one_by_one {
        for (index, sample) in samples.iter_mut().enumerate() {
            if !relay(index / FEATURES, index % FEATURES) {
                *sample = Point3::from([f64::NAN; 3]);
            }
        }
    }
    add("features that are seen one after the other", reference(FRAMES), one_by_one);
    for (size, name) in [(1e-30, "tiny"), (1e30, "huge")] {
        let scaled = |seen: Seen| match seen {
            Seen::Points { features, samples } => {
                Seen::Points { features, samples: samples.into_iter().map(|p| p * size).collect() }
            }
            other => other,
        };
        let name = format!("a turning pair of {name} size");
        add(&name, scaled(reference(FRAMES)), scaled(points(NOISE, FRAMES, &turning)));
    }
    let far = Pose::translation(1e7, -2e7, 3e7);
    let away = |seen: Seen| seen.moved(&far);
    add("a turning pair far away", away(reference(FRAMES)), away(points(NOISE, FRAMES, &turning)));
    inputs
}
