//! Large recordings for measuring speed, reproducible by seed; all have 1 mm of noise.

use jointscope_motion::{MotionError, Pose, Tracks};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal, UnitSphere};

use crate::law::waves;
use crate::sensor::{Purpose, stream};
use crate::{Attachment, Joint, JointKind, Scene, SceneBody, SceneError, Sensor, Shape, Simulation};

/// Noise of every coordinate, metres.
const NOISE: f64 = 0.001;
/// Frames after which motions begin to come back to where they were, so that long recordings stay in view.
const PERIOD: f64 = 437.0;

/// Workload W1: one shape and its noisy positions in many frames, to be registered.
#[derive(Debug, Clone, PartialEq)]
pub struct Registrations {
    /// The shape's points, metres.
    pub reference: Vec<Point3<f64>>,
    /// Where they are in every frame, metres.
    pub tracks: Tracks,
    /// True poses `recording_from_shape`, one per frame.
    pub poses: Vec<Pose>,
}

/// W1: registrations of a body of 30 cm that moves freely; the full size is 100 000 frames of 50 features.
///
/// # Errors
/// None in practice: the positions fill their frames.
pub fn registrations(frames: usize, features: usize, seed: u64) -> Result<Registrations, MotionError> {
    let mut rng = stream(seed, Purpose::Layout, 0);
    let mut coordinate = || rng.random_range(-0.15..0.15);
    let reference: Vec<_> =
        (0..features).map(|_| Point3::new(coordinate(), coordinate(), 1.0 + coordinate())).collect();
    let motion = free_motion(frames, 2.5, 1.0, &mut stream(seed, Purpose::Motion, 0));
    let pose = |frame: usize| {
        let vector = |first: usize| Vector3::from_fn(|axis, _| motion[first + axis][frame]);
        Pose::from_parts(vector(3).into(), UnitQuaternion::from_scaled_axis(vector(0)))
    };
    let poses: Vec<Pose> = (0..frames).map(pose).collect();
    let mut noise = stream(seed, Purpose::Noise, 0);
    let mut error = || NOISE * Vector3::from_fn(|_, _| StandardNormal.sample(&mut noise));
    let mut positions = Vec::with_capacity(frames * features);
    for pose in &poses {
        positions.extend(reference.iter().map(|point| pose * point + error()));
    }
    Ok(Registrations { reference, tracks: Tracks::new(features, positions)?, poses })
}

/// W2: two bodies, both moving, with a revolute joint; the full size is 437 frames of 40 features.
///
/// # Errors
/// As [`Scene::simulate`].
pub fn hinge(frames: usize, features: usize, seed: u64) -> Result<Simulation, SceneError> {
    let mut rng = stream(seed, Purpose::Motion, 0);
    let home = Pose::translation(0.0, 0.0, 2.0);
    let moves = joint(JointKind::Disconnected, home, frames, &mut rng);
    let first = body("body-0", features, 0.3, home, Attachment { parent: None, ..moves });
    let turns = joint(JointKind::Revolute, home, frames, &mut rng);
    let second = body("body-1", features, 0.3, home * Pose::translation(0.35, 0.0, 0.0), turns);
    simulate("hinge", frames, vec![first, second], seed)
}

/// W3: a tree of bodies in a room at rest, attached to one another by rigid, prismatic, revolute and no joints in turn;
/// the full size is 50 bodies, 1000 frames of 40 features.
///
/// # Errors
/// As [`Scene::simulate`].
pub fn kitchen(bodies: usize, frames: usize, features: usize, seed: u64) -> Result<Simulation, SceneError> {
    const KINDS: [JointKind; 4] =
        [JointKind::Rigid, JointKind::Prismatic, JointKind::Revolute, JointKind::Disconnected];
    let mut rng = stream(seed, Purpose::Motion, 0);
    let room = Pose::translation(0.0, 0.0, 3.0);
    let mut all = vec![body("body-0", features, 2.0, room, Attachment::at_rest())];
    for number in 1..bodies {
        let parent = rng.random_range(0..number);
        let mut aside = || rng.random_range(-0.3..0.3);
        let placement = all[parent].placement * Pose::translation(aside(), aside(), aside());
        let attachment = joint(KINDS[(number - 1) % KINDS.len()], placement, frames, &mut rng);
        let attachment = Attachment { parent: Some(parent), ..attachment };
        all.push(body(&format!("body-{number}"), features, 0.3, placement, attachment));
    }
    simulate("kitchen", frames, all, seed)
}

/// A joint to the first body near a place, in a random direction, and its motion.
fn joint(kind: JointKind, place: Pose, frames: usize, rng: &mut ChaCha8Rng) -> Attachment {
    let mut aside = || rng.random_range(-0.3..0.3);
    let origin = place * Point3::new(aside(), aside(), aside());
    let joint = Joint::about(kind, origin, Vector3::from(UnitSphere.sample(rng)));
    let motion = match kind {
        JointKind::Rigid => vec![],
        JointKind::Disconnected => free_motion(frames, 1.0, 1.0, rng),
        JointKind::Prismatic => vec![waves(frames, 0.6, PERIOD, rng)],
        _ => vec![waves(frames, 1.6, PERIOD, rng)],
    };
    Attachment::new(Some(0), joint, motion)
}

/// Rotation vector, then translation.
fn free_motion(frames: usize, turn: f64, travel: f64, rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    [turn, turn, turn, travel, travel, travel].map(|amplitude| waves(frames, amplitude, PERIOD, rng)).to_vec()
}

fn body(name: &str, features: usize, edge: f64, placement: Pose, attachment: Attachment) -> SceneBody {
    SceneBody {
        name: name.into(),
        features,
        shape: Shape::Box { size: [edge; 3] },
        placement,
        attachment,
        noise_factor: 1.0,
        scale: 1.0,
        depth_gain: 1.0,
    }
}

fn simulate(name: &str, frames: usize, bodies: Vec<SceneBody>, seed: u64) -> Result<Simulation, SceneError> {
    let sensor = Sensor { noise: NOISE, ..Sensor::default() };
    Scene { name: name.into(), frames, rate: 30.0, bodies, sensor }.simulate(seed)
}

#[cfg(test)]
mod tests {
    use jointscope_motion::Observation;

    use super::*;

    #[test]
    fn registrations_follow_their_poses() {
        let work = registrations(200, 50, 1).expect("fills its frames");
        assert_eq!((work.tracks.frames(), work.tracks.features(), work.poses.len()), (200, 50, 200));
        let mut sum = 0.0;
        for (frame, pose) in work.poses.iter().enumerate() {
            let errors = work.tracks.frame(frame).iter().zip(&work.reference).map(|(seen, point)| seen - pose * point);
            sum += errors.map(|error| error.norm_squared()).sum::<f64>();
        }
        let sigma = f64::sqrt(sum / (3.0 * 200.0 * 50.0));
        assert!((sigma / NOISE - 1.0).abs() < 0.05, "{sigma}");
        assert_eq!(work, registrations(200, 50, 1).expect("the same again"));
    }

    #[test]
    fn the_hinge_is_one() {
        let simulation = hinge(437, 40, 2).expect("simulates");
        assert_eq!((simulation.recording.frames(), simulation.recording.bodies().len()), (437, 2));
        assert_eq!(simulation.truth.pairs[0].joint, "revolute");
    }

    #[test]
    fn the_kitchen_is_a_tree_of_joints_around_a_room_at_rest() {
        let simulation = kitchen(50, 100, 10, 3).expect("simulates");
        assert_eq!((simulation.recording.frames(), simulation.recording.bodies().len()), (100, 50));
        assert_eq!(simulation.truth.pairs.len(), 1225);
        assert!(simulation.poses[0].iter().all(|pose| *pose == Pose::identity()));
        for kind in ["rigid", "prismatic", "revolute", "disconnected"] {
            assert!(simulation.truth.pairs.iter().any(|pair| pair.joint == kind), "{kind}");
        }
        let Observation::Points { tracks, .. } = simulation.recording.bodies()[7].observation() else {
            panic!("points")
        };
        assert_eq!(tracks.features(), 10);
    }
}
