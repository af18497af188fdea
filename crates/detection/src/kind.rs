//! What kind of joint a verdict is, whatever its model is called.

use jointscope_models::{JointFit, Positions};
use jointscope_motion::nalgebra::{Unit, Vector3};

use crate::PairDetection;

/// The kind of a joint, told by what it has: axis, direction, pitch, freedoms.
///
/// Models are named by configurations, and others come from other crates; pictures and robot descriptions need to know
/// how a joint moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointKind {
    /// No motion.
    Rigid,
    /// A slide along the axis.
    Prismatic,
    /// A turn about the axis.
    Revolute,
    /// A way about the axis on ellipses that are alike; positions are eccentric angles.
    Elliptical {
        /// Short over long axis.
        ratio: f64,
        /// Direction of the long axes, in the coordinates of the body from which the motion was seen.
        long_axis: Unit<Vector3<f64>>,
    },
    /// A turn about the axis with a slide along it in proportion.
    Screw {
        /// Metres along per radian about the axis.
        pitch: f64,
    },
    /// A turn about the axis and a slide along it.
    Cylindrical,
    /// Two slides in a plane and a turn about its normal.
    Planar,
    /// Any turn about a point.
    Spherical,
    /// Two turns about axes that meet in a point.
    Universal,
    /// Nothing connects the bodies.
    Disconnected,
}

impl JointKind {
    /// Degrees of freedom.
    pub fn freedoms(self) -> usize {
        match self {
            Self::Rigid => 0,
            Self::Prismatic | Self::Revolute | Self::Elliptical { .. } | Self::Screw { .. } => 1,
            Self::Cylindrical | Self::Universal => 2,
            Self::Planar | Self::Spherical => 3,
            Self::Disconnected => 6,
        }
    }

    /// Whether there is a joint at all.
    pub fn connects(self) -> bool {
        self != Self::Disconnected
    }
}

impl PairDetection {
    /// The kind of the verdict's joint.
    pub fn kind(&self) -> JointKind {
        let fit = self.models.get(&self.verdict.joint).and_then(|finding| finding.as_ref().ok());
        let Some(axis) = self.axis else {
            return if fit.is_some_and(holds_still) { JointKind::Rigid } else { JointKind::Disconnected };
        };
        let of_evidence = fit.and_then(|fit| fit.evidence).map(|e| usize::from(e.mobility.turns + e.mobility.slides));
        let freedoms = self.positions.as_ref().map(Positions::freedoms).or(of_evidence).unwrap_or(1);
        match (axis.direction, axis.pitch, freedoms) {
            (None, _, 2) => JointKind::Universal,
            (None, ..) => JointKind::Spherical,
            (Some(_), Some(pitch), _) if pitch != 0.0 => JointKind::Screw { pitch },
            (Some(_), Some(_), _) => fit.and_then(on_ellipses).unwrap_or(JointKind::Revolute),
            (Some(_), None, 1) => JointKind::Prismatic,
            (Some(_), None, 2) => JointKind::Cylindrical,
            (Some(_), None, _) => JointKind::Planar,
        }
    }
}

/// The ellipses of a fit whose parts tell them; they say how features move, and not how the body turns.
fn on_ellipses(fit: &JointFit) -> Option<JointKind> {
    let part = |name| fit.parts.get(name).copied();
    let long_axis = Vector3::new(part("long_axis_x")?, part("long_axis_y")?, part("long_axis_z")?);
    Some(JointKind::Elliptical { ratio: part("ratio")?, long_axis: Unit::try_new(long_axis, 0.5)? })
}

/// Whether a fit without axis is one of bodies that hold together, rather than of bodies that move freely.
fn holds_still(fit: &JointFit) -> bool {
    fit.evidence.is_none_or(|evidence| evidence.mobility.turns + evidence.mobility.slides == 0)
}
