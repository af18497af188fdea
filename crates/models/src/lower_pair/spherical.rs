//! `spherical`: a turn about one point.

use jointscope_motion::{
    End, Pose, PoseSeries, RelativeMotion,
    twist::{Twist, rotation_log},
};
use nalgebra::{Point3, UnitQuaternion, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Geometry, Mechanism, Mobility, Placement, judge, judge::far_hinge_cost, misfit, misfit_and, starts};
use crate::{FitError, JointFit, JointModel, joint_model, point_path};

/// Spherical joint: any rotation about a point that is fixed in both bodies.
///
/// `L_t = g h(q_t) g⁻¹ L_0` with `h(q)` any rotation; `g` places the centre, `L_0` the moving body.
///
/// Convention: positions are rotation vectors in the axes of the reference, radians; the axis's point is the centre,
/// and there is no direction.
///
/// Joints lie near their bodies: where the body swings by less than `sweep` about the point, that costs
/// `-2 ln(θ/sweep)`. Bodies that show one point: the point stays on a sphere, likewise.
///
/// References: docs/method.md, "Mechanisms".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Spherical {
    /// Part of the sphere from which the path of a body is as likely as any, degrees.
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
        Mobility { turns: 3, slides: 0, parameters: 15, advances: false, roams: false }
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

/// Turn by which a body swings about a point of the moving body, radians, or what of its own turn shows where the point
/// is; of the two bodies' the larger. Little of a far sphere is seen: it is hardly told from a plane.
fn swing(centre: &Vector3<f64>, series: &PoseSeries) -> f64 {
    let of_end = |(number, end): (usize, &End)| {
        let lever = |pose: &Pose| {
            let (pivot, body) = (Point3::from(*centre), Point3::from(end.centre));
            if number == 0 { pose.rotation * (body - pivot) } else { pose.inverse() * body - pivot }
        };
        let levers: Vec<Vector3<f64>> = series.poses().iter().map(lever).collect();
        let length = levers.iter().map(Vector3::norm).sum::<f64>() / levers.len() as f64;
        let own = series.turn() * (end.radius / length).min(1.0);
        (misfit::vector_range(&levers) / length).max(own)
    };
    series.ends().iter().enumerate().map(of_end).fold(0.0, f64::max)
}

impl JointModel for Spherical {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        let Some(series) = motion.pose_series() else { return point_path::sphere(motion, self.sweep) };
        let mut fit = judge(self, motion)?;
        let in_moving = if series.reversed() { fit.joint.axis } else { fit.axis_in_moving };
        if let (Some(evidence), Some(centre)) = (&mut fit.evidence, in_moving) {
            let turned = swing(&(centre.point.coords - series.moving_origin()), series);
            evidence.prior_cost += far_hinge_cost(turned.to_degrees(), self.sweep);
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
