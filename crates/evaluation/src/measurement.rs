//! One recording, simulated and judged.

use std::time::Instant;

use jointscope_detection::{DetectionError, Detector, PairDetection};
use jointscope_models::{Axis, AxisUncertainty};
use jointscope_motion::{Body, Observation, Pose, Recording};
use jointscope_scenes::{EXPERIMENTS, SceneError, SceneOptions, Simulation, TrueAxis, simulate};
use nalgebra::{Point3, Vector3};

use crate::{
    AxisError, Column, Condition, EvaluationError, Procedure,
    axis_error::{angle, from_line},
};

/// Largest differences between the axes of one joint seen from both bodies, radians and metres.
const SAME_AXIS: f64 = 1e-6;

/// What is known about one verdict.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Measurement {
    pub(crate) scene: &'static str,
    pub(crate) seed: u64,
    /// Name of the true joint.
    pub(crate) expected: String,
    /// Name of the joint found.
    pub(crate) found: String,
    pub(crate) confidence: f64,
    pub(crate) determined: bool,
    /// Error of the revolute model's axis, whatever the verdict; only where the true joint is revolute.
    pub(crate) axis: Option<AxisError>,
    /// What that model says of its axis.
    pub(crate) stated: Option<AxisUncertainty>,
    /// Reported noise of the moving body over its true noise.
    pub(crate) noise_ratio: Option<f64>,
    /// What the true joint's model leaves unexplained, per degree of freedom.
    pub(crate) chi_squared_per_freedom: Option<f64>,
    /// What is left of the moving body's scale beside the reference's when it is put right, as a share; only where the
    /// motion shows it.
    pub(crate) scale_error: Option<f64>,
    /// Whether the motion shows the scale; only where it was sought.
    pub(crate) shows_scale: Option<bool>,
    /// Error of the moving body's depth gain, as a share; only where it was told.
    pub(crate) gain_error: Option<f64>,
    /// Whether all orders of the bodies give the same; only where that was tried.
    pub(crate) symmetric: Option<bool>,
    /// Time of one detection.
    pub(crate) seconds: f64,
}

/// Simulates a condition with one seed, and lets every column judge it: the measurements of every column.
pub(crate) fn measure(
    condition: &Condition,
    seed: u64,
    columns: &[Column],
) -> Result<Vec<Vec<Measurement>>, EvaluationError> {
    let Condition { scene, .. } = *condition;
    let options = SceneOptions { seed, ..condition.options.clone() };
    let simulated = simulate(scene, &options).and_then(|simulation| {
        Ok(Simulated { tracked_from_true: tracked_from_true(&options, &simulation)?, simulation })
    });
    let simulated = simulated.map_err(|error| EvaluationError::Scene { scene, seed, error })?;
    let judge = |column: &Column| {
        let detector = if condition.one_camera { &column.for_one_camera } else { &column.detector };
        judge(condition, &simulated, detector).map_err(|error| EvaluationError::Detection { scene, seed, error })
    };
    columns.iter().map(judge).collect()
}

/// A recording with what is true of it.
struct Simulated {
    simulation: Simulation,
    /// Moves the truth about every body into the coordinates in which it is tracked.
    tracked_from_true: Vec<Pose>,
}

/// For every body the coordinates that its axes are compared in, from those of the truth.
///
/// Bodies seen as points have no coordinates but those of the first frame, as it is seen. Bodies seen as poses have
/// their tracker's, in which any other program gives its axes; in those of the first frame all axes would be off by the
/// noise of a single pose.
fn tracked_from_true(options: &SceneOptions, simulation: &Simulation) -> Result<Vec<Pose>, SceneError> {
    let bodies = simulation.recording.bodies();
    if !options.poses {
        return Ok(vec![Pose::identity(); bodies.len()]);
    }
    let exact = SceneOptions {
        noise: Some(0.0),
        rotation_noise: Some(0.0),
        outlier_samples: None,
        dropout: None,
        flips: None,
        filter: None,
        ..options.clone()
    };
    let exact = simulate(&simulation.truth.scene, &exact)?;
    let first = |body: &Body| match body.observation() {
        Observation::Poses(poses) => poses.iter().flatten().next().copied().unwrap_or_default(),
        _ => Pose::identity(),
    };
    Ok(bodies.iter().zip(exact.recording.bodies()).map(|(seen, exact)| first(seen) * first(exact).inverse()).collect())
}

fn judge(
    condition: &Condition,
    simulated: &Simulated,
    detector: &Detector,
) -> Result<Vec<Measurement>, DetectionError> {
    let Simulated { simulation, .. } = simulated;
    let experiment = match condition.procedure {
        Procedure::Experiment => EXPERIMENTS.iter().find(|experiment| experiment.scene == condition.scene),
        Procedure::Pair | Procedure::Exchange => None,
    };
    let asked: Option<Vec<[String; 2]>> = experiment.map(|experiment| {
        experiment.pairs.iter().map(|pair| [pair.reference, pair.moving].map(String::from)).collect()
    });
    let recording = simulation.recording.clone();
    let start = Instant::now();
    let detection = detector.detect(recording, asked.as_deref())?;
    let seconds = start.elapsed().as_secs_f64();
    let symmetric = match (condition.procedure, detection.pairs.as_slice()) {
        (Procedure::Exchange, [pair]) => Some(symmetric(pair, &simulation.recording, detector)?),
        _ => None,
    };
    let measured = detection.pairs.iter().filter_map(|pair| measured(simulated, condition.scene, pair));
    Ok(measured.map(|measurement| Measurement { symmetric, seconds, ..measurement }).collect())
}

fn measured(simulated: &Simulated, scene: &'static str, pair: &PairDetection) -> Option<Measurement> {
    let Simulated { simulation, tracked_from_true } = simulated;
    let truth = simulation.truth.pair(&pair.reference, &pair.moving)?;
    let revolute = pair.models.get("revolute").and_then(|fit| fit.as_ref().ok());
    let revolute = revolute.filter(|_| truth.joint == "revolute");
    let reference = simulation.truth.bodies.iter().position(|body| body.name == pair.reference)?;
    let true_axis = truth.axis.as_ref().map(|axis| seen_from(axis, &tracked_from_true[reference]));
    let axis = revolute.and_then(|fit| AxisError::between(fit.joint.axis.as_ref()?, true_axis.as_ref()?));
    let body = |name: &String| simulation.truth.bodies.iter().find(|body| body.name == *name);
    let scale_of = |name: &String| body(name).map(|body| body.scale);
    let (scale, gain) = (pair.scale.as_ref(), pair.depth_gain.map(|[_, moving]| moving));
    let true_noise = simulation.truth.bodies.iter().find(|body| body.name == pair.moving).map(|body| body.noise);
    let ratio = |noise: f64| Some(pair.noise_moving.position? / noise);
    let of_true_joint = pair.models.get(&truth.joint).and_then(|fit| fit.as_ref().ok());
    Some(Measurement {
        scene,
        seed: simulation.truth.seed,
        expected: truth.joint.clone(),
        found: pair.verdict.joint.clone(),
        confidence: pair.verdict.confidence,
        determined: pair.determined,
        axis,
        stated: revolute.and_then(|fit| fit.axis_uncertainty),
        noise_ratio: true_noise.filter(|noise| *noise > 0.0).and_then(ratio),
        chi_squared_per_freedom: of_true_joint.and_then(|fit| fit.parts.get("chi_squared_per_freedom").copied()),
        scale_error: scale
            .and_then(|scale| Some(scale.factor? * scale_of(&pair.moving)? / scale_of(&pair.reference)? - 1.0)),
        shows_scale: scale.map(|scale| scale.observable),
        gain_error: gain
            .filter(|gain| gain.observable)
            .and_then(|gain| Some(gain.gain / body(&pair.moving)?.depth_gain - 1.0)),
        symmetric: None,
        seconds: 0.0,
    })
}

fn seen_from(axis: &TrueAxis, target_from_source: &Pose) -> TrueAxis {
    let turned = |direction: [f64; 3]| (target_from_source.rotation * Vector3::from(direction)).into();
    let point = (target_from_source * Point3::from(axis.point)).coords.into();
    TrueAxis { point, direction: axis.direction.map(turned), ..*axis }
}

/// Whether the joint is the same with the bodies asked for in the other order, and with exchanged bodies.
fn symmetric(pair: &PairDetection, recording: &Recording, detector: &Detector) -> Result<bool, DetectionError> {
    let swapped = [[pair.moving.clone(), pair.reference.clone()]];
    let asked = detector.detect(recording.clone(), Some(&swapped))?;
    let (numbers, times, mut bodies) = recording.clone().into_parts();
    bodies.reverse();
    let Ok(exchanged) = Recording::new(numbers, times, bodies) else { return Ok(false) };
    let exchanged = detector.detect(exchanged, None)?;
    let same = |other: &PairDetection| {
        pair.verdict.joint == other.verdict.joint
            && same_axis(&pair.verdict.joint, pair.axis.as_ref(), other.axis_in_moving.as_ref())
            && same_axis(&pair.verdict.joint, pair.axis_in_moving.as_ref(), other.axis.as_ref())
    };
    Ok(asked.pairs.iter().chain(&exchanged.pairs).all(same))
}

/// Whether two axes of a joint are one, as far as the joint knows: slides and planes have no place, centres no
/// direction.
fn same_axis(joint: &str, one: Option<&Axis>, other: Option<&Axis>) -> bool {
    let (one, other) = match (one, other) {
        (Some(one), Some(other)) => (one, other),
        (one, other) => return one.is_none() && other.is_none(),
    };
    match (one.direction, other.direction) {
        (Some(direction), Some(other_direction)) => {
            let placed = !matches!(joint, "prismatic" | "planar");
            angle(&direction, &other_direction) < SAME_AXIS
                && (!placed || from_line(&other.point, &one.point, &direction) < SAME_AXIS)
        }
        (None, None) => (one.point - other.point).norm() < SAME_AXIS,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use jointscope_detection::Configuration;
    use jointscope_models::Catalog;

    use super::*;
    use crate::evaluation::tests::thesis;

    fn axis(point: [f64; 3], direction: Vector3<f64>) -> Axis {
        Axis { point: point.into(), direction: Some(nalgebra::Unit::new_normalize(direction)), pitch: None }
    }

    #[test]
    fn lines_are_the_same_wherever_their_points_are_and_slides_have_no_place() {
        let one = axis([0.0; 3], Vector3::z());
        let along = axis([0.0, 0.0, 4.0], -Vector3::z());
        let beside = axis([0.0, 1e-3, 0.0], Vector3::z());
        let tilted = axis([0.0; 3], Vector3::new(0.0, 1e-5, 1.0));
        assert!(same_axis("revolute", Some(&one), Some(&along)) && !same_axis("revolute", Some(&one), Some(&beside)));
        assert!(same_axis("prismatic", Some(&one), Some(&beside)) && same_axis("planar", Some(&one), Some(&beside)));
        assert!(!same_axis("prismatic", Some(&one), Some(&tilted)));
        let [here, there] = [[0.0; 3], [0.0, 0.0, 1e-3]]
            .map(|point| Axis { direction: None, ..axis(point, one.point.coords + Vector3::z()) });
        assert!(same_axis("spherical", Some(&here), Some(&here)) && !same_axis("spherical", Some(&here), Some(&there)));
        assert!(!same_axis("revolute", Some(&one), None) && same_axis("rigid", None, None));
    }

    fn judged_in_all_orders(options: &SceneOptions) -> Measurement {
        let condition = Condition { procedure: Procedure::Exchange, ..Condition::new("revolute", options.clone()) };
        let mut columns = measure(&condition, 3, &[thesis("thesis")]).expect("a scene");
        assert_eq!(columns[0].len(), 1, "one pair");
        columns[0].remove(0)
    }

    #[test]
    fn a_clear_hinge_is_measured_in_full() {
        let clear = SceneOptions { noise: Some(1e-4), sweep_deg: Some(90.0), ..SceneOptions::default() };
        let measurement = judged_in_all_orders(&clear);
        assert_eq!((measurement.expected.as_str(), measurement.found.as_str()), ("revolute", "revolute"));
        assert_eq!((measurement.scene, measurement.seed), ("revolute", 3));
        let axis = measurement.axis.expect("an axis");
        assert!(axis.angle > 0.0 && axis.angle < 0.02 && axis.distance < 0.01, "{axis:?}");
        let ratio = measurement.noise_ratio.expect("noise");
        assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
        // The thesis's method looks at the features of one of the bodies only.
        assert_eq!(measurement.symmetric, Some(false));
    }

    #[test]
    fn without_noise_a_hinge_is_the_same_from_both_sides() {
        let exact = SceneOptions { noise: Some(0.0), sweep_deg: Some(120.0), ..SceneOptions::default() };
        let measurement = judged_in_all_orders(&exact);
        assert_eq!((measurement.symmetric, measurement.noise_ratio), (Some(true), None));
    }

    #[test]
    fn axes_of_tracked_poses_are_compared_in_the_coordinates_that_are_tracked() {
        let tracked = SceneOptions { poses: true, sweep_deg: Some(90.0), frames: Some(60), ..SceneOptions::default() };
        let noisy_start = SceneOptions { noise: Some(0.02), rotation_noise: Some(0.2), seed: 4, ..tracked };
        let mut simulation = simulate("revolute", &noisy_start).expect("a scene");
        let tracked_from_true = tracked_from_true(&noisy_start, &simulation).expect("a scene");
        // Only the first pose is as noisy as that.
        let calm = SceneOptions { noise: Some(0.0), rotation_noise: Some(0.0), ..noisy_start };
        let exact = simulate("revolute", &calm).expect("a scene").recording.into_parts();
        let bodies = exact.2.iter().zip(simulation.recording.bodies()).map(|(exact, noisy)| {
            let (Observation::Poses(exact_poses), Observation::Poses(noisy)) =
                (exact.observation(), noisy.observation())
            else {
                panic!("poses")
            };
            let poses = noisy[..1].iter().chain(&exact_poses[1..]).copied().collect();
            Body::from_poses(exact.name(), poses).expect("a body")
        });
        simulation.recording = Recording::new(exact.0, exact.1, bodies.collect()).expect("a recording");
        let simulated = Simulated { simulation, tracked_from_true };
        let found = simulated.tracked_from_true[0].rotation.angle();
        assert!(found > 0.1, "the first pose is off by {found} rad");
        let default = Column::new("", Configuration::parse("", &Catalog::linked().expect("names")).expect("valid"));
        let condition = Condition::new("revolute", calm);
        let judged = judge(&condition, &simulated, &default.detector).expect("two bodies");
        let axis = judged[0].axis.expect("an axis");
        assert!(axis.angle < 0.05 && axis.distance < 0.02, "{axis:?}");
    }

    #[test]
    fn only_true_hinges_have_an_axis_error_and_experiments_have_their_pairs() {
        let slide = Condition::new("prismatic", SceneOptions::default());
        let columns = measure(&slide, 1, &[thesis("thesis")]).expect("a scene");
        assert_eq!((columns[0][0].axis, columns[0][0].symmetric), (None, None));
        let options = SceneOptions { frames: Some(30), ..SceneOptions::default() };
        let door = Condition { procedure: Procedure::Experiment, ..Condition::new("drawers", options) };
        assert_eq!(measure(&door, 1, &[thesis("thesis")]).expect("a scene")[0].len(), 3);
    }
}
