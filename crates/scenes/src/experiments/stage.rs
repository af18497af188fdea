//! Bodies placed in a room, in front of a camera.

use jointscope_motion::Pose;
use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

use crate::{Attachment, Joint, JointKind, Scene, SceneBody, SceneOptions, Sensor, Shape};

/// A scene under construction, in room coordinates: x to the right, y away from the camera, z up; the camera looks at
/// the origin.
pub(super) struct Stage<'a> {
    pub(super) frames: usize,
    options: &'a SceneOptions,
    features: usize,
    recording_from_room: Pose,
    bodies: Vec<SceneBody>,
}

impl<'a> Stage<'a> {
    /// A room seen from a distance in metres, the camera looking down by `pitch` and standing to the side by `yaw`
    /// degrees.
    pub(super) fn new(
        options: &'a SceneOptions,
        frames: usize,
        features: usize,
        view: [f64; 2],
        distance: f64,
    ) -> Self {
        let [pitch, yaw] = view.map(f64::to_radians);
        let (sin, cos) = pitch.sin_cos();
        // Columns: where the camera (x right, y down, z ahead) sees the room's right, far and up directions.
        let look = Matrix3::from_columns(&[Vector3::x(), Vector3::new(0.0, -sin, cos), Vector3::new(0.0, -cos, -sin)]);
        let look = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(look));
        let turned = look * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
        Self {
            frames: options.frames.unwrap_or(frames),
            options,
            features: options.features.unwrap_or(features),
            recording_from_room: Pose::from_parts(Vector3::new(0.0, 0.0, distance).into(), turned),
            bodies: vec![],
        }
    }

    /// A cluster at rest, seen exactly. Gives its number.
    pub(super) fn still(&mut self, name: &str, shape: Shape, placement: Pose) -> usize {
        self.add(name, shape, placement, Attachment::at_rest(), 0.0)
    }

    /// A body that moves on a joint of another one.
    pub(super) fn moving(
        &mut self,
        name: &str,
        parent: usize,
        joint: (JointKind, Pose),
        motion: Vec<Vec<f64>>,
        shape: Shape,
        placement: Pose,
    ) -> usize {
        self.on(Some(parent), name, joint, motion, shape, placement)
    }

    /// A body that moves on a joint of the room itself.
    pub(super) fn on_the_floor(
        &mut self,
        name: &str,
        joint: (JointKind, Pose),
        motion: Vec<Vec<f64>>,
        shape: Shape,
        placement: Pose,
    ) -> usize {
        self.on(None, name, joint, motion, shape, placement)
    }

    fn on(
        &mut self,
        parent: Option<usize>,
        name: &str,
        (kind, room_from_joint): (JointKind, Pose),
        motion: Vec<Vec<f64>>,
        shape: Shape,
        placement: Pose,
    ) -> usize {
        let joint = Joint { kind, frame: self.recording_from_room * room_from_joint };
        let play = if kind == JointKind::Rigid { 0.0 } else { self.options.play.unwrap_or(0.0) };
        let bend = self.options.bend.unwrap_or(0.0);
        let attachment = Attachment { play, bend, ..Attachment::new(parent, joint, motion) };
        let body = self.add(name, shape, placement, attachment, 1.0);
        self.bodies[body].scale = self.options.scale.unwrap_or(1.0);
        self.bodies[body].depth_gain = self.options.depth_gain.unwrap_or(1.0);
        body
    }

    fn add(&mut self, name: &str, shape: Shape, placement: Pose, attachment: Attachment, noise_factor: f64) -> usize {
        self.bodies.push(SceneBody {
            name: name.into(),
            features: self.features,
            shape,
            placement: self.recording_from_room * placement,
            attachment,
            noise_factor,
            scale: 1.0,
            depth_gain: 1.0,
        });
        self.bodies.len() - 1
    }

    /// With `monocular`, a body appears so large that scaling it by `repair` makes it agree with the others.
    pub(super) fn seen_at_scale(&mut self, body: usize, repair: f64) {
        if self.options.monocular {
            self.bodies[body].scale = self.options.scale.unwrap_or(1.0 / repair);
        }
    }

    /// A body's depth changes are compressed, unless the options say by how much.
    pub(super) fn seen_with_depth_gain(&mut self, body: usize, gain: f64) {
        self.bodies[body].depth_gain = self.options.depth_gain.unwrap_or(gain);
    }

    pub(super) fn into_scene(self, name: &str, sensor: Sensor) -> Scene {
        Scene { name: name.into(), frames: self.frames, rate: 30.0, bodies: self.bodies, sensor }
    }
}

/// A place in the room, metres.
pub(super) fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::translation(x, y, z)
}

/// Coordinates at the room's origin whose z axis has a unit direction.
pub(super) fn along(direction: Vector3<f64>) -> Pose {
    Joint::about(JointKind::Rigid, Point3::origin(), direction).frame
}

/// Coordinates at the room's origin turned about a unit axis by so many degrees.
pub(super) fn tilted(axis: Vector3<f64>, degrees: f64) -> Pose {
    Pose::rotation(axis * degrees.to_radians())
}
