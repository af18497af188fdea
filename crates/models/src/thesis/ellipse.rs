//! Ellipses through trajectories: in parallel planes, alike in the ratio and the direction of their axes.

use jointscope_motion::Trajectory;
use nalgebra::{Matrix2, Matrix3, Point3, Unit, Vector2, Vector3};

use super::{circle::taubin, principal_axes};

/// Logarithm of the least ratio of axes that is looked for, halved: a tenth.
const FLATTEST: f64 = 1.15;
/// Stretches and directions with which fits begin, and samples of a feature that are looked at there.
const STRETCHES: usize = 11;
const DIRECTIONS: usize = 12;
const GLANCE: usize = 24;
/// Iterations of a fit, and step of a stretch by which derivatives are taken.
const ITERATIONS: usize = 40;
const STEP: f64 = 1e-4;
/// Damping beyond which no step helps, and step at which the fit has settled.
const STUCK: f64 = 1e8;
const SETTLED: f64 = 1e-10;
/// Correlation of successive residuals that is believed at most.
const CORRELATED: f64 = 0.98;

/// Ellipses in parallel planes, of one ratio of their axes, whose long axes have one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Ellipses {
    /// Unit normal of the planes.
    pub normal: Unit<Vector3<f64>>,
    /// Unit direction of the long axes.
    pub long_axis: Unit<Vector3<f64>>,
    /// Short over long axis, at most 1.
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
    /// common to all turns ellipses into circles, which are fitted by Taubin's method; of all stretches, the one with
    /// the least sum of squared Sampson distances `f/|∇f|` counts, `f = |S (p - c)| - r`.
    ///
    /// # References
    /// G. Taubin, IEEE PAMI 13 (1991); P. D. Sampson, Comput. Graph. Image Process. 18 (1982).
    pub fn through(tracks: &[Trajectory<'_>]) -> Option<Self> {
        let arcs = Arcs::of(tracks)?;
        let glance = arcs.thinned(GLANCE);
        let begin = (0..STRETCHES * DIRECTIONS)
            .map(|k| {
                let stretch = FLATTEST * (k / DIRECTIONS) as f64 / STRETCHES as f64;
                let angle = std::f64::consts::TAU * (k % DIRECTIONS) as f64 / DIRECTIONS as f64;
                Vector2::new(angle.cos(), angle.sin()) * stretch
            })
            .filter_map(|shape| Some((shape, glance.cost(&shape)?)))
            .min_by(|a, b| a.1.total_cmp(&b.1))?
            .0;
        let circles = arcs.fit(&Vector2::zeros())?;
        let ellipses = arcs.polished(begin)?;
        let significance = significance(&circles, &ellipses);
        Some(arcs.in_space(ellipses, significance))
    }

    /// Gradients of the coordinates in which the ellipses are circles, counted from the long axis: the angle of a place
    /// in these is its eccentric angle.
    pub fn circular(&self) -> (Vector3<f64>, Vector3<f64>) {
        let short = self.normal.cross(&self.long_axis);
        (self.long_axis.into_inner(), short / self.ratio)
    }
}

/// Trajectories in their plane, each about its centroid, in units of their spread.
struct Arcs {
    x: Unit<Vector3<f64>>,
    y: Unit<Vector3<f64>>,
    unit: f64,
    centroids: Vec<Point3<f64>>,
    points: Vec<Vec<Vector2<f64>>>,
    /// Whether a trajectory is more than a straight line.
    bent: Vec<bool>,
}

/// Ellipses in units of the arcs.
struct Fitted {
    /// Logarithm of the stretch `S = exp [[a, b], [b, -a]]`, as (a, b).
    shape: Vector2<f64>,
    /// Centre, radius after the stretch, and distances; one for each arc that is bent.
    each: Vec<(Vector2<f64>, f64, Vec<f64>)>,
}

impl Fitted {
    fn cost(&self) -> f64 {
        self.distances().map(|d| d * d).sum()
    }

    fn distances(&self) -> impl Iterator<Item = f64> + '_ {
        self.each.iter().flat_map(|(_, _, distances)| distances.iter().copied())
    }
}

fn stretch(shape: &Vector2<f64>) -> Matrix2<f64> {
    let size = shape.norm();
    // sinh(x)/x is 1 at 0.
    let share = if size > 0.0 { size.sinh() / size } else { 1.0 };
    Matrix2::identity() * size.cosh() + Matrix2::new(shape.x, shape.y, shape.y, -shape.x) * share
}

impl Arcs {
    fn of(tracks: &[Trajectory<'_>]) -> Option<Self> {
        let centroid = |track: &Trajectory<'_>| {
            Point3::from(track.points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / track.points.len() as f64)
        };
        let centroids: Vec<Point3<f64>> = tracks.iter().map(centroid).collect();
        let offsets = |(track, centroid): (&Trajectory<'_>, &Point3<f64>)| -> Vec<Vector3<f64>> {
            track.points.iter().map(|p| p - centroid).collect()
        };
        let offsets: Vec<Vec<Vector3<f64>>> = tracks.iter().zip(&centroids).map(offsets).collect();
        let count = offsets.iter().map(Vec::len).sum::<usize>() as f64;
        let covariance = offsets.iter().flatten().map(|d| d * d.transpose()).sum::<Matrix3<f64>>() / count;
        let unit = covariance.trace().sqrt();
        if !(unit > 0.0 && unit.is_finite()) {
            return None;
        }
        let [(_, x), (_, y), _] = principal_axes(covariance);
        let flat = |d: &Vector3<f64>| Vector2::new(x.dot(d), y.dot(d)) / unit;
        let points: Vec<Vec<Vector2<f64>>> = offsets.iter().map(|all| all.iter().map(flat).collect()).collect();
        let bent: Vec<bool> = points.iter().map(|arc| circle(arc.iter().copied()).is_some()).collect();
        bent.contains(&true).then_some(Self { x, y, unit, centroids, points, bent })
    }

    /// The same with at most so many samples of each arc.
    fn thinned(&self, most: usize) -> Self {
        let thin = |arc: &Vec<Vector2<f64>>| -> Vec<Vector2<f64>> {
            let kept: Vec<_> = arc.iter().step_by(arc.len().div_ceil(most).max(1)).copied().collect();
            let centroid = kept.iter().sum::<Vector2<f64>>() / kept.len() as f64;
            kept.iter().map(|p| p - centroid).collect()
        };
        Self {
            points: self.points.iter().map(thin).collect(),
            centroids: self.centroids.clone(),
            bent: self.bent.clone(),
            ..*self
        }
    }

    fn fit(&self, shape: &Vector2<f64>) -> Option<Fitted> {
        if shape.norm() > FLATTEST {
            return None;
        }
        let stretch = stretch(shape);
        let ellipse = |arc: &Vec<Vector2<f64>>| {
            let (centre, radius) = circle(arc.iter().map(|p| stretch * p))?;
            let distance = |p: &Vector2<f64>| {
                let d = stretch * p - centre;
                let length = d.norm();
                // The stretch is symmetric, so that the gradient of |S p| is S d/|d|.
                let slope = (stretch * d).norm() / length.max(f64::MIN_POSITIVE);
                (length - radius) / slope.max((-FLATTEST).exp())
            };
            Some((centre, radius, arc.iter().map(distance).collect()))
        };
        let bent = self.points.iter().zip(&self.bent).filter(|(_, bent)| **bent);
        Some(Fitted { shape: *shape, each: bent.map(|(arc, _)| ellipse(arc)).collect::<Option<_>>()? })
    }

    fn cost(&self, shape: &Vector2<f64>) -> Option<f64> {
        Some(self.fit(shape)?.cost())
    }

    /// The best ellipses near a shape, by damped Gauss-Newton steps; circles are fitted anew in each of them.
    fn polished(&self, begin: Vector2<f64>) -> Option<Fitted> {
        let mut best = self.fit(&begin)?;
        let mut damping = 1e-3;
        for _ in 0..ITERATIONS {
            let near = |dx: f64, dy: f64| self.fit(&(best.shape + Vector2::new(dx, dy)));
            let (Some(east), Some(west)) = (near(STEP, 0.0), near(-STEP, 0.0)) else { break };
            let (Some(north), Some(south)) = (near(0.0, STEP), near(0.0, -STEP)) else { break };
            let (mut normal, mut gradient) = (Matrix2::zeros(), Vector2::zeros());
            let along = east.distances().zip(west.distances()).zip(north.distances().zip(south.distances()));
            for (distance, ((e, w), (n, s))) in best.distances().zip(along) {
                let slope = Vector2::new(e - w, n - s) / (2.0 * STEP);
                normal += slope * slope.transpose();
                gradient += slope * distance;
            }
            let step = loop {
                let damped =
                    normal + Matrix2::from_diagonal(&normal.diagonal().map(|x| damping * x + f64::MIN_POSITIVE));
                let step = -(damped.try_inverse()? * gradient);
                match self.fit(&(best.shape + step)) {
                    Some(next) if next.cost() < best.cost() => {
                        best = next;
                        damping = (damping / 10.0).max(1e-9);
                        break Some(step);
                    }
                    _ if damping > STUCK => break None,
                    _ => damping *= 10.0,
                }
            };
            if step.is_none_or(|step| step.norm() < SETTLED) {
                break;
            }
        }
        Some(best)
    }

    fn in_space(&self, fitted: Fitted, significance: f64) -> Ellipses {
        let shape = fitted.shape;
        let count = fitted.distances().count() as f64;
        let residual = (fitted.cost() / count).sqrt() * self.unit;
        let (larger, unstretch) = (shape.norm().exp(), stretch(&-shape));
        // The stretch is largest at half the angle of the shape: there is the short axis.
        let short = shape.y.atan2(shape.x) / 2.0;
        let in_space = |v: Vector2<f64>| self.x.scale(v.x) + self.y.scale(v.y);
        let mut bent = fitted.each.into_iter();
        let each = self.centroids.iter().zip(&self.bent).map(|(centroid, is_bent)| {
            let (centre, radius, distances) = is_bent.then(|| bent.next())??;
            Some(Ellipse {
                centre: centroid + in_space(unstretch * centre) * self.unit,
                long: radius * larger * self.unit,
                distances: distances.into_iter().map(|d| d * self.unit).collect(),
            })
        });
        Ellipses {
            normal: Unit::new_normalize(self.x.cross(&self.y)),
            long_axis: Unit::new_normalize(in_space(Vector2::new(-short.sin(), short.cos()))),
            ratio: larger.powi(-2),
            each: each.collect(),
            significance,
            residual,
        }
    }
}

/// Centre and radius of Taubin's circle through points whose centroid is the origin.
fn circle(points: impl Iterator<Item = Vector2<f64>> + Clone) -> Option<(Vector2<f64>, f64)> {
    let (sum, count) = points.clone().fold((0.0, 0.0), |(sum, count), p| (sum + p.norm_squared(), count + 1.0));
    let unit = f64::sqrt(sum / f64::max(count, 1.0));
    if unit <= 0.0 {
        return None;
    }
    let (x, y, radius) = taubin(points.map(|p| (p.x / unit, p.y / unit)), count)?;
    Some((Vector2::new(x, y) * unit, radius * unit))
}

/// By how many standard deviations ellipses explain the distances better than circles; drifting errors count for less.
fn significance(circles: &Fitted, ellipses: &Fitted) -> f64 {
    /// Mean square of distances, in the squared spread, that rounding explains.
    const ROUNDING: f64 = 1e-24;
    let (before, after) = (circles.cost(), ellipses.cost());
    let gained = before - after;
    let count = ellipses.distances().count() as f64;
    if gained <= ROUNDING * count {
        return 0.0;
    }
    let freedom = (count - 3.0 * ellipses.each.len() as f64 - 2.0).max(1.0);
    let (mut square, mut product) = (0.0, 0.0);
    for (_, _, distances) in &ellipses.each {
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
        for ratio in [0.15, 0.4, 0.7, 0.95] {
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
