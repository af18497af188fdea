//! Low-pass filtering over time.

use jointscope_motion::Pose;
use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};

/// Standard deviations after which the Gaussian ends.
const REACH: f64 = 4.0;

/// A Gaussian over frames that ends at 4 standard deviations; at the ends of a recording it is cut off and scaled to
/// weigh 1 again.
#[derive(Debug, Clone)]
pub(crate) struct Filter {
    /// By the distance in frames.
    weights: Vec<f64>,
}

impl Filter {
    /// Of a standard deviation in frames.
    pub(crate) fn new(sigma: f64) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of frames")]
        let reach = (REACH * sigma) as usize;
        let weight =
            |distance: usize| if distance == 0 { 1.0 } else { (-0.5 * (distance as f64 / sigma).powi(2)).exp() };
        Self { weights: (0..=reach).map(weight).collect() }
    }

    /// Smooths the tracks of so many features (frame-major), none of them missing.
    pub(crate) fn smooth_rows(&self, positions: &mut [Point3<f64>], features: usize) {
        if self.is_idle() {
            return;
        }
        let rows: Vec<_> = positions.to_vec();
        let frames = rows.len() / features;
        for (frame, smooth) in positions.chunks_exact_mut(features).enumerate() {
            smooth.fill(Point3::origin());
            for (other, weight) in self.around(frame, frames) {
                for (sum, position) in smooth.iter_mut().zip(&rows[other * features..]) {
                    *sum += weight * position.coords;
                }
            }
        }
    }

    /// Smooths poses: the weighted means of positions, and of quaternions of the same half-sphere.
    pub(crate) fn smooth_poses(&self, poses: &mut [Pose]) {
        if self.is_idle() {
            return;
        }
        let rough = poses.to_vec();
        for (frame, smooth) in poses.iter_mut().enumerate() {
            let (mut place, mut turn) = (Vector3::zeros(), Quaternion::from_real(0.0));
            for (other, weight) in self.around(frame, rough.len()) {
                place += weight * rough[other].translation.vector;
                let side = rough[frame].rotation.coords.dot(&rough[other].rotation.coords).signum();
                turn += rough[other].rotation.into_inner() * (side * weight);
            }
            *smooth = Pose::from_parts(place.into(), UnitQuaternion::new_normalize(turn));
        }
    }

    /// Whether it leaves everything as it is.
    fn is_idle(&self) -> bool {
        self.weights.len() == 1
    }

    /// The frames that go into one, each with its weight; the weights sum to 1.
    fn around(&self, frame: usize, frames: usize) -> impl Iterator<Item = (usize, f64)> {
        let reach = self.weights.len() - 1;
        let window = frame.saturating_sub(reach)..(frame + reach + 1).min(frames);
        let weighed = window.map(move |other| (other, self.weights[other.abs_diff(frame)]));
        let sum: f64 = weighed.clone().map(|(_, weight)| weight).sum();
        weighed.map(move |(other, weight)| (other, weight / sum))
    }
}
