//! What stands between true positions and recorded ones.

use jointscope_motion::Pose;
use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3, Vector4};
use rand::{RngExt as _, SeedableRng as _, seq::index};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use crate::filter::Filter;
use crate::options::within;
use crate::{SceneBody, SceneError, law};

/// Range of every coordinate of a feature that moves on its own, metres.
const STRAY_RANGE: f64 = 0.3;
/// Largest error of a wild sample in every coordinate, metres.
const WILD_ERROR: f64 = 0.5;

/// How well a scene is seen, by a camera at the origin that looks along +z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// Standard deviation of every coordinate of a sample across the viewing ray, metres.
    pub noise: f64,
    /// Standard deviation along the viewing ray as a multiple of `noise`; 1 is isotropic.
    pub depth_noise: f64,
    /// Correlation of a feature's noise with its noise one frame before, in [0, 1): a tracker's drift.
    pub drift: f64,
    /// Share of the samples that are missing, in [0, 1), each independently.
    pub dropout: f64,
    /// Share of each body's features, rounded to whole ones, that move on their own: a smooth path through 0.3 m in
    /// every coordinate from where the feature is at frame 0.
    pub outlier_features: f64,
    /// Share of the samples that are wild: off by up to 0.5 m in every coordinate, each independently.
    pub outlier_samples: f64,
    /// Features lie on skin: standard deviation of every coordinate of their smooth wandering about their place on the
    /// body, over the frames, metres.
    pub skin: f64,
    /// Noise and wild samples are smoothed over time, with whatever the body did, by a Gaussian of this standard
    /// deviation, frames; 0 smooths nothing.
    pub filter: f64,
    /// Bodies are seen by a tracker that gives poses. What is about features, depth and scale does not apply; a wild
    /// pose is off by up to 0.3 m in every coordinate and by up to 0.5 rad in every coordinate of a rotation vector.
    pub poses: bool,
    /// Standard deviation of every coordinate of the rotation vector by which a tracked pose is off, radians.
    pub rotation_noise: f64,
    /// Share of the frames, rounded to whole ones, in which a tracked orientation is flipped, as that of a flat marker
    /// is by a single camera: bursts of 1 to 5 frames, each off by 10° to 86° about a random axis.
    pub flips: f64,
}

impl Default for Sensor {
    /// Sees everything exactly.
    fn default() -> Self {
        Self {
            noise: 0.0,
            depth_noise: 1.0,
            drift: 0.0,
            dropout: 0.0,
            outlier_features: 0.0,
            outlier_samples: 0.0,
            skin: 0.0,
            filter: 0.0,
            poses: false,
            rotation_noise: 0.0,
            flips: 0.0,
        }
    }
}

impl Sensor {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`SceneError::OutOfRange`], naming the option.
    pub fn check(&self) -> Result<(), SceneError> {
        within("noise", self.noise, 0.0..=10.0, "0 to 10 m")?;
        within("depth_noise", self.depth_noise, 0.0..=1000.0, "0 to 1000")?;
        within("drift", self.drift, 0.0..1.0, "at least 0 and less than 1")?;
        within("dropout", self.dropout, 0.0..1.0, "at least 0 and less than 1")?;
        within("outlier_features", self.outlier_features, 0.0..=1.0, "0 to 1")?;
        within("outlier_samples", self.outlier_samples, 0.0..=1.0, "0 to 1")?;
        within("skin", self.skin, 0.0..=10.0, "0 to 10 m")?;
        within("filter", self.filter, 0.0..=1000.0, "0 to 1000 frames")?;
        within("rotation_noise", self.rotation_noise, 0.0..=3.0, "0 to 3 rad")?;
        within("flips", self.flips, 0.0..=1.0, "0 to 1")
    }

    /// Lets every feature of a noisy body wander about its place on the body, given the body's true poses.
    pub(crate) fn move_skin(
        &self,
        body: &SceneBody,
        number: usize,
        seed: u64,
        poses: &[Pose],
        positions: &mut [Point3<f64>],
    ) {
        if self.skin == 0.0 || body.noise_factor == 0.0 {
            return;
        }
        let mut rng = stream(seed, Purpose::Skin, number);
        for feature in 0..body.features {
            let path = law::waver(poses.len(), &[self.skin; 3], &mut rng);
            let row = positions.iter_mut().skip(feature).step_by(body.features);
            for (frame, (position, pose)) in row.zip(poses).enumerate() {
                *position += pose.rotation * Vector3::from_fn(|axis, _| path[axis][frame]);
            }
        }
    }

    /// Turns true positions (frame-major) into observed ones, NaN where missing; gives the features that move on
    /// their own.
    pub(crate) fn observe(
        &self,
        body: &SceneBody,
        number: usize,
        seed: u64,
        positions: &mut [Point3<f64>],
    ) -> Vec<usize> {
        let random = |purpose| stream(seed, purpose, number);
        let frames = positions.len() / body.features;
        let mut strays = vec![];
        if body.noise_factor > 0.0 {
            strays = self.pick_strays(body.features, &mut random(Purpose::Strays));
            let mut rng = random(Purpose::StrayPaths);
            for &feature in &strays {
                stray(positions, body.features, feature, &law::wander(frames, &[STRAY_RANGE; 3], &mut rng));
            }
        }
        see_through_one_eye(positions, body);
        if body.noise_factor > 0.0 {
            self.add_noise(positions, body, &mut random(Purpose::Noise));
            let mut rng = random(Purpose::WildSamples);
            for position in positions.iter_mut() {
                let wild = rng.random::<f64>() < self.outlier_samples;
                let error = Vector3::from_fn(|_, _| rng.random_range(-WILD_ERROR..WILD_ERROR));
                if wild {
                    *position += error;
                }
            }
            Filter::new(self.filter).smooth_rows(positions, body.features);
        }
        let mut rng = random(Purpose::Dropouts);
        for position in positions.iter_mut() {
            if rng.random::<f64>() < self.dropout {
                *position = Point3::from([f64::NAN; 3]);
            }
        }
        strays
    }

    fn pick_strays(&self, features: usize, rng: &mut ChaCha8Rng) -> Vec<usize> {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of the features")]
        let count = (self.outlier_features * features as f64).round() as usize;
        let mut strays = index::sample(rng, features, count.min(features)).into_vec();
        strays.sort_unstable();
        strays
    }

    fn add_noise(&self, positions: &mut [Point3<f64>], body: &SceneBody, rng: &mut ChaCha8Rng) {
        let sigma = self.noise * body.noise_factor;
        let mut noises = vec![Drifting::new(self.drift); body.features];
        for row in positions.chunks_exact_mut(body.features) {
            for (position, noise) in row.iter_mut().zip(&mut noises) {
                let noise = noise.draw(rng);
                let ray = position.coords.try_normalize(0.0).unwrap_or(Vector3::z());
                *position += sigma * (noise + (self.depth_noise - 1.0) * ray.dot(&noise) * ray);
            }
        }
    }
}

/// Noise of unit variance in every coordinate that remembers its last value: an AR(1) process.
#[derive(Debug, Clone)]
pub(crate) struct Drifting {
    drift: f64,
    last: Option<Vector3<f64>>,
}

impl Drifting {
    /// With this correlation between two frames in a row.
    pub(crate) fn new(drift: f64) -> Self {
        Self { drift, last: None }
    }

    /// The noise of the next frame.
    pub(crate) fn draw(&mut self, rng: &mut ChaCha8Rng) -> Vector3<f64> {
        let fresh = Vector3::from_fn(|_, _| StandardNormal.sample(rng));
        // Keeps the variance at 1 from the first frame on.
        let keep = (1.0 - self.drift * self.drift).sqrt();
        *self.last.insert(self.last.map_or(fresh, |last| self.drift * last + keep * fresh))
    }
}

/// Lets one feature go its own way from where it is at frame 0.
fn stray(positions: &mut [Point3<f64>], features: usize, feature: usize, path: &[Vec<f64>]) {
    let start = positions[feature];
    for (frame, row) in positions.chunks_exact_mut(features).enumerate() {
        row[feature] = start + Vector3::from_fn(|axis, _| path[axis][frame]);
    }
}

/// Compresses depth changes, then scales about the camera centre.
fn see_through_one_eye(positions: &mut [Point3<f64>], body: &SceneBody) {
    let depths: Vec<f64> = positions.iter().take(body.features).map(|position| position.z).collect();
    for row in positions.chunks_exact_mut(body.features) {
        for (position, depth) in row.iter_mut().zip(&depths) {
            position.z = depth + body.depth_gain * (position.z - depth);
            *position *= body.scale;
        }
    }
}

/// What random numbers are drawn for. Every purpose has a stream of its own per body, whose number must stay.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Purpose {
    Layout = 1,
    Motion,
    Shape,
    Play,
    Strays,
    StrayPaths,
    Noise,
    WildSamples,
    Dropouts,
    Bend,
    Skin,
    Orientation,
    Tracker,
    RotationNoise,
    Flips,
}

/// The random numbers of a purpose and a body.
pub(crate) fn stream(seed: u64, purpose: Purpose, body: usize) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream((purpose as u64) << 32 | body as u64);
    rng
}

/// Any orientation, all alike.
pub(crate) fn any_orientation(rng: &mut ChaCha8Rng) -> UnitQuaternion<f64> {
    let vector = Vector4::from_fn(|_, _| StandardNormal.sample(rng));
    UnitQuaternion::new_normalize(Quaternion::from_vector(vector))
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;
    use crate::{Attachment, Shape};

    const FRAMES: usize = 500;
    const FEATURES: usize = 40;

    fn body() -> SceneBody {
        SceneBody {
            name: "body".into(),
            features: FEATURES,
            shape: Shape::Box { size: [0.1; 3] },
            placement: Pose::identity(),
            attachment: Attachment::at_rest(),
            noise_factor: 1.0,
            scale: 1.0,
            depth_gain: 1.0,
        }
    }

    fn place() -> Point3<f64> {
        Point3::new(0.4, -0.3, 1.2)
    }

    fn observed(sensor: Sensor, body: &SceneBody) -> (Vec<Point3<f64>>, Vec<usize>) {
        let mut positions = vec![place(); FRAMES * FEATURES];
        let strays = sensor.observe(body, 0, 5, &mut positions);
        (positions, strays)
    }

    fn rms(values: impl Iterator<Item = f64>) -> f64 {
        let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
        f64::sqrt(sum / count)
    }

    fn share(positions: &[Point3<f64>], is: impl Fn(&Point3<f64>) -> bool) -> f64 {
        positions.iter().filter(|p| is(p)).count() as f64 / positions.len() as f64
    }

    #[test]
    fn noise_has_the_size_that_is_asked_in_every_direction() {
        let (positions, _) = observed(Sensor { noise: 0.003, ..Sensor::default() }, &body());
        for axis in 0..3 {
            let sigma = rms(positions.iter().map(|p| (p - place())[axis]));
            assert!((sigma / 0.003 - 1.0).abs() < 0.05, "{sigma}");
        }
    }

    #[test]
    fn depth_noise_is_a_multiple_along_the_viewing_ray_only() {
        let (positions, _) = observed(Sensor { noise: 0.001, depth_noise: 5.0, ..Sensor::default() }, &body());
        let ray = place().coords.normalize();
        let across = ray.cross(&Vector3::x()).normalize();
        let turned = Rotation3::from_scaled_axis(ray * 0.7) * across;
        let sigma = |direction: Vector3<f64>| rms(positions.iter().map(|p| (p - place()).dot(&direction)));
        assert!((sigma(ray) / 0.005 - 1.0).abs() < 0.05);
        assert!((sigma(across) / 0.001 - 1.0).abs() < 0.05 && (sigma(turned) / 0.001 - 1.0).abs() < 0.05);
    }

    #[test]
    fn drift_correlates_frames_without_changing_the_size_of_the_noise() {
        let (positions, _) = observed(Sensor { noise: 0.003, drift: 0.9, ..Sensor::default() }, &body());
        let x = |index: usize| positions[index].x - place().x;
        let sigma = rms((0..positions.len()).map(x));
        assert!((sigma / 0.003 - 1.0).abs() < 0.1, "{sigma}");
        let pairs = 0..positions.len() - FEATURES;
        let product = pairs.clone().map(|index| x(index) * x(index + FEATURES)).sum::<f64>() / pairs.len() as f64;
        assert!((product / (sigma * sigma) - 0.9).abs() < 0.02, "{product}");
    }

    #[test]
    fn the_asked_share_of_samples_is_missing() {
        for dropout in [0.0, 0.3, 0.6] {
            let (positions, _) = observed(Sensor { dropout, ..Sensor::default() }, &body());
            assert!((share(&positions, |p| p.x.is_nan()) - dropout).abs() < 0.015);
        }
    }

    #[test]
    fn the_asked_share_of_samples_is_wild() {
        for outlier_samples in [0.0, 0.05, 0.3, 1.0] {
            let (positions, _) = observed(Sensor { outlier_samples, ..Sensor::default() }, &body());
            assert!((share(&positions, |p| *p != place()) - outlier_samples).abs() < 0.015);
            assert!(positions.iter().all(|p| (p - place()).amax() <= WILD_ERROR));
        }
    }

    #[test]
    fn the_asked_share_of_features_moves_on_its_own() {
        let (positions, strays) = observed(Sensor { outlier_features: 0.2, ..Sensor::default() }, &body());
        assert_eq!(strays.len(), 8);
        for feature in 0..FEATURES {
            let track = || positions.iter().skip(feature).step_by(FEATURES);
            assert_eq!(track().next(), Some(&place()), "all start in their place");
            assert_eq!(track().any(|p| *p != place()), strays.contains(&feature));
        }
    }

    #[test]
    fn what_is_seen_exactly_is_constant_to_the_digit_but_can_be_missing() {
        let everything = Sensor {
            noise: 0.003,
            depth_noise: 3.0,
            drift: 0.5,
            dropout: 0.2,
            outlier_features: 0.5,
            outlier_samples: 0.5,
            filter: 3.0,
            ..Sensor::default()
        };
        let (positions, strays) = observed(everything, &SceneBody { noise_factor: 0.0, ..body() });
        assert!(strays.is_empty() && positions.iter().all(|p| p.x.is_nan() || *p == place()));
        assert!(positions.iter().any(|p| p.x.is_nan()));
    }

    #[test]
    fn features_on_skin_wander_smoothly_by_what_is_asked() {
        let sensor = Sensor { skin: 0.004, ..Sensor::default() };
        let turn = Pose::rotation(Vector3::new(0.3, 1.0, -0.4));
        let mut positions = vec![place(); FRAMES * FEATURES];
        sensor.move_skin(&body(), 0, 5, &vec![turn; FRAMES], &mut positions);
        let mut frame_0 = vec![];
        for feature in 0..FEATURES {
            let track: Vec<_> = positions.iter().skip(feature).step_by(FEATURES).map(|p| p - place()).collect();
            for axis in 0..3 {
                let on_body = |displacement: &Vector3<f64>| (turn.rotation.inverse() * displacement)[axis];
                let deviation = rms(track.iter().map(on_body));
                assert!((deviation / 0.004 - 1.0).abs() < 1e-9, "{deviation}");
                let mean = track.iter().map(on_body).sum::<f64>() / FRAMES as f64;
                assert!(mean.abs() < 1e-12, "{mean}");
            }
            let fastest = track.windows(2).map(|pair| (pair[1] - pair[0]).norm()).fold(0.0, f64::max);
            assert!(fastest < 0.001, "{fastest}");
            frame_0.push(track[0].x);
        }
        frame_0.sort_by(f64::total_cmp);
        frame_0.dedup();
        assert_eq!(frame_0.len(), FEATURES, "each goes its own way");
        let exactly = SceneBody { noise_factor: 0.0, ..body() };
        let mut positions = vec![place(); FRAMES * FEATURES];
        sensor.move_skin(&exactly, 0, 5, &vec![turn; FRAMES], &mut positions);
        assert!(positions.iter().all(|p| *p == place()), "what is seen exactly has no skin");
    }

    #[test]
    fn a_filter_takes_the_jitter_out_of_tracks() {
        let noisy = Sensor { noise: 0.003, ..Sensor::default() };
        let [rough, smooth] = [0.0, 2.0].map(|filter| observed(Sensor { filter, ..noisy }, &body()).0);
        let jitter = |positions: &[Point3<f64>]| {
            let x = |frame: usize| positions[frame * FEATURES].x;
            rms((3..FRAMES).map(|frame| x(frame) - 3.0 * x(frame - 1) + 3.0 * x(frame - 2) - x(frame - 3)))
        };
        // White noise after a Gaussian of standard deviation s: its third differences shrink by
        // sqrt(15 / (16 sqrt(pi) s^7) / 20), itself by 1 / sqrt(2 s sqrt(pi)).
        let ratio = jitter(&smooth) / jitter(&rough);
        assert!((0.010..0.019).contains(&ratio), "{ratio}");
        let size = |positions: &[Point3<f64>]| rms(positions.iter().map(|p| p.y - place().y));
        let ratio = size(&smooth) / size(&rough);
        assert!((0.34..0.41).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_filter_smears_wild_samples_but_not_gaps() {
        let wild = Sensor { outlier_samples: 0.001, dropout: 0.3, ..Sensor::default() };
        let [rough, smooth] = [0.0, 1.0].map(|filter| observed(Sensor { filter, ..wild }, &body()).0);
        assert!(rough.iter().zip(&smooth).all(|(rough, smooth)| rough.x.is_nan() == smooth.x.is_nan()));
        let off = |positions: &[Point3<f64>]| share(positions, |p| (p - place()).norm() > 1e-9);
        let spread = off(&smooth) / off(&rough);
        assert!((6.0..11.0).contains(&spread), "a wild sample reaches 4 frames to either side: {spread}");
    }

    #[test]
    fn one_eye_compresses_changes_of_depth_and_then_scales() {
        let near = |p: Point3<f64>, x: f64, y: f64, z: f64| (p - Point3::new(x, y, z)).norm() < 1e-15;
        let mut positions = vec![Point3::new(0.5, 0.25, 2.0), Point3::new(0.75, 0.25, 3.0)];
        let body = SceneBody { features: 1, scale: 2.0, depth_gain: 0.5, ..body() };
        Sensor::default().observe(&body, 0, 0, &mut positions);
        assert!(near(positions[0], 1.0, 0.5, 4.0) && near(positions[1], 1.5, 0.5, 5.0));
    }
}
