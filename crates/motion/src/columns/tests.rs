//! What is not kept is computed anew, and is the same.

use nalgebra::{UnitQuaternion, Vector3};

use super::*;

/// Rounding of sums that are put together in another order, as a share.
const SAME: f64 = 1e-12;

fn wild(k: usize) -> f64 {
    (k as f64 * 12.9898).sin().mul_add(43_758.545_3, 0.5).rem_euclid(1.0) - 0.5
}

fn wild_vector(k: usize) -> Vector3<f64> {
    Vector3::new(wild(3 * k), wild(3 * k + 1), wild(3 * k + 2))
}

/// A hinge that swings by so many degrees, with 1 mm of noise.
fn swinging(features: usize, frames: usize, degrees: f64) -> Tracks {
    let place = |frame: usize, feature: usize| {
        let angle = (0.5 * degrees).to_radians() * (0.013 * frame as f64).sin();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.2, -0.1, 1.0).normalize() * angle);
        Point3::from(turn * (Vector3::new(0.5, 0.0, 1.0) + 0.3 * wild_vector(feature)))
            + 0.001 * wild_vector(1000 + 7 * frame * features + feature)
    };
    let places = (0..frames).flat_map(|frame| (0..features).map(move |feature| place(frame, feature)));
    Tracks::new(features, places.collect()).expect("whole frames")
}

#[test]
fn long_recordings_show_the_same_a_part_at_a_time() {
    const FRAMES: usize = 1501;
    // Of a full turn, too many places may be the ends of the largest distance.
    for (features, degrees) in [(100, 70.0), (60, 200.0), (60, 360.0)] {
        let tracks = swinging(features, FRAMES, degrees);
        let seen = SeenAtScale { tracks: &tracks, factor: 1.0 };
        let frames: Vec<usize> = (0..FRAMES).collect();
        let pose = |frame: usize| {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::x() * 0.001 * frame as f64);
            Pose::from_parts((Vector3::y() * 0.0003 * frame as f64).into(), turn)
        };
        let kept = Placed::of(seen, &frames, Maps::of(&frames, pose), None).expect("all is seen");
        let anew = Placed { numbers: None, summaries: OnceLock::new(), ..kept.clone() };
        let [kept, anew] = [&kept, &anew].map(|placed| Columns::new(seen, &frames, placed));
        let mut parts = 0;
        let mut next = 0;
        anew.in_turn(|first, rows| {
            assert_eq!((first, rows.len()), (next, features));
            kept.in_turn(|_, all| {
                for (rows, all) in rows.iter().zip(all) {
                    assert!((0..rows.frames).all(|k| rows.point(k) == all.point(first + k)));
                }
            });
            (next, parts) = (first + rows[0].frames, parts + 1);
        });
        assert!(next == FRAMES && parts > 2, "{parts} parts");
        for (feature, (found, expected)) in anew.summaries().iter().zip(kept.summaries()).enumerate() {
            let place = format!("{degrees} degrees, {feature}: {found:?}\n{expected:?}");
            let pairs = [(found.path, expected.path), (found.extent, expected.extent)];
            assert!(pairs.iter().all(|(found, expected)| (found / expected - 1.0).abs() < SAME), "{place}");
            assert_eq!(
                (found.first, found.moved, found.magnitude),
                (expected.first, expected.moved, expected.magnitude)
            );
            assert!((found.mean - expected.mean).norm() < SAME, "{place}");
            assert!((found.covariance - expected.covariance).norm() < SAME, "{place}");
            let form = found.covariance;
            let ((cubic, quartic), (expected_cubic, expected_quartic)) =
                (found.by_form(&form), expected.by_form(&form));
            assert!((cubic - expected_cubic).norm() < SAME && (quartic - expected_quartic).abs() < SAME, "{place}");
            let shown = [anew, kept].map(|columns| columns.of(feature, |rows| rows.point(FRAMES - 1)));
            assert_eq!(shown[0], shown[1]);
        }
    }
}

#[test]
fn the_largest_distance_is_told_by_few_places_of_an_arc_and_refused_of_a_circle() {
    const FRAMES: usize = 1501;
    for (degrees, told) in [(30.0, true), (90.0, true), (150.0, true), (360.0, false)] {
        let tracks = swinging(8, FRAMES, degrees);
        let seen = SeenAtScale { tracks: &tracks, factor: 1.0 };
        let frames: Vec<usize> = (0..FRAMES).collect();
        let mut placed = Placed::of(seen, &frames, Maps::of(&frames, |_| Pose::identity()), None).expect("all is seen");
        placed.numbers = None;
        let columns = Columns::new(seen, &frames, &placed);
        let mut far = columns.far_ends().expect("a long recording");
        columns.in_turn(|_, rows| far.iter_mut().zip(rows).for_each(|(far, rows)| far.add(rows.coordinates)));
        assert!(far.into_iter().all(|far| far.extent().is_some() == told), "{degrees} degrees");
    }
}
