//! Whether a body moves at all.

use nalgebra::{Matrix6, Vector3};

use super::BodyMotion;
use crate::Pose;

impl BodyMotion<'_> {
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
        // Turns are measured from the one that is known best.
        let turn_noise = |noise: &Matrix6<f64>| noise.fixed_view::<3, 3>(0, 0).trace();
        let Some((best, _)) = posed.iter().min_by(|(_, a), (_, b)| turn_noise(a).total_cmp(&turn_noise(b))) else {
            return self.tracks.rest_but_for(self.noise.position.unwrap_or(0.0));
        };
        let departure = |(pose, noise): &(&Pose, &Matrix6<f64>)| {
            let shift = (**pose * centre).coords - mean;
            let turn = (pose.rotation * best.rotation.inverse()).scaled_axis();
            let noise = |first: usize| noise.fixed_view::<3, 3>(first, first).trace().max(f64::MIN_POSITIVE);
            // That has noise itself.
            shift.norm_squared() / noise(3) + turn.norm_squared() / (2.0 * noise(0))
        };
        posed.iter().map(departure).sum::<f64>() < 2.0 * MOVED * MOVED * count
    }
}
