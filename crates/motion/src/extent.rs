//! Lengths of trajectories: paths and extents.

use nalgebra::{Point3, distance, distance_squared};

/// Largest distance between any two of the points, in the unit of the points; 0 for fewer than two.
///
/// Exact. Points are visited from the outermost inwards, and a pair is measured only while the sum of its distances
/// from the centroid could beat the best found, so that elongated trajectories cost little more than one pass.
///
/// # References
/// Thesis section 5.2: the length of a trajectory.
pub fn extent(points: &[Point3<f64>]) -> f64 {
    let Some(first) = points.first() else { return 0.0 };
    let sum = points.iter().fold(nalgebra::Vector3::zeros(), |sum, p| sum + (p - first));
    let centre = first + sum / points.len() as f64;
    let mut outwards: Vec<(f64, &Point3<f64>)> = points.iter().map(|p| (distance(p, &centre), p)).collect();
    outwards.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut best = 0.0_f64;
    for (i, (radius, p)) in outwards.iter().enumerate() {
        if 2.0 * radius <= best {
            break;
        }
        let mut best_squared = best * best;
        for (other, q) in &outwards[i + 1..] {
            if radius + other <= best {
                break;
            }
            best_squared = best_squared.max(distance_squared(p, q));
        }
        best = best_squared.sqrt();
    }
    best
}

/// Length of the polyline through the points, in the unit of the points.
pub fn path_length(points: &[Point3<f64>]) -> f64 {
    points.windows(2).map(|pair| distance(&pair[0], &pair[1])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extent_equals_the_largest_of_all_distances() {
        let points: Vec<_> = (0..60)
            .map(|i| {
                let s = f64::from(i);
                Point3::new((s * 0.7).sin() * s, (s * 1.3).cos() * 3.0, (s * 0.1).sin() * 20.0)
            })
            .collect();
        let all = points.iter().flat_map(|p| points.iter().map(move |q| distance(p, q)));
        let largest = all.fold(0.0, f64::max);
        assert!((extent(&points) - largest).abs() <= 4.0 * f64::EPSILON * largest);
    }

    #[test]
    fn degenerate_sets_have_no_extent() {
        assert_eq!(extent(&[]), 0.0);
        assert_eq!(extent(&[Point3::new(1., 2., 3.)]), 0.0);
        assert_eq!(extent(&[Point3::new(1., 2., 3.); 5]), 0.0);
        assert_eq!(path_length(&[]), 0.0);
    }

    #[test]
    fn a_path_sums_its_steps() {
        assert_eq!(path_length(&[Point3::origin(), Point3::new(3., 4., 0.), Point3::origin()]), 10.0);
    }
}
