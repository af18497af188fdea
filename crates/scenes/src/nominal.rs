//! The nominal scene: two bodies, `base` and `part`, with one joint of any kind between them.

use std::f64::consts::FRAC_PI_2;

use jointscope_motion::Pose;
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, UnitSphere};

use crate::sensor::{Purpose, any_orientation, stream};
use crate::{Attachment, BodyShape, Joint, JointKind, Scene, SceneBody, SceneError, SceneOptions, Shape, law};

/// Distance of bodies from the axis, and the edge of the cubes that hold their features, metres.
const DISTANCE: f64 = 0.15;
/// Distance of the joint from the camera, metres.
const VIEW: f64 = 1.5;
/// How far the base turns about every axis, radians, and moves along it, metres, in all.
const BASE_TURN: f64 = 0.5;
const BASE_TRAVEL: f64 = 0.2;
/// A screw's pitch where the options ask for no travel, metres per radian.
const PITCH: f64 = 0.05;
/// Distance of a trammel's crank pin from the axis, metres: less than that of the body, so that the body's centre runs
/// on an ellipse too.
const CRANK: f64 = 0.1;

/// The joints that have a nominal scene of their own, by the name of the joint.
pub(crate) const KINDS: [JointKind; 10] = [
    JointKind::Rigid,
    JointKind::Prismatic,
    JointKind::Revolute,
    JointKind::Screw { pitch: PITCH },
    JointKind::Cylindrical,
    JointKind::Planar,
    JointKind::Spherical,
    JointKind::Disconnected,
    JointKind::Elliptical { crank: CRANK },
    JointKind::Universal,
];

/// Both bodies move smoothly and generally in front of the camera, 20 features each at random in a cube of 15 cm: the base
/// about the joint, the part 15 cm from its axis; 50 frames, 45° or the same arc, 118 mm; noise of 3 mm.
pub(crate) fn nominal(kind: JointKind, options: &SceneOptions) -> Result<Scene, SceneError> {
    options.refuse(kind.name(), &["monocular"])?;
    let edge = options.body_size.unwrap_or(DISTANCE);
    let shape = options.body_shape.unwrap_or(BodyShape::Box).of_size(edge);
    let part = Part { kind, shape, distance: DISTANCE, sweep_deg: 45.0 };
    Ok(part.on_a_moving_base(kind.name(), options))
}

/// A flat disc that turns about its own axis: all features at one height, so that the centres of their circles do not
/// form a line.
pub(crate) fn turntable(options: &SceneOptions) -> Result<Scene, SceneError> {
    options.refuse("turntable", &["travel", "axis_distance", "monocular", "bend", "body_shape"])?;
    let outer = options.body_size.map_or(DISTANCE, |size| size / 2.0);
    let shape = Shape::Ring { inner: 0.0, outer, width: 0.0 };
    let part = Part { kind: JointKind::Revolute, shape, distance: 0.0, sweep_deg: 180.0 };
    Ok(part.on_a_moving_base("turntable", options))
}

struct Part {
    kind: JointKind,
    shape: Shape,
    distance: f64,
    sweep_deg: f64,
}

impl Part {
    fn on_a_moving_base(self, name: &str, options: &SceneOptions) -> Scene {
        let mut layout = stream(options.seed, Purpose::Layout, 0);
        let frames = options.frames.unwrap_or(50);
        // Poses have no features, whose number could be too large for so many frames.
        let features = options.features.unwrap_or(if options.poses { 1 } else { 20 });
        let edge = options.body_size.unwrap_or(DISTANCE);
        let joint_frame = somewhere_in_view(&mut layout);
        let shifted = |x: f64| joint_frame * Translation3::new(x, 0.0, 0.0);
        let body = |name: &str, shape, placement, attachment| SceneBody {
            name: name.into(),
            features,
            shape,
            placement,
            attachment,
            noise_factor: 1.0,
            scale: 1.0,
            depth_gain: 1.0,
        };
        let at_base = shifted(-options.base_distance.unwrap_or(0.0));
        let base = body("base", Shape::Box { size: [edge; 3] }, at_base, base_motion(at_base, frames, options));
        let at_part = shifted(options.axis_distance.unwrap_or(self.distance));
        let mut part = body("part", self.shape, at_part, self.attachment(joint_frame, at_part, frames, options));
        if options.body_shape.is_some_and(|shape| shape != BodyShape::Box) {
            part.placement *= any_orientation(&mut stream(options.seed, Purpose::Orientation, 1));
        }
        part.scale = options.scale.unwrap_or(1.0);
        part.depth_gain = options.depth_gain.unwrap_or(1.0);
        let bodies = vec![base, part];
        Scene { name: name.into(), frames, rate: 30.0, bodies, sensor: options.sensor(0.003) }
    }

    /// The joint between base and part, and a random motion that spans exactly what is asked.
    fn attachment(&self, joint_frame: Pose, at_part: Pose, frames: usize, options: &SceneOptions) -> Attachment {
        let sweep = options.sweep_deg.unwrap_or(self.sweep_deg).to_radians();
        let travel = options.travel.unwrap_or(sweep * DISTANCE);
        let kind = match (self.kind, options.travel) {
            (JointKind::Screw { .. }, Some(travel)) => JointKind::Screw { pitch: travel / sweep },
            (kind, _) => kind,
        };
        // What has no axis turns about the part itself: its translation is then the part's own.
        let frame = match kind {
            JointKind::Planar | JointKind::Disconnected => at_part,
            // Both axes are across the arm from the centre to the part.
            JointKind::Universal => joint_frame * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -FRAC_PI_2),
            _ => joint_frame,
        };
        let mut spans = vec![travel; kind.freedoms()];
        spans[..kind.angles()].fill(sweep);
        let motion = law::wander(frames, &spans, &mut stream(options.seed, Purpose::Motion, 1));
        let ideal = Attachment::new(Some(0), Joint { kind, frame }, motion);
        Attachment { play: options.play.unwrap_or(0.0), bend: options.bend.unwrap_or(0.0), ..ideal }
    }
}

fn base_motion(at_base: Pose, frames: usize, options: &SceneOptions) -> Attachment {
    let joint = Joint { kind: JointKind::Disconnected, frame: at_base };
    let mut spans = [BASE_TRAVEL; 6];
    spans[..3].fill(BASE_TURN);
    let motion = law::wander(frames, &spans, &mut stream(options.seed, Purpose::Motion, 0));
    if options.still_base { Attachment::at_rest() } else { Attachment::new(None, joint, motion) }
}

/// A place near the point that the camera looks at, and any direction.
fn somewhere_in_view(rng: &mut ChaCha8Rng) -> Pose {
    let mut aside = || rng.random_range(-0.1..0.1);
    let place = Translation3::new(aside(), aside(), VIEW + aside());
    let axis = Joint::about(JointKind::Rigid, place.vector.into(), Vector3::from(UnitSphere.sample(rng)));
    axis.frame * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), rng.random_range(0.0..std::f64::consts::TAU))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, UnitQuaternion};

    use super::*;
    use crate::{PairTruth, Positions, Simulation, simulate};

    /// Rounding of poses a metre or two from the origin.
    const EXACT: f64 = 1e-12;

    struct Seen {
        pair: PairTruth,
        /// `base_from_part`, per frame.
        poses: Vec<Pose>,
    }

    fn look(name: &str, options: &SceneOptions) -> Seen {
        let Simulation { truth, poses, .. } = simulate(name, options).expect(name);
        let relative = poses[0].iter().zip(&poses[1]).map(|(base, part)| base.inverse() * part).collect();
        Seen { pair: truth.pairs[0].clone(), poses: relative }
    }

    fn seeds() -> impl Iterator<Item = SceneOptions> {
        (0..10).map(|seed| SceneOptions { seed, sweep_deg: Some(70.0), travel: Some(0.2), ..Default::default() })
    }

    impl Seen {
        fn point(&self) -> Point3<f64> {
            self.pair.axis.expect("an axis").point.into()
        }

        fn direction(&self) -> Vector3<f64> {
            self.pair.axis.expect("an axis").direction.expect("a direction").into()
        }

        /// One coordinate of the position, per frame.
        fn q(&self, coordinate: usize) -> Vec<f64> {
            match self.pair.positions.as_ref().expect("positions") {
                Positions::Single(all) => all.clone(),
                Positions::Several(all) => all.iter().map(|q| q[coordinate]).collect(),
            }
        }

        fn spans(&self, coordinate: usize, span: f64) {
            let q = self.q(coordinate);
            let most = q.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let range = most - q.iter().copied().fold(f64::INFINITY, f64::min);
            assert!((range - span).abs() < EXACT, "{} spans {range}, not {span}", self.pair.joint);
            assert!(q[0].abs() < EXACT);
        }

        /// Every rotation is by this angle about the axis.
        fn turns_about_the_axis_by(&self, angles: &[f64]) {
            for (pose, angle) in self.poses.iter().zip(angles) {
                let expected = UnitQuaternion::from_scaled_axis(self.direction() * *angle);
                assert!(pose.rotation.angle_to(&expected) < 1e-7);
            }
        }
    }

    fn sweep() -> f64 {
        70_f64.to_radians()
    }

    #[test]
    fn rigid_parts_keep_their_pose_and_have_no_axis() {
        for options in seeds() {
            let seen = look("rigid", &options);
            assert!(
                seen.poses.iter().all(|pose| pose.translation.vector.norm() < EXACT && pose.rotation.angle() < 1e-7)
            );
            assert!(seen.pair.axis.is_none() && seen.pair.positions.is_none());
        }
    }

    #[test]
    fn prismatic_parts_do_not_turn_and_move_along_the_axis_by_their_position() {
        for options in seeds() {
            let seen = look("prismatic", &options);
            seen.spans(0, 0.2);
            assert!((seen.direction().norm() - 1.0).abs() < EXACT && seen.pair.axis.expect("axis").pitch.is_none());
            for (pose, q) in seen.poses.iter().zip(seen.q(0)) {
                assert!(pose.rotation.angle() < 1e-7);
                assert!((pose * seen.point() - (seen.point() + q * seen.direction())).norm() < EXACT);
            }
        }
    }

    #[test]
    fn revolute_parts_leave_the_axis_where_it_is() {
        for options in seeds() {
            let seen = look("revolute", &options);
            seen.spans(0, sweep());
            seen.turns_about_the_axis_by(&seen.q(0));
            assert_eq!(seen.pair.axis.expect("axis").pitch, Some(0.0));
            for point in [-0.5, 0.0, 0.5].map(|along| seen.point() + along * seen.direction()) {
                assert!(seen.poses.iter().all(|pose| (pose * point - point).norm() < EXACT));
            }
        }
    }

    #[test]
    fn screws_advance_in_proportion() {
        for options in seeds() {
            let seen = look("screw", &options);
            seen.spans(0, sweep());
            seen.turns_about_the_axis_by(&seen.q(0));
            let pitch = seen.pair.axis.expect("axis").pitch.expect("pitch");
            assert!((pitch * sweep() - 0.2).abs() < EXACT);
            for (pose, q) in seen.poses.iter().zip(seen.q(0)) {
                assert!((pose * seen.point() - seen.point() - pitch * q * seen.direction()).norm() < EXACT);
            }
        }
    }

    #[test]
    fn cylindrical_parts_turn_about_the_axis_and_slide_along_it() {
        for options in seeds() {
            let seen = look("cylindrical", &options);
            seen.spans(0, sweep());
            seen.spans(1, 0.2);
            seen.turns_about_the_axis_by(&seen.q(0));
            for (pose, slide) in seen.poses.iter().zip(seen.q(1)) {
                assert!((pose * seen.point() - seen.point() - slide * seen.direction()).norm() < EXACT);
            }
        }
    }

    #[test]
    fn planar_parts_stay_in_the_plane() {
        for options in seeds() {
            let seen = look("planar", &options);
            seen.spans(0, sweep());
            seen.spans(1, 0.2);
            seen.spans(2, 0.2);
            seen.turns_about_the_axis_by(&seen.q(0));
            for (frame, pose) in seen.poses.iter().enumerate() {
                let displacement = pose * seen.point() - seen.point();
                assert!(displacement.dot(&seen.direction()).abs() < EXACT);
                assert!((displacement.norm() - seen.q(1)[frame].hypot(seen.q(2)[frame])).abs() < EXACT);
            }
        }
    }

    #[test]
    fn spherical_parts_leave_the_centre_where_it_is() {
        for options in seeds() {
            let seen = look("spherical", &options);
            assert!(seen.pair.axis.expect("axis").direction.is_none());
            (0..3).for_each(|coordinate| seen.spans(coordinate, sweep()));
            assert!(seen.poses.iter().all(|pose| (pose * seen.point() - seen.point()).norm() < EXACT));
        }
    }

    #[test]
    fn universal_parts_turn_about_two_axes_that_cross_at_right_angles() {
        for options in seeds() {
            let seen = look("universal", &options);
            assert!(seen.pair.axis.expect("axis").direction.is_none());
            assert_eq!(seen.pair.thesis_joint, "disconnected");
            (0..2).for_each(|coordinate| seen.spans(coordinate, sweep()));
            assert!(seen.poses.iter().all(|pose| (pose * seen.point() - seen.point()).norm() < EXACT));
            let part = &scene_bodies("universal", &options)[1];
            let frame = part.attachment.joint.frame.rotation;
            let [first, second] = [Vector3::z_axis(), Vector3::x_axis()].map(|axis| (frame * axis).into_inner());
            let arm = part.placement.translation.vector - seen.point().coords;
            assert!((arm.norm() - 0.15).abs() < EXACT && arm.dot(&first).abs() < EXACT);
            assert!(arm.dot(&second).abs() < EXACT, "both axes are across the arm");
            for (frame, pose) in seen.poses.iter().enumerate() {
                let turn = |axis: Vector3<f64>, angle: f64| UnitQuaternion::from_scaled_axis(axis * angle);
                let expected = turn(first, seen.q(0)[frame]) * turn(second, seen.q(1)[frame]);
                assert!(pose.rotation.angle_to(&expected) < 1e-7);
            }
        }
    }

    #[test]
    fn points_of_a_trammel_run_on_ellipses_about_its_axis() {
        for options in seeds() {
            let seen = look("elliptical", &options);
            seen.spans(0, sweep());
            seen.turns_about_the_axis_by(&seen.q(0).iter().map(|q| -q).collect::<Vec<_>>());
            // In Cardan motion a point at distance d from the pin has semi-axes crank + d and |crank - d|, with the
            // pin's arm starting along the joint's x; take a point on that arm, where the ellipse lies straight.
            let joint = super::nominal(JointKind::Elliptical { crank: CRANK }, &options).expect("scene").bodies[1]
                .attachment
                .joint
                .frame;
            let (major, minor) = (CRANK + 0.05, CRANK - 0.05);
            for pose in &seen.poses {
                let p = joint.inverse() * pose * joint * Point3::new(major, 0.0, 0.02);
                assert!(
                    ((p.x / major).powi(2) + (p.y / minor).powi(2) - 1.0).abs() < 1e-9 && (p.z - 0.02).abs() < EXACT
                );
            }
            assert!((joint.translation.vector - seen.point().coords).norm() < EXACT);
        }
    }

    #[test]
    fn disconnected_parts_have_no_axis_but_span_what_is_asked() {
        for options in seeds() {
            let seen = look("disconnected", &options);
            assert!(seen.pair.axis.is_none() && seen.pair.positions.is_none());
            assert_eq!(seen.pair.thesis_joint, "disconnected");
            let farthest = seen.poses.iter().map(|pose| pose.rotation.angle()).fold(0.0, f64::max);
            assert!(farthest > sweep() / 2.0, "{farthest}");
        }
    }

    #[test]
    fn the_nominal_scene_is_as_the_goals_say() {
        let simulation = simulate("prismatic", &SceneOptions::default()).expect("prismatic");
        assert_eq!(simulation.recording.frames(), 50);
        assert_eq!(simulation.recording.duration(), Some(49.0 / 30.0));
        let seen = look("prismatic", &SceneOptions::default());
        seen.spans(0, 45_f64.to_radians() * 0.15);
        for body in scene_bodies("revolute", &SceneOptions::default()) {
            assert_eq!(body.features, 20);
        }
        for seed in 0..50 {
            let options = SceneOptions { seed, noise: Some(0.0), ..Default::default() };
            for body in simulate("disconnected", &options).expect("disconnected").recording.bodies() {
                let jointscope_motion::Observation::Points { tracks, .. } = body.observation() else {
                    panic!("points")
                };
                for point in (0..50).flat_map(|frame| tracks.frame(frame)) {
                    assert!(point.z > 0.8 && point.coords.norm() < 2.3, "{point}");
                }
            }
        }
    }

    fn scene_bodies(name: &str, options: &SceneOptions) -> Vec<SceneBody> {
        crate::scene(name, options).expect(name).bodies
    }

    #[test]
    fn bodies_can_be_centred_on_the_axis_or_far_from_it_and_their_base_can_rest() {
        for distance in [0.0, 0.15, 0.7] {
            let options = SceneOptions { axis_distance: Some(distance), still_base: true, ..Default::default() };
            let part = &scene_bodies("revolute", &options)[1];
            let arm = part.placement.translation.vector - part.attachment.joint.point().coords;
            assert!((arm.norm() - distance).abs() < EXACT && arm.dot(&part.attachment.joint.direction()).abs() < EXACT);
            let still = simulate("revolute", &options).expect("revolute");
            assert!(still.poses[0].iter().all(|pose| *pose == Pose::identity()));
        }
    }

    #[test]
    fn features_can_be_in_a_box_on_a_plate_or_on_a_line() {
        for seed in 0..5 {
            let exact = SceneOptions { seed, noise: Some(0.0), body_size: Some(0.2), ..Default::default() };
            let edges = |shape: Option<BodyShape>, body: usize| {
                let options = SceneOptions { body_shape: shape, features: Some(200), ..exact.clone() };
                let simulation = simulate("revolute", &options).expect("revolute");
                let jointscope_motion::Observation::Points { tracks, .. } =
                    simulation.recording.bodies()[body].observation()
                else {
                    panic!("points")
                };
                let scene = scene_bodies("revolute", &options);
                let inside: Vec<_> = tracks.frame(0).iter().map(|p| scene[body].placement.inverse() * p).collect();
                [0, 1, 2].map(|axis| {
                    let [least, most] = law::extremes(&inside.iter().map(|p| p[axis]).collect::<Vec<_>>());
                    most - least
                })
            };
            let long = 0.18..0.2;
            for (shape, thick) in [
                (BodyShape::Box, [0.2, 0.2]),
                (BodyShape::Flat, [0.2, 0.0]),
                (BodyShape::Line, [0.0, 0.0]),
                (BodyShape::NearLine, [4e-4, 4e-4]),
            ] {
                let mut part = edges(Some(shape), 1);
                part.sort_by(f64::total_cmp);
                assert!(long.contains(&part[2]), "{shape:?}: {part:?}");
                for (edge, expected) in [part[1], part[0]].iter().zip(thick) {
                    assert!((0.9 * expected - EXACT..=expected + EXACT).contains(edge), "{shape:?}: {part:?}");
                }
                assert!(edges(Some(shape), 0).iter().all(|edge| long.contains(edge)), "the base stays a box");
            }
            let plain = simulate("revolute", &exact).expect("revolute").recording;
            let boxed = SceneOptions { body_shape: Some(BodyShape::Box), ..exact.clone() };
            assert_eq!(plain, simulate("revolute", &boxed).expect("revolute").recording);
        }
    }

    #[test]
    fn a_line_of_features_lies_in_any_direction() {
        let along = |seed| {
            let options = SceneOptions { seed, body_shape: Some(BodyShape::Line), ..Default::default() };
            let part = &scene_bodies("revolute", &options)[1];
            (part.placement.rotation * Vector3::z()).dot(&part.attachment.joint.direction()).abs()
        };
        let mut cosines: Vec<f64> = (0..40).map(along).collect();
        cosines.sort_by(f64::total_cmp);
        assert!(cosines[5] < 0.4 && cosines[34] > 0.6, "{cosines:?}");
    }

    #[test]
    fn a_hinge_far_from_tracked_poses_is_as_asked() {
        for still_base in [false, true] {
            let options = SceneOptions {
                axis_distance: Some(0.7),
                poses: true,
                frames: Some(200),
                noise: Some(0.005),
                rotation_noise: Some(0.01),
                sweep_deg: Some(90.0),
                still_base,
                ..Default::default()
            };
            let exact = SceneOptions { noise: Some(0.0), rotation_noise: Some(0.0), ..options.clone() };
            let [noisy, exact] = [&options, &exact].map(|options| simulate("revolute", options).expect("revolute"));
            for body in 0..2 {
                let [seen, truth] = [&noisy, &exact].map(|simulation| {
                    let jointscope_motion::Observation::Poses(poses) =
                        simulation.recording.bodies()[body].observation()
                    else {
                        panic!("poses")
                    };
                    poses.iter().map(|pose| pose.expect("seen")).collect::<Vec<_>>()
                });
                assert_eq!(seen.len(), 200);
                let pairs = || seen.iter().zip(&truth);
                let shift: f64 =
                    pairs().map(|(a, b)| (a.translation.vector - b.translation.vector).norm_squared()).sum();
                let turn: f64 = pairs().map(|(a, b)| a.rotation.angle_to(&b.rotation).powi(2)).sum();
                assert!(((shift / 600.0).sqrt() / 0.005 - 1.0).abs() < 0.1, "{shift}");
                assert!(((turn / 600.0).sqrt() / 0.01 - 1.0).abs() < 0.1, "{turn}");
                let rests = still_base && body == 0;
                assert_eq!((truth[0].translation.vector - truth[150].translation.vector).norm() < EXACT, rests);
                let joint = &scene_bodies("revolute", &options)[1].attachment.joint;
                let arm = Point3::from(truth[0].translation.vector) - joint.point();
                let distance = arm.cross(&joint.direction()).norm();
                // The base surrounds its joint.
                assert!((distance - [0.0, 0.7][body]).abs() < EXACT, "{distance}");
            }
            let seen = look("revolute", &options);
            seen.spans(0, std::f64::consts::FRAC_PI_2);
            seen.turns_about_the_axis_by(&seen.q(0));
        }
    }

    #[test]
    fn tracked_slides_and_screws_travel_as_far_as_is_asked() {
        for travel in [0.05, 0.4] {
            let options = SceneOptions { poses: true, travel: Some(travel), frames: Some(200), ..Default::default() };
            let seen = look("prismatic", &options);
            seen.spans(0, travel);
            let part = scene_bodies("prismatic", &options)[1].placement.translation.vector;
            assert!((seen.point().coords - part).norm() < EXACT, "the axis goes through the tracker");
        }
        let options = SceneOptions { poses: true, travel: Some(0.1), sweep_deg: Some(90.0), ..Default::default() };
        let seen = look("screw", &options);
        seen.spans(0, std::f64::consts::FRAC_PI_2);
        let pitch = seen.pair.axis.expect("axis").pitch.expect("pitch");
        assert!((pitch * std::f64::consts::FRAC_PI_2 - 0.1).abs() < EXACT);
    }

    #[test]
    fn poses_may_be_as_many_as_frames() {
        let options = SceneOptions { poses: true, frames: Some(600_000), ..Default::default() };
        assert!(crate::scene("rigid", &options).expect("rigid").check().is_ok());
    }

    #[test]
    fn play_departs_from_the_joint_by_no_more_than_is_asked() {
        let options = SceneOptions { play: Some(0.002), ..Default::default() };
        let seen = look("revolute", &options);
        let farthest = seen.poses.iter().map(|pose| (pose * seen.point() - seen.point()).norm()).fold(0.0, f64::max);
        assert!(farthest > 0.0005 && farthest <= 0.002 * 3_f64.sqrt(), "{farthest}");
    }

    #[test]
    fn a_turntable_turns_in_its_own_plane() {
        let options = SceneOptions { noise: Some(0.0), still_base: true, ..Default::default() };
        let simulation = simulate("turntable", &options).expect("turntable");
        let axis = simulation.truth.pairs[0].axis.expect("axis");
        let (point, normal) = (Point3::from(axis.point), Vector3::from(axis.direction.expect("direction")));
        let jointscope_motion::Observation::Points { tracks, .. } = simulation.recording.bodies()[1].observation()
        else {
            panic!("points")
        };
        for frame in 0..50 {
            assert!(tracks.frame(frame).iter().all(|p| (p - point).dot(&normal).abs() < EXACT));
        }
    }
}
