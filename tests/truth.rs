//! Axes and positions against the truth of simulated scenes, in the stated coordinates and signs.

use jointscope_detection::PairDetection;
use jointscope_models::{Axis, Positions};
use jointscope_scenes::{Positions as TruePositions, SceneOptions, Simulation, simulate};
use jointscope_tests::{THESIS, detector};
use nalgebra::Vector3;

/// Rounding of coordinates of some metres through registration and circle fits, radians and metres.
const EXACT: f64 = 1e-7;
/// What 1 mm of noise leaves of the axis of 20 features over 50 frames and 90°, radians and metres: several times the
/// spread seen over seeds.
const NOISY: f64 = 0.05;

fn detect(scene: &str, options: &SceneOptions) -> (Simulation, PairDetection) {
    let simulation = simulate(scene, options).expect("a scene");
    let mut detection = detector(THESIS).detect(simulation.recording.clone(), None).expect("two bodies");
    (simulation, detection.pairs.remove(0))
}

/// Checks joint, axis and positions; positions count along the detected direction.
fn check(scene: &str, options: &SceneOptions, tolerance: f64) {
    let (simulation, pair) = detect(scene, options);
    let truth = &simulation.truth.pairs[0];
    assert_eq!((pair.verdict.joint.as_str(), truth.joint.as_str()), (scene, scene));
    let (axis, true_axis) = (pair.axis.expect("an axis"), truth.axis.as_ref().expect("an axis"));
    let true_direction = Vector3::from(true_axis.direction.expect("a direction"));
    let direction = axis.direction.expect("a direction");
    let off = direction.cross(&true_direction).norm();
    assert!(off < tolerance, "{scene}: the axis is {off:e} rad off");
    let beside = axis.point.coords - Vector3::from(true_axis.point);
    let off = if scene == "prismatic" { beside.norm() } else { true_direction.cross(&beside).norm() };
    assert!(off < tolerance, "{scene}: the axis is {off:e} m off");
    assert_eq!(axis.pitch, true_axis.pitch, "{scene}");

    let Some(TruePositions::Single(positions)) = &truth.positions else { panic!("one number per frame") };
    let sense = direction.dot(&true_direction).signum();
    let found: &Positions = pair.positions.as_ref().expect("positions");
    for (frame, (found, q)) in found.iter().zip(positions).enumerate() {
        let found = found.expect("seen")[0];
        assert!((found - sense * q).abs() < tolerance, "{scene}, frame {frame}: {found} along {sense}, truth {q}");
    }

    // Bodies' coordinates coincide at frame 0, where both are posed: the axis is the same in both.
    let in_moving: Axis = pair.axis_in_moving.expect("an axis");
    let turned = in_moving.direction.expect("a direction").cross(&direction).norm();
    assert!(turned < tolerance && (in_moving.point - axis.point).norm() < tolerance, "{scene}: {in_moving:?}");
}

#[test]
fn exact_scenes_give_exact_axes_and_positions() {
    for seed in 0..4 {
        let exact = SceneOptions { seed, noise: Some(0.0), ..SceneOptions::default() };
        check("revolute", &SceneOptions { sweep_deg: Some(120.0), ..exact.clone() }, EXACT);
        // On a base that moves as far as the part slides, the thesis's rigid veto would win.
        check("prismatic", &SceneOptions { travel: Some(1.5), ..exact }, EXACT);
    }
}

#[test]
fn noisy_scenes_give_axes_and_positions_within_the_noise() {
    for seed in 0..4 {
        let options = SceneOptions { seed, noise: Some(0.001), sweep_deg: Some(90.0), ..SceneOptions::default() };
        check("revolute", &options, NOISY);
    }
}

#[test]
fn turns_are_counted_beyond_a_full_one() {
    let options =
        SceneOptions { noise: Some(0.0), sweep_deg: Some(800.0), frames: Some(200), ..SceneOptions::default() };
    let (_, pair) = detect("revolute", &options);
    let [[least, most]] = pair.positions.expect("positions").ranges().expect("seen")[..] else { panic!("one freedom") };
    assert!(((most - least).to_degrees() - 800.0).abs() < 1e-3, "{least} to {most}");
}
