//! Registration as one would write it with nalgebra's singular value decomposition.

use jointscope_motion::Pose;
use nalgebra::{Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// `target_from_source`, of points in metres, by Kabsch's method.
pub(crate) fn by_svd(source: &[Point3<f64>], target: &[Point3<f64>]) -> Option<Pose> {
    let count = source.len() as f64;
    let p = source.iter().map(|p| p.coords).sum::<Vector3<f64>>() / count;
    let q = target.iter().map(|q| q.coords).sum::<Vector3<f64>>() / count;
    let h: Matrix3<f64> = source.iter().zip(target).map(|(a, b)| (a.coords - p) * (b.coords - q).transpose()).sum();
    let rotation = rotation_by_svd(h)?;
    Some(Pose::from_parts(Translation3::from(q - rotation * p), rotation))
}

/// The rotation that fits a cross-covariance best.
pub(crate) fn rotation_by_svd(h: Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    let svd = h.svd(true, true);
    let (u, v) = (svd.u?, svd.v_t?.transpose());
    let sign = (v * u.transpose()).determinant().signum();
    let rotation = v * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * u.transpose();
    Some(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation)))
}
