//! Whether a body moves at all.

use nalgebra::{Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};

use super::BodyMotion;
use super::scaled::AtScale;
use crate::noise::{believed_drift, slowness};
use crate::{Pose, twist};

/// Fewest poses that tell that a body stays where it is.
const FEWEST: usize = 8;
/// Turn up to which rotations add up like vectors, radians.
const LARGEST_TURN: f64 = 0.6;
/// By how much the squares of departures may exceed what noise makes them, for the noise is not known better.
const UNSURE: f64 = 0.25;

/// The poses of a body that stays where it is, all one, and how well this is known.
#[derive(Debug, Clone)]
pub(super) struct Still {
    pub(super) poses: AtScale<'static, Vec<Option<Pose>>>,
    pub(super) covariances: AtScale<'static, Vec<Matrix6<f64>>>,
}

impl Still {
    pub(super) fn times(&self, factor: f64) -> Self {
        Self { poses: self.poses.times(factor), covariances: self.covariances.times(factor) }
    }
}

/// What some successive poses say of one: the inverse of the covariance of their mean, and that times the mean.
#[derive(Clone, Copy)]
struct Told {
    information: Matrix6<f64>,
    weighted: Vector6<f64>,
    frames: f64,
}

impl Told {
    fn and(&self, other: &Self) -> Self {
        Self {
            information: self.information + other.information,
            weighted: self.weighted + other.weighted,
            frames: self.frames + other.frames,
        }
    }
}

impl BodyMotion<'_> {
    /// The mean of all poses, if no motion shows beside their noise: not from frame to frame, and not in means over twice,
    /// four times, and so on as many frames up to half of them.
    ///
    /// # References
    /// docs/method.md, equation (6a).
    pub(super) fn find_still(&self) -> Option<Still> {
        let (poses, covariances, centre) = (self.poses_by_frame(), self.covariances_by_frame(), self.centre());
        let posed = || poses.iter().zip(covariances).filter_map(|(pose, noise)| Some((pose.as_ref()?, noise)));
        let count = posed().count();
        if self.at_rest || self.line.is_some() || count < FEWEST {
            return None;
        }
        let (middle, _) = posed().nth(count / 2)?;
        let mut all = Vec::with_capacity(count);
        let mut shifts = 0.0;
        for (pose, noise) in posed() {
            let turn = twist::rotation_log(&(pose.rotation * middle.rotation.inverse()));
            let shift = pose * centre - middle * centre;
            // Both poses have noise. Most bodies move farther in a few frames than all of it.
            shifts += 0.5 * shift.norm_squared() / noise.fixed_view::<3, 3>(3, 3).trace();
            if turn.norm() > LARGEST_TURN || !is_chance(shifts, count as f64) {
                return None;
            }
            let information = noise.cholesky()?.inverse();
            all.push(Told { information, weighted: information * twist::twist(&turn, &shift), frames: 1.0 });
        }
        let drift = believed_drift(self.drift(), count);
        let together = all.iter().copied().reduce(|a, b| a.and(&b))?;
        let known = together.information.cholesky()?;
        let mean = known.solve(&together.weighted);
        // Means over as many frames, and over twice as many.
        while all.len() > 1 {
            let mut squares = 0.0;
            for told in &all {
                let off = told.weighted - told.information * mean;
                squares += off.dot(&told.information.cholesky()?.solve(&off)) / slowness(drift, told.frames);
            }
            if !is_chance(squares, 6.0 * (all.len() as f64 - 1.0)) {
                return None;
            }
            all = all.chunks(2).map(|two| two.iter().skip(1).fold(two[0], |a, b| a.and(b))).collect();
        }
        let (turn, shift) = (mean.fixed_rows::<3>(0).into_owned(), mean.fixed_rows::<3>(3).into_owned());
        let pivot = (middle * centre).coords;
        let moved =
            Translation3::from(pivot + shift) * UnitQuaternion::from_scaled_axis(turn) * Translation3::from(-pivot);
        let pose = moved * middle;
        let covariance = known.inverse() * slowness(drift, count as f64);
        Some(Still {
            poses: poses.iter().map(|known| known.map(|_| pose)).collect::<Vec<_>>().into(),
            covariances: vec![covariance; poses.len()].into(),
        })
    }

    /// Whether the body hardly moves: its joints, its scale, and that of what is seen beside it, then show in nothing.
    pub fn rests(&self) -> bool {
        /// Root mean square distance of the poses from their mean, in standard deviations of their noise.
        const MOVED: f64 = 2.0;
        if self.at_rest || self.tracks.as_seen().rest() {
            return true;
        }
        let covariances = self.pose_covariances();
        let posed: Vec<(&Pose, &Matrix6<f64>)> = self
            .likely_poses()
            .iter()
            .zip(covariances)
            .filter_map(|(pose, noise)| Some((pose.as_ref()?, noise)))
            .collect();
        let centre = self.centre();
        let count = posed.len().max(1) as f64;
        let mean = posed.iter().map(|(pose, _)| (**pose * centre).coords).sum::<Vector3<f64>>() / count;
        let Some((middle, _)) = posed.get(posed.len() / 2) else {
            return self.tracks.rest_but_for(self.noise.position.unwrap_or(0.0));
        };
        let departure = |(pose, noise): &(&Pose, &Matrix6<f64>)| {
            let shift = (**pose * centre).coords - mean;
            let turn = (pose.rotation * middle.rotation.inverse()).scaled_axis();
            let noise = |first: usize| noise.fixed_view::<3, 3>(first, first).trace().max(f64::MIN_POSITIVE);
            // The turns are measured from one that has noise itself.
            shift.norm_squared() / noise(3) + turn.norm_squared() / (2.0 * noise(0))
        };
        posed.iter().map(departure).sum::<f64>() < 2.0 * MOVED * MOVED * count
    }
}

/// Whether a sum of squares of so many normal numbers, whose variance is about 1, is no larger than chance makes it.
fn is_chance(squares: f64, count: f64) -> bool {
    squares <= (1.0 + UNSURE) * count + 3.0 * (2.0 * count).sqrt()
}
