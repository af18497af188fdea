//! A pose as files write it: a position and a unit quaternion.

use jointscope_motion::Pose;
use nalgebra::{Quaternion, Translation3, Unit as UnitLength, UnitQuaternion};

use crate::Unit;

/// Departure of a quaternion's norm from 1 that rounding in a file may cause.
const NORM_TOLERANCE: f64 = 0.05;

/// A norm this close to 1 comes from rounding in `f64`; such a quaternion is kept bit by bit, so that poses survive
/// being written and read.
const NORM_ROUNDING: f64 = 4. * f64::EPSILON;

/// The pose of `x y z qx qy qz qw`; missing if any of them is NaN or the quaternion is all zeros, as trackers write it
/// when they lost the body.
pub(crate) fn pose(values: [f64; 7], unit: Unit) -> Result<Option<Pose>, String> {
    let [x, y, z, qx, qy, qz, qw] = values;
    if values.iter().any(|value| value.is_nan()) || [qx, qy, qz, qw] == [0.; 4] {
        return Ok(None);
    }
    let quaternion = Quaternion::new(qw, qx, qy, qz);
    let norm = quaternion.norm();
    let departure = (norm - 1.).abs();
    if departure > NORM_TOLERANCE {
        return Err(format!(
            "needed a unit quaternion, found ({qx} {qy} {qz} {qw}) of norm {norm:.3e}; check the order and number of \
             the columns"
        ));
    }
    let rotation = if departure <= NORM_ROUNDING {
        UnitLength::new_unchecked(quaternion)
    } else {
        UnitQuaternion::from_quaternion(quaternion)
    };
    Ok(Some(Pose::from_parts(Translation3::from([x, y, z].map(|length| unit.to_metres(length))), rotation)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_positions_are_scaled_and_rounded_quaternions_are_normalised() {
        let pose = pose([1000., 0., 0., 0., 0., 0.6, 0.801], Unit::Millimetre).expect("sound").expect("seen");
        assert!(pose.translation.x == 1.);
        assert!((pose.rotation.norm() - 1.).abs() < 1e-15);
        assert!((pose.rotation.k / pose.rotation.w - 0.6 / 0.801).abs() < 1e-15);
    }

    #[test]
    fn lost_poses_are_missing_and_other_norms_are_refused() {
        let read = |q: [f64; 4]| pose([0., 0., 0., q[0], q[1], q[2], q[3]], Unit::Metre);
        assert_eq!(read([0.; 4]), Ok(None));
        assert_eq!(read([f64::NAN, 0., 0., 1.]), Ok(None));
        for q in [[0., 0., 0., 0.9], [1., 1., 0., 0.], [1e300, 1e300, 0., 0.], [1e-300, 0., 0., 0.]] {
            assert!(read(q).expect_err("no unit quaternion").starts_with("needed a unit quaternion"));
        }
    }
}
