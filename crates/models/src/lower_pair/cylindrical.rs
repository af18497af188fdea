//! `cylindrical`: a turn about an axis, and a slide along it.

use jointscope_motion::{Pose, PoseSeries, RelativeMotion, twist::Twist};
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Geometry, Mechanism, Mobility, Placement, far_hinge_cost, judge, starts, turn_about_z};
use crate::{Evidence, FitError, JointFit, JointModel, joint_model};

/// How much nearer than the body is large an axis may be for that to count: what is nearer is so by chance.
const NEAREST: f64 = 1e6;

/// Cylindrical joint: rotation about a fixed axis and translation along it, independent of each other.
///
/// `L_t = g h(q_t, s_t) g⁻¹ L_0` with `h(q, s) = Rz(q) Tz(s)`; `g` places the axis, `L_0` the moving body.
///
/// Convention: positions are turn and slide, radians and metres, 0 at the first frame; there is no pitch.
///
/// The path of a single point cannot tell it from other motions on a surface; such bodies are not judged.
///
/// Joints lie near their bodies, and a far cylinder looks like a plane: where the body turns by less than `sweep`, that
/// costs `-2 ln(θ/sweep)`; `θ` is that turn, and as much more as the body is larger than the axis is far.
///
/// References: docs/method.md, "Mechanisms" and "Joints lie near their bodies".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Cylindrical {
    /// Turn from which a cylinder is as likely as any, degrees.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub sweep: f64,
}

impl Default for Cylindrical {
    fn default() -> Self {
        Self { sweep: 30.0 }
    }
}

joint_model!(Cylindrical, "cylindrical", "rotation about a fixed axis and translation along it");

impl Mechanism for Cylindrical {
    fn mobility(&self) -> Mobility {
        Mobility { turns: 1, slides: 1, parameters: 13, advances: true, roams: false }
    }

    fn geometry(&self, _: &Vector2<f64>) -> Geometry {
        Geometry::Axis { pitch: None }
    }

    fn pose(&self, q: &Vector3<f64>, _: &Vector2<f64>) -> Pose {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), q.x);
        Pose::from_parts(Vector3::new(0.0, 0.0, q.y).into(), turn)
    }

    fn twists(&self, _: &Vector3<f64>, _: &Vector2<f64>) -> [Twist; 3] {
        [Twist::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0), Twist::new(0.0, 0.0, 0.0, 0.0, 0.0, 1.0), Twist::zeros()]
    }

    fn project(&self, motion: &Pose, previous: &Vector3<f64>, _: &Vector2<f64>) -> Vector3<f64> {
        Vector3::new(turn_about_z(motion, previous.x), motion.translation.z, 0.0)
    }

    fn starts(&self, series: &PoseSeries) -> Vec<Placement> {
        starts::about_axes_or_travel(series)
    }
}

impl JointModel for Cylindrical {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        let mut fit = judge(self, motion)?;
        let part = |name| fit.parts.get(name).copied().unwrap_or(0.0);
        if let (Some(evidence), Some(series)) = (fit.evidence, motion.pose_series()) {
            let near = (series.radius() / part("radius").max(f64::MIN_POSITIVE)).clamp(1.0, NEAREST);
            let far = far_hinge_cost(part("sweep") * near, self.sweep);
            fit.evidence = Some(Evidence { prior_cost: evidence.prior_cost + far, ..evidence });
        }
        Ok(fit)
    }

    fn mechanism(&self) -> Option<&dyn Mechanism> {
        Some(self)
    }

    fn states_evidence(&self) -> bool {
        true
    }
}
