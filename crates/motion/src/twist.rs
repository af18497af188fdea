//! Twists `[ω; v]`, angular part first, and poses: the exponential map of SE(3), its inverse, and the adjoint.

use nalgebra::{Matrix3, Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};

use crate::Pose;

/// A twist `[ω; v]`: radians and metres.
pub type Twist = Vector6<f64>;

/// Angle below which series replace quotients that vanish, radians.
const SMALL: f64 = 1e-4;

/// The twist of an angular and a linear part.
pub fn twist(angular: &Vector3<f64>, linear: &Vector3<f64>) -> Twist {
    Twist::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z)
}

/// The angular part `ω`.
pub fn angular(twist: &Twist) -> Vector3<f64> {
    twist.fixed_rows::<3>(0).into_owned()
}

/// The linear part `v`.
pub fn linear(twist: &Twist) -> Vector3<f64> {
    twist.fixed_rows::<3>(3).into_owned()
}

/// The pose that a twist leads to in unit time.
///
/// *Reference.* R. M. Murray, Z. Li, S. S. Sastry, A Mathematical Introduction to Robotic Manipulation (1994), chapter 2.
pub fn exp(twist: &Twist) -> Pose {
    let (w, v) = (angular(twist), linear(twist));
    let angle = w.norm();
    let square = angle * angle;
    let (b, c) = if angle < SMALL {
        (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
    } else {
        ((1.0 - angle.cos()) / square, (angle - angle.sin()) / (square * angle))
    };
    let across = w.cross(&v);
    let shift = v + b * across + c * w.cross(&across);
    Pose::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(w))
}

/// The twist that leads to a pose in unit time, with a turn of at most half a revolution.
pub fn log(pose: &Pose) -> Twist {
    let w = rotation_log(&pose.rotation);
    let square = w.norm_squared();
    let angle = square.sqrt();
    let c = if angle < SMALL {
        1.0 / 12.0 + square / 720.0
    } else {
        // 1/θ² - (1 + cos θ)/(2 θ sin θ), where (1 + cos θ)/sin θ is cot θ/2.
        (1.0 - 0.5 * angle / (0.5 * angle).tan()) / square
    };
    let t = pose.translation.vector;
    let across = w.cross(&t);
    twist(&w, &(t - 0.5 * across + c * w.cross(&across)))
}

/// The rotation vector of a rotation, of length at most π.
pub fn rotation_log(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let q = if rotation.w < 0.0 { -rotation.coords } else { rotation.coords };
    let v = Vector3::new(q.x, q.y, q.z);
    let sine = v.norm();
    if sine < 1e-9 { v * 2.0 } else { v * (2.0 * sine.atan2(q.w) / sine) }
}

/// The adjoint of a pose: takes a twist from source to target coordinates.
pub fn adjoint(pose: &Pose) -> Matrix6<f64> {
    let turn = pose.rotation.to_rotation_matrix().into_inner();
    let lever: Matrix3<f64> = pose.translation.vector.cross_matrix() * turn;
    let mut adjoint = Matrix6::zeros();
    adjoint.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
    adjoint.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
    adjoint.fixed_view_mut::<3, 3>(3, 0).copy_from(&lever);
    adjoint
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_and_log_are_inverse_up_to_half_a_turn() {
        for scale in [1e-9, 1e-5, 9e-5, 1.1e-4, 0.1, 1.0, 2.0, 3.13] {
            let direction = Vector3::new(0.3, -0.5, 0.8).normalize();
            let t = twist(&(direction * scale), &Vector3::new(0.4, -1.0, 2.0));
            assert!((log(&exp(&t)) - t).norm() < 1e-9, "{scale}");
        }
    }

    #[test]
    fn the_adjoint_carries_twists() {
        let pose = exp(&Twist::new(0.3, -0.2, 0.9, 1.0, 2.0, -0.5));
        let small = Twist::new(0.01, 0.02, -0.03, 0.04, 0.0, 0.05);
        let carried = exp(&(adjoint(&pose) * small));
        assert!((log(&(carried.inverse() * (pose * exp(&small) * pose.inverse())))).norm() < 1e-12);
    }

    #[test]
    fn exp_agrees_with_many_small_steps() {
        let t = Twist::new(0.7, -0.4, 1.1, 0.3, 0.2, -0.9);
        let steps = 4096;
        let step = exp(&(t / f64::from(steps)));
        let walked = (0..steps).fold(Pose::identity(), |pose, _| pose * step);
        assert!(log(&(walked.inverse() * exp(&t))).norm() < 1e-9);
    }
}
