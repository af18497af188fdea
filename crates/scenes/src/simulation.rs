//! From a scene to a recording and its truth.

use jointscope_motion::{Body, Pose, Recording, Tracks};
use nalgebra::{Point3, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use crate::sensor::{Purpose, stream};
use crate::{BodyTruth, PairTruth, Scene, SceneError, SceneOptions, Shape, Truth};

/// A simulated recording and what is true of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// What the sensor saw.
    pub recording: Recording,
    /// What is true.
    pub truth: Truth,
    /// True poses `recording_from_body`, per body and frame, at scale 1 and depth gain 1; the identity at frame 0.
    pub poses: Vec<Vec<Pose>>,
}

impl Scene {
    /// Simulates the scene.
    ///
    /// # Errors
    /// [`SceneError::OutOfRange`], [`SceneError::Body`], [`SceneError::TooFast`], [`SceneError::Recording`].
    pub fn simulate(&self, seed: u64) -> Result<Simulation, SceneError> {
        self.check()?;
        let poses = self.poses(seed);
        let mut bodies = vec![];
        let mut body_truths = vec![];
        let mut centroids = vec![];
        for (number, (body, poses)) in self.bodies.iter().zip(&poses).enumerate() {
            let mut outlier_features = vec![];
            if self.sensor.poses {
                centroids.push(body.placement.translation.vector.into());
                bodies.push(Body::from_poses(&body.name, self.sensor.track(body, number, seed, poses))?);
            } else {
                let mut rng = stream(seed, Purpose::Shape, number);
                let shape: Vec<_> = (0..body.features).map(|_| body.placement * body.shape.sample(&mut rng)).collect();
                centroids.push(Point3::from(shape.iter().map(|p| p.coords).sum::<Vector3<f64>>() / shape.len() as f64));
                let mut positions: Vec<_> = poses.iter().flat_map(|pose| shape.iter().map(move |p| pose * p)).collect();
                self.sensor.move_skin(body, number, seed, poses, &mut positions);
                outlier_features = self.sensor.observe(body, number, seed, &mut positions);
                let labels = (0..body.features).map(|feature| feature.to_string()).collect();
                bodies.push(Body::from_points(&body.name, labels, Tracks::new(body.features, positions)?)?);
            }
            body_truths.push(BodyTruth {
                name: body.name.clone(),
                scale: body.scale,
                depth_gain: body.depth_gain,
                noise: self.sensor.noise * body.noise_factor,
                outlier_features,
            });
        }
        let numbers: Vec<u64> = (0..self.frames as u64).collect();
        let times = numbers.iter().map(|&number| number as f64 / self.rate).collect();
        let truth = Truth {
            format: "jointscope-truth".into(),
            version: 1,
            scene: self.name.clone(),
            seed,
            options: SceneOptions { seed, ..SceneOptions::default() },
            pairs: self.pairs(&poses, &centroids),
            bodies: body_truths,
        };
        Ok(Simulation { recording: Recording::new(numbers, Some(times), bodies)?, truth, poses })
    }

    fn pairs(&self, poses: &[Vec<Pose>], centroids: &[Point3<f64>]) -> Vec<PairTruth> {
        let count = self.bodies.len();
        let pairs = (0..count).flat_map(|reference| (reference + 1..count).map(move |moving| (reference, moving)));
        pairs
            .map(|(reference, moving)| {
                let names = [reference, moving].map(|body| self.bodies[body].name.as_str());
                let relative = poses[reference].iter().zip(&poses[moving]).map(|(r, m)| r.inverse() * m);
                PairTruth::new(names, &self.joint_between(reference, moving), centroids[moving], relative)
            })
            .collect()
    }

    fn poses(&self, seed: u64) -> Vec<Vec<Pose>> {
        let mut all: Vec<Vec<Pose>> = vec![];
        for (number, body) in self.bodies.iter().enumerate() {
            let centre = body.placement.translation.vector.into();
            let own = body.attachment.poses(self.frames, centre, |purpose| stream(seed, purpose, number));
            all.push(match body.attachment.parent {
                None => own,
                Some(parent) => all[parent].iter().zip(&own).map(|(parent, own)| parent * own).collect(),
            });
        }
        all
    }
}

impl Shape {
    /// A random point of the shape.
    fn sample(&self, rng: &mut ChaCha8Rng) -> Point3<f64> {
        let mut along = |edge: f64| (rng.random::<f64>() - 0.5) * edge;
        match *self {
            Self::Box { size: [x, y, z] } => Point3::new(along(x), along(y), along(z)),
            Self::Plate { size: [x, y] } => Point3::new(along(x), along(y), 0.0),
            Self::Ring { inner, outer, width } => {
                // Squared radii are uniform where areas are.
                let radius = (inner * inner + rng.random::<f64>() * (outer * outer - inner * inner)).sqrt();
                let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
                Point3::new(radius * cos, radius * sin, (rng.random::<f64>() - 0.5) * width)
            }
        }
    }
}
