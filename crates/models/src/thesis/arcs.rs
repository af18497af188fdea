//! Circles, and ellipses of one shape, through plane arcs.

use jointscope_motion::Trajectory;
use nalgebra::{Matrix2, Matrix3, Matrix3x2, Point3, SymmetricEigen, Unit, Vector2, Vector3};

use super::{circle::taubin, principal_axes};

/// Half the logarithm of the least ratio of axes that is looked for, which is a fifth: flatter arcs are nearly lines.
const FLATTEST: f64 = 0.8;
/// Stretches and directions with which fits may begin, and samples of a feature that are looked at there.
const STRETCHES: usize = 6;
const DIRECTIONS: usize = 8;
const GLANCE: usize = 16;
/// Iterations of a fit, relative fall of its cost at which it has settled, and damping beyond which no step helps.
const ITERATIONS: usize = 60;
const SETTLED: f64 = 1e-14;
const STUCK: f64 = 1e8;

/// Trajectories in their plane, each about its centroid, in units of their spread.
pub(super) struct Arcs {
    pub x: Unit<Vector3<f64>>,
    pub y: Unit<Vector3<f64>>,
    pub unit: f64,
    pub centroids: Vec<Point3<f64>>,
    points: Vec<Vec<Vector2<f64>>>,
    /// Whether a trajectory is more than a straight line.
    pub is_bent: Vec<bool>,
}

/// Ellipses in units of the arcs.
pub(super) struct Fitted {
    /// Logarithm of the stretch `S = exp [[a, b], [b, -a]]`, as (a, b).
    pub shape: Vector2<f64>,
    /// One for each arc that is bent.
    pub each: Vec<Curve>,
}

impl Fitted {
    pub(super) fn cost(&self) -> f64 {
        self.each.iter().flat_map(|curve| &curve.distances).map(|d| d * d).sum()
    }

    pub(super) fn count(&self) -> usize {
        self.each.iter().map(|curve| curve.distances.len()).sum()
    }
}

/// The ellipse of an arc: a circle after the stretch.
pub(super) struct Curve {
    /// After the stretch, as the radius.
    pub centre: Vector2<f64>,
    pub radius: f64,
    /// Of the samples, before the stretch.
    pub distances: Vec<f64>,
}

impl Curve {
    fn new(arc: &[Vector2<f64>], stretch: &Matrix2<f64>, centre: Vector2<f64>, radius: f64) -> Self {
        let distances = arc.iter().map(|p| Sight::new(p, stretch, &centre).distance(radius)).collect();
        Self { centre, radius, distances }
    }
}

/// A sample as seen from the centre, after the stretch.
struct Sight {
    /// Unit direction, and length.
    outwards: Vector2<f64>,
    length: f64,
    /// Gradient of the length by the sample's place before the stretch; the stretch is symmetric.
    gradient: Vector2<f64>,
    slope: f64,
}

impl Sight {
    fn new(sample: &Vector2<f64>, stretch: &Matrix2<f64>, centre: &Vector2<f64>) -> Self {
        let d = stretch * sample - centre;
        let length = d.norm().max(f64::MIN_POSITIVE);
        let outwards = d / length;
        let gradient = stretch * outwards;
        Self { outwards, length, gradient, slope: gradient.norm().max((-FLATTEST).exp()) }
    }

    /// Sampson's distance from the ellipse.
    fn distance(&self, radius: f64) -> f64 {
        (self.length - radius) / self.slope
    }

    /// How the distance changes, where a change of stretch or centre moves the sample as seen from the centre by `by`,
    /// and the stretch itself turns the direction into `bent` more of the gradient.
    fn change(&self, distance: f64, stretch: &Matrix2<f64>, by: &Vector2<f64>, bent: &Vector2<f64>) -> f64 {
        let longer = self.outwards.dot(by);
        let turned = (by - self.outwards * longer) / self.length;
        let steeper = self.gradient.dot(&(bent + stretch * turned)) / self.slope;
        (longer - distance * steeper) / self.slope
    }
}

/// The symmetric stretch of a shape.
pub(super) fn stretch(shape: &Vector2<f64>) -> Matrix2<f64> {
    let size = shape.norm();
    // sinh(x)/x is 1 at 0.
    let share = if size > 0.0 { size.sinh() / size } else { 1.0 };
    Matrix2::identity() * size.cosh() + Matrix2::new(shape.x, shape.y, shape.y, -shape.x) * share
}

/// Derivatives of the stretch by its shape.
fn stretch_slopes(shape: &Vector2<f64>) -> [Matrix2<f64>; 2] {
    /// Central differences of functions whose third derivatives are near 1 are good to a sixth of the square.
    const STEP: f64 = 1e-5;
    [Vector2::x() * STEP, Vector2::y() * STEP]
        .map(|step: Vector2<f64>| (stretch(&(shape + step)) - stretch(&(shape - step))) / (2.0 * STEP))
}

/// Normal equations of one ellipse: of its centre and radius, of these with the shape, and right-hand side.
struct Block {
    own: Matrix3<f64>,
    shared: Matrix3x2<f64>,
    pull: Vector3<f64>,
}

impl Arcs {
    pub(super) fn of(tracks: &[Trajectory<'_>]) -> Option<Self> {
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
        let is_bent: Vec<bool> = points.iter().map(|arc| circle(arc.iter().copied()).is_some()).collect();
        is_bent.contains(&true).then_some(Self { x, y, unit, centroids, points, is_bent })
    }

    /// The circles nearest to all arcs.
    pub(super) fn circles(&self) -> Option<Fitted> {
        Some(self.settled(self.begun(&Vector2::zeros())?, false))
    }

    /// The ellipses of one shape that are nearest to all arcs.
    pub(super) fn ellipses(&self) -> Option<Fitted> {
        let shapes = self.thinned(GLANCE).glanced().into_iter().chain(self.conics());
        let starts = shapes.filter_map(|shape| self.begun(&shape));
        Some(self.settled(starts.min_by(|a, b| a.cost().total_cmp(&b.cost()))?, true))
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
            is_bent: self.is_bent.clone(),
            ..*self
        }
    }

    /// Ellipses of a shape, by Taubin's circles.
    fn begun(&self, shape: &Vector2<f64>) -> Option<Fitted> {
        let stretch = stretch(shape);
        let curve = |arc: &Vec<Vector2<f64>>| {
            let (centre, radius) = circle(arc.iter().map(|p| stretch * p))?;
            Some(Curve::new(arc, &stretch, centre, radius))
        };
        Some(Fitted { shape: *shape, each: self.bent().map(curve).collect::<Option<_>>()? })
    }

    /// The best shape of many.
    fn glanced(&self) -> Option<Vector2<f64>> {
        let shape = |k: usize| {
            let stretch = FLATTEST * (k / DIRECTIONS) as f64 / STRETCHES as f64;
            let angle = std::f64::consts::TAU * (k % DIRECTIONS) as f64 / DIRECTIONS as f64;
            Vector2::new(angle.cos(), angle.sin()) * stretch
        };
        let begun = (DIRECTIONS - 1..STRETCHES * DIRECTIONS).filter_map(|k| self.begun(&shape(k)));
        begun.min_by(|a, b| a.cost().total_cmp(&b.cost())).map(|fitted| fitted.shape)
    }

    /// The shape of the conics through all arcs that have their quadratic terms in common, by Taubin's normalisation of the
    /// algebraic distance, with the other terms eliminated; `None` unless these are ellipses.
    fn conics(&self) -> Option<Vector2<f64>> {
        let (mut scatter, mut slopes) = (Matrix3::zeros(), Matrix3::zeros());
        let squares = |p: &Vector2<f64>| Vector3::new(p.x * p.x, p.x * p.y, p.y * p.y);
        for arc in self.bent() {
            let mean = arc.iter().map(squares).sum::<Vector3<f64>>() / arc.len() as f64;
            let spread: Matrix2<f64> = arc.iter().map(|p| p * p.transpose()).sum();
            let mixed: Matrix3x2<f64> = arc.iter().map(|p| (squares(p) - mean) * p.transpose()).sum();
            let linear = mixed * spread.try_inverse()?;
            for p in arc {
                let rest = squares(p) - mean - linear * p;
                let slope = Matrix3x2::new(2.0 * p.x, 0.0, p.y, p.x, 0.0, 2.0 * p.y) - linear;
                scatter += rest * rest.transpose();
                slopes += slope * slope.transpose();
            }
        }
        let root = slopes.cholesky()?.l();
        let half = root.solve_lower_triangular(&scatter)?;
        let eigen = SymmetricEigen::new(root.solve_lower_triangular(&half.transpose())?);
        let least = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        let terms = root.transpose().solve_upper_triangular(&least)?;
        let form = Matrix2::new(terms.x, terms.y / 2.0, terms.y / 2.0, terms.z);
        let size = form.determinant();
        if size <= 0.0 {
            return None;
        }
        // The square of the stretch: cosh 2e + sinh 2e / e times the logarithm of the stretch, whose size is e.
        let square = form * (form.trace().signum() / size.sqrt());
        let twice = (square.trace() / 2.0).max(1.0).acosh();
        let share = if twice > 0.0 { twice / 2.0 / twice.sinh() } else { 0.5 };
        let shape = Vector2::new((square.m11 - square.m22) / 2.0, square.m12) * share;
        (shape.norm() <= FLATTEST).then_some(shape)
    }

    fn bent(&self) -> impl Iterator<Item = &Vec<Vector2<f64>>> {
        self.points.iter().zip(&self.is_bent).filter(|(_, is_bent)| **is_bent).map(|(arc, _)| arc)
    }

    /// The best ellipses nearby, by damped Gauss-Newton steps with centres and radii eliminated; of the same shape, unless
    /// that is `free`.
    fn settled(&self, mut best: Fitted, free: bool) -> Fitted {
        let mut damping = 1e-3;
        for _ in 0..ITERATIONS {
            let (normal, pull, blocks) = self.equations(&best);
            let before = best.cost();
            let better = loop {
                let next = self.stepped(&best, damping, free.then_some((&normal, &pull)), &blocks);
                if let Some(next) = next.filter(|next| next.cost() < before) {
                    damping = (damping / 10.0).max(1e-9);
                    break Some(next);
                }
                damping *= 10.0;
                if damping > STUCK {
                    break None;
                }
            };
            let Some(better) = better else { break };
            best = better;
            if before - best.cost() <= SETTLED * before {
                break;
            }
        }
        best
    }

    fn equations(&self, at: &Fitted) -> (Matrix2<f64>, Vector2<f64>, Vec<Block>) {
        let stretch = stretch(&at.shape);
        let slopes = stretch_slopes(&at.shape);
        let (mut normal, mut pull, mut blocks) = (Matrix2::zeros(), Vector2::zeros(), Vec::new());
        for (arc, curve) in self.bent().zip(&at.each) {
            let mut block = Block { own: Matrix3::zeros(), shared: Matrix3x2::zeros(), pull: Vector3::zeros() };
            for (sample, &distance) in arc.iter().zip(&curve.distances) {
                let sight = Sight::new(sample, &stretch, &curve.centre);
                let change = |by: Vector2<f64>, bent: Vector2<f64>| sight.change(distance, &stretch, &by, &bent);
                let [a, b] = slopes.map(|slope| change(slope * sample, slope * sight.outwards));
                let [x, y] = [-Vector2::x(), -Vector2::y()].map(|by| change(by, Vector2::zeros()));
                let (by_shape, own) = (Vector2::new(a, b), Vector3::new(x, y, -1.0 / sight.slope));
                normal += by_shape * by_shape.transpose();
                pull += by_shape * distance;
                block.own += own * own.transpose();
                block.shared += own * by_shape.transpose();
                block.pull += own * distance;
            }
            blocks.push(block);
        }
        (normal, pull, blocks)
    }

    /// Ellipses after a damped step; `None` where it leads nowhere.
    fn stepped(
        &self,
        from: &Fitted,
        damping: f64,
        shape: Option<(&Matrix2<f64>, &Vector2<f64>)>,
        blocks: &[Block],
    ) -> Option<Fitted> {
        let inverses = blocks.iter().map(|block| {
            let damped = block.own + Matrix3::from_diagonal(&(block.own.diagonal() * damping));
            Some(damped.cholesky()?.inverse())
        });
        let inverses: Vec<Matrix3<f64>> = inverses.collect::<Option<_>>()?;
        let mut turn = Vector2::zeros();
        if let Some((normal, pull)) = shape {
            let mut reduced = normal + Matrix2::from_diagonal(&(normal.diagonal() * damping));
            let mut rest = *pull;
            for (block, inverse) in blocks.iter().zip(&inverses) {
                let eliminated = block.shared.transpose() * inverse;
                reduced -= eliminated * block.shared;
                rest -= eliminated * block.pull;
            }
            turn = -(reduced.cholesky()?.solve(&rest));
        }
        let shape = from.shape + turn;
        let size = shape.norm();
        if size.is_nan() || size > FLATTEST {
            return None;
        }
        let stretch = stretch(&shape);
        let arcs = self.bent().zip(&from.each).zip(blocks).zip(&inverses);
        let each = arcs.map(|(((arc, curve), block), inverse)| {
            let step = inverse * (block.pull + block.shared * turn);
            Curve::new(arc, &stretch, curve.centre - step.xy(), curve.radius - step.z)
        });
        let each = each.collect();
        Some(Fitted { shape, each })
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
