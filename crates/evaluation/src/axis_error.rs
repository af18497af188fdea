//! How far a found axis is from the true one.

use jointscope_models::Axis;
use jointscope_scenes::TrueAxis;
use nalgebra::{Point3, Unit, Vector3};
use serde::Serialize;

/// How far a found axis is from the true one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AxisError {
    /// Angle between the directions, whichever way they point, radians.
    pub angle: f64,
    /// Distance of the true axis's point from the found line, metres.
    pub distance: f64,
}

impl AxisError {
    /// Compares lines; `None` if one of the axes has no direction.
    ///
    /// The true axis's point is where the moving body is: in the nominal scenes it is the point of the axis that is
    /// nearest to the body's middle.
    pub fn between(found: &Axis, truth: &TrueAxis) -> Option<Self> {
        let direction = found.direction?;
        let true_direction = Unit::try_new(Vector3::from(truth.direction?), 0.0)?;
        let distance = from_line(&truth.point.into(), &found.point, &direction);
        Some(Self { angle: angle(&direction, &true_direction), distance })
    }
}

/// Angle between two lines' directions, radians.
pub(crate) fn angle(one: &Unit<Vector3<f64>>, other: &Unit<Vector3<f64>>) -> f64 {
    one.cross(other).norm().atan2(one.dot(other).abs())
}

/// Distance of a point from a line, metres.
pub(crate) fn from_line(point: &Point3<f64>, origin: &Point3<f64>, direction: &Unit<Vector3<f64>>) -> f64 {
    direction.cross(&(point - origin)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(point: [f64; 3], direction: [f64; 3]) -> Axis {
        Axis { point: point.into(), direction: Some(Unit::new_normalize(direction.into())), pitch: Some(0.0) }
    }

    #[test]
    fn lines_are_compared_whichever_way_they_point_and_wherever_their_points_are() {
        let truth = TrueAxis { point: [1.0, 2.0, 3.0], direction: Some([0.0, 0.0, 1.0]), pitch: Some(0.0) };
        let same = AxisError::between(&found([1.0, 2.0, -7.0], [0.0, 0.0, -2.0]), &truth).expect("directions");
        assert_eq!(same, AxisError { angle: 0.0, distance: 0.0 });
        let beside = AxisError::between(&found([1.3, 2.4, 50.0], [0.0, 0.0, 1.0]), &truth).expect("directions");
        assert!(beside.angle == 0.0 && (beside.distance - 0.5).abs() < 1e-12, "{beside:?}");
        // Through the point's own height, tilted by 30 degrees away from a point 0.2 m aside.
        let tilted = found([1.2, 2.0, 3.0], [0.0, 0.5, 0.75_f64.sqrt()]);
        let tilted = AxisError::between(&tilted, &truth).expect("directions");
        assert!((tilted.angle.to_degrees() - 30.0).abs() < 1e-12 && (tilted.distance - 0.2).abs() < 1e-12);
        // Tilted about a place 2 m along: the lever counts, sin 30 degrees of it.
        let lever = found([1.0, 2.0, 1.0], [0.0, 0.5, 0.75_f64.sqrt()]);
        let lever = AxisError::between(&lever, &truth).expect("directions");
        assert!((lever.distance - 1.0).abs() < 1e-12, "{lever:?}");
    }

    #[test]
    fn tiny_angles_are_not_lost_in_rounding() {
        let truth = TrueAxis { point: [0.0; 3], direction: Some([0.0, 0.0, 1.0]), pitch: None };
        let error = AxisError::between(&found([0.0; 3], [1e-9, 0.0, 1.0]), &truth).expect("directions");
        assert!((error.angle - 1e-9).abs() < 1e-15);
    }

    #[test]
    fn a_centre_is_no_line() {
        let centre = TrueAxis { point: [0.0; 3], direction: None, pitch: None };
        assert_eq!(AxisError::between(&found([0.0; 3], [1.0, 0.0, 0.0]), &centre), None);
    }
}
