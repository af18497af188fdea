//! `planar`: slides and turns in a plane.

use jointscope_motion::{Pose, PoseSeries, RelativeMotion, twist::Twist};
use nalgebra::{Complex, Matrix3, UnitQuaternion, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Geometry, Mechanism, Mobility, Otherwise, Placement, judge, misfit_and, starts, turn_about_z};
use crate::{FitError, JointFit, JointModel, joint_model, point_path};

/// Planar joint: translation in a plane and rotation about its normal.
///
/// `L_t = g h(q_t, x_t, y_t) g⁻¹ L_0` with `h(q, x, y) = Tx(x) Ty(y) Rz(q)`; `g` places the plane, `L_0` the moving
/// body.
///
/// Convention: positions are the turn about the normal, radians, and the way of the moving body's centre in the
/// plane, metres, 0 at the first frame; the axis is the normal through the moving body.
///
/// Bodies that show one point: the point stays in a plane.
///
/// References: docs/method.md, "Mechanisms".
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Planar {}

joint_model!(Planar, "planar", "translation in a plane and rotation about its normal");

impl Mechanism for Planar {
    fn mobility(&self) -> Mobility {
        Mobility { turns: 1, slides: 2, parameters: 14, advances: false, roams: true }
    }

    fn geometry(&self, _: &Vector2<f64>) -> Geometry {
        Geometry::Plane
    }

    fn pose(&self, q: &Vector3<f64>, _: &Vector2<f64>) -> Pose {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), q.x);
        Pose::from_parts(Vector3::new(q.y, q.z, 0.0).into(), turn)
    }

    fn twists(&self, q: &Vector3<f64>, _: &Vector2<f64>) -> [Twist; 3] {
        // The turn is about the place where the body is.
        let turn = Twist::new(0.0, 0.0, 1.0, q.z, -q.y, 0.0);
        [turn, Twist::new(0.0, 0.0, 0.0, 1.0, 0.0, 0.0), Twist::new(0.0, 0.0, 0.0, 0.0, 1.0, 0.0)]
    }

    fn project(&self, motion: &Pose, previous: &Vector3<f64>, _: &Vector2<f64>) -> Vector3<f64> {
        Vector3::new(turn_about_z(motion, previous.x), motion.translation.x, motion.translation.y)
    }

    fn starts(&self, series: &PoseSeries) -> Vec<Placement> {
        starts::across_the_plane(series)
    }

    /// Slides of the place of the body that goes around least: of a body that turns on a far arm, the arm's other end.
    fn told_otherwise(&self, positions: &[Vector3<f64>], noise: &[Matrix3<f64>]) -> Option<Otherwise> {
        let count = positions.len() as f64;
        let (place, turned) = (|q: &Vector3<f64>| Complex::new(q.y, q.z), |q: &Vector3<f64>| Complex::cis(q.x));
        let mean = positions.iter().map(place).sum::<Complex<f64>>() / count;
        let usual = positions.iter().map(turned).sum::<Complex<f64>>() / count;
        let along = |q: &Vector3<f64>| (turned(q) - usual).conj() * (place(q) - mean);
        let square = positions.iter().map(|q| (turned(q) - usual).norm_sqr()).sum::<f64>();
        if square <= noise.iter().map(|noise| noise[(0, 0)]).sum::<f64>() {
            return None;
        }
        let arm = -positions.iter().map(along).sum::<Complex<f64>>() / square;
        let to_there = |q: &Vector3<f64>| turned(q) * arm;
        let moved = |q: &Vector3<f64>| q + Vector3::new(0.0, to_there(q).re, to_there(q).im);
        let carried = |(q, noise): (&Vector3<f64>, &Matrix3<f64>)| {
            let arm = to_there(q);
            let by_turn = Matrix3::new(1.0, 0.0, 0.0, -arm.im, 1.0, 0.0, arm.re, 0.0, 1.0);
            by_turn * noise * by_turn.transpose()
        };
        Some(Otherwise {
            positions: positions.iter().map(moved).collect(),
            noise: positions.iter().zip(noise).map(carried).collect(),
        })
    }
}

impl JointModel for Planar {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        if motion.pose_series().is_some() { judge(self, motion) } else { point_path::plane(motion) }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slides_may_be_those_of_the_place_about_which_the_body_turns() {
        let arm = Complex::new(2.0, -1.0);
        let (turns, noise) = ([-0.3, 0.1, 0.4, 0.9], Matrix3::new(4e-6, 1e-6, 0.0, 1e-6, 9e-6, 2e-6, 0.0, 2e-6, 5e-6));
        let around = |turn: &f64| Complex::cis(*turn) * arm + Complex::new(5.0, 3.0);
        let positions = turns.map(|turn| Vector3::new(turn, around(&turn).re, around(&turn).im));
        let other = Planar {}.told_otherwise(&positions, &[noise; 4]).expect("it turns");
        for (told, turn) in other.positions.iter().zip(turns) {
            assert!((told - Vector3::new(turn, 5.0, 3.0)).norm() < 1e-12, "{told}");
        }
        for (told, turn) in other.noise.iter().zip(turns) {
            // A place this far away is known worse by the noise of the turn, but nothing is known less.
            let by_turn = Complex::cis(turn) * arm;
            let across = 9e-6 + 2.0 * 1e-6 * by_turn.im + 4e-6 * by_turn.im.powi(2);
            assert!((told[(1, 1)] - across).abs() < 1e-12, "{} {across}", told[(1, 1)]);
            assert!((told.determinant() / noise.determinant() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_body_that_does_not_turn_has_no_other_place() {
        let positions = [0.0, 0.1, 0.3].map(|x| Vector3::new(0.001 * x, x, 0.0));
        assert!(Planar {}.told_otherwise(&positions, &[Matrix3::identity() * 1e-4; 3]).is_none());
    }
}
