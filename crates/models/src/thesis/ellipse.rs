//! Ellipses through trajectories: in parallel planes, alike in the ratio and the direction of their axes.

use jointscope_motion::Trajectory;
use nalgebra::{Point3, Unit, Vector2, Vector3};

use super::arcs::{Arcs, Curve, Fitted, stretch};

/// Mean square of distances, in the squared spread, that rounding explains.
const ROUNDING: f64 = 1e-24;
/// Correlation of successive residuals that is believed at most.
const CORRELATED: f64 = 0.98;

/// Ellipses in parallel planes, of one ratio of their axes, whose long axes have one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Ellipses {
    /// Unit normal of the planes.
    pub normal: Unit<Vector3<f64>>,
    /// Unit direction of the long axes.
    pub long_axis: Unit<Vector3<f64>>,
    /// Short over long axis: 0.2 to 1.
    pub ratio: f64,
    /// One of each trajectory, in their order; `None` for those that are straight.
    pub each: Vec<Option<Ellipse>>,
    /// How much better than circles they are: root of the fall of the squared distances, in variances of the distance
    /// that remains, where samples whose distances drift count as fewer. Of circles, the square is `χ²` of 2 degrees of
    /// freedom; infinite where nothing remains.
    pub significance: f64,
    /// Root mean square distance of the samples from the ellipses, in the planes, metres.
    pub residual: f64,
}

/// The ellipse of one trajectory.
#[derive(Debug, Clone, PartialEq)]
pub struct Ellipse {
    /// Centre, metres.
    pub centre: Point3<f64>,
    /// Long semi-axis, metres.
    pub long: f64,
    /// Distance of each sample from the ellipse, in its plane, metres; positive outside.
    pub distances: Vec<f64>,
}

impl Ellipses {
    /// The ellipses through trajectories of three samples or more; `None` where all of these are straight.
    ///
    /// The normal is that of the plane of least squares of all trajectories, each about its own centroid. A stretch
    /// common to all turns ellipses into circles, for which fits begin with Taubin's. Stretch, centres and radii minimise
    /// the squared Sampson distances `f/|∇f|` of all samples, `f = |S p - c| - r`.
    ///
    /// # References
    /// G. Taubin, IEEE PAMI 13 (1991); P. D. Sampson, Comput. Graph. Image Process. 18 (1982).
    pub fn through(tracks: &[Trajectory<'_>]) -> Option<Self> {
        let arcs = Arcs::of(tracks)?;
        let ellipses = arcs.ellipses()?;
        let significance = significance(&arcs.circles()?, &ellipses);
        Some(Self::in_space(&arcs, ellipses, significance))
    }

    /// Gradients of the coordinates in which the ellipses are circles, counted from the long axis: the angle of a place
    /// in these is its eccentric angle.
    pub fn circular(&self) -> (Vector3<f64>, Vector3<f64>) {
        let short = self.normal.cross(&self.long_axis);
        (self.long_axis.into_inner(), short / self.ratio)
    }

    fn in_space(arcs: &Arcs, fitted: Fitted, significance: f64) -> Self {
        let shape = fitted.shape;
        let count = fitted.count() as f64;
        let residual = (fitted.cost() / count).sqrt() * arcs.unit;
        let (larger, unstretch) = (shape.norm().exp(), stretch(&-shape));
        // The stretch is largest at half the angle of the shape: there is the short axis.
        let short = shape.y.atan2(shape.x) / 2.0;
        let in_space = |v: Vector2<f64>| arcs.x.scale(v.x) + arcs.y.scale(v.y);
        let mut bent = fitted.each.into_iter();
        let each = arcs.centroids.iter().zip(&arcs.is_bent).map(|(centroid, is_bent)| {
            let Curve { centre, radius, distances } = is_bent.then(|| bent.next())??;
            Some(Ellipse {
                centre: centroid + in_space(unstretch * centre) * arcs.unit,
                long: radius * larger * arcs.unit,
                distances: distances.into_iter().map(|d| d * arcs.unit).collect(),
            })
        });
        Self {
            normal: Unit::new_normalize(arcs.x.cross(&arcs.y)),
            long_axis: Unit::new_normalize(in_space(Vector2::new(-short.sin(), short.cos()))),
            ratio: larger.powi(-2),
            each: each.collect(),
            significance,
            residual,
        }
    }
}

/// How much better than circles ellipses are; see [`Ellipses::significance`].
fn significance(circles: &Fitted, ellipses: &Fitted) -> f64 {
    let (before, after) = (circles.cost(), ellipses.cost());
    let gained = before - after;
    let count = ellipses.count() as f64;
    if gained <= ROUNDING * count {
        return 0.0;
    }
    let freedom = (count - 3.0 * ellipses.each.len() as f64 - 2.0).max(1.0);
    let (mut square, mut product) = (0.0, 0.0);
    for Curve { distances, .. } in &ellipses.each {
        square += distances.iter().map(|d| d * d).sum::<f64>();
        product += distances.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>();
    }
    let drift = if square > 0.0 { (product / square).clamp(0.0, CORRELATED) } else { 0.0 };
    (gained / (after / freedom) * (1.0 - drift) / (1.0 + drift)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    /// Arcs of ellipses with semi-axes 0.4 m and `ratio` of it, and a third of that, whose long axes lie at 0.5 rad.
    fn arcs(ratio: f64, degrees: f64) -> Vec<Vec<Point3<f64>>> {
        let turn = Rotation3::new(Vector3::new(0.4, -0.8, 0.3)) * Rotation3::from_axis_angle(&Vector3::z_axis(), 0.5);
        let arc = |size: f64, height: f64| {
            let place = |i: i32| {
                let angle = (degrees * f64::from(i) / 39.0 - 20.0).to_radians();
                turn * Point3::new(size * angle.cos() + 1.0, ratio * size * angle.sin(), height)
            };
            (0..40).map(place).collect()
        };
        vec![arc(0.4, 0.0), arc(0.4 / 3.0, 0.3)]
    }

    fn through(arcs: &[Vec<Point3<f64>>]) -> Option<Ellipses> {
        let frames: Vec<usize> = (0..40).collect();
        let tracks: Vec<_> = arcs.iter().map(|points| Trajectory { frames: &frames[..points.len()], points }).collect();
        Ellipses::through(&tracks)
    }

    #[test]
    fn exact_arcs_give_their_ellipses() {
        /// Rounding through squares and fourth powers, and the end of the iteration, metres on 0.4 m.
        const EXACT: f64 = 1e-7;
        let turn = Rotation3::new(Vector3::new(0.4, -0.8, 0.3));
        for ratio in [0.25, 0.4, 0.7, 0.95] {
            for degrees in [60.0, 100.0, 180.0, 340.0] {
                let found = through(&arcs(ratio, degrees)).expect("ellipses");
                let long_axis = turn * Vector3::new(0.5_f64.cos(), 0.5_f64.sin(), 0.0);
                let first = found.each[0].as_ref().expect("bent");
                let off = (first.centre
                    - turn * Rotation3::from_axis_angle(&Vector3::z_axis(), 0.5) * Point3::new(1.0, 0.0, 0.0))
                .norm();
                let place = format!("{ratio} over {degrees}°: {found:?}");
                assert!(off < EXACT && (first.long - 0.4).abs() < EXACT, "{place}");
                assert!((found.ratio - ratio).abs() < EXACT && found.residual < EXACT, "{place}");
                assert!(found.long_axis.cross(&long_axis).norm() < EXACT && found.significance > 1e3, "{place}");
                assert!(found.normal.cross(&(turn * Vector3::z())).norm() < EXACT, "{place}");
            }
        }
    }

    #[test]
    fn circles_are_ellipses_of_ratio_1() {
        let found = through(&arcs(1.0, 120.0)).expect("ellipses");
        assert!((found.ratio - 1.0).abs() < 1e-7 && found.significance == 0.0, "{found:?}");
    }

    #[test]
    fn straight_trajectories_have_no_ellipse() {
        let line: Vec<_> = (0..9).map(|i| Point3::from(Vector3::new(0.1, 0.2, -0.3) * f64::from(i))).collect();
        assert_eq!(through(&[line]), None);
        assert_eq!(through(&[vec![Point3::new(0.3, 0.1, 7.0); 5]]), None);
    }
}
