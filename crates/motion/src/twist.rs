//! Twists `[ω; v]`, angular part first, and poses: the exponential map of SE(3), its inverse, and the adjoint.

use nalgebra::{Matrix3, Matrix6, Quaternion, Translation3, UnitQuaternion, Vector3, Vector6};

use crate::Pose;

/// A twist `[ω; v]`: radians and metres.
pub type Twist = Vector6<f64>;

/// Square of an angle, or of the sine of its half, below which a few terms of a series are exact.
const SMALL_SQUARE: f64 = 4e-4;

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
    let square = w.norm_squared();
    let angle = square.sqrt();
    let (sine, cosine) = (0.5 * angle).sin_cos();
    // sin θ/2 over θ, (1 - cos θ)/θ² and (θ - sin θ)/θ³.
    let (a, b, c) = if square < SMALL_SQUARE {
        let of_half = 0.5 + square * (-1.0 / 48.0 + square / 3840.0);
        (of_half, 2.0 * of_half * of_half, 1.0 / 6.0 + square * (-1.0 / 120.0 + square / 5040.0))
    } else {
        let of_half = sine / angle;
        (of_half, 2.0 * of_half * of_half, (1.0 - 2.0 * of_half * cosine) / square)
    };
    let across = w.cross(&v);
    let shift = v + b * across + c * w.cross(&across);
    let turn = w * a;
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(cosine, turn.x, turn.y, turn.z));
    Pose::from_parts(Translation3::from(shift), rotation)
}

/// The twist that leads to a pose in unit time, with a turn of at most half a revolution.
pub fn log(pose: &Pose) -> Twist {
    let (w, half_cotangent) = vector_and_cotangent(&pose.rotation);
    let square = w.norm_squared();
    // 1/θ² - (1 + cos θ)/(2 θ sin θ), where (1 + cos θ)/sin θ is cot θ/2.
    let c = if square < SMALL_SQUARE {
        1.0 / 12.0 + square * (1.0 / 720.0 + square / 30_240.0)
    } else {
        (1.0 - half_cotangent) / square
    };
    let t = pose.translation.vector;
    let across = w.cross(&t);
    twist(&w, &(t - 0.5 * across + c * w.cross(&across)))
}

/// The rotation vector of a rotation, of length at most π.
pub fn rotation_log(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    vector_and_cotangent(rotation).0
}

/// The rotation vector, and `θ/2 cot θ/2`.
fn vector_and_cotangent(rotation: &UnitQuaternion<f64>) -> (Vector3<f64>, f64) {
    let q = if rotation.w < 0.0 { -rotation.coords } else { rotation.coords };
    let v = Vector3::new(q.x, q.y, q.z);
    let square = v.norm_squared();
    // The half angle over its sine.
    let ratio = if square < SMALL_SQUARE {
        // The series of the arcsine.
        1.0 + square * (1.0 / 6.0 + square * (3.0 / 40.0 + square * (15.0 / 336.0 + square * (105.0 / 3456.0))))
    } else {
        let sine = square.sqrt();
        sine.atan2(q.w) / sine
    };
    (v * (2.0 * ratio), ratio * q.w)
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
        /// Rounding of numbers of the size of 1, radians and metres, near half a turn, too.
        const EXACT: f64 = 1e-12;
        for scale in [1e-9, 1e-5, 1e-3, 0.0199, 0.0201, 0.0399, 0.0401, 0.1, 1.0, 2.0, 3.13] {
            let direction = Vector3::new(0.3, -0.5, 0.8).normalize();
            let t = twist(&(direction * scale), &Vector3::new(0.4, -1.0, 2.0));
            assert!((log(&exp(&t)) - t).norm() < EXACT, "{scale}");
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
