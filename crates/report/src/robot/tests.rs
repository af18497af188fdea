use jointscope_detection::{Configuration, Detector};
use jointscope_models::Catalog;
use jointscope_scenes::{SceneOptions, simulate};
use nalgebra::Unit;

use super::*;

/// Where a robot's link is in a frame, seen from the link that everything known hangs on; with that link.
fn standing(robot: &Robot, link: usize, frame: usize) -> Option<(usize, Pose)> {
    let Some(joint) = link.checked_sub(1).map(|joint| &robot.joints[joint]) else {
        return Some((link, Pose::identity()));
    };
    if joint.moves == Move::Floating {
        return Some((link, Pose::identity()));
    }
    let (root, parent) = standing(robot, joint.parent, frame)?;
    let axis = Unit::new_normalize(Vector3::from(joint.axis));
    let moved = match joint.moves {
        Move::Turn => {
            Pose::from_parts(Vector3::zeros().into(), UnitQuaternion::from_axis_angle(&axis, joint.positions[frame]?))
        }
        Move::Slide => translation(axis.into_inner() * joint.positions[frame]?),
        _ => Pose::identity(),
    };
    Some((root, parent * joint.origin * moved))
}

fn translation(by: Vector3<f64>) -> Pose {
    Pose::from_parts(by.into(), UnitQuaternion::identity())
}

/// Root mean square distance, per coordinate, of all features from where the robot has them when it takes the
/// recording's positions.
fn departure(scene: &str, options: &SceneOptions) -> f64 {
    departure_by("", scene, options)
}

/// The same by a configuration, of a moving body that is multiplied by what its pair with the base tells.
fn departure_by(configuration: &str, scene: &str, options: &SceneOptions) -> f64 {
    let recording = simulate(scene, options).expect("a scene").recording;
    let configuration = Configuration::parse(configuration, &Catalog::linked().expect("unique names")).expect("valid");
    let detection = Detector::new(configuration).detect(recording.clone(), None).expect("bodies");
    let robot = Robot::of(&Report { detection: &detection, recording: &recording, settings: "" });
    let (mut sum, mut count) = (0.0, 0.0);
    for (index, link) in robot.links.iter().enumerate() {
        let Some(body) = link.body else { continue };
        let factor = if body == 1 { own_scale(&detection, &detection.pairs[0]) } else { 1.0 };
        let ways = places(&recording.bodies()[body], &detection.poses[body]);
        let shape: Vec<Point3<f64>> = seen_from(&detection.poses[body], &ways).iter().map(middle).collect();
        for frame in 0..detection.frames {
            let Some((root, pose)) = standing(&robot, index, frame) else { continue };
            let Some(recording_from_root) = detection.poses[robot.links[root].body.expect("a body")][frame] else {
                continue;
            };
            let recording_from_link = recording_from_root * robot.links[root].place * pose;
            for (way, place) in ways.iter().zip(&shape) {
                let Some((_, seen)) = way.iter().find(|(at, _)| *at == frame) else { continue };
                let told = recording_from_link * (link.place.inverse() * (place * factor));
                sum += (told - seen * factor).norm_squared();
                count += 3.0;
            }
        }
    }
    (sum / f64::max(count, 1.0)).sqrt()
}

#[test]
fn robots_move_as_the_recordings_do_within_twice_the_noise() {
    const NOISE: f64 = 0.002;
    let scenes = [
        "rigid",
        "prismatic",
        "revolute",
        "screw",
        "cylindrical",
        "planar",
        "spherical",
        "universal",
        "disconnected",
        "drawers",
        "tricycle",
        "turntable",
        "train",
    ];
    for scene in scenes {
        let options = SceneOptions { noise: Some(NOISE), ..SceneOptions::default() };
        let departure = departure(scene, &options);
        // Less than half of it would mean that nothing was compared.
        assert!((0.5 * NOISE..2.0 * NOISE).contains(&departure), "{scene}: {departure:.5} m");
    }
}

#[test]
fn names_that_are_taken_get_a_number() {
    let mut names = BTreeSet::from(["door".to_owned(), "door_2".to_owned()]);
    assert_eq!(unique("door", &mut names), "door_3");
    assert_eq!(unique("wall", &mut names), "wall");
}

#[test]
fn three_turns_make_any_rotation() {
    for vector in [[0.3, -1.2, 2.0], [0.0, 0.1, 0.0], [-2.0, 0.4, 0.3]] {
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(vector));
        let axes = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
        let made = turns(&rotation).into_iter().zip(axes).fold(UnitQuaternion::identity(), |made, (angle, axis)| {
            made * UnitQuaternion::from_axis_angle(&axis, angle)
        });
        assert!(made.angle_to(&rotation) < 1e-9);
    }
}

#[test]
fn robots_of_bodies_at_scales_of_their_own_are_in_the_scale_of_the_base() {
    const NOISE: f64 = 0.002;
    for scene in ["prismatic", "revolute", "planar", "spherical"] {
        let options = SceneOptions { noise: Some(NOISE), scale: Some(1.12), seed: 4, ..SceneOptions::default() };
        let off = departure_by("[scale]\nsearch = 'moments'\n", scene, &options);
        assert!(off < 2.0 * NOISE, "{scene}: {:.2} mm", 1e3 * off);
    }
}
