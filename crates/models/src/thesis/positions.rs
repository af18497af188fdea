//! Joint positions over time, from trajectories and an axis.

use super::lanes::Turned;
use jointscope_motion::RelativeMotion;
use nalgebra::{Complex, Point3, Unit, Vector3};
use std::f64::consts::{PI, TAU};

/// Displacement along `direction` in metres, per frame of the recording; 0 at the first frame.
pub(super) fn slides(motion: &RelativeMotion<'_>, direction: Unit<Vector3<f64>>) -> Vec<Option<f64>> {
    let place = |p: &Point3<f64>| direction.dot(&p.coords);
    let mean = |pairs: &[(f64, f64)], _| pairs.iter().map(|(start, now)| now - start).sum::<f64>() / pairs.len() as f64;
    follow(motion, place, mean, |now, position| now - position)
}

/// Angle about an axis in radians, unwrapped, per frame of the recording; 0 at the first frame.
///
/// Features weigh by their squared distance from the axis, as least squares demands.
pub(super) fn angles(motion: &RelativeMotion<'_>, point: Point3<f64>, axis: Unit<Vector3<f64>>) -> Vec<Option<f64>> {
    let [x, y] = across(axis);
    turns(motion, point, x, y)
}

/// The same, with the coordinates in which features turn given by their gradients `x` and `y`.
pub(super) fn turns(
    motion: &RelativeMotion<'_>,
    point: Point3<f64>,
    x: Vector3<f64>,
    y: Vector3<f64>,
) -> Vec<Option<f64>> {
    if let Some(columns) = motion.columns() {
        return unwrapped(motion, &Turned::of_all(point, [x, y], columns));
    }
    let place = |p: &Point3<f64>| Complex::new(x.dot(&(p - point)), y.dot(&(p - point)));
    let nearest_turn = |pairs: &[(Complex<f64>, Complex<f64>)], previous: f64| {
        nearest(pairs.iter().map(|(start, now)| start.conj() * now).sum(), previous)
    };
    follow(motion, place, nearest_turn, |now, position| now * Complex::from_polar(1.0, -position))
}

/// The angle of a product of places that is nearest to the previous one.
fn nearest(turned: Complex<f64>, previous: f64) -> f64 {
    let angle = turned.arg();
    if (previous - angle).abs() < PI {
        return angle;
    }
    angle + TAU * ((previous - angle) / TAU).round()
}

/// Angles per frame of the recording, unwrapped; 0 at the first frame.
pub(super) fn unwrapped(motion: &RelativeMotion<'_>, turned: &Turned) -> Vec<Option<f64>> {
    let mut previous = 0.0;
    let angles = turned.sums().enumerate().map(|(index, turned)| {
        previous = if index == 0 { 0.0 } else { nearest(turned, previous) };
        previous
    });
    by_frame(motion, angles)
}

/// Gradients of the coordinates in which features turn about an axis.
pub(super) fn across(axis: Unit<Vector3<f64>>) -> [Vector3<f64>; 2] {
    let x = Unit::new_normalize(axis.cross(&Vector3::ith(axis.iamin(), 1.0)));
    [x.into_inner(), axis.cross(&x)]
}

/// Positions of the frames that count, per frame of the recording.
pub(super) fn by_frame(motion: &RelativeMotion<'_>, counted: impl Iterator<Item = f64>) -> Vec<Option<f64>> {
    let mut positions = vec![None; motion.recording_frames()];
    for (&frame, position) in motion.frames().iter().zip(counted) {
        positions[frame] = Some(position);
    }
    positions
}

/// Follows a joint position through the frames.
///
/// Every feature is anchored at the place it would have at position 0: the features of the first frame where they are,
/// later ones carried back by the position of the frame in which they appear. A frame that shows none of the anchored
/// features has no position.
fn follow<C: Copy>(
    motion: &RelativeMotion<'_>,
    place: impl Fn(&Point3<f64>) -> C,
    measure: impl Fn(&[(C, C)], f64) -> f64,
    undo: impl Fn(C, f64) -> C,
) -> Vec<Option<f64>> {
    let trajectories = motion.trajectories();
    let mut anchors = vec![None; trajectories.len()];
    let mut next = vec![0; trajectories.len()];
    let mut positions = vec![None; motion.recording_frames()];
    let mut previous = None;
    let (mut here, mut pairs) = (Vec::new(), Vec::new());
    for &frame in motion.frames() {
        here.clear();
        for (feature, cursor) in next.iter_mut().enumerate() {
            let trajectory = trajectories.get(feature);
            if trajectory.frames.get(*cursor) == Some(&frame) {
                here.push((feature, place(&trajectory.points[*cursor])));
                *cursor += 1;
            }
        }
        pairs.clear();
        pairs.extend(here.iter().filter_map(|&(feature, now)| Some((anchors[feature]?, now))));
        let position = match previous {
            None => 0.0,
            Some(_) if pairs.is_empty() => continue,
            Some(previous) => measure(&pairs, previous),
        };
        for &(feature, now) in &here {
            anchors[feature].get_or_insert_with(|| undo(now, position));
        }
        positions[frame] = Some(position);
        previous = Some(position);
    }
    positions
}

/// Whether the joint's direction must be turned for its farthest position to be positive.
pub(super) fn points_backwards(positions: &[Option<f64>]) -> bool {
    let seen = || positions.iter().flatten().copied();
    -seen().fold(0.0, f64::min) > seen().fold(0.0, f64::max)
}
