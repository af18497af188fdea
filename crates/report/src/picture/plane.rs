//! The plane of a picture, its units, its clock, and lines in it.

use jointscope_detection::JointKind;
use jointscope_motion::Recording;
use nalgebra::{Matrix3, Point3, Vector3};

use super::chart::range;
use crate::pair_view::{PairView, Trajectory, middle};

/// When frames are: seconds where times are known, else frames.
pub(super) struct Clock<'r> {
    times: Option<&'r [f64]>,
    frames: usize,
}

impl<'r> Clock<'r> {
    pub(super) fn of(recording: &'r Recording) -> Self {
        Self { times: recording.times(), frames: recording.frames() }
    }

    pub(super) fn at(&self, frame: usize) -> f64 {
        self.times.map_or(frame as f64, |times| times[frame] - times[0])
    }

    pub(super) fn axis(&self) -> ([f64; 2], &'static str) {
        let last = self.at(self.frames.saturating_sub(1));
        ([0.0, last.max(1e-9)], if self.times.is_some() { "time [s]" } else { "frame" })
    }
}

/// A length's unit by its size: factor from metres, and name.
pub(super) fn unit(length: f64) -> (f64, &'static str) {
    if length < 0.5 { (1e3, "mm") } else { (1.0, "m") }
}

/// The directions in which points spread most, second and least, as columns.
pub(super) fn spread<'p>(points: impl Iterator<Item = &'p Point3<f64>> + Clone) -> Matrix3<f64> {
    let count = points.clone().count().max(1) as f64;
    let centre = points.clone().map(|point| point.coords).sum::<Vector3<f64>>() / count;
    let scatter: Matrix3<f64> = points.map(|point| point.coords - centre).map(|x| x * x.transpose()).sum();
    let eigen = scatter.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    // Signs of eigenvectors are arbitrary: the largest coordinate is positive.
    let column = |k: usize| {
        let column = eigen.eigenvectors.column(order[k]).into_owned();
        column * column[column.iamax()].signum()
    };
    Matrix3::from_columns(&[column(0), column(1), column(2)])
}

/// The plane of a picture.
pub(super) struct Plane {
    pub(super) origin: Point3<f64>,
    pub(super) across: Vector3<f64>,
    pub(super) up: Vector3<f64>,
}

impl Plane {
    pub(super) fn at(&self, point: &Point3<f64>) -> [f64; 2] {
        let from = point - self.origin;
        [from.dot(&self.across), from.dot(&self.up)]
    }

    /// Where the joint is seen best: along the axis of a turn, from the side of a slide, else where most is seen.
    pub(super) fn of(view: &PairView) -> Self {
        let main = spread(view.points());
        let centre = Point3::from(
            view.points().map(|point| point.coords).sum::<Vector3<f64>>() / view.points().count().max(1) as f64,
        );
        let found = view.axis.filter(|_| view.kind.connects());
        match (found.and_then(|axis| Some((axis, axis.direction?))), view.kind) {
            (Some((axis, direction)), JointKind::Prismatic) => {
                let stilled = view.stilled().unwrap_or_default();
                let centred = centred(&stilled);
                let side = spread(centred.iter().flatten().map(|(_, point)| point));
                let flat = |v: Vector3<f64>| v - direction.into_inner() * direction.dot(&v);
                let up = [0, 1, 2].map(|k| flat(side.column(k).into_owned()));
                let up = up.into_iter().find(|v| v.norm() > 0.5).unwrap_or_else(|| flat(main.column(2).into_owned()));
                Self { origin: axis.point, across: direction.into_inner(), up: up.normalize() }
            }
            (Some((axis, direction)), _) => {
                let z = direction.into_inner();
                let flat = |v: Vector3<f64>| v - z * z.dot(&v);
                let x = flat(Vector3::ith(z.iamin(), 1.0)).normalize();
                Self { origin: axis.point, across: x, up: z.cross(&x) }
            }
            (None, _) => {
                let origin = found.map_or(centre, |axis| axis.point);
                Self { origin, across: main.column(0).into_owned(), up: main.column(1).into_owned() }
            }
        }
    }
}

/// Every trajectory about its own middle.
pub(super) fn centred(ways: &[Trajectory]) -> Vec<Trajectory> {
    let about = |way: &Trajectory| {
        let middle = middle(way);
        way.iter().map(|(frame, point)| (*frame, Point3::from(point - middle))).collect()
    };
    ways.iter().map(about).collect()
}

/// A range that holds values, but for the wildest, and one that it must hold.
pub(super) fn framed(values: impl Iterator<Item = f64>, within: Option<f64>) -> [f64; 2] {
    let mut values: Vec<f64> = values.collect();
    if values.is_empty() {
        return [0.0, 1.0];
    }
    let [low, high] = [0.01, 0.99].map(|share| jointscope_motion::quantile(&mut values, share));
    let near = (high - low) * 0.25;
    let tame = values.into_iter().filter(|x| *x >= low - near && *x <= high + near);
    range(tame.chain(within), 0.07)
}

/// The points of a way as a line, broken where the feature is not seen for long, or leaps.
pub(super) fn joined<'w>(
    way: &'w Trajectory,
    whole: &[Trajectory],
    place: impl Fn(&(usize, Point3<f64>)) -> [f64; 2] + 'w,
) -> impl Iterator<Item = Option<[f64; 2]>> + 'w {
    let longest = whole.iter().map(Vec::len).max().unwrap_or(1);
    // Thinning leaves gaps of its own.
    let usual = 3 * longest.div_ceil(way.len().max(1)).max(2);
    let mut steps: Vec<f64> = way.windows(2).map(|pair| nalgebra::distance(&pair[0].1, &pair[1].1)).collect();
    let leap = if steps.is_empty() { 0.0 } else { 6.0 * jointscope_motion::quantile(&mut steps, 0.9) };
    let leap = leap + f64::MIN_POSITIVE;
    way.iter().enumerate().flat_map(move |(k, sample)| {
        let before = k.checked_sub(1).map(|k| &way[k]);
        let apart = |&(frame, point): &(usize, Point3<f64>)| {
            sample.0 - frame > usual || nalgebra::distance(&point, &sample.1) > leap
        };
        [before.is_some_and(apart).then_some(None), Some(Some(place(sample)))].into_iter().flatten()
    })
}
