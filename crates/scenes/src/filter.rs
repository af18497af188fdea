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

#[cfg(test)]
mod tests {
    use super::*;

    fn smoothed(sigma: f64, series: &[f64]) -> Vec<f64> {
        let mut positions: Vec<_> = series.iter().map(|&x| Point3::new(x, 0.0, -x)).collect();
        Filter::new(sigma).smooth_rows(&mut positions, 1);
        positions.iter().map(|p| p.x).collect()
    }

    #[test]
    fn a_pulse_becomes_a_gaussian_that_ends_at_four_standard_deviations() {
        let mut pulse = vec![0.0; 61];
        pulse[30] = 1.0;
        let smooth = smoothed(2.0, &pulse);
        assert!((smooth.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let ratio = smooth[32] / smooth[30];
        assert!((ratio - (-0.5_f64).exp()).abs() < 1e-12, "{ratio}");
        assert!(smooth[38] > 0.0 && smooth[39] == 0.0 && smooth[22] > 0.0 && smooth[21] == 0.0);
    }

    #[test]
    fn what_is_constant_stays_so_up_to_the_ends_and_what_is_even_stays_within() {
        assert!(smoothed(3.0, &[0.7; 20]).iter().all(|x| (x - 0.7).abs() < 1e-14));
        let even: Vec<f64> = (0..40).map(f64::from).collect();
        let smooth = smoothed(2.0, &even);
        assert!((8..32).all(|frame| (smooth[frame] - even[frame]).abs() < 1e-12));
        assert!(smooth[0] > 0.5 && smooth[39] < 38.5, "an end leans inwards");
    }

    #[test]
    fn a_filter_may_be_longer_than_the_recording_or_shorter_than_a_frame() {
        assert!(smoothed(1000.0, &[0.0, 1.0]).iter().all(|x| (x - 0.5).abs() < 1e-6));
        for idle in [0.0, 0.2] {
            assert_eq!(smoothed(idle, &[0.0, 1.0, 5.0]), [0.0, 1.0, 5.0]);
        }
    }

    #[test]
    fn orientations_are_smoothed_like_positions_over_full_turns() {
        let turn = |frame: usize| 0.2 * frame as f64;
        let pose = |frame: usize| Pose::new(Vector3::new(turn(frame), 0.0, 0.0), Vector3::z() * turn(frame));
        let mut poses: Vec<Pose> = (0..60).map(pose).collect();
        Filter::new(1.5).smooth_poses(&mut poses);
        for (frame, smooth) in poses.iter().enumerate().take(54).skip(6) {
            assert!((smooth.translation.x - turn(frame)).abs() < 1e-12);
            assert!(smooth.rotation.angle_to(&pose(frame).rotation) < 1e-7);
        }
        let mut jump = vec![Pose::identity(); 40];
        jump[20] = Pose::rotation(Vector3::x() * 0.5);
        Filter::new(2.0).smooth_poses(&mut jump);
        let [least, most] = [jump[20].rotation.angle(), jump[22].rotation.angle()];
        assert!(least < 0.11 && most > 0.05 && most < least, "{least} {most}");
    }
}
