//! Plane and circle through a trajectory.

use jointscope_motion::Summary;
use nalgebra::{Matrix3, Point3, Unit, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{lanes, principal_axes};

/// Radius, in extents of the points, beyond which a circle is a straight line.
const STRAIGHT: f64 = 1e7;
/// Spread of the points, as a share of the coordinates' magnitude, that rounding explains.
const ROUNDING: f64 = 1e-14;

/// How a circle is fitted in its plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CircleMethod {
    /// Taubin's algebraic fit, nearly unbiased: the thesis's choice.
    #[default]
    Taubin,
    /// Kåsa's fit, which shrinks the circle of a short noisy arc.
    Kasa,
}

/// A circle in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Centre, metres.
    pub centre: Point3<f64>,
    /// Unit normal of its plane.
    pub normal: Unit<Vector3<f64>>,
    /// Radius, metres.
    pub radius: f64,
    /// Direction in the plane from which angles count: the largest extent of the points.
    pub x_axis: Unit<Vector3<f64>>,
}

impl Circle {
    /// The circle through points: the plane of least squares, and in it the circle by `method`.
    ///
    /// `None` where points coincide or lie on a straight line, so that no circle of finite radius exists.
    ///
    /// # References
    /// Plane: thesis equations (21)-(37), by the eigenvectors of the covariance. Circle: G. Taubin, IEEE PAMI 13
    /// (1991), in the form of N. Chernov, *Circular and Linear Regression* (2010): the least eigenvector of the
    /// covariance of `((z - z̄)/(2√z̄), x, y)`, `z = x² + y²`, with x, y from the centroid; Kåsa: I. Kåsa, IEEE
    /// Trans. Instrum. Meas. 25 (1976).
    pub fn through(points: &[Point3<f64>], method: CircleMethod) -> Option<Self> {
        let count = points.len() as f64;
        let centroid = points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / count;
        let covariance =
            points.iter().map(|p| p.coords - centroid).map(|d| d * d.transpose()).sum::<Matrix3<f64>>() / count;
        let magnitude = points.iter().fold(0.0_f64, |m, p| m.max(p.coords.amax()));
        let plane = Plane::of(covariance.trace(), magnitude, &principal_axes(covariance))?;
        let [x_axis, y_axis] = plane.axes.map(|axis| axis.into_inner() / plane.unit);
        let places = points.iter().map(|p| {
            let d = p.coords - centroid;
            (x_axis.dot(&d), y_axis.dot(&d))
        });
        let fit = match method {
            CircleMethod::Taubin => taubin(places, count),
            CircleMethod::Kasa => kasa(&moments(places, count)),
        };
        Some(plane.circle(centroid, fit?))
    }

    /// The same through each of several features' positions, which are known by their moments.
    pub(super) fn through_all(known: &[Summary], method: CircleMethod) -> Vec<Option<Self>> {
        let planes = lanes::principal_axes(&known.iter().map(|known| known.covariance).collect::<Vec<_>>());
        let planes = known
            .iter()
            .zip(&planes)
            .map(|(known, axes)| Plane::of(known.covariance.trace(), known.magnitude, axes))
            .collect::<Vec<_>>();
        let moments = planes.iter().zip(known).map(|(plane, known)| {
            let plane = plane.as_ref()?;
            Some(PlaneMoments::of(known, plane.axes.map(|axis| axis.into_inner() / plane.unit)))
        });
        let moments: Vec<Option<PlaneMoments>> = moments.collect();
        let fits: Vec<Option<(f64, f64, f64)>> = match method {
            CircleMethod::Taubin => {
                let matrix =
                    |moments: &Option<PlaneMoments>| moments.as_ref().map_or_else(Matrix3::zeros, taubin_matrix);
                let axes = lanes::principal_axes(&moments.iter().map(matrix).collect::<Vec<_>>());
                moments.iter().zip(axes).map(|(moments, axes)| taubin_of(moments.as_ref()?, &axes[2].1)).collect()
            }
            CircleMethod::Kasa => moments.iter().map(|moments| kasa(moments.as_ref()?)).collect(),
        };
        planes
            .iter()
            .zip(known)
            .zip(fits)
            .map(|((plane, known), fit)| Some(plane.as_ref()?.circle(known.mean, fit?)))
            .collect()
    }

    /// Places a point on the unit circle: (x, y) of thesis equations (38) and (39).
    pub fn on_unit_circle(&self, point: &Point3<f64>) -> (f64, f64) {
        let d = (point - self.centre) / self.radius;
        (self.x_axis.dot(&d), self.normal.cross(&self.x_axis).dot(&d))
    }
}

/// Means of products of plane coordinates `x`, `y` about the centroid, and of `z = x² + y²` less its mean.
#[derive(Debug, Clone, Copy)]
struct PlaneMoments {
    /// Mean of `x² + y²`.
    square: f64,
    xx: f64,
    xy: f64,
    yy: f64,
    xz: f64,
    yz: f64,
    zz: f64,
}

impl PlaneMoments {
    /// Of a feature, with coordinates along two axes, which are unit vectors over the unit of length.
    fn of(known: &Summary, [x, y]: [Vector3<f64>; 2]) -> Self {
        let form = x * x.transpose() + y * y.transpose();
        let (cubic, quartic) = known.by_form(&form);
        let [of_x, of_y] = [x, y].map(|axis| known.covariance * axis);
        let (xx, xy, yy) = (x.dot(&of_x), x.dot(&of_y), y.dot(&of_y));
        let square = xx + yy;
        Self { square, xx, xy, yy, xz: x.dot(&cubic), yz: y.dot(&cubic), zz: quartic - square * square }
    }
}

/// The plane in which a trajectory spreads most.
struct Plane {
    axes: [Unit<Vector3<f64>>; 2],
    /// Unit of length: the spread, so that squares and fourth powers are of one size.
    unit: f64,
}

impl Plane {
    /// By the trace of the covariance and its principal axes; `None` where the spread is rounding of coordinates.
    fn of(spread: f64, magnitude: f64, axes: &[(f64, Unit<Vector3<f64>>); 3]) -> Option<Self> {
        let [(_, x_axis), (_, y_axis), _] = *axes;
        (spread > (ROUNDING * magnitude).powi(2)).then(|| Self { axes: [x_axis, y_axis], unit: spread.sqrt() })
    }

    /// The circle with a centre and a radius in the plane, in its unit from the centroid.
    fn circle(&self, centroid: Vector3<f64>, (x, y, radius): (f64, f64, f64)) -> Circle {
        let [x_axis, y_axis] = self.axes;
        let centre = Point3::from(centroid + (x_axis.scale(x) + y_axis.scale(y)) * self.unit);
        Circle { centre, normal: Unit::new_normalize(x_axis.cross(&y_axis)), radius: radius * self.unit, x_axis }
    }
}

/// Centre and radius from points whose centroid is the origin and whose mean square distance from it is 1.
pub(super) fn taubin(points: impl Iterator<Item = (f64, f64)> + Clone, count: f64) -> Option<(f64, f64, f64)> {
    let moments = moments(points, count);
    taubin_of(&moments, &principal_axes(taubin_matrix(&moments))[2].1)
}

/// The matrix whose least eigenvector is Taubin's circle.
fn taubin_matrix(moments: &PlaneMoments) -> Matrix3<f64> {
    let PlaneMoments { square, xx, xy, yy, xz, yz, zz } = *moments;
    let scale = 1.0 / (2.0 * square.sqrt());
    let (xz, yz, zz) = (scale * xz, scale * yz, scale * scale * zz);
    Matrix3::new(zz, xz, yz, xz, xx, xy, yz, xy, yy)
}

fn taubin_of(moments: &PlaneMoments, least: &Vector3<f64>) -> Option<(f64, f64, f64)> {
    let a = least[0] / (2.0 * moments.square.sqrt());
    let (b, c) = (least[1], least[2]);
    finite(-b / (2.0 * a), -c / (2.0 * a), (b * b + c * c + 4.0 * a * a * moments.square).sqrt() / (2.0 * a.abs()))
}

/// As [`taubin`], by Kåsa's normal equations `2 M c = (Mxz, Myz)`.
fn kasa(moments: &PlaneMoments) -> Option<(f64, f64, f64)> {
    let PlaneMoments { xx, xy, yy, xz, yz, .. } = *moments;
    let determinant = 2.0 * (xx * yy - xy * xy);
    let (x, y) = ((xz * yy - yz * xy) / determinant, (yz * xx - xz * xy) / determinant);
    finite(x, y, (x * x + y * y + xx + yy).sqrt())
}

/// Moments of points whose centroid is the origin.
fn moments(points: impl Iterator<Item = (f64, f64)> + Clone, count: f64) -> PlaneMoments {
    let square = points.clone().map(|(x, y)| x * x + y * y).sum::<f64>() / count;
    let row = |(x, y): (f64, f64)| Vector3::new(x, y, x * x + y * y - square);
    let sum = points.map(row).map(|r| r * r.transpose()).sum::<Matrix3<f64>>() / count;
    PlaneMoments { square, xx: sum.m11, xy: sum.m12, yy: sum.m22, xz: sum.m13, yz: sum.m23, zz: sum.m33 }
}

fn finite(x: f64, y: f64, radius: f64) -> Option<(f64, f64, f64)> {
    (x.is_finite() && y.is_finite() && radius <= STRAIGHT).then_some((x, y, radius))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding through squares and fourth powers, metres on a circle of 0.4 m.
    const EXACT: f64 = 1e-9;

    fn arc(degrees: f64, wobble: f64) -> Vec<Point3<f64>> {
        let turn = nalgebra::Rotation3::new(Vector3::new(0.4, -0.8, 0.3));
        (0..40)
            .map(|i| {
                let angle = (degrees * f64::from(i) / 39.0).to_radians();
                let r = 0.4 + wobble * f64::from(i * i).sin();
                turn * Point3::new(r * angle.cos() + 1.0, r * angle.sin(), 2.0)
            })
            .collect()
    }

    #[test]
    fn exact_arcs_give_their_circle() {
        let turn = nalgebra::Rotation3::new(Vector3::new(0.4, -0.8, 0.3));
        for degrees in [5.0, 20.0, 90.0, 360.0] {
            for method in [CircleMethod::Taubin, CircleMethod::Kasa] {
                let circle = Circle::through(&arc(degrees, 0.0), method).expect("a circle");
                let off = nalgebra::distance(&circle.centre, &(turn * Point3::new(1.0, 0.0, 2.0)));
                assert!(off < EXACT && (circle.radius - 0.4).abs() < EXACT, "{degrees}° {method:?}: {off:e}");
                assert!(circle.normal.cross(&(turn * Vector3::z())).norm() < EXACT);
            }
        }
    }

    #[test]
    fn kasa_shrinks_short_noisy_arcs_and_taubin_hardly() {
        let [taubin, kasa] = [CircleMethod::Taubin, CircleMethod::Kasa]
            .map(|method| Circle::through(&arc(25.0, 0.004), method).expect("a circle").radius);
        assert!(kasa < taubin && kasa < 0.38 && (taubin - 0.4).abs() < 0.03, "{kasa} {taubin}");
    }

    #[test]
    fn straight_and_still_trajectories_have_no_circle() {
        let line: Vec<_> = (0..9).map(|i| Point3::from(Vector3::new(0.1, 0.2, -0.3) * f64::from(i))).collect();
        assert_eq!(Circle::through(&line, CircleMethod::Taubin), None);
        assert_eq!(Circle::through(&[Point3::new(0.3, 0.1, 7.0); 5], CircleMethod::Taubin), None);
    }
}
