//! `rigid`: no motion at all.

use jointscope_motion::{Pose, PoseSeries, RelativeMotion, twist::Twist};
use nalgebra::{Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Geometry, Mechanism, Mobility, Placement, judge, misfit_and, starts};
use crate::{FitError, JointFit, JointModel, joint_model, point_path};

/// Rigid connection: one body keeps its place on the other.
///
/// `L_t = L_0`, the constant pose of the moving body in the reference.
///
/// Convention: there is neither an axis nor a position.
///
/// Parameters: the six of the constant pose. Bodies that show one point: the point rests.
///
/// References: docs/method.md, "Mechanisms".
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Rigid {}

joint_model!(Rigid, "rigid", "no motion between the bodies");

impl Mechanism for Rigid {
    fn mobility(&self) -> Mobility {
        Mobility { turns: 0, slides: 0, parameters: 6, advances: false, roams: false }
    }

    fn geometry(&self, _: &Vector2<f64>) -> Geometry {
        Geometry::Nothing
    }

    fn pose(&self, _: &Vector3<f64>, _: &Vector2<f64>) -> Pose {
        Pose::identity()
    }

    fn twists(&self, _: &Vector3<f64>, _: &Vector2<f64>) -> [Twist; 3] {
        [Twist::zeros(); 3]
    }

    fn project(&self, _: &Pose, _: &Vector3<f64>, _: &Vector2<f64>) -> Vector3<f64> {
        Vector3::zeros()
    }

    fn starts(&self, series: &PoseSeries) -> Vec<Placement> {
        vec![starts::at_rest(series)]
    }
}

impl JointModel for Rigid {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        if motion.pose_series().is_some() { judge(self, motion) } else { point_path::rest(motion) }
    }

    fn mechanism(&self) -> Option<&dyn Mechanism> {
        Some(self)
    }

    fn states_evidence(&self) -> bool {
        true
    }

    fn parts(&self) -> &'static [&'static str] {
        const ALL: [&str; 6] = misfit_and(&["leap_share"]);
        &ALL
    }
}
