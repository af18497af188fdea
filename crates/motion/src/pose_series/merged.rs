//! Successive frames merged into one.

use std::{ops::Range, sync::OnceLock};

use nalgebra::{Matrix6, Vector6};

use super::{End, PoseSeries};
use crate::{Pose, twist};

/// Most frames that are merged into one: in more, motion would be lost.
const LONGEST_RUN: usize = 20;
/// Standard deviations of what differs within merged runs above chance that may be motion.
const LOST_MOTION: f64 = 2.0;
/// What the noise of a rate adds to six coordinates' squared distances of a run, in variances, of a rate told by the run
/// itself and one neighbour, and by two neighbours: `Σ (t - t̄)²` of `n` poses is `n³/12`, the variance of the rate `2/n³`
/// and `1/2n³`.
const RATE_COST: [f64; 2] = [1.0, 0.25];

impl PoseSeries {
    /// The series with about so many frames left; `None` where that leaves too few in each, or loses motion.
    pub(crate) fn merged(&self, frames: usize) -> Option<Self> {
        let count = self.poses.len();
        if !self.evenly || frames == 0 || count < 2 * frames || count > LONGEST_RUN * frames {
            return None;
        }
        let run = |k: usize| k * count / frames..(k + 1) * count / frames;
        let means: Vec<Mean> = (0..frames).map(|k| Mean::of(self, run(k))).collect::<Option<_>>()?;
        let merged_cost = means.iter().map(|mean| mean.cost).sum();
        // What differs within a run is noise, or the run is too long.
        let length = count as f64 / frames as f64;
        let freedom = 6.0 * (count as f64 - frames as f64 * self.slowness(length));
        if merged_cost > freedom + LOST_MOTION * (2.0 * freedom * self.correlation_time).sqrt() {
            return None;
        }
        // Within a run the motion goes on as from the one before to the one after.
        let motion = |(k, mean): (usize, &Mean)| {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(frames - 1));
            let way = means[before].pose.inverse() * means[after].pose;
            let rate = twist::log(&way) / (length * (after - before).max(1) as f64);
            mean.motion(&rate) + RATE_COST[usize::from(after - before == 2)]
        };
        let merged_motion = means.iter().enumerate().map(motion).sum::<f64>().max(0.0);
        let mut merged = Self {
            frames: (0..frames).map(|k| self.frames[run(k).start + run(k).len() / 2]).collect(),
            poses: means.iter().map(|mean| mean.pose).collect(),
            noise: means.iter().map(|mean| mean.covariance).collect(),
            merged_cost,
            merged_motion,
            ..self.clone()
        };
        let quieter =
            |(number, end): (usize, &End)| End { shift_noise: merged.shift_noise_at(&end.centre, number > 0), ..*end };
        merged.ends = OnceLock::from(self.ends().iter().enumerate().map(quieter).collect::<Vec<_>>());
        Some(merged)
    }
}

/// The mean of a run of poses by their information.
pub(super) struct Mean {
    pub(super) pose: Pose,
    pub(super) covariance: Matrix6<f64>,
    /// Squared distances from it, in variances.
    pub(super) cost: f64,
    /// Sum of the weighted distances, times how many poses each is after the middle of the run, and the information of a
    /// rate that would explain them.
    pull_in_time: Vector6<f64>,
    information_in_time: Matrix6<f64>,
}

impl Mean {
    pub(super) fn of(series: &PoseSeries, run: Range<usize>) -> Option<Self> {
        let (poses, noise) = (&series.poses[run.clone()], &series.noise[run]);
        let mut pose = *poses.get(poses.len() / 2)?;
        let information: Vec<Matrix6<f64>> =
            noise.iter().map(|noise| Some(noise.cholesky()?.inverse())).collect::<Option<_>>()?;
        let sum: Matrix6<f64> = information.iter().sum();
        let covariance = sum.cholesky()?.inverse();
        let departures = |pose: &Pose| {
            let back = pose.inverse();
            poses.iter().map(move |other| twist::log(&(back * other)))
        };
        for _ in 0..3 {
            let pull = departures(&pose).zip(&information).map(|(d, w)| w * d).sum::<Vector6<f64>>();
            pose *= twist::exp(&(covariance * pull));
        }
        let middle = (poses.len() - 1) as f64 / 2.0;
        let (cost, pull_in_time, information_in_time) = (0.0, Vector6::zeros(), Matrix6::zeros());
        let mut mean = Self { pose, covariance, cost, pull_in_time, information_in_time };
        for (at, (d, w)) in departures(&pose).zip(&information).enumerate() {
            let (after, pull) = (at as f64 - middle, w * d);
            mean.cost += d.dot(&pull);
            mean.pull_in_time += pull * after;
            mean.information_in_time += w * (after * after);
        }
        Some(mean)
    }

    /// How much of the cost a motion at this rate, a twist per pose, explains.
    fn motion(&self, rate: &twist::Twist) -> f64 {
        2.0 * rate.dot(&self.pull_in_time) - rate.dot(&(self.information_in_time * rate))
    }
}
