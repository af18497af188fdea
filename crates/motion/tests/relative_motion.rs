//! What one body looks like from another: coordinates, axes carried over, and lengths counted by hand.

use jointscope_motion::{
    Body, BodyMotion, MotionSettings, Pose, Registration, RelativeMotion, RelativeMotionError, Tracks,
    nalgebra::{Point3, Translation3, UnitQuaternion, Vector3, distance},
};

/// Rounding of coordinates within two metres through some poses, metres.
const EXACT: f64 = 1e-13;
const MISSING: [f64; 3] = [f64::NAN; 3];

const REGISTRATIONS: [Registration; 3] = [Registration::Shape, Registration::First, Registration::Chained];

fn settings(registration: Registration) -> MotionSettings {
    MotionSettings { registration, ..MotionSettings::default() }
}

/// A body from rows of samples, one per frame.
fn body(name: &str, rows: &[Vec<[f64; 3]>]) -> Body {
    let labels = (0..rows[0].len()).map(|feature| feature.to_string()).collect();
    let samples = rows.iter().flatten().map(|p| Point3::from(*p)).collect();
    Body::from_points(name, labels, Tracks::new(rows[0].len(), samples).expect("whole frames")).expect("seen")
}

fn pose(frame: usize) -> Pose {
    let s = frame as f64 * 0.1;
    let turn = UnitQuaternion::new(Vector3::new(0.4 * s, -0.7 * s, 0.3 * s.sin()));
    Pose::from_parts(Translation3::new(0.3 * s.sin(), 0.2 * s, 1.0 - 0.1 * s), turn)
}

/// Six features of a box, in the body's own coordinates.
const BOX: [[f64; 3]; 6] =
    [[0.1, 0.0, 0.0], [-0.1, 0.05, 0.0], [0.0, 0.2, 0.1], [0.1, 0.1, -0.1], [0.0, -0.1, 0.1], [0.05, 0.0, 0.2]];

/// Samples of a moving box that departs from rigidity by `noise` metres, of which `seen` says what is seen.
fn boxed(
    frames: usize,
    noise: f64,
    pose: impl Fn(usize) -> Pose,
    seen: impl Fn(usize, usize) -> bool,
) -> Vec<Vec<[f64; 3]>> {
    let sample = |frame: usize, feature: usize| {
        let wobble = Vector3::from_fn(|axis, _| ((frame * 7 + feature * 3 + axis) as f64 * 2.4).sin()) * noise;
        if seen(frame, feature) { (pose(frame) * Point3::from(BOX[feature]) + wobble).coords.into() } else { MISSING }
    };
    (0..frames).map(|frame| (0..BOX.len()).map(|feature| sample(frame, feature)).collect()).collect()
}

/// Rows of features that move by straight steps of their own, metres along x.
fn sliding(frames: usize, steps: &[f64]) -> Vec<Vec<[f64; 3]>> {
    let row = |frame| steps.iter().enumerate().map(|(i, step)| [frame as f64 * step, i as f64, 0.5]).collect();
    (0..frames).map(row).collect()
}

/// A reference with an identity pose in some frames, unseen in the others.
fn resting_reference(frames: usize, seen: impl Fn(usize) -> bool) -> Body {
    Body::from_poses("reference", (0..frames).map(|frame| seen(frame).then(Pose::identity)).collect()).expect("seen")
}

/// Calls `look` with the motion of `moving` seen from `reference`.
fn between(reference: &Body, moving: &Body, look: impl FnOnce(&RelativeMotion<'_>)) {
    between_by(Registration::Shape, reference, moving, look);
}

fn between_by(registration: Registration, reference: &Body, moving: &Body, look: impl FnOnce(&RelativeMotion<'_>)) {
    let [reference, moving] = [reference, moving].map(|body| BodyMotion::of(body, &settings(registration)));
    look(&RelativeMotion::between(&reference, &moving).expect("seen together"));
}

#[test]
fn the_reference_s_coordinates_are_the_recording_s_at_its_first_posed_frame() {
    // The reference is seen by too few features in frames 0 and 1, and not at all in frame 5.
    let seen = |frame, feature| if frame < 2 { feature < 2 } else { frame != 5 && (frame + feature) % 4 != 1 };
    let points = body("reference", &boxed(12, 0.003, pose, seen));
    let tracked = (0..12).map(|frame| (frame >= 2 && frame != 5).then(|| pose(2 * frame)));
    let poses = Body::from_poses("reference", tracked.collect()).expect("seen");
    let rows = boxed(12, 0.003, |frame| pose(frame + 30), |frame, feature| (frame + feature) % 5 != 0);
    let moving = body("moving", &rows);
    for reference in [&points, &poses] {
        for registration in REGISTRATIONS {
            between_by(registration, reference, &moving, |motion| {
                assert_eq!(motion.reference().first_posed_frame(), Some(2));
                assert_eq!(motion.frames(), [2, 3, 4, 6, 7, 8, 9, 10, 11]);
                for (feature, trajectory) in motion.trajectories().iter().enumerate() {
                    for (frame, point) in trajectory.frames.iter().zip(trajectory.points) {
                        let recorded = Point3::from(rows[*frame][feature]);
                        let expected = motion.reference().poses()[*frame].expect("posed").inverse() * recorded;
                        assert!(distance(point, &expected) <= EXACT, "{registration:?}, frame {frame}");
                        // All frames tell where the body was at its first, better than that one alone.
                        let gauge = if motion.reference().is_tracked() || registration != Registration::Shape {
                            EXACT
                        } else {
                            4.0 * 0.003
                        };
                        assert!(*frame != 2 || distance(point, &recorded) <= gauge, "{registration:?}: the gauge");
                    }
                }
                let here: Vec<_> = (0..6).filter(|f| (2 + f) % 5 != 0).map(|f| Vector3::from(rows[2][f])).collect();
                let centroid = Point3::from(here.iter().sum::<Vector3<f64>>() / here.len() as f64);
                assert!(distance(&motion.first_centroid(), &centroid) <= 2.0 * 0.003);
            });
        }
    }
}

#[test]
fn a_pair_has_a_pose_where_both_bodies_have_one() {
    let reference = body("reference", &boxed(10, 0.0, pose, |frame, _| frame != 3));
    let moving = body("moving", &boxed(10, 0.0, |f| pose(f + 20), |frame, feature| frame != 4 || feature < 2));
    between(&reference, &moving, |motion| {
        // Frame 4 shows two features of the moving body: it counts, though not as a pose.
        assert_eq!(motion.frames(), [0, 1, 2, 4, 5, 6, 7, 8, 9]);
        assert_eq!(motion.recording_frames(), 10);
        for frame in 0..10 {
            // Both bodies' coordinates are the recording's in frame 0.
            let expected = pose(0) * pose(frame).inverse() * pose(frame + 20) * pose(20).inverse();
            assert_eq!(motion.pose(frame).is_some(), frame != 3 && frame != 4);
            for point in motion.pose(frame).iter().map(|found| found * Point3::from(BOX[2])) {
                assert!(distance(&point, &(expected * Point3::from(BOX[2]))) <= EXACT * 100.0, "frame {frame}");
            }
        }
    });
}

/// A hinge between two moving bodies: where a point of its axis is in the recording, per frame.
fn on_hinge(frame: usize, along: f64) -> Point3<f64> {
    pose(frame) * Point3::new(0.3, 0.1, along)
}

/// The second body of that hinge, turning by 0.05 rad per frame.
fn beyond_hinge(frame: usize) -> Pose {
    let hinge = Pose::translation(0.3, 0.1, 0.0);
    let turn = Pose::rotation(Vector3::z() * (0.05 * frame as f64));
    pose(frame) * hinge * turn * hinge.inverse() * Pose::translation(0.5, 0.1, 0.0)
}

#[test]
fn axes_are_carried_into_the_moving_body_s_coordinates() {
    let all = |_, _| true;
    let reference = |seen: fn(usize, usize) -> bool| body("reference", &boxed(15, 0.0, pose, seen));
    let moving = |seen: fn(usize, usize) -> bool| body("moving", &boxed(15, 0.0, beyond_hinge, seen));
    let single = boxed(15, 0.0, beyond_hinge, |frame, _| frame > 5).into_iter().map(|row| vec![row[0]]);
    let tracked = (0..15).map(|frame| (frame > 5).then(|| beyond_hinge(frame) * pose(3)));
    // Each with the frame in which the moving body's coordinates are the recording's.
    let cases = [
        ("both from the start", reference(all), moving(all), 0),
        ("the moving body appears late", reference(all), moving(|frame, _| frame > 3), 4),
        ("the reference appears late", reference(|frame, _| frame > 6), moving(all), 0),
        ("neither starts", reference(|frame, _| frame > 2), moving(|frame, _| frame > 4), 5),
        ("too few features at first", reference(all), moving(|frame, feature| frame > 2 || feature < 2), 3),
        ("a single feature", reference(all), body("moving", &single.collect::<Vec<_>>()), 6),
        ("poses", reference(all), Body::from_poses("moving", tracked.collect()).expect("seen"), 6),
    ];
    for (case, reference, moving, start) in cases {
        between(&reference, &moving, |motion| {
            let gauge = motion.reference().first_posed_frame().expect("posed");
            let carry = motion.moving_from_reference().expect("seen together");
            for along in [-1.0, 0.0, 1.0] {
                let carried = carry * on_hinge(gauge, along);
                let off = distance(&carried, &on_hinge(start, along));
                assert!(off <= 100.0 * EXACT, "{case}: {off:e} m off");
            }
        });
    }
}

#[test]
fn a_body_without_poses_that_the_reference_never_meets_at_its_start_takes_no_axis() {
    let single = boxed(8, 0.0, beyond_hinge, |_, _| true).into_iter().map(|row| vec![row[0]]);
    let moving = body("moving", &single.collect::<Vec<_>>());
    let reference = body("reference", &boxed(8, 0.0, pose, |frame, _| frame > 0));
    between(&reference, &moving, |motion| assert_eq!(motion.moving_from_reference(), None));
}

#[test]
fn path_lengths_are_the_mean_of_the_summed_steps() {
    // Over four steps one feature goes 4 m, the other 8 m.
    let moving = body("moving", &sliding(5, &[1.0, 2.0]));
    between(&resting_reference(5, |_| true), &moving, |motion| {
        let lengths = motion.path_lengths();
        assert_eq!((lengths.reference, lengths.moving, lengths.relative), (0.0, 6.0, 6.0));
    });
    // There and back again: 2 m of path, 1 m apart.
    let rows = [0.0, 1.0, 0.0].map(|x| vec![[x, 0.0, 0.0]]);
    between(&resting_reference(3, |_| true), &body("moving", &rows), |motion| {
        assert_eq!((motion.path_lengths().moving, motion.net_lengths().moving), (2.0, 1.0));
    });
}

#[test]
fn features_seen_for_part_of_the_time_weigh_by_that_part() {
    // The first goes 1 m per step for all four steps; the second 3 m per step, seen for the last two only:
    // 4 m + 6 m in 4 + 2 steps, times 4 steps.
    let mut rows = sliding(5, &[1.0, 3.0]);
    rows[0][1] = MISSING;
    rows[1][1] = MISSING;
    let reference = resting_reference(5, |_| true);
    between(&reference, &body("moving", &rows), |motion| {
        assert!((motion.path_lengths().moving - 10.0 / 6.0 * 4.0).abs() <= EXACT);
        // Net: 4 m and 6 m.
        assert_eq!(motion.net_lengths().moving, 5.0);
    });
    // A straight path through a missing sample is as long as without; so is one through a frame that shows nothing.
    let mut gap = sliding(5, &[1.0, 3.0]);
    gap[2] = vec![MISSING; 2];
    gap[3][0] = MISSING;
    between(&reference, &body("moving", &gap), |motion| {
        assert_eq!(motion.frames(), [0, 1, 3, 4]);
        assert_eq!((motion.path_lengths().moving, motion.net_lengths().moving), (8.0, 8.0));
    });
    // A feature that is never seen changes nothing.
    let unseen: Vec<_> = sliding(5, &[1.0, 3.0]).into_iter().map(|row| [row, vec![MISSING]].concat()).collect();
    between(&reference, &body("moving", &unseen), |motion| {
        assert_eq!((motion.path_lengths().moving, motion.net_lengths().moving), (8.0, 8.0));
    });
}

#[test]
fn lengths_count_the_frames_that_show_both_bodies() {
    // The reference is seen in frames 2, 3 and 5 to 7: five steps of 2 m.
    let reference = resting_reference(10, |frame| (2..8).contains(&frame) && frame != 4);
    between(&reference, &body("moving", &sliding(10, &[2.0])), |motion| {
        assert_eq!(motion.frames(), [2, 3, 5, 6, 7]);
        let lengths = motion.path_lengths();
        assert_eq!((lengths.reference, lengths.moving, lengths.relative), (0.0, 10.0, 10.0));
        assert_eq!(motion.net_lengths().relative, 10.0);
    });
}

#[test]
fn lengths_of_both_bodies_and_of_one_seen_from_the_other_differ_as_they_should() {
    // The reference slides by 3 m along x, the moving body by 4 m along y: 5 m apart, over four steps.
    let tracked = (0..5).map(|frame| Some(Pose::translation(0.75 * f64::from(frame), 0.0, 0.0)));
    let reference = Body::from_poses("reference", tracked.collect()).expect("seen");
    let rows: Vec<_> = (0..5).map(|frame| vec![[0.5, f64::from(frame), 0.0]]).collect();
    let moving = body("moving", &rows);
    between(&reference, &moving, |motion| {
        for lengths in [motion.path_lengths(), motion.net_lengths()] {
            let found = [lengths.reference, lengths.moving, lengths.relative];
            assert!(found.iter().zip([3.0, 4.0, 5.0]).all(|(a, b)| (a - b).abs() <= EXACT), "{found:?}");
        }
    });
}

#[test]
fn bodies_that_move_as_one_and_bodies_at_rest_have_no_length_at_all() {
    let [reference, moving] = [0, 40].map(|ahead| {
        let pose = move |frame| pose(frame) * pose(ahead);
        body(if ahead == 0 { "reference" } else { "moving" }, &boxed(30, 0.0, pose, |_, _| true))
    });
    for registration in REGISTRATIONS {
        between_by(registration, &reference, &moving, |motion| {
            for lengths in [motion.path_lengths(), motion.net_lengths()] {
                assert!(lengths.reference > 0.1 && lengths.moving > 0.1, "{lengths:?}");
                assert_eq!(lengths.relative, 0.0, "{registration:?}");
            }
        });
    }
}

#[test]
fn from_the_world_a_body_looks_as_it_was_recorded() {
    let rows = boxed(9, 0.01, pose, |frame, feature| (frame + feature) % 4 != 0);
    let (world, moving) = (Body::at_rest("world", 9), body("moving", &rows));
    between(&world, &moving, |motion| {
        for (feature, trajectory) in motion.trajectories().iter().enumerate() {
            for (frame, point) in trajectory.frames.iter().zip(trajectory.points) {
                assert_eq!(*point, Point3::from(rows[*frame][feature]));
            }
        }
        let lengths = motion.path_lengths();
        assert_eq!((lengths.reference, lengths.relative), (0.0, lengths.moving));
        assert!(lengths.moving > 0.1);
    });
    between(&moving, &world, |motion| {
        assert!(motion.path_lengths().moving == 0.0 && motion.path_lengths().relative > 0.1);
    });
}

#[test]
fn bodies_that_are_never_seen_together_or_have_no_pose_are_refused_by_name() {
    let early = body("early", &boxed(10, 0.0, pose, |frame, _| frame < 5));
    let late = body("late", &boxed(10, 0.0, pose, |frame, _| frame >= 5));
    let point = body("point", &sliding(10, &[1.0]));
    let motions = [&early, &late, &point].map(|body| BodyMotion::of(body, &MotionSettings::default()));
    let refused = RelativeMotion::between(&motions[0], &motions[1]).expect_err("never together");
    assert_eq!(refused, RelativeMotionError::NeverTogether { reference: "early".into(), moving: "late".into() });
    let refused = RelativeMotion::between(&motions[2], &motions[0]).expect_err("no pose");
    assert!(matches!(refused, RelativeMotionError::Unposed { ref body, .. } if body == "point"), "{refused}");
    assert!(RelativeMotion::between(&motions[0], &motions[2]).is_ok());
}
