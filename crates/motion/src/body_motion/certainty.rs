//! How well the poses of a body are known.

use std::f64::consts::SQRT_2;
use std::sync::OnceLock;

use nalgebra::Matrix6;

use super::BodyMotion;
use super::scaled::AtScale;
use crate::noise::Spread;
use crate::twist;
use crate::uncertainty::{of_registered, of_tracked};

/// Uncertainty of a rotation that was replaced by that of its surroundings in time, radians.
const REPLACED: f64 = 0.175;

impl BodyMotion<'_> {
    /// Covariance of every one of [`BodyMotion::likely_poses`], rad and m squared: a twist `[ω; v]` about the body's
    /// [centre](BodyMotion::centre), in axes of the recording.
    pub fn pose_covariances(&self) -> &[Matrix6<f64>] {
        self.covariances.get_or_init(|| self.find_covariances().into())
    }

    fn find_covariances(&self) -> Vec<Matrix6<f64>> {
        let centre = self.centre();
        if let Some(mended) = &self.tracked {
            let [position, rotation] = [self.noise.position, self.noise.rotation].map(Option::unwrap_or_default);
            return of_tracked(position, rotation, &mended.as_seen().replaced, REPLACED);
        }
        let Some(registered) = &self.registered else {
            let Some(line) = &self.line else { return vec![Matrix6::zeros(); self.poses.len()] };
            return of_registered(&self.tracks, &line.poses, &line.shape, |_, _| true, self.sound_spread(), &centre);
        };
        let used = |frame: usize, feature: usize| registered.uses(frame, feature);
        let (poses, shape) = self
            .line
            .as_ref()
            .map_or((self.found_poses(registered), &registered.shape), |line| (&line.poses, &line.shape));
        let Spread { across, along } = self.sound_spread();
        let times = if registered.shown_first.is_some() { SQRT_2 } else { 1.0 };
        let spread = Spread { across: times * across, along: times * along };
        of_registered(&self.tracks, poses, shape, used, spread, &centre)
    }

    /// The same body with poses that are less certain: by as much as another registration of it puts them elsewhere,
    /// times `errors`.
    ///
    /// # References
    /// docs/method.md, "One camera".
    #[must_use]
    pub fn uncertain_towards(self, other: &BodyMotion<'_>, errors: f64) -> Self {
        let (centre, of_other) = (self.centre(), other.centre());
        let both = self.likely_poses().iter().zip(other.likely_poses()).zip(self.pose_covariances());
        let covariances: Vec<Matrix6<f64>> = both
            .map(|((pose, elsewhere), covariance)| {
                let (Some(pose), Some(elsewhere)) = (pose, elsewhere) else { return *covariance };
                let turn = twist::rotation_log(&(elsewhere.rotation * pose.rotation.inverse()));
                let away = twist::twist(&turn, &(elsewhere * of_other - pose * centre)) * errors;
                covariance + away * away.transpose()
            })
            .collect();
        Self { covariances: OnceLock::from(AtScale::from(covariances)), ..self }
    }

    /// Covariance of the first pose, which the body's coordinates rest on, as those of
    /// [`BodyMotion::pose_covariances`]; `None` without poses.
    pub fn start_covariance(&self) -> Option<Matrix6<f64>> {
        let first = self.likely_poses().iter().position(Option::is_some)?;
        Some(self.start_covariance.unwrap_or(self.pose_covariances()[first]))
    }

    /// The spread, never so small that its inverse is not a number.
    fn sound_spread(&self) -> Spread {
        let least = (1e-6 * self.size()).max(1e-30);
        Spread { across: self.spread.across.max(least), along: self.spread.along.max(least) }
    }
}
