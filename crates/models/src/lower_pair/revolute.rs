//! `revolute`: a turn about one axis.

use jointscope_motion::{Pose, PoseSeries, RelativeMotion, twist::Twist};
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Geometry, Mechanism, Mobility, Placement, judge, misfit_and, starts, turn_about_z};
use crate::{FitError, JointFit, JointModel, joint_model, point_path};

/// Revolute joint: rotation about an axis that is fixed in both bodies.
///
/// `L_t = g h(q_t) g⁻¹ L_0` with `h(q) = Rz(q)`; `g` places the axis, `L_0` the moving body.
///
/// Convention: positions in radians, unwrapped, 0 at the first frame, the farthest positive by the right-hand rule;
/// the point of the axis is the one nearest to the moving body; pitch 0.
///
/// Bodies that show one point: the point runs on a circle. Joints lie near their bodies: an arc that turns by little is
/// as likely a slide on a bent rail, and sweeps below `sweep` cost `-2 ln(θ/sweep)`.
///
/// References: docs/method.md, "Mechanisms" and "Joints lie near their bodies".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Revolute {
    /// Sweep from which the arc of a point is as likely a hinge as any, degrees.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub sweep: f64,
}

impl Default for Revolute {
    fn default() -> Self {
        Self { sweep: 30.0 }
    }
}

joint_model!(Revolute, "revolute", "rotation about a fixed axis");

impl Mechanism for Revolute {
    fn mobility(&self) -> Mobility {
        Mobility { turns: 1, slides: 0, parameters: 11, advances: false, roams: false }
    }

    fn geometry(&self, _: &Vector2<f64>) -> Geometry {
        Geometry::Axis { pitch: Some(0.0) }
    }

    fn pose(&self, q: &Vector3<f64>, _: &Vector2<f64>) -> Pose {
        Pose::from_parts(Vector3::zeros().into(), UnitQuaternion::from_axis_angle(&Vector3::z_axis(), q.x))
    }

    fn twists(&self, _: &Vector3<f64>, _: &Vector2<f64>) -> [Twist; 3] {
        [Twist::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0), Twist::zeros(), Twist::zeros()]
    }

    fn project(&self, motion: &Pose, previous: &Vector3<f64>, _: &Vector2<f64>) -> Vector3<f64> {
        Vector3::new(turn_about_z(motion, previous.x), 0.0, 0.0)
    }

    fn starts(&self, series: &PoseSeries) -> Vec<Placement> {
        starts::about_axes(series)
    }
}

/// The hinge that fits poses: the arc of a bent rail as well, and settings do not matter to it.
pub(super) fn hinge(motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
    #[derive(Clone)]
    struct Hinge(Result<JointFit, FitError>);
    motion.once(|| Hinge(judge(&Revolute::default(), motion))).0
}

impl JointModel for Revolute {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        if motion.pose_series().is_none() {
            return point_path::circle(motion, self.sweep);
        }
        hinge(motion)
    }

    fn mechanism(&self) -> Option<&dyn Mechanism> {
        Some(self)
    }

    fn states_evidence(&self) -> bool {
        true
    }

    fn parts(&self) -> &'static [&'static str] {
        const ALL: [&str; 7] = misfit_and(&["leap_share", "radius"]);
        &ALL
    }
}
