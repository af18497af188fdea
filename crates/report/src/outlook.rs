//! From where a recording is looked at.

use nalgebra::{Point3, Rotation3, Vector3};

/// A place to look from: recordings do not say what is up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Outlook {
    /// Middle of what is seen, metres.
    pub(crate) centre: Point3<f64>,
    /// Half the diagonal of what is seen, metres.
    pub(crate) size: f64,
    /// Unit vector that is taken for up.
    pub(crate) up: Vector3<f64>,
    /// Unit vector from the middle to the eye.
    pub(crate) eye: Vector3<f64>,
}

impl Outlook {
    /// Where all is before the origin along z, as a camera sees it, a little from the side and from above. Else up is
    /// the coordinate, z or y, in which things differ less: rooms are wider than they are high.
    pub(crate) fn of<'p>(points: impl Iterator<Item = &'p Point3<f64>>) -> Self {
        /// Samples by which bounds are told, of every coordinate from 1 to 99 %.
        const SHARE: f64 = 0.01;
        let mut columns = [Vec::new(), Vec::new(), Vec::new()];
        for point in points {
            (0..3).for_each(|axis| columns[axis].push(point[axis]));
        }
        if columns[0].is_empty() {
            return Self { centre: Point3::origin(), size: 1.0, up: Vector3::z(), eye: Vector3::new(0.6, -0.7, 0.4) };
        }
        let mut at = |share: f64| Vector3::from_fn(|axis, _| jointscope_motion::quantile(&mut columns[axis], share));
        let (low, high) = (at(SHARE), at(1.0 - SHARE));
        let extent = high - low;
        let centre = (low + high) / 2.0;
        let camera = low.z > 0.25 * extent.norm() && centre.x.abs() < centre.z && centre.y.abs() < centre.z;
        let (up, eye) = if camera {
            (-Vector3::y(), Vector3::new(0.45, -0.6, -0.8))
        } else if extent.z <= extent.y || low.y < -0.3 * extent.y {
            (Vector3::z(), Vector3::new(0.5, -0.8, 0.45))
        } else {
            (Vector3::y(), Vector3::new(0.5, 0.45, 0.8))
        };
        Self { centre: centre.into(), size: (extent.norm() / 2.0).max(1e-6), up, eye: eye.normalize() }
    }

    /// Rotation to the eye's axes: x to the right, y upwards, z to the eye.
    pub(crate) fn turn(&self) -> Rotation3<f64> {
        let right = self.up.cross(&self.eye).normalize();
        let above = self.eye.cross(&right);
        Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_rows(&[
            right.transpose(),
            above.transpose(),
            self.eye.transpose(),
        ]))
    }
}
