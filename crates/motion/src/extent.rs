//! Lengths of trajectories: paths and extents.

mod in_lanes;

pub(crate) use in_lanes::FarEnds;
pub use in_lanes::{Extents, extent_of_rows, farthest_of_rows, path_length_of_rows};

use nalgebra::{Point3, distance, distance_squared};

/// Points in a block at the bottom of the hierarchy.
const BLOCK: usize = 16;

/// Largest distance between any two of the points, in the unit of the points; 0 for fewer than two.
///
/// Exact. Neighbours in time are neighbours in space, so blocks of successive points have small boxes, and boxes of
/// boxes too; a pair of boxes is opened only if points at their far corners could beat the best distance found. The
/// cost grows about linearly with the points, also on full circles, where every point has an opposite one.
///
/// # References
/// Thesis section 5.2: the length of a trajectory.
pub fn extent(points: &[Point3<f64>]) -> f64 {
    let Some(first) = points.first() else { return 0.0 };
    let farthest_from = |from: &Point3<f64>| {
        points
            .iter()
            .map(|p| (distance_squared(from, p), p))
            .fold((0.0, *first), |far, (d, p)| if d > far.0 { (d, *p) } else { far })
    };
    let mut best = farthest_from(&farthest_from(first).1).0;
    let levels = hierarchy(points);
    let mut open = vec![(levels.len() - 1, 0, 0)];
    while let Some((level, i, j)) = open.pop() {
        if levels[level][i].farthest_squared(&levels[level][j]) <= best {
            continue;
        }
        if level > 0 {
            let below = levels[level - 1].len();
            let children = |k: usize| 2 * k..(2 * k + 2).min(below);
            open.extend(
                children(i).flat_map(|a| children(j).map(move |b| (level - 1, a, b))).filter(|(_, a, b)| a <= b),
            );
        } else {
            let block = |k: usize| &points[k * BLOCK..((k + 1) * BLOCK).min(points.len())];
            best = block(i).iter().flat_map(|p| block(j).iter().map(|q| distance_squared(p, q))).fold(best, f64::max);
        }
    }
    best.sqrt()
}

/// An axis-aligned box.
#[derive(Clone, Copy)]
struct Extremes {
    least: Point3<f64>,
    most: Point3<f64>,
}

impl Extremes {
    fn around(parts: impl Iterator<Item = Self>) -> Self {
        let nothing = Self { least: Point3::from([f64::INFINITY; 3]), most: Point3::from([f64::NEG_INFINITY; 3]) };
        parts.fold(nothing, |a, b| Self { least: a.least.inf(&b.least), most: a.most.sup(&b.most) })
    }

    /// Squared distance that no two points of the boxes exceed.
    fn farthest_squared(&self, other: &Self) -> f64 {
        (self.most - other.least).sup(&(other.most - self.least)).norm_squared()
    }
}

/// Boxes of blocks of points, boxes of pairs of these, and so on up to one box of all.
fn hierarchy(points: &[Point3<f64>]) -> Vec<Vec<Extremes>> {
    let of_points = |block: &[Point3<f64>]| Extremes::around(block.iter().map(|&p| Extremes { least: p, most: p }));
    let mut levels = vec![points.chunks(BLOCK).map(of_points).collect::<Vec<_>>()];
    while levels[levels.len() - 1].len() > 1 {
        let below = &levels[levels.len() - 1];
        levels.push(below.chunks(2).map(|pair| Extremes::around(pair.iter().copied())).collect());
    }
    levels
}

/// Length of the polyline through the points, in the unit of the points.
pub fn path_length(points: &[Point3<f64>]) -> f64 {
    points.windows(2).map(|pair| distance(&pair[0], &pair[1])).sum()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn the_extent_equals_the_largest_of_all_distances() {
        let wild = |s: f64| Point3::new((s * 0.7).sin() * s, (s * 1.3).cos() * 3.0, (s * 0.1).sin() * 20.0);
        let circle = |s: f64| Point3::new((s * 0.01).cos(), (s * 0.01).sin(), 1e-3 * (s * s).sin());
        let arc = |s: f64| Point3::new((0.3 * s).sin().cos(), (0.3 * s).sin().sin(), 1e-3 * (s * s).sin());
        let line = |s: f64| Point3::new((0.03 * s).sin(), 1e-3 * (7.0 * s).sin(), 1e-3 * (s * s).sin());
        for place in [&wild as &dyn Fn(f64) -> Point3<f64>, &circle, &arc, &line] {
            for count in [2, 15, 16, 17, 60, 700] {
                let points: Vec<_> = (0..count).map(|i| place(f64::from(i))).collect();
                let all = points.iter().flat_map(|p| points.iter().map(move |q| distance(p, q)));
                assert_eq!(extent(&points), all.fold(0.0, f64::max), "{count} points");
                let rows = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).collect::<Vec<_>>());
                let rows = [&rows[0][..], &rows[1], &rows[2]];
                let in_lanes = |d: Vector3<f64>| d.z.mul_add(d.z, d.y.mul_add(d.y, d.x * d.x)).sqrt();
                let all = points.iter().flat_map(|p| points.iter().map(move |q| in_lanes(p - q)));
                assert_eq!(extent_of_rows(rows), all.fold(0.0, f64::max), "{count} points in lanes");
                let far = |k: usize| distance(&points[0], &points[k]);
                let farthest = far(farthest_of_rows(rows, &points[0]));
                assert!((0..points.len()).all(|k| far(k) <= farthest * (1.0 + 1e-15)), "{count} points in lanes");
                let off = (path_length_of_rows(rows, points.len()) / path_length(&points) - 1.0).abs();
                assert!(off < 1e-13, "the path of {count} points in lanes: {off:e}");
            }
        }
    }

    #[test]
    fn degenerate_sets_have_no_extent() {
        assert_eq!(extent(&[]), 0.0);
        assert_eq!(extent(&[Point3::new(1., 2., 3.)]), 0.0);
        assert_eq!(extent(&[Point3::new(1., 2., 3.); 5]), 0.0);
        assert_eq!(path_length(&[]), 0.0);
        assert_eq!((extent_of_rows([&[]; 3]), path_length_of_rows([&[]; 3], 0)), (0.0, 0.0));
        assert_eq!((extent_of_rows([&[1.0; 5]; 3]), path_length_of_rows([&[1.0; 5]; 3], 5)), (0.0, 0.0));
    }

    #[test]
    fn a_path_sums_its_steps() {
        assert_eq!(path_length(&[Point3::origin(), Point3::new(3., 4., 0.), Point3::origin()]), 10.0);
    }
}
