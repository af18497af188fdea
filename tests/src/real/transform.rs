//! Poses from matrices, and bodies seen as poses only.

use jointscope_motion::{Body, Pose, Recording};
use jointscope_recordings::Unit;
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};

/// Departure from a rotation that rounding in a file may cause.
const ROUNDING: f64 = 0.01;

/// The pose of the upper three rows of a homogeneous matrix; the rotation is the nearest one.
pub(super) fn pose(rows: [[f64; 4]; 3], unit: Unit) -> Result<Pose, String> {
    let matrix = Matrix3::from_fn(|row, column| rows[row][column]);
    let svd = matrix.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Err("a matrix cannot be decomposed".into()) };
    let nearest = u * v_t;
    if !(svd.singular_values.add_scalar(-1.0).amax() < ROUNDING && nearest.determinant() > 0.0) {
        return Err(format!("needed a rotation, found {matrix}"));
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(nearest));
    Ok(Pose::from_parts(Translation3::from(rows.map(|row| unit.to_metres(row[3]))), rotation))
}

/// A recording of bodies seen as poses in frames counted from 0.
pub(super) fn recording(times: Option<Vec<f64>>, bodies: Vec<(&str, Vec<Option<Pose>>)>) -> Result<Recording, String> {
    let frames = bodies.first().map_or(0, |(_, poses)| poses.len() as u64);
    let bodies = bodies.into_iter().map(|(name, poses)| Body::from_poses(name, poses)).collect::<Result<_, _>>();
    bodies.and_then(|bodies| Recording::new((0..frames).collect(), times, bodies)).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounded_rotations_are_taken_and_reflections_refused() {
        let turned = [[0., -1.0001, 0., 1000.], [1., 0., 0., 0.], [0., 0.0001, 1., 0.]];
        let pose_found = pose(turned, Unit::Millimetre).expect("nearly a rotation");
        assert_eq!(pose_found.translation.x, 1.0);
        assert!((pose_found.rotation.angle() - std::f64::consts::FRAC_PI_2).abs() < 1e-3);
        let mirrored = [[-1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., 0.]];
        assert!(pose(mirrored, Unit::Metre).is_err());
        assert!(pose([[0.; 4]; 3], Unit::Metre).is_err());
        assert!(pose([[f64::NAN; 4]; 3], Unit::Metre).is_err());
    }
}
