//! What the experiments promise.

use jointscope_motion::{Observation, Pose, Tracks};
use nalgebra::{Matrix3, Vector3};

use super::*;
use crate::{Positions, Simulation, Truth, simulate};

fn play(scene: &str, options: &SceneOptions) -> Simulation {
    simulate(scene, options).expect(scene)
}

fn exactly(scene: &str) -> Simulation {
    play(scene, &SceneOptions { noise: Some(0.0), ..SceneOptions::default() })
}

fn tracks<'a>(simulation: &'a Simulation, name: &str) -> &'a Tracks {
    let body = simulation.recording.bodies().iter().find(|body| body.name() == name).expect(name);
    let Observation::Points { tracks, .. } = body.observation() else { panic!("points") };
    tracks
}

fn range(truth: &Truth, reference: &str, moving: &str, coordinate: usize) -> f64 {
    let positions = truth.pair(reference, moving).and_then(|pair| pair.positions.clone()).expect("positions");
    let q: Vec<f64> = match positions {
        Positions::Single(q) => q,
        Positions::Several(q) => q.iter().map(|q| q[coordinate]).collect(),
    };
    q.iter().copied().fold(f64::NEG_INFINITY, f64::max) - q.iter().copied().fold(f64::INFINITY, f64::min)
}

#[test]
fn ten_experiments_have_twenty_eight_printed_pairs() {
    assert_eq!(EXPERIMENTS.iter().map(|experiment| experiment.letter).collect::<String>(), "ABCDEFGHIJ");
    assert_eq!(EXPERIMENTS.iter().map(|experiment| experiment.pairs.len()).sum::<usize>(), 28);
    for pair in EXPERIMENTS.iter().flat_map(|experiment| experiment.pairs) {
        assert!((pair.confidences.iter().sum::<f64>() - 1.0).abs() < 0.0015, "{pair:?} sums to 1 as printed");
    }
}

#[test]
fn the_thesis_is_right_about_twenty_six_of_them() {
    let wrong: Vec<_> = EXPERIMENTS
        .iter()
        .flat_map(|experiment| experiment.pairs)
        .filter(|pair| pair.printed_joint() != pair.joint)
        .map(|pair| (pair.reference, pair.moving))
        .collect();
    assert_eq!(wrong, [("background", "door1"), ("door1", "door2")]);
}

#[test]
fn printed_pairs_are_the_pairs_of_the_scene_with_their_reference_first() {
    for experiment in &EXPERIMENTS {
        let truth = play(experiment.scene, &SceneOptions::default()).truth;
        assert_eq!(truth.pairs.len(), experiment.pairs.len());
        for printed in experiment.pairs {
            let pair = truth.pair(printed.reference, printed.moving).expect("a pair of the scene");
            assert_eq!(pair.thesis_joint, printed.joint, "{printed:?}");
            assert_eq!((pair.reference.as_str(), pair.moving.as_str()), (printed.reference, printed.moving));
        }
    }
}

#[test]
fn joints_beyond_the_four_classes_are_told_as_they_are() {
    let joint = |scene, a, b| play(scene, &SceneOptions::default()).truth.pair(a, b).expect("a pair").joint.clone();
    assert_eq!(joint("train", "background", "left-train"), "planar");
    assert_eq!(joint("train", "background", "right-train"), "planar");
    assert_eq!(joint("tricycle", "background", "top"), "planar");
    assert_eq!(joint("tricycle", "background", "wheel"), "disconnected");
    assert_eq!(joint("diaper-box", "background", "side"), "planar");
    assert_eq!(joint("laptop", "power-supply", "screen"), "disconnected");
}

#[test]
fn what_stands_on_the_background_is_constant_to_the_digit() {
    for (scene, still) in [
        ("train", vec!["background"]),
        ("tricycle", vec!["background"]),
        ("table", vec!["background"]),
        ("diaper-box", vec!["background"]),
        ("elevator", vec!["background"]),
        ("fridge", vec!["background"]),
        ("sliding-door", vec!["top-part", "left-part"]),
        ("laptop", vec!["power-supply"]),
        ("door", vec!["poster"]),
    ] {
        let simulation = play(scene, &SceneOptions::default());
        for body in simulation.recording.bodies() {
            let tracks = tracks(&simulation, body.name());
            let constant = (1..tracks.frames()).all(|frame| tracks.repeats_previous(frame));
            assert_eq!(constant, still.contains(&body.name()), "{scene}: {}", body.name());
        }
    }
}

#[test]
fn motions_are_as_large_as_described() {
    let degrees = |scene, a, b| range(&exactly(scene).truth, a, b, 0).to_degrees();
    let metres = |scene, a, b| range(&exactly(scene).truth, a, b, 0);
    assert!(degrees("train", "left-train", "right-train") >= 60.0);
    assert!(degrees("tricycle", "top", "wheel") > 360.0);
    assert!((degrees("diaper-box", "side", "top") - 75.0).abs() < 1e-6);
    assert!((degrees("fridge", "background", "door1") - 80.0).abs() < 1e-6);
    assert!((degrees("fridge", "background", "door2") - 80.0).abs() < 1e-6);
    assert!((degrees("laptop", "power-supply", "keyboard") - 55.0).abs() < 1e-6);
    assert!((degrees("laptop", "keyboard", "screen") - 75.0).abs() < 1e-6);
    assert!((degrees("door", "poster", "door") - 70.0).abs() < 1e-6);
    assert!((metres("drawers", "frame", "top-drawer") - 0.35).abs() < 1e-6);
    assert!((metres("drawers", "frame", "bottom-drawer") - 0.30).abs() < 1e-6);
    assert!((metres("table", "background", "bottom-table") - 0.8).abs() < 1e-6);
    assert!((metres("elevator", "left-door", "right-door") - 0.9).abs() < 1e-6);
    assert!((metres("sliding-door", "door", "left-part") - 0.5).abs() < 1e-6);
}

#[test]
fn rolling_paths_bend_both_ways() {
    for (scene, body) in [("train", "left-train"), ("tricycle", "top"), ("diaper-box", "side")] {
        let truth = exactly(scene).truth;
        let Some(Positions::Several(q)) = truth.pair("background", body).and_then(|pair| pair.positions.clone()) else {
            panic!("several numbers per frame")
        };
        assert!(q.iter().any(|q| q[0] > 0.5) && q.iter().any(|q| q[0] < -0.5), "{scene}");
    }
}

#[test]
fn the_camera_sees_everything_in_front_of_it() {
    for experiment in &EXPERIMENTS {
        let simulation = exactly(experiment.scene);
        let bodies = simulation.recording.bodies().iter().map(|body| tracks(&simulation, body.name()));
        for (tracks, frame) in bodies.flat_map(|tracks| (0..tracks.frames()).map(move |frame| (tracks, frame))) {
            let inside = tracks.frame(frame).iter().all(|p| p.z > 0.4 && p.x.hypot(p.y) < p.z);
            assert!(inside, "{}: frame {frame}", experiment.scene);
        }
    }
}

/// Largest departure of a feature's path from its best circle, as a share of the radius. The path lies in a plane that
/// contains the viewing direction; it is measured in coordinates of its plane.
fn departure_from_circle(tracks: &Tracks, feature: usize) -> f64 {
    let path: Vec<_> = (0..tracks.frames()).map(|frame| tracks.frame(frame)[feature]).collect();
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for p in &path {
        let row = Vector3::new(2.0 * p.x, 2.0 * p.z, 1.0);
        normal += row * row.transpose();
        right += row * (p.x * p.x + p.z * p.z);
    }
    let fit = normal.try_inverse().expect("a bent path") * right;
    let radius = (fit.z + fit.x * fit.x + fit.y * fit.y).sqrt();
    path.iter().map(|p| ((p.x - fit.x).hypot(p.z - fit.y) / radius - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn the_first_cluster_on_the_fridge_runs_on_ellipses_and_the_second_nearly_on_circles() {
    let simulation = exactly("fridge");
    for feature in 0..12 {
        assert!(departure_from_circle(tracks(&simulation, "door1"), feature) > 0.03);
        assert!(departure_from_circle(tracks(&simulation, "door2"), feature) < 0.005);
    }
    let gains: Vec<_> = simulation.truth.bodies.iter().map(|body| body.depth_gain).collect();
    assert_eq!(gains, [1.0, 0.6, 0.97]);
    let [door1, door2] = [1, 2].map(|body| &simulation.poses[body]);
    let apart = |(a, b): (&Pose, &Pose)| (a.inverse() * b).translation.vector.norm();
    assert!(door1.iter().zip(door2).map(apart).all(|shift| shift < 1e-12), "one door");
}

#[test]
fn the_fridge_is_a_small_recording() {
    let recording = play("fridge", &SceneOptions::default()).recording;
    assert_eq!(recording.frames(), 100);
    // frame,time,body,feature and three coordinates of up to 22 digits
    let longest_row = "99,3.3000000000000003,background,11,".len() + 3 * 23;
    let samples: usize = recording.bodies().len() * 100 * 12;
    assert!(samples * longest_row < 500_000);
}

#[test]
fn one_camera_gives_bodies_the_scales_that_the_thesis_repairs() {
    let scales = |scene, monocular| {
        let options = SceneOptions { monocular, ..SceneOptions::default() };
        play(scene, &options).truth.bodies.iter().map(|body| body.scale).collect::<Vec<_>>()
    };
    assert_eq!(scales("laptop", false), [1.0; 3]);
    assert_eq!(scales("drawers", false), [1.0; 3]);
    assert_eq!(scales("laptop", true), [1.0, 1.0 / 0.94, 1.0]);
    assert_eq!(scales("drawers", true), [1.0, 1.0 / 0.96, 1.0]);
}

#[test]
fn scale_and_depth_gain_apply_to_what_moves() {
    let options = SceneOptions { scale: Some(0.9), depth_gain: Some(0.8), ..SceneOptions::default() };
    let bodies = play("fridge", &options).truth.bodies;
    let seen: Vec<_> = bodies.iter().map(|body| (body.scale, body.depth_gain)).collect();
    assert_eq!(seen, [(1.0, 1.0), (0.9, 0.8), (0.9, 0.8)]);
}
