//! `universal`: turns about two axes that meet at a right angle.

use jointscope_motion::{Pose, PoseSeries, RelativeMotion, twist::Twist};
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Geometry, Mechanism, Mobility, Placement, judge, misfit_and, starts};
use crate::{FitError, JointFit, JointModel, joint_model};

/// Universal joint (Cardan, Hooke): rotation about an axis fixed in the reference, then about one that is
/// perpendicular to it, meets it, and is fixed in the moving body.
///
/// `L_t = g h(q_t) g⁻¹ L_0` with `h(a, b) = Rz(a) Rx(b)`; `g` places the centre and the axes, `L_0` the moving body.
///
/// Convention: positions are the two turns, radians; the axis's point is the centre, and there is no direction.
///
/// Its motions form no group: it is a mechanism between a revolute and a spherical joint. The path of a single point
/// cannot tell it; such bodies are not judged.
///
/// References: docs/method.md, "Mechanisms".
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Universal {}

joint_model!(Universal, "universal", "rotation about two perpendicular axes that meet");

impl Mechanism for Universal {
    fn mobility(&self) -> Mobility {
        // Centre, two directions at a right angle, home; mean and spread of two angles.
        Mobility { turns: 2, slides: 0, parameters: 15, advances: false, roams: false }
    }

    fn geometry(&self, _: &Vector2<f64>) -> Geometry {
        Geometry::Centre
    }

    fn pose(&self, q: &Vector3<f64>, _: &Vector2<f64>) -> Pose {
        let first = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), q.x);
        let second = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), q.y);
        Pose::from_parts(Vector3::zeros().into(), first * second)
    }

    fn twists(&self, q: &Vector3<f64>, _: &Vector2<f64>) -> [Twist; 3] {
        // The second axis is carried along by the first turn.
        let (sin, cos) = q.x.sin_cos();
        [Twist::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0), Twist::new(cos, sin, 0.0, 0.0, 0.0, 0.0), Twist::zeros()]
    }

    fn project(&self, motion: &Pose, previous: &Vector3<f64>, _: &Vector2<f64>) -> Vector3<f64> {
        // The image of x shows the first turn, that of z the second.
        let x = motion.rotation * Vector3::x();
        let z = motion.rotation * Vector3::z();
        let first = x.y.atan2(x.x);
        let (sin, cos) = first.sin_cos();
        let second = (sin * z.x - cos * z.y).atan2(z.z);
        let near = |angle: f64, before: f64| {
            angle + std::f64::consts::TAU * ((before - angle) / std::f64::consts::TAU).round()
        };
        Vector3::new(near(first, previous.x), near(second, previous.y), 0.0)
    }

    fn starts(&self, series: &PoseSeries) -> Vec<Placement> {
        starts::about_two_axes(series)
    }
}

impl JointModel for Universal {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        judge(self, motion)
    }

    fn mechanism(&self) -> Option<&dyn Mechanism> {
        Some(self)
    }

    fn states_evidence(&self) -> bool {
        true
    }

    fn parts(&self) -> &'static [&'static str] {
        const ALL: [&str; 5] = misfit_and(&[]);
        &ALL
    }
}
