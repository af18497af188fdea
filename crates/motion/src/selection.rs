//! Which frames of a pair are looked at.

use nalgebra::Point3;

use crate::pose_series::median;
use crate::{BodyMotion, Pose};

/// Most frames that are looked at.
const MOST_FRAMES: usize = 400;
/// Share of a long recording's frames in which there is motion below which they are sought out.
const SPARSE: f64 = 0.25;
/// Steps of a long recording that count as motion, in standard deviations of a sample's coordinate, and the most frames
/// of such a step.
const IN_NOISE: f64 = 4.0;
const LONGEST_STRIDE: usize = 20;
/// Frames that are needed besides their exact repetitions.
const FEW_FRESH: usize = 6;
/// Uncertainty of a frame's turn that is passed over: in usual ones, and least, radians.
const VAGUE: f64 = 3.0;
const VAGUE_TURN: f64 = 0.1;

/// So many of `0..count`, evenly, first and last included.
pub fn evenly(count: usize, most: usize) -> Vec<usize> {
    if count <= most {
        return (0..count).collect();
    }
    (0..most).map(|k| k * (count - 1) / (most - 1)).collect()
}

/// Poses of reference and moving body in a frame.
pub(crate) type Common = (usize, Pose, Pose);

/// The frames, by their index in `common`, that say something of their own.
pub(crate) fn telling(common: &[Common], reference: &BodyMotion<'_>, moving: &BodyMotion<'_>) -> Vec<usize> {
    // An exact repetition of a frame says nothing new.
    let repeats = |body: &BodyMotion<'_>, frame| body.is_at_rest() || body.seen().tracks.repeats_previous(frame);
    let fresh: Vec<usize> = (0..common.len())
        .filter(|&index| index == 0 || !(repeats(reference, common[index].0) && repeats(moving, common[index].0)))
        .collect();
    // A turn that a few features hardly tell is no small one, and what is computed of it means nothing; but a tracker's
    // turn that was smoothed is as good as it says.
    let turn_noise = |index: &usize| {
        let of = |body: &BodyMotion<'_>| body.pose_covariances()[common[*index].0].fixed_view::<3, 3>(0, 0).trace();
        (of(reference) + of(moving)).sqrt()
    };
    let usual = median(fresh.iter().map(turn_noise).collect());
    let tracked = reference.is_tracked() || moving.is_tracked();
    let told = |index: &usize| tracked || turn_noise(index) < (VAGUE * usual).max(VAGUE_TURN);
    let fresh: Vec<usize> = fresh.into_iter().filter(told).collect();
    if fresh.len() < FEW_FRESH { (0..common.len()).collect() } else { fresh }
}

/// Poses that are taken from many, and whether they lie evenly in time.
pub(crate) struct Sample {
    pub(crate) frames: Vec<usize>,
    pub(crate) evenly: bool,
}

/// The poses that are taken from a long recording: half of them evenly over time, and half evenly over the way that a
/// body of this centre, turning on this arm, goes beyond noise, so that a motion between long rests is seen.
pub(crate) fn sampled(poses: &[Pose], centre: &Point3<f64>, arm: f64, noise: f64) -> Sample {
    let count = poses.len();
    let all = Sample { frames: evenly(count, MOST_FRAMES), evenly: true };
    if count < 2 * MOST_FRAMES {
        return all;
    }
    // Over some frames motion adds up, and jitter does not.
    let stride = (count / 40).min(LONGEST_STRIDE);
    let mut way = vec![0.0; count];
    for at in stride..count {
        let moved = poses[at - stride].inverse() * poses[at];
        let step = (moved * centre - centre).norm() + moved.rotation.angle() * arm;
        way[at] = way[at - 1] + (step - IN_NOISE * noise).max(0.0);
    }
    let whole = way[count - 1];
    // So many frames there were, did all that move move alike.
    let steps = || way.windows(2).map(|pair| pair[1] - pair[0]);
    let moving = whole.powi(2) / steps().map(|step| step * step).sum::<f64>().max(f64::MIN_POSITIVE);
    if whole <= 0.0 || moving > SPARSE * count as f64 {
        return all;
    }
    let mut taken = evenly(count, MOST_FRAMES / 2);
    let half = MOST_FRAMES / 2;
    taken.extend((1..=half).map(|k| way.partition_point(|way| *way < whole * k as f64 / half as f64).min(count - 1)));
    taken.sort_unstable();
    taken.dedup();
    Sample { frames: taken, evenly: false }
}
