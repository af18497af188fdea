//! Noise that is larger along the viewing ray than across it, as depth cameras and single cameras have it.
//!
//! The ray is that from the origin of the recording's coordinates, whether or not a camera is there: of motion capture it
//! is a direction like any other, along which noise may differ.

use nalgebra::{Matrix3, Matrix6, Point3, Vector3, Vector6};

use crate::poses::rebase;
use crate::robust::Registered;
use crate::{Pose, Tracks, noise::Spread};

/// Ratio of the variances along and across the ray within which noise counts as equal in all directions.
const EQUAL: std::ops::Range<f64> = 0.6..1.6;
/// Standard deviations by which the ratio must differ from 1.
const CHANCE: f64 = 4.0;
/// Rounds of estimating noise, poses and shape in turn.
const ROUNDS: usize = 7;
/// Rounds after which samples are judged anew: the equal noise before has cut the tail along the ray.
const JUDGED_ANEW: [usize; 2] = [1, 3];
/// Squared distance in standard deviations beyond which a sample is wild: 4.5².
const WILD: f64 = 20.0;

/// Estimates noise along and across the ray from a camera at the origin; where they differ, poses and shape are
/// refined with it.
///
/// *Definition.* Point information `(I - r rᵀ)/σ_across² + r rᵀ/σ_along²`; variances from residuals, each divided by
/// what the fit of poses (leverage) and shape leaves of it; Gauss-Newton in between.
pub(crate) fn refine(tracks: &Tracks, body: &mut Registered, sigma: f64) -> Spread {
    let equal = Spread { across: sigma, along: sigma };
    let features = body.shape.len();
    let (posed, known) = (body.poses.iter().flatten().count(), body.shape.iter().flatten().count());
    let Some(mut used) = body.used.clone().filter(|_| posed >= 5 && known >= 4 && sigma > 0.0) else { return equal };
    let (mut poses, mut shape) = (body.poses.clone(), body.shape.clone());
    let mut spread = equal;
    for round in 0..ROUNDS {
        if round > 0 {
            step_poses(tracks, &mut poses, &shape, &used, &spread);
            step_shape(tracks, &poses, &mut shape, &used, &spread);
        }
        let (estimated, chance) = spread_of(tracks, &poses, &shape, &used, &spread);
        let floor = 1e-6 * sigma;
        spread = Spread { across: estimated.across.max(floor), along: estimated.along.max(floor) };
        let ratio = (spread.along / spread.across).powi(2);
        if round == 0 && (EQUAL.contains(&ratio) || ratio.ln().abs() < CHANCE * chance) {
            return equal;
        }
        if JUDGED_ANEW.contains(&round) {
            for (frame, pose) in poses.iter_mut().enumerate() {
                let Some(found) = pose else { continue };
                let mut count = 0;
                for (feature, position) in tracks.seen(frame) {
                    let Some(place) = shape[feature] else { continue };
                    let (along, across) = parts(position, &(*found * place));
                    let distance = along / spread.along.powi(2) + across / spread.across.powi(2);
                    let stays = distance < WILD && !body.strays.contains(&feature);
                    used[frame * features + feature] = stays;
                    count += usize::from(stays);
                }
                if count < 3 {
                    *pose = None;
                }
            }
        }
    }
    rebase(&mut poses, &mut shape);
    (body.poses, body.shape, body.used) = (poses, shape, Some(used));
    spread
}

/// Squared residual along and across the ray, m².
fn parts(position: &Point3<f64>, expected: &Point3<f64>) -> (f64, f64) {
    let residual = position - expected;
    let along = residual.dot(&ray(position)).powi(2);
    (along, residual.norm_squared() - along)
}

fn ray(position: &Point3<f64>) -> Vector3<f64> {
    position.coords.try_normalize(0.0).unwrap_or_else(Vector3::z)
}

/// Information of a pose, as a twist `[ω; v]` about a centre from which a point of this information is at `arm`:
/// `Dᵀ W D` with the derivative `D = [-[arm]ₓ, 1]` of the point by the twist.
fn of_pose(arm: &Vector3<f64>, information: &Matrix3<f64>) -> Matrix6<f64> {
    let lever = arm.cross_matrix();
    let across = lever * information;
    let mut of_pose = Matrix6::zeros();
    of_pose.fixed_view_mut::<3, 3>(0, 0).copy_from(&(across * lever.transpose()));
    of_pose.fixed_view_mut::<3, 3>(0, 3).copy_from(&across);
    of_pose.fixed_view_mut::<3, 3>(3, 0).copy_from(&across.transpose());
    of_pose.fixed_view_mut::<3, 3>(3, 3).copy_from(information);
    of_pose
}

/// What a direction at a point moves of a twist: `Dᵀ r`.
fn moment(arm: &Vector3<f64>, direction: &Vector3<f64>) -> Vector6<f64> {
    let turn = arm.cross(direction);
    Vector6::new(turn.x, turn.y, turn.z, direction.x, direction.y, direction.z)
}

/// Variance of a point in all directions together by a pose's covariance: the trace of `D C Dᵀ`.
fn variance(arm: &Vector3<f64>, covariance: &Matrix6<f64>) -> f64 {
    let (turns, mixed) = (covariance.fixed_view::<3, 3>(0, 0), covariance.fixed_view::<3, 3>(0, 3));
    let twisted =
        Vector3::new(mixed[(1, 2)] - mixed[(2, 1)], mixed[(2, 0)] - mixed[(0, 2)], mixed[(0, 1)] - mixed[(1, 0)]);
    let of_turns = turns.trace() * arm.norm_squared() - arm.dot(&(turns * arm));
    of_turns - 2.0 * arm.dot(&twisted) + covariance.fixed_view::<3, 3>(3, 3).trace()
}

/// The samples of a frame that take part: feature, seen position, expected position.
fn taking_part<'a>(
    tracks: &'a Tracks,
    frame: usize,
    pose: &'a Pose,
    shape: &'a [Option<Point3<f64>>],
    used: &'a [bool],
) -> impl Iterator<Item = (usize, &'a Point3<f64>, Point3<f64>)> {
    let row = &used[frame * shape.len()..];
    tracks.seen(frame).filter_map(move |(f, position)| Some((f, position, pose * shape[f].filter(|_| row[f])?)))
}

fn step_poses(
    tracks: &Tracks,
    poses: &mut [Option<Pose>],
    shape: &[Option<Point3<f64>>],
    used: &[bool],
    spread: &Spread,
) {
    for (frame, pose) in poses.iter_mut().enumerate() {
        let Some(found) = pose else { continue };
        let centre = *found * Point3::origin();
        let (mut information, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
        for (_, position, expected) in taking_part(tracks, frame, found, shape, used) {
            let (arm, of_point) = (expected - centre, spread.information(&ray(position)));
            information += of_pose(&arm, &of_point);
            gradient += moment(&arm, &(of_point * (position - expected)));
        }
        let Some(step) = information.cholesky().map(|factor| factor.solve(&gradient)) else { continue };
        let turn = nalgebra::UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
        let shift = centre.coords + step.fixed_rows::<3>(3) - turn * centre.coords;
        *found = Pose::from_parts(shift.into(), turn) * *found;
    }
}

fn step_shape(
    tracks: &Tracks,
    poses: &[Option<Pose>],
    shape: &mut [Option<Point3<f64>>],
    used: &[bool],
    spread: &Spread,
) {
    let mut sums = vec![(Matrix3::zeros(), Vector3::zeros()); shape.len()];
    for (frame, pose) in poses.iter().enumerate() {
        let Some(pose) = pose else { continue };
        let turn = pose.rotation.to_rotation_matrix();
        for (feature, position, expected) in taking_part(tracks, frame, pose, shape, used) {
            let back = turn.matrix().transpose() * spread.information(&ray(position));
            sums[feature].0 += back * turn.matrix();
            sums[feature].1 += back * (position - expected);
        }
    }
    for (place, (information, gradient)) in shape.iter_mut().zip(sums) {
        if let (Some(place), Some(factor)) = (place, information.cholesky()) {
            *place += factor.solve(&gradient);
        }
    }
}

/// Noise along and across the ray, and the standard deviation that chance gives the logarithm of their variances' ratio.
fn spread_of(
    tracks: &Tracks,
    poses: &[Option<Pose>],
    shape: &[Option<Point3<f64>>],
    used: &[bool],
    spread: &Spread,
) -> (Spread, f64) {
    let mut counts = vec![0.0; shape.len()];
    for (frame, pose) in poses.iter().enumerate() {
        let Some(pose) = pose else { continue };
        taking_part(tracks, frame, pose, shape, used).for_each(|(feature, ..)| counts[feature] += 1.0);
    }
    let (mut along, mut across) = ((0.0, 0.0), (0.0, 0.0));
    for (frame, pose) in poses.iter().enumerate() {
        let Some(pose) = pose else { continue };
        let centre = pose * Point3::origin();
        let mut information = Matrix6::zeros();
        for (_, position, expected) in taking_part(tracks, frame, pose, shape, used) {
            information += of_pose(&(expected - centre), &spread.information(&ray(position)));
        }
        let Some(covariance) = information.cholesky().map(|factor| factor.inverse()) else { continue };
        for (feature, position, expected) in taking_part(tracks, frame, pose, shape, used) {
            let arm = expected - centre;
            let along_ray = moment(&arm, &ray(position));
            let of_ray = along_ray.dot(&(covariance * along_ray));
            let share = 1.0 / counts[feature];
            let (square_along, square_across) = parts(position, &expected);
            along.0 += square_along;
            along.1 += 1.0 - of_ray / spread.along.powi(2) - share;
            across.0 += square_across;
            across.1 += 2.0 - (variance(&arm, &covariance) - of_ray) / spread.across.powi(2) - 2.0 * share;
        }
    }
    let sigma = |(sum, freedom): (f64, f64)| (sum / freedom.max(1.0)).sqrt();
    let chance = (2.0 / along.1.max(1.0) + 2.0 / across.1.max(1.0)).sqrt();
    (Spread { across: sigma(across), along: sigma(along) }, chance)
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3x6;

    use super::*;

    #[test]
    fn closed_forms_are_products_with_the_derivative_of_a_point() {
        let arm = Vector3::new(0.3, -0.7, 1.1);
        let mut derivative = Matrix3x6::zeros();
        derivative.fixed_view_mut::<3, 3>(0, 0).copy_from(&-arm.cross_matrix());
        derivative.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
        let root = Matrix6::from_fn(|r, c| ((3 * r + 5 * c) as f64).sin());
        let covariance = root * root.transpose();
        let ray = Vector3::new(0.2, 0.9, -0.4).normalize();
        let information = Spread { across: 0.5, along: 2.0 }.information(&ray);
        assert!((of_pose(&arm, &information) - derivative.transpose() * information * derivative).amax() < 1e-12);
        assert!((moment(&arm, &ray) - derivative.transpose() * ray).amax() < 1e-15);
        let of_point = derivative * covariance * derivative.transpose();
        assert!((variance(&arm, &covariance) - of_point.trace()).abs() < 1e-12 * of_point.trace());
    }
}
