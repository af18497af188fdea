use super::*;
use nalgebra::{Translation3, Vector3};

fn settings(registration: Registration) -> MotionSettings {
    MotionSettings { registration, ..MotionSettings::default() }
}

fn truth(frame: usize) -> Pose {
    let s = frame as f64 * 0.11;
    Pose::new(Vector3::new(s.sin(), 0.3 * s, 1.0), Vector3::new(0.4 * s, -0.2 * s, s.cos()))
}

fn body(features: &[Point3<f64>], frames: usize, seen: impl Fn(usize, usize) -> bool) -> Body {
    let mut positions = Vec::new();
    for frame in 0..frames {
        for (feature, p) in features.iter().enumerate() {
            let missing = Point3::from([f64::NAN; 3]);
            positions.push(if seen(frame, feature) { truth(frame) * p } else { missing });
        }
    }
    let labels = (0..features.len()).map(|f| f.to_string()).collect();
    Body::from_points("thing", labels, Tracks::new(features.len(), positions).expect("full")).expect("seen")
}

fn box_corners() -> Vec<Point3<f64>> {
    (0..8).map(|i| Point3::new(f64::from(i & 1), f64::from(i >> 1 & 1) * 0.5, f64::from(i >> 2) * 0.3) * 0.2).collect()
}

fn largest_error(motion: &BodyMotion<'_>) -> f64 {
    let start = motion.first_posed_frame().expect("posed");
    let errors = motion.poses().iter().enumerate().filter_map(|(frame, pose)| {
        let expected = truth(frame) * truth(start).inverse();
        let off = pose.as_ref()?.inverse() * expected;
        Some(off.rotation.angle().max(off.translation.vector.norm()))
    });
    errors.fold(0.0, f64::max)
}

#[test]
fn all_registrations_recover_exact_motion_with_missing_samples() {
    // Every frame misses other features, the first and one in the middle miss nearly all of them.
    let seen = |frame: usize, feature: usize| match frame {
        0 | 9 => feature < 2,
        1 => feature != 3,
        _ => !(frame + 3 * feature).is_multiple_of(4),
    };
    let body = body(&box_corners(), 20, seen);
    for registration in [Registration::Chained, Registration::First, Registration::Shape] {
        let motion = BodyMotion::of(&body, &settings(registration));
        assert_eq!(motion.first_posed_frame(), Some(1), "{registration:?}");
        assert!(motion.poses()[9].is_none());
        assert_eq!(motion.poses().iter().flatten().count(), 18, "{registration:?}");
        assert!(motion.poses()[1].is_some_and(|pose| (pose.inverse() * Pose::identity()).rotation.angle() < 1e-9));
        let error = largest_error(&motion);
        assert!(error < 1e-9, "{registration:?} is off by {error:e}");
        assert!(motion.noise().position.expect("estimated") < 1e-9);
    }
}

#[test]
fn a_poor_first_frame_does_not_cut_off_the_rest() {
    // Frame 0 shows three features that never appear again with others; the best frame is in the middle.
    let seen = |frame: usize, feature: usize| match frame {
        0 => feature < 3,
        5 => feature > 0,
        _ => feature > 2 && !(frame + feature).is_multiple_of(5),
    };
    let body = body(&box_corners(), 12, seen);
    let motion = BodyMotion::of(&body, &MotionSettings::default());
    assert_eq!(motion.poses()[1..].iter().flatten().count(), 11);
    let start = motion.first_posed_frame().expect("posed");
    assert!(largest_error(&motion) < 1e-9 && motion.poses()[start].is_some_and(|pose| pose.rotation.angle() < 1e-9));
}

#[test]
fn collinear_single_and_double_features_have_no_poses_and_say_why() {
    let line: Vec<_> = (0..4).map(|i| Point3::new(f64::from(i) * 0.1, 0.0, 0.0)).collect();
    for (features, word) in [(&line[..], "collinear"), (&line[..2], "found 2"), (&line[..1], "found 1")] {
        let body = body(features, 12, |_, _| true);
        let motion = BodyMotion::of(&body, &MotionSettings::default());
        assert!(motion.poses().iter().all(Option::is_none));
        let reason = motion.unposed().expect("a reason");
        assert!(reason.contains("orientation is not observed") && reason.contains(word), "{reason}");
    }
}

#[test]
fn bodies_given_as_poses_start_at_the_identity_and_show_four_features() {
    let tracked: Vec<_> = (0..10).map(|frame| (frame != 0 && frame != 4).then(|| truth(frame))).collect();
    let body = Body::from_poses("tag", tracked).expect("seen");
    let motion = BodyMotion::of(&body, &MotionSettings::default());
    assert_eq!(motion.first_posed_frame(), Some(1));
    assert!(largest_error(&motion) < 1e-12);
    assert_eq!(motion.tracks().seen_count(1), 4);
    assert_eq!(motion.tracks().seen_count(4), 0);
    let origin = Point3::from(truth(3).translation.vector);
    assert!((nalgebra::distance(&origin, &motion.tracks().frame(3)[2]) - 0.1).abs() < 1e-12);
}

#[test]
fn a_wild_sample_is_found_and_does_not_make_a_body_collinear() {
    let seen = body(&box_corners(), 30, |_, _| true);
    let Observation::Points { labels, tracks } = seen.observation() else { panic!("points") };
    assert_eq!(BodyMotion::of(&seen, &MotionSettings::default()).outlier(), None);
    let mut positions: Vec<_> = (0..30).flat_map(|frame| tracks.frame(frame).to_vec()).collect();
    positions[8 * 17 + 5].z += 5.0;
    let tracks = Tracks::new(8, positions).expect("full");
    let wild = Body::from_points("wild", labels.clone(), tracks).expect("seen");
    let plain = MotionSettings { robust: false, ..MotionSettings::default() };
    let motion = BodyMotion::of(&wild, &plain);
    let outlier = motion.outlier().expect("found");
    assert_eq!((outlier.frame, outlier.feature, motion.unposed()), (17, 5, None));
    assert!(outlier.distance > 1.0, "{outlier:?}");

    let motion = BodyMotion::of(&wild, &MotionSettings::default());
    assert_eq!((motion.outlier(), motion.unposed(), motion.wild_samples()), (None, None, 1));
    assert!(motion.strays().is_empty());
    assert!(largest_error(&motion) < 1e-9, "what is left out bends no pose: {:e}", largest_error(&motion));
}

#[test]
fn features_of_another_body_are_left_out_as_a_whole() {
    let seen = body(&box_corners(), 30, |_, _| true);
    let Observation::Points { labels, tracks } = seen.observation() else { panic!("points") };
    // The last two of eight stay where they were first seen.
    let place = |(frame, feature): (usize, usize)| tracks.frame(if feature < 6 { frame } else { 0 })[feature];
    let positions = (0..30).flat_map(|frame| (0..8).map(move |feature| (frame, feature))).map(place);
    let tracks = Tracks::new(8, positions.collect()).expect("full");
    let mixed = Body::from_points("mixed", labels.clone(), tracks).expect("seen");
    let motion = BodyMotion::of(&mixed, &MotionSettings::default());
    assert_eq!((motion.strays(), motion.wild_samples()), (&[6, 7][..], 0));
    assert!(largest_error(&motion) < 1e-9, "{:e}", largest_error(&motion));
    assert!(motion.noise().position.expect("estimated") < 1e-9);
}

#[test]
fn the_world_rests() {
    let world = Body::at_rest("world", 5);
    let motion = BodyMotion::of(&world, &MotionSettings::default());
    assert!(motion.poses().iter().all(
        |pose| *pose == Some(Pose::from_parts(Translation3::identity(), nalgebra::UnitQuaternion::identity()))
    ));
    assert_eq!(motion.noise(), Noise { position: Some(0.0), rotation: Some(0.0) });
}

#[test]
fn a_body_rests_also_where_the_frame_in_the_middle_hardly_shows_its_turn() {
    const FRAMES: usize = 41;
    let wild = |k: usize| (k as f64 * 12.9898).sin().mul_add(43_758.545_3, 0.5).rem_euclid(1.0) - 0.5;
    // Three corners near a line, 1 cm off it.
    let shape: Vec<Point3<f64>> =
        box_corners().into_iter().chain([Point3::new(0.05, 0.01, 0.0), Point3::new(0.1, 0.0, 0.0)]).collect();
    let near_a_line = [0, 1, 8];
    let sample = |frame: usize, feature: usize| {
        if frame == FRAMES / 2 && !near_a_line.contains(&feature) {
            return Point3::from([f64::NAN; 3]);
        }
        let noise = |axis: usize| 0.004 * wild(3 * (100 * frame + feature) + axis);
        Point3::new(0.0, 0.0, 1.0) + shape[feature].coords + Vector3::from_fn(|axis, _| noise(axis))
    };
    let positions = (0..FRAMES).flat_map(|frame| (0..shape.len()).map(move |feature| (frame, feature)));
    let positions = positions.map(|(frame, feature)| sample(frame, feature)).collect();
    let labels = (0..shape.len()).map(|f| f.to_string()).collect();
    let body = Body::from_points("thing", labels, Tracks::new(shape.len(), positions).expect("full")).expect("seen");
    assert!(BodyMotion::of(&body, &MotionSettings::default()).rests());
}
