//! What is computed in lanes equals what is computed point by point.

use jointscope_motion::{Body, BodyMotion, MotionSettings, Pose, Registration, RelativeMotion, Tracks};
use nalgebra::{Point3, Vector3};

use crate::thesis::{CircleMethod, Longest, Overshoot, ThesisPrismatic, ThesisRevolute, ThesisRigid};
use crate::{Joint, JointFit, JointModel};

/// Rounding through squares, fourth powers and eigenvectors.
const SAME: f64 = 1e-9;

/// A number between -1 and 1 that looks random.
fn wild(seed: usize) -> f64 {
    (seed as f64 * 12.9898).sin().mul_add(43_758.545_3, 0.5).rem_euclid(1.0) * 2.0 - 1.0
}

fn wild_vector(seed: usize) -> Vector3<f64> {
    Vector3::new(wild(3 * seed), wild(3 * seed + 1), wild(3 * seed + 2))
}

/// A body of seven features that follows poses; with `unseen`, of an eighth one that is never seen, for the sake of which
/// nothing is computed in lanes.
fn body(name: &str, poses: &[Pose], noise: f64, unseen: bool) -> Body {
    const FEATURES: usize = 7;
    let seed = name.len();
    let features = FEATURES + usize::from(unseen);
    let place = |frame: usize, feature: usize| {
        if feature == FEATURES {
            return Point3::from([f64::NAN; 3]);
        }
        let error = noise * wild_vector(1000 * (frame + 1) + 10 * feature + seed);
        poses[frame] * Point3::from(0.2 * wild_vector(feature + 100 * seed)) + error
    };
    let positions = (0..poses.len()).flat_map(|frame| (0..features).map(move |feature| (frame, feature)));
    let positions = positions.map(|(frame, feature)| place(frame, feature)).collect();
    let labels = (0..features).map(|feature| feature.to_string()).collect();
    Body::from_points(name, labels, Tracks::new(features, positions).expect("full")).expect("seen")
}

type Motion = (&'static str, fn(f64) -> Pose);

const MOTIONS: [Motion; 5] = [
    ("a hinge", |s| {
        let arm = Pose::translation(0.4, 0.1, 0.0);
        arm * Pose::rotation(Vector3::new(0.3, 0.2, 1.0).normalize() * 1.7 * s) * arm.inverse()
    }),
    ("a door ajar", |s| Pose::rotation(Vector3::z() * 0.1 * s) * Pose::translation(0.5, 0.0, 0.0)),
    ("a drawer", |s| Pose::translation(0.5 * s, 0.2 * s, -0.1 * s)),
    ("rest", |_| Pose::translation(0.3, 0.0, 0.0)),
    ("flight", |s| Pose::new(Vector3::new(s.sin(), (3.0 * s).cos(), s), Vector3::new(s, -2.0 * s, (2.0 * s).sin()))),
];

/// The fits of a model to a motion, in lanes and point by point.
fn both_ways(model: &dyn JointModel, motion: fn(f64) -> Pose, frames: usize, noise: f64) -> [JointFit; 2] {
    let at = |frame: usize| frame as f64 / (frames - 1) as f64;
    let base: Vec<Pose> =
        (0..frames).map(|k| Pose::new(Vector3::new(0.1 * at(k), 0.0, 2.0), Vector3::new(0.0, 0.4, at(k)))).collect();
    let moved: Vec<Pose> = base.iter().enumerate().map(|(k, base)| base * motion(at(k))).collect();
    [false, true].map(|unseen| {
        let bodies = [body("base", &base, noise, false), body("mover", &moved, noise, unseen)];
        let settings = MotionSettings { registration: Registration::First, ..MotionSettings::default() };
        let [base, mover] = [0, 1].map(|k| BodyMotion::of(&bodies[k], &settings));
        let motion = RelativeMotion::between(&base, &mover).expect("seen together");
        assert_eq!(motion.columns().is_none(), unseen);
        model.fit(&motion).expect("enough frames")
    })
}

fn numbers(fit: &JointFit) -> Vec<f64> {
    let Joint { axis, positions } = &fit.joint;
    let axis = axis.iter().flat_map(|axis| {
        axis.point.iter().copied().chain(axis.direction.iter().flat_map(|d| d.iter().copied().collect::<Vec<_>>()))
    });
    let positions = positions.iter().flat_map(|positions| positions.iter().flatten().flatten().copied());
    let parts = fit.parts.values().copied().chain(fit.residual_rms);
    std::iter::once(fit.confidence.value()).chain(parts).chain(axis).chain(positions.collect::<Vec<_>>()).collect()
}

#[test]
fn scores_axes_and_positions_are_the_same_in_lanes() {
    let models: [(&str, Box<dyn JointModel>); 7] = [
        ("rigid", Box::new(ThesisRigid::default())),
        ("prismatic", Box::new(ThesisPrismatic::default())),
        ("by path", Box::new(ThesisPrismatic { longest: Longest::Path, sections: 3, ..ThesisPrismatic::default() })),
        ("drop", Box::new(ThesisPrismatic { overshoot: Overshoot::Drop, ..ThesisPrismatic::default() })),
        ("adaptive", Box::new(ThesisPrismatic { adaptive_sections: true, ..ThesisPrismatic::default() })),
        ("revolute", Box::new(ThesisRevolute::default())),
        ("Kåsa", Box::new(ThesisRevolute { circle: CircleMethod::Kasa, turntable: true, ..Default::default() })),
    ];
    for (name, model) in &models {
        for (what, motion) in MOTIONS {
            for frames in [3, 8, 37, 200] {
                let [lanes, points] = both_ways(&**model, motion, frames, 1e-3);
                let (found, expected) = (numbers(&lanes), numbers(&points));
                assert_eq!(found.len(), expected.len(), "{name}, {what}, {frames} frames");
                for (a, b) in found.iter().zip(&expected) {
                    let off = (a - b).abs();
                    assert!(off <= SAME * b.abs().max(1.0), "{name}, {what}, {frames} frames: {a} {b}\n{lanes:?}");
                }
            }
        }
    }
}

#[test]
fn exact_motions_are_told_the_same_in_lanes() {
    for (what, motion) in MOTIONS {
        for model in [&ThesisPrismatic::default() as &dyn JointModel, &ThesisRevolute::default()] {
            let [lanes, points] = both_ways(model, motion, 101, 0.0);
            let off = (lanes.confidence.value() - points.confidence.value()).abs();
            assert!(off < SAME, "{what}: {lanes:?}\n{points:?}");
        }
    }
}
