//! `spherical`: a turn about one point.

use jointscope_motion::{
    Pose, PoseSeries, RelativeMotion,
    twist::{Twist, rotation_log},
};
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Geometry, Mechanism, Mobility, Placement, judge, starts};
use crate::{FitError, JointFit, JointModel, joint_model, point_path};

/// Spherical joint: any rotation about a point that is fixed in both bodies.
///
/// Bodies that show one point: the point stays on a sphere; spheres of which little is seen cost what short arcs cost
/// a revolute joint.
///
/// References: docs/method.md, "Mechanisms".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Spherical {
    /// Part of the sphere from which the path of a point is as likely as any, degrees.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub sweep: f64,
}

impl Default for Spherical {
    fn default() -> Self {
        Self { sweep: 30.0 }
    }
}

joint_model!(Spherical, "spherical", "any rotation about a fixed point");

impl Mechanism for Spherical {
    fn mobility(&self) -> Mobility {
        Mobility { turns: 3, slides: 0, parameters: 15 }
    }

    fn geometry(&self, _: &Vector2<f64>) -> Geometry {
        Geometry::Centre
    }

    fn pose(&self, q: &Vector3<f64>, _: &Vector2<f64>) -> Pose {
        Pose::from_parts(Vector3::zeros().into(), UnitQuaternion::from_scaled_axis(*q))
    }

    fn twists(&self, _: &Vector3<f64>, _: &Vector2<f64>) -> [Twist; 3] {
        [0, 1, 2].map(|axis| Twist::ith(axis, 1.0))
    }

    fn advance(&self, q: &Vector3<f64>, step: &Vector3<f64>) -> Vector3<f64> {
        let turned = UnitQuaternion::from_scaled_axis(*step) * UnitQuaternion::from_scaled_axis(*q);
        rotation_log(&turned)
    }

    fn project(&self, motion: &Pose, _: &Vector3<f64>, _: &Vector2<f64>) -> Vector3<f64> {
        rotation_log(&motion.rotation)
    }

    fn starts(&self, series: &PoseSeries) -> Vec<Placement> {
        starts::about_a_point(series)
    }
}

impl JointModel for Spherical {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        if motion.pose_series().is_some() { judge(self, motion) } else { point_path::sphere(motion, self.sweep) }
    }

    fn states_evidence(&self) -> bool {
        true
    }
}
