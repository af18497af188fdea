//! The line through the centres of circles or ellipses: the axis about which features turn.

use nalgebra::{Point3, Unit, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::principal_axes;

/// What the radius of the tube around the axis is measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AxisRadius {
    /// Extent of the centres along the axis, as in the prismatic case.
    Line,
    /// Mean radius of the circles, or long semi-axis of the ellipses.
    Circle,
}

/// A line, and how many centres lie along it.
pub(super) struct CentreLine {
    pub point: Point3<f64>,
    pub direction: Unit<Vector3<f64>>,
    /// Centres inside the tube around the line.
    pub inside: usize,
}

/// Centres, and what is known of them.
pub(super) struct Centres<'c> {
    places: &'c [Point3<f64>],
    mean: Point3<f64>,
    radius: f64,
}

impl<'c> Centres<'c> {
    /// Centres of curves of a mean radius, metres; `None` where there are none.
    pub(super) fn new(places: &'c [Point3<f64>], radius: f64) -> Option<Self> {
        let sum: Vector3<f64> = places.iter().map(|place| place.coords).sum();
        (!places.is_empty()).then(|| Self { places, mean: Point3::from(sum / places.len() as f64), radius })
    }

    fn offsets(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        self.places.iter().map(|place| place - self.mean)
    }

    /// Whether all are in one place, up to rounding.
    pub(super) fn are_one(&self) -> bool {
        /// Distance of centres, as a share of the radius, that rounding explains.
        const ROUNDING: f64 = 1e-9;
        self.offsets().all(|d| d.norm() <= ROUNDING * self.radius)
    }

    /// The direction in which they extend most, and their spread across it as a share of that along it.
    pub(super) fn extent(&self) -> (Unit<Vector3<f64>>, f64) {
        let [along, across, _] = principal_axes(self.offsets().map(|d| d * d.transpose()).sum());
        (along.1, (across.0.max(0.0) / along.0).sqrt())
    }

    /// The line of a direction through their mean, with a tube whose radius is a share `tolerance` of `measure`: thesis
    /// equation (43).
    pub(super) fn along(&self, direction: Unit<Vector3<f64>>, tolerance: f64, measure: AxisRadius) -> CentreLine {
        let places = self.offsets().map(|d| direction.dot(&d));
        let (least, most) = places.fold((0.0_f64, 0.0_f64), |(a, b), s| (a.min(s), b.max(s)));
        let tube = tolerance
            * match measure {
                AxisRadius::Line => most - least,
                AxisRadius::Circle => self.radius,
            };
        let inside = self.offsets().filter(|d| direction.cross(d).norm() < tube).count();
        CentreLine { point: self.mean, direction, inside }
    }
}
