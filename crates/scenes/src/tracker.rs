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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Attachment, Shape};

    const FRAMES: usize = 4000;
    const EXACT: Sensor = Sensor {
        noise: 0.0,
        depth_noise: 1.0,
        drift: 0.0,
        dropout: 0.0,
        outlier_features: 0.0,
        outlier_samples: 0.0,
        skin: 0.0,
        filter: 0.0,
        poses: true,
        rotation_noise: 0.0,
        flips: 0.0,
    };

    fn body() -> SceneBody {
        SceneBody {
            name: "body".into(),
            features: 1,
            shape: Shape::Box { size: [0.1; 3] },
            placement: Pose::new(Vector3::new(0.2, -0.1, 1.4), Vector3::new(1.0, 0.0, 0.3)),
            attachment: Attachment::at_rest(),
            noise_factor: 1.0,
            scale: 1.0,
            depth_gain: 1.0,
        }
    }

    fn moving() -> Vec<Pose> {
        let pose = |frame: usize| {
            let q = frame as f64 / 400.0;
            Pose::new(Vector3::new(q.sin(), 0.2 * q, 0.1), Vector3::new(0.4 * q.cos(), q.sin(), 0.0))
        };
        (0..FRAMES).map(pose).collect()
    }

    fn tracked(sensor: Sensor) -> Vec<Option<Pose>> {
        sensor.track(&body(), 1, 5, &moving())
    }

    /// Errors of position and of orientation.
    type Errors = (Vector3<f64>, Vector3<f64>);

    /// Per frame that is seen.
    fn errors(sensor: Sensor) -> Vec<Errors> {
        let pairs = tracked(EXACT).into_iter().zip(tracked(sensor));
        let seen = pairs.filter_map(|(exact, seen)| Some((exact?, seen?)));
        seen.map(|(exact, seen)| {
            let turn = exact.rotation.inverse() * seen.rotation;
            (seen.translation.vector - exact.translation.vector, turn.scaled_axis())
        })
        .collect()
    }

    fn rms(values: impl Iterator<Item = f64>) -> f64 {
        let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
        f64::sqrt(sum / count)
    }

    #[test]
    fn a_tracker_sits_at_the_bodys_centre_in_an_orientation_of_its_own() {
        let exact = tracked(EXACT);
        let offset = moving()[0].inv_mul(&exact[0].expect("seen"));
        assert!((offset.translation.vector - body().placement.translation.vector).norm() < 1e-12);
        assert!(offset.rotation.angle() > 0.1 && offset.rotation.angle_to(&body().placement.rotation) > 0.1);
        for (pose, tracked) in moving().iter().zip(&exact) {
            let expected = pose * offset;
            assert!((expected.to_homogeneous() - tracked.expect("seen").to_homogeneous()).norm() < 1e-12);
        }
        let other = EXACT.track(&body(), 0, 5, &moving())[0].expect("seen");
        assert!(other.rotation.angle_to(&exact[0].expect("seen").rotation) > 0.1, "each body has its own");
    }

    #[test]
    fn positions_and_orientations_have_the_noise_that_is_asked() {
        let errors = errors(Sensor { noise: 0.004, rotation_noise: 0.02, ..EXACT });
        for axis in 0..3 {
            let (shift, turn) = (rms(errors.iter().map(|e| e.0[axis])), rms(errors.iter().map(|e| e.1[axis])));
            assert!((shift / 0.004 - 1.0).abs() < 0.05 && (turn / 0.02 - 1.0).abs() < 0.05, "{shift} {turn}");
        }
        let half = SceneBody { noise_factor: 0.5, ..body() };
        let seen = Sensor { noise: 0.004, ..EXACT }.track(&half, 1, 5, &moving());
        let shifts = seen.iter().zip(tracked(EXACT)).filter_map(|(a, b)| Some((*a)?.translation.x - b?.translation.x));
        assert!((rms(shifts) / 0.002 - 1.0).abs() < 0.05);
    }

    #[test]
    fn drift_correlates_the_noise_of_poses() {
        let errors = errors(Sensor { noise: 0.004, rotation_noise: 0.02, drift: 0.9, ..EXACT });
        let correlation = |of: &dyn Fn(&Errors) -> f64| {
            let product: f64 = errors.windows(2).map(|pair| of(&pair[0]) * of(&pair[1])).sum();
            product / errors.iter().map(|e| of(e).powi(2)).sum::<f64>()
        };
        assert!((correlation(&|e| e.0.x) - 0.9).abs() < 0.03 && (correlation(&|e| e.1.y) - 0.9).abs() < 0.03);
        assert!((rms(errors.iter().map(|e| e.1.z)) / 0.02 - 1.0).abs() < 0.2);
    }

    #[test]
    fn the_asked_share_of_poses_is_missing() {
        let missing = tracked(Sensor { dropout: 0.3, ..EXACT }).iter().filter(|pose| pose.is_none()).count();
        assert!((missing as f64 / FRAMES as f64 - 0.3).abs() < 0.03);
    }

    #[test]
    fn the_asked_share_of_poses_is_wild_within_bounds() {
        let errors = errors(Sensor { outlier_samples: 0.2, ..EXACT });
        let wild: Vec<_> = errors.iter().filter(|(shift, _)| shift.norm() > 1e-9).collect();
        assert!((wild.len() as f64 / FRAMES as f64 - 0.2).abs() < 0.02);
        assert!(wild.iter().all(|(shift, turn)| shift.amax() <= WILD_SHIFT && turn.amax() <= WILD_TURN + 1e-12));
        assert!(wild.iter().any(|(shift, turn)| shift.amax() > 0.28 && turn.amax() > 0.4));
    }

    #[test]
    fn the_asked_share_of_frames_is_flipped_in_bursts() {
        for flips in [0.0, 0.01, 0.3, 1.0] {
            let errors = errors(Sensor { flips, ..EXACT });
            let angle = |error: &Errors| error.1.norm().to_degrees();
            let flipped: Vec<_> = errors.iter().filter(|error| angle(error) > 1.0).collect();
            assert_eq!(flipped.len() as f64, flips * FRAMES as f64);
            assert!(flipped.iter().all(|error| (9.999..86.001).contains(&angle(error))));
            assert!(errors.iter().all(|error| error.0.norm() < 1e-12), "positions stay");
        }
    }

    #[test]
    fn a_flip_lasts_one_to_five_frames() {
        let errors = errors(Sensor { flips: 0.02, ..EXACT });
        let same = |pair: &[Errors]| (pair[0].1 - pair[1].1).norm() < 1e-9;
        let mut lengths = vec![1];
        for pair in errors.windows(2) {
            if same(pair) {
                *lengths.last_mut().expect("one") += 1;
            } else {
                lengths.push(1);
            }
        }
        // Bursts and the stretches between them alternate, but where two bursts meet.
        let bursts: Vec<usize> = lengths.into_iter().filter(|&length| length <= LONGEST_BURST).collect();
        for length in 1..=LONGEST_BURST {
            assert!(bursts.contains(&length), "{length} frames");
        }
    }

    #[test]
    fn a_filter_smooths_poses_after_all_that_is_wrong_with_them() {
        let noisy = Sensor { noise: 0.004, rotation_noise: 0.02, ..EXACT };
        let jitter = |filter: f64| {
            let errors = errors(Sensor { filter, ..noisy });
            let third = |of: &dyn Fn(usize) -> f64| {
                rms((3..FRAMES).map(|t| of(t) - 3.0 * of(t - 1) + 3.0 * of(t - 2) - of(t - 3)))
            };
            [third(&|t| errors[t].0.x), third(&|t| errors[t].1.z)]
        };
        let (rough, smooth) = (jitter(0.0), jitter(2.0));
        assert!((0..2).all(|part| smooth[part] < 0.02 * rough[part]), "{rough:?} {smooth:?}");
        let flipped = errors(Sensor { flips: 0.01, filter: 1.0, ..EXACT });
        let off = flipped.iter().filter(|error| error.1.norm() > 0.001).count();
        assert!(off > FRAMES / 50, "a flip is smeared over its neighbours: {off}");
    }

    #[test]
    fn what_is_seen_exactly_is_tracked_exactly_but_can_be_missing() {
        let everything = Sensor {
            noise: 0.1,
            drift: 0.5,
            dropout: 0.2,
            outlier_samples: 0.5,
            filter: 2.0,
            rotation_noise: 0.1,
            flips: 0.5,
            ..EXACT
        };
        let seen = everything.track(&SceneBody { noise_factor: 0.0, ..body() }, 1, 5, &moving());
        assert!(seen.iter().any(Option::is_none));
        assert!(seen.iter().zip(tracked(EXACT)).all(|(seen, exact)| seen.is_none() || *seen == exact));
    }
}
