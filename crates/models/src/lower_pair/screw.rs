//! `screw`: a turn about an axis, and a slide along it in proportion.

use jointscope_motion::{Pose, PoseSeries, RelativeMotion, twist::Twist};
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Geometry, Mechanism, Mobility, Placement, judge, misfit_and, starts, turn_about_z};
use crate::{FitError, JointFit, JointModel, joint_model, point_path};

/// Screw joint: rotation about a fixed axis with a proportional translation along it.
///
/// `L_t = g h(q_t) g⁻¹ L_0` with `h(q) = Rz(q) Tz(p q)`; `g` places the axis, `L_0` the moving body, `p` is the
/// pitch.
///
/// Convention: positions in radians, unwrapped, 0 at the first frame; pitch in metres per radian, positive for a
/// right-hand thread.
///
/// Bodies that show one point: the point runs on a helix; sweeps below `sweep` cost what they cost a revolute joint.
///
/// References: docs/method.md, "Mechanisms".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Screw {
    /// Sweep from which the helix of a point is as likely a screw as any, degrees.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub sweep: f64,
    /// How large pitches usually are, as a standard deviation: metres per radian for each metre of the body's radius.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub pitch: f64,
    /// How likely a screw is beforehand, as a share of how likely any other joint is.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub prior: f64,
}

impl Default for Screw {
    fn default() -> Self {
        Self { sweep: 30.0, pitch: 1.0, prior: 0.4 }
    }
}

joint_model!(Screw, "screw", "rotation about a fixed axis with proportional translation along it");

impl Mechanism for Screw {
    fn mobility(&self) -> Mobility {
        Mobility { turns: 1, slides: 0, parameters: 12, advances: true, roams: false }
    }

    fn constants(&self) -> usize {
        1
    }

    fn usual_constant(&self, radius: f64) -> Option<f64> {
        Some(self.pitch * radius)
    }

    fn geometry(&self, constants: &Vector2<f64>) -> Geometry {
        Geometry::Axis { pitch: Some(constants.x) }
    }

    fn pose(&self, q: &Vector3<f64>, constants: &Vector2<f64>) -> Pose {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), q.x);
        Pose::from_parts(Vector3::new(0.0, 0.0, constants.x * q.x).into(), turn)
    }

    fn twists(&self, _: &Vector3<f64>, constants: &Vector2<f64>) -> [Twist; 3] {
        [Twist::new(0.0, 0.0, 1.0, 0.0, 0.0, constants.x), Twist::zeros(), Twist::zeros()]
    }

    fn constant_twists(&self, q: &Vector3<f64>, _: &Vector2<f64>) -> [Twist; 2] {
        [Twist::new(0.0, 0.0, 0.0, 0.0, 0.0, q.x), Twist::zeros()]
    }

    fn project(&self, motion: &Pose, previous: &Vector3<f64>, _: &Vector2<f64>) -> Vector3<f64> {
        Vector3::new(turn_about_z(motion, previous.x), 0.0, 0.0)
    }

    fn starts(&self, series: &PoseSeries) -> Vec<Placement> {
        starts::with_pitch(series, starts::about_axes_or_travel(series))
    }
}

impl JointModel for Screw {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        let mut fit = match motion.pose_series() {
            Some(_) => judge(self, motion)?,
            None => point_path::helix(motion, self.sweep)?,
        };
        if let Some(evidence) = &mut fit.evidence {
            evidence.prior_cost -= 2.0 * self.prior.ln();
        }
        Ok(fit)
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
