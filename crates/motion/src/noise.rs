//! Noise of observations, from what the data themselves show.

use nalgebra::{Point3, Vector3};

use crate::{Pose, Tracks};

/// Variance of a third difference of white noise, in variances of the noise: 1 + 9 + 9 + 1.
const THIRD_DIFFERENCE: f64 = 20.0;
/// Median absolute value of a standard normal variable.
const NORMAL_MEDIAN: f64 = 0.674_489_750_196_081_7;

/// Standard deviation of one coordinate, in metres, from the residuals of a registration to a shape.
///
/// *Definition.* `σ² = Σ |x - G s|² / dof` over the samples used, `dof = 3 n - 6 frames - 3 features + 6`: six per
/// pose and three per feature of the shape are fitted, less the six of the coordinates' choice. Exact repetitions of
/// a frame say nothing about noise and count once. `None` where nothing is left to tell noise by.
pub(crate) fn from_residuals(tracks: &Tracks, poses: &[Option<Pose>], shape: &[Option<Point3<f64>>]) -> Option<f64> {
    let mut used = vec![false; shape.len()];
    let (mut samples, mut frames, mut sum) = (0_usize, 0_usize, 0.0);
    for (frame, pose) in fresh(tracks, poses) {
        frames += 1;
        for (feature, position) in tracks.seen(frame) {
            let Some(expected) = &shape[feature] else { continue };
            used[feature] = true;
            samples += 1;
            sum += (position - pose * expected).norm_squared();
        }
    }
    let features = used.iter().filter(|used| **used).count();
    let freedom = (3 * samples + 6).checked_sub(6 * frames + 3 * features)?;
    if freedom == 0 && frames <= 1 && tracks.frames() > 1 && (1..tracks.frames()).all(|t| tracks.repeats_previous(t)) {
        return Some(0.0);
    }
    (freedom > 0).then(|| (sum / freedom as f64).sqrt())
}

/// The posed frames that are observations of their own: an exact repetition of the frame before says nothing new.
pub(crate) fn fresh<'p>(tracks: &Tracks, poses: &'p [Option<Pose>]) -> impl Iterator<Item = (usize, &'p Pose)> {
    let repeats = |frame| tracks.repeats_previous(frame) && poses[frame - 1].is_some();
    poses.iter().enumerate().filter_map(move |(frame, pose)| Some((frame, pose.as_ref().filter(|_| !repeats(frame))?)))
}

/// Noise of features that cannot be registered, metres: the root mean square of each one's own estimate.
pub(crate) fn of_single_points(tracks: &Tracks) -> Option<f64> {
    let sigmas: Vec<f64> = (0..tracks.features())
        .filter_map(|feature| {
            let series = (0..tracks.frames()).map(|frame| tracks.get(frame, feature).map(|p| p.coords));
            of_series(&series.collect::<Vec<_>>())
        })
        .collect();
    (!sigmas.is_empty()).then(|| (sigmas.iter().map(|s| s * s).sum::<f64>() / sigmas.len() as f64).sqrt())
}

/// Noise of tracked positions, metres.
pub(crate) fn of_positions(poses: &[Option<Pose>]) -> Option<f64> {
    of_series(&poses.iter().map(|pose| pose.map(|pose| pose.translation.vector)).collect::<Vec<_>>())
}

/// Noise of tracked rotations, radians per coordinate of the rotation vector.
pub(crate) fn of_rotations(poses: &[Option<Pose>]) -> Option<f64> {
    // Rotations relative to the previous frame are small, and are first differences already.
    let steps = poses.windows(2).map(|pair| Some((pair[0]?.rotation.inverse() * pair[1]?.rotation).scaled_axis()));
    robust_sigma(&steps.collect::<Vec<_>>(), |w: &[Vector3<f64>]| w[2] - 2.0 * w[1] + w[0], 3)
}

/// Standard deviation of white noise on a smooth series: the median of its third differences.
fn of_series(series: &[Option<Vector3<f64>>]) -> Option<f64> {
    robust_sigma(series, |w: &[Vector3<f64>]| w[3] - 3.0 * (w[2] - w[1]) - w[0], 4)
}

fn robust_sigma<F>(series: &[Option<Vector3<f64>>], third_difference: F, window: usize) -> Option<f64>
where
    F: Fn(&[Vector3<f64>]) -> Vector3<f64>,
{
    let mut sizes: Vec<f64> = series
        .windows(window)
        .filter_map(|w| w.iter().copied().collect::<Option<Vec<_>>>())
        // A repeated frame is not a fresh observation.
        .filter(|w| w.windows(2).all(|pair| pair[0] != pair[1]) || w.iter().all(|x| *x == w[0]))
        .flat_map(|w| third_difference(&w).abs().data.0[0])
        .collect();
    if sizes.is_empty() {
        return None;
    }
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*median / NORMAL_MEDIAN / THIRD_DIFFERENCE.sqrt())
}
