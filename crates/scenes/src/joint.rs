//! The kinematics of every kind of joint.

use jointscope_motion::Pose;
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};

/// Radians below which a rotation has no direction.
const NO_TURN: f64 = 1e-9;

/// A kind of joint: the motions that it lets the moving body make.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointKind {
    /// No motion.
    Rigid,
    /// Translation along the axis: position \[m\].
    Prismatic,
    /// Rotation about the axis: position \[rad\].
    Revolute,
    /// Rotation about the axis with proportional translation along it: position \[rad\].
    Screw {
        /// Metres per radian.
        pitch: f64,
    },
    /// Rotation about the axis and translation along it: position \[rad, m\].
    Cylindrical,
    /// Rotation about the axis and translation across it: position \[rad, m, m\], the translation being that of the
    /// joint's origin along the joint's x and y.
    Planar,
    /// Rotation about the origin: position is the rotation vector \[rad; 3\].
    Spherical,
    /// Rotation about the axis, then about the joint's x axis, which the first rotation carries along: two axes that
    /// cross at right angles in the origin, as in a Cardan coupling: position \[rad, rad\].
    Universal,
    /// Elliptic trammel (Cardan motion): the body turns by -q while a crank pin on it turns by +q around the axis, so
    /// that every point runs on an ellipse about the axis: position \[rad\]. The pin starts on the joint's x axis.
    Elliptical {
        /// Distance of the pin from the axis, metres.
        crank: f64,
    },
    /// Any motion: position is the rotation vector about the joint's origin, then the origin's translation
    /// \[rad; 3, m; 3\], in joint coordinates.
    Disconnected,
}

impl JointKind {
    /// The name used in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rigid => "rigid",
            Self::Prismatic => "prismatic",
            Self::Revolute => "revolute",
            Self::Screw { .. } => "screw",
            Self::Cylindrical => "cylindrical",
            Self::Planar => "planar",
            Self::Spherical => "spherical",
            Self::Universal => "universal",
            Self::Elliptical { .. } => "elliptical",
            Self::Disconnected => "disconnected",
        }
    }

    /// The name in the thesis's four classes: what is neither rigid, prismatic nor revolute is disconnected.
    pub fn thesis_name(self) -> &'static str {
        match self {
            Self::Rigid | Self::Prismatic | Self::Revolute => self.name(),
            _ => "disconnected",
        }
    }

    /// How many numbers its position has.
    pub fn freedoms(self) -> usize {
        match self {
            Self::Rigid => 0,
            Self::Prismatic | Self::Revolute | Self::Screw { .. } | Self::Elliptical { .. } => 1,
            Self::Cylindrical | Self::Universal => 2,
            Self::Planar | Self::Spherical => 3,
            Self::Disconnected => 6,
        }
    }

    /// How many of them are angles; those come first.
    pub fn angles(self) -> usize {
        match self {
            Self::Rigid | Self::Prismatic => 0,
            Self::Revolute | Self::Screw { .. } | Self::Cylindrical | Self::Planar | Self::Elliptical { .. } => 1,
            Self::Universal => 2,
            Self::Spherical | Self::Disconnected => 3,
        }
    }
}

/// A joint between two bodies, as it stands at frame 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// What motion it allows.
    pub kind: JointKind,
    /// `recording_from_joint` at frame 0, metres: the axis is the joint's z axis, through its origin.
    pub frame: Pose,
}

impl Joint {
    /// A joint about (along, across) the line through `point` with `direction`, in recording coordinates at frame 0.
    pub fn about(kind: JointKind, point: Point3<f64>, direction: Vector3<f64>) -> Self {
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), &direction);
        // Only the opposite direction leaves the turn open; any half turn across z will do.
        let rotation = turn.unwrap_or(UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
        Self { kind, frame: Pose::from_parts(Translation3::from(point.coords), rotation) }
    }

    /// No motion at all.
    pub fn rigid() -> Self {
        Self { kind: JointKind::Rigid, frame: Pose::identity() }
    }

    /// Unit direction of the axis in recording coordinates at frame 0.
    pub fn direction(&self) -> Vector3<f64> {
        self.frame.rotation * Vector3::z()
    }

    /// Origin of the joint in recording coordinates at frame 0, metres.
    pub fn point(&self) -> Point3<f64> {
        self.frame.translation.vector.into()
    }

    /// Pose `reference_from_moving` at a joint position counted from frame 0.
    ///
    /// # Convention
    /// Both bodies' coordinates are those of the recording at frame 0, so the position 0 gives the identity.
    /// Missing numbers of `position` are zero.
    pub fn pose(&self, position: &[f64]) -> Pose {
        let q = |i: usize| position.get(i).copied().unwrap_or(0.0);
        let vector = |i: usize| Vector3::new(q(i), q(i + 1), q(i + 2));
        let about_z = |angle: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        let about_x = |angle: f64| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
        let (rotation, shift) = match self.kind {
            JointKind::Rigid => return Pose::identity(),
            JointKind::Prismatic => (UnitQuaternion::identity(), q(0) * Vector3::z()),
            JointKind::Revolute => (about_z(q(0)), Vector3::zeros()),
            JointKind::Screw { pitch } => (about_z(q(0)), pitch * q(0) * Vector3::z()),
            JointKind::Cylindrical => (about_z(q(0)), q(1) * Vector3::z()),
            JointKind::Planar => (about_z(q(0)), Vector3::new(q(1), q(2), 0.0)),
            JointKind::Spherical => (UnitQuaternion::from_scaled_axis(vector(0)), Vector3::zeros()),
            JointKind::Universal => (about_z(q(0)) * about_x(q(1)), Vector3::zeros()),
            JointKind::Elliptical { crank } => {
                let back = about_z(-q(0));
                let pin = crank * Vector3::x();
                (back, about_z(q(0)) * pin - back * pin)
            }
            JointKind::Disconnected => (UnitQuaternion::from_scaled_axis(vector(0)), vector(3)),
        };
        self.frame * Pose::from_parts(shift.into(), rotation) * self.frame.inverse()
    }

    /// Joint position of a pose `reference_from_moving` that the joint allows; the inverse of [`Joint::pose`].
    ///
    /// Angles are those nearest to `previous`, the position one frame before, so that they run on over full turns.
    pub fn position(&self, reference_from_moving: &Pose, previous: &[f64]) -> Vec<f64> {
        let motion = self.frame.inverse() * reference_from_moving * self.frame;
        let (rotation, shift) = (motion.rotation, motion.translation.vector);
        let before = |i: usize| previous.get(i).copied().unwrap_or(0.0);
        let angle = |sign: f64| nearest_turn(sign * 2.0 * rotation.k.atan2(rotation.w), before(0));
        let vector = || nearest_rotation(rotation.scaled_axis(), Vector3::new(before(0), before(1), before(2)));
        match self.kind {
            JointKind::Rigid => vec![],
            JointKind::Prismatic => vec![shift.z],
            JointKind::Revolute | JointKind::Screw { .. } => vec![angle(1.0)],
            JointKind::Cylindrical => vec![angle(1.0), shift.z],
            JointKind::Planar => vec![angle(1.0), shift.x, shift.y],
            JointKind::Spherical => vector().as_slice().to_vec(),
            JointKind::Universal => {
                let turn = rotation.to_rotation_matrix();
                let first = nearest_turn(turn[(1, 0)].atan2(turn[(0, 0)]), before(0));
                vec![first, nearest_turn(turn[(2, 1)].atan2(turn[(2, 2)]), before(1))]
            }
            JointKind::Elliptical { .. } => vec![angle(-1.0)],
            JointKind::Disconnected => [vector().as_slice(), shift.as_slice()].concat(),
        }
    }
}

/// The angle nearest to `before` that differs from `angle` by full turns.
fn nearest_turn(angle: f64, before: f64) -> f64 {
    angle + ((before - angle) / std::f64::consts::TAU).round() * std::f64::consts::TAU
}

/// The rotation vector nearest to `before` of all those that mean the same rotation.
fn nearest_rotation(vector: Vector3<f64>, before: Vector3<f64>) -> Vector3<f64> {
    let angle = vector.norm();
    if angle < NO_TURN {
        return vector;
    }
    let axis = vector / angle;
    axis * nearest_turn(angle, axis.dot(&before))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nominal::KINDS;

    fn somewhere(kind: JointKind) -> Joint {
        Joint::about(kind, Point3::new(0.2, -0.1, 1.4), Vector3::new(0.3, -0.8, 0.4).normalize())
    }

    #[test]
    fn every_joint_tells_the_position_it_stands_at_over_full_turns() {
        for kind in KINDS {
            let joint = somewhere(kind);
            let mut previous = vec![];
            for step in 0..60 {
                let turn = 0.2 * f64::from(step);
                let position: Vec<f64> = (0..kind.freedoms()).map(|i| turn * (0.7 + 0.1 * i as f64)).collect();
                previous = joint.position(&joint.pose(&position), &previous);
                for (found, set) in previous.iter().zip(&position) {
                    assert!((found - set).abs() < 1e-9, "{}: {found} instead of {set}", kind.name());
                }
            }
        }
    }

    #[test]
    fn position_zero_is_the_pose_of_frame_0() {
        for kind in KINDS {
            let pose = somewhere(kind).pose(&vec![0.0; kind.freedoms()]);
            assert!((pose.to_homogeneous() - nalgebra::Matrix4::identity()).norm() < 1e-14);
        }
    }

    #[test]
    fn an_axis_may_point_straight_back() {
        let joint = Joint::about(JointKind::Revolute, Point3::origin(), -Vector3::z());
        assert!((joint.direction() + Vector3::z()).norm() < 1e-15);
    }
}
