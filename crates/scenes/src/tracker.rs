//! Bodies seen as poses by a tracker.

use jointscope_motion::Pose;
use nalgebra::{Isometry3, UnitQuaternion, UnitVector3, Vector3};
use rand::{RngExt as _, seq::SliceRandom as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, UnitSphere};

use crate::filter::Filter;
use crate::sensor::{Drifting, Purpose, any_orientation, stream};
use crate::{SceneBody, Sensor};

/// Largest error of a wild pose in every coordinate, metres, and in every coordinate of a rotation vector, radians.
const WILD_SHIFT: f64 = 0.3;
const WILD_TURN: f64 = 0.5;
/// Frames of the longest burst of flips.
const LONGEST_BURST: usize = 5;
/// Angles of a flip, degrees.
const FLIP_DEG: std::ops::RangeInclusive<f64> = 10.0..=86.0;

impl Sensor {
    /// Turns true poses `recording_from_body` into tracked ones, `recording_from_tracked`, `None` where missing: the
    /// tracked coordinates are at the centre of the shape, in any orientation.
    pub(crate) fn track(&self, body: &SceneBody, number: usize, seed: u64, poses: &[Pose]) -> Vec<Option<Pose>> {
        let random = |purpose| stream(seed, purpose, number);
        let turn = any_orientation(&mut random(Purpose::Tracker));
        let body_from_tracked = Isometry3::from_parts(body.placement.translation, turn);
        let mut tracked: Vec<Pose> = poses.iter().map(|pose| pose * body_from_tracked).collect();
        if body.noise_factor > 0.0 {
            self.add_pose_noise(&mut tracked, body.noise_factor, random);
            self.add_wild_poses(&mut tracked, &mut random(Purpose::WildSamples));
            self.flip(&mut tracked, &mut random(Purpose::Flips));
            Filter::new(self.filter).smooth_poses(&mut tracked);
        }
        let mut rng = random(Purpose::Dropouts);
        tracked.into_iter().map(|pose| (rng.random::<f64>() >= self.dropout).then_some(pose)).collect()
    }

    fn add_pose_noise(&self, poses: &mut [Pose], factor: f64, random: impl Fn(Purpose) -> ChaCha8Rng) {
        let (mut shifts, mut turns) = (Drifting::new(self.drift), Drifting::new(self.drift));
        let (mut shift_rng, mut turn_rng) = (random(Purpose::Noise), random(Purpose::RotationNoise));
        for pose in poses {
            pose.translation.vector += factor * self.noise * shifts.draw(&mut shift_rng);
            pose.rotation *= UnitQuaternion::from_scaled_axis(factor * self.rotation_noise * turns.draw(&mut turn_rng));
        }
    }

    fn add_wild_poses(&self, poses: &mut [Pose], rng: &mut ChaCha8Rng) {
        for pose in poses {
            let wild = rng.random::<f64>() < self.outlier_samples;
            let mut error = |most: f64| Vector3::from_fn(|_, _| rng.random_range(-most..most));
            let (shift, turn) = (error(WILD_SHIFT), error(WILD_TURN));
            if wild {
                pose.translation.vector += shift;
                pose.rotation *= UnitQuaternion::from_scaled_axis(turn);
            }
        }
    }

    fn flip(&self, poses: &mut [Pose], rng: &mut ChaCha8Rng) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of the frames")]
        let mut flipped = (self.flips * poses.len() as f64).round() as usize;
        // The recording in pieces: frames seen well, and bursts.
        let mut pieces = vec![(1, false); poses.len() - flipped];
        while flipped > 0 {
            let burst = rng.random_range(1..=LONGEST_BURST).min(flipped);
            pieces.push((burst, true));
            flipped -= burst;
        }
        pieces.shuffle(rng);
        let mut rest = poses;
        for (frames, burst) in pieces {
            let (piece, after) = rest.split_at_mut(frames);
            rest = after;
            if burst {
                let axis = UnitVector3::new_normalize(Vector3::from(UnitSphere.sample(rng)));
                let flip = UnitQuaternion::from_axis_angle(&axis, rng.random_range(FLIP_DEG).to_radians());
                for pose in piece {
                    pose.rotation *= flip;
                }
            }
        }
    }
}
