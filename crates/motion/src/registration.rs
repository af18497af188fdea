//! Registration of two point sets in closed form.

use nalgebra::{Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::Pose;

/// Thickness over length below which points count as collinear: their spread about the line is lost in rounding.
const SMALLEST_ASPECT: f64 = 1e-8;
/// Rounding of a coordinate, as a share of its magnitude, after the few operations that lead to the spread.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Aspect below which the covariance is accumulated a second time, in the axes of the cloud, where the small spread
/// no longer drowns in the rounding of the large one.
const THIN_ASPECT: f64 = 1e-2;

/// Why two point sets determine no rigid motion.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RegistrationError {
    /// Fewer than three corresponding points.
    #[error("three features that are not collinear are needed in one frame, found {found}")]
    TooFewPoints {
        /// Corresponding points.
        found: usize,
    },
    /// The points lie on one line, or in one place: the rotation about it is free.
    #[error("the features are collinear: {:.3} mm off a line of {:.1} mm", 1e3 * thickness, 1e3 * length)]
    Collinear {
        /// Root mean square distance from the line, metres.
        thickness: f64,
        /// Root mean square extent along the line, metres.
        length: f64,
    },
}

/// Rigid motion that takes corresponding source points to target points with the least sum of squared distances.
///
/// *Definition.* `H = Σ (p - p̄)(q - q̄)ᵀ = U Λ Vᵀ`, `R = v₁u₁ᵀ + v₂u₂ᵀ + (v₁×v₂)(u₁×u₂)ᵀ`, `t = q̄ - R p̄`. Completing
/// both bases with cross products is the flip of the singular vector of the *smallest* singular value, so flat bodies
/// never give a reflection.
///
/// *Degenerate cases.* Right for coplanar points, for half turns, and for thin clouds down to a thickness of 1e-6 of
/// the length (to the accuracy that the coordinates' rounding leaves).
///
/// # Errors
/// [`RegistrationError::TooFewPoints`], [`RegistrationError::Collinear`].
///
/// # References
/// K. S. Arun, T. S. Huang, S. D. Blostein, IEEE PAMI 9 (1987); S. Umeyama, IEEE PAMI 13 (1991). Thesis equations
/// (1)-(12) and Algorithm 2, with the order of factors in (9)-(11) and the reflection rule set right.
///
/// ```
/// use jointscope_motion::{nalgebra::{Isometry3, Point3, Vector3}, register};
/// let source = [Point3::new(0., 0., 0.), Point3::new(1., 0., 0.), Point3::new(0., 2., 0.)];
/// let truth = Isometry3::new(Vector3::new(1., 2., 3.), Vector3::z() * 0.5);
/// let target = source.map(|p| truth * p);
/// let target_from_source = register(source.iter().zip(&target))?;
/// assert!((target_from_source.inverse() * truth).rotation.angle() < 1e-12);
/// # Ok::<(), jointscope_motion::RegistrationError>(())
/// ```
pub fn register<'p, I>(pairs: I) -> Result<Pose, RegistrationError>
where
    I: Iterator<Item = (&'p Point3<f64>, &'p Point3<f64>)> + Clone,
{
    register_weighted(pairs.map(|(p, q)| (p, q, 1.0)))
}

/// As [`register`], every correspondence with a weight of its own; those of weight 0 do not count.
pub(crate) fn register_weighted<'p, I>(pairs: I) -> Result<Pose, RegistrationError>
where
    I: Iterator<Item = (&'p Point3<f64>, &'p Point3<f64>, f64)> + Clone,
{
    let (mut found, mut count, mut source_sum, mut target_sum, mut magnitude) =
        (0_usize, 0.0, Vector3::zeros(), Vector3::zeros(), 0.0_f64);
    for (p, q, weight) in pairs.clone() {
        found += usize::from(weight > 0.0);
        count += weight;
        source_sum += p.coords * weight;
        target_sum += q.coords * weight;
        magnitude = magnitude.max(p.coords.amax()).max(q.coords.amax());
    }
    if found < 3 {
        return Err(RegistrationError::TooFewPoints { found });
    }
    let (source_centroid, target_centroid) = (source_sum / count, target_sum / count);
    let covariance = pairs.clone().fold(Matrix3::zeros(), |sum, (p, q, weight)| {
        sum + (p.coords - source_centroid) * weight * (q.coords - target_centroid).transpose()
    });
    let mut axes = SingularVectors::of(&covariance);
    let mut off_line = f64::INFINITY;
    if axes.values[1] < THIN_ASPECT * THIN_ASPECT * axes.values[0] {
        let (mut within, mut off_lines) = (Matrix3::zeros(), [0.0; 2]);
        for (p, q, weight) in pairs {
            let p = axes.left.tr_mul(&(p.coords - source_centroid));
            let q = axes.right.tr_mul(&(q.coords - target_centroid));
            within += p * weight * q.transpose();
            off_lines = [off_lines[0] + weight * p.yz().norm_squared(), off_lines[1] + weight * q.yz().norm_squared()];
        }
        // The covariance holds the product of both clouds' thickness: a thick one must not hide that the other is a
        // line up to rounding.
        off_line = (off_lines[0].min(off_lines[1]) / count).sqrt();
        let within = SingularVectors::of(&within);
        axes =
            SingularVectors { left: axes.left * within.left, right: axes.right * within.right, values: within.values };
    }
    let (length, thickness) = ((axes.values[0] / count).sqrt(), (axes.values[1] / count).sqrt().min(off_line));
    if thickness <= (SMALLEST_ASPECT * length).max(ROUNDING * magnitude) {
        return Err(RegistrationError::Collinear { thickness, length });
    }
    let rotation = axes.right * axes.left.transpose();
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Ok(Pose::from_parts(Translation3::from(target_centroid - rotation * source_centroid), rotation))
}

/// The rotation that fits a cross-covariance best, if it is determined.
pub(crate) fn rotation_of(covariance: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    let axes = SingularVectors::of(covariance);
    (axes.values[1] > ROUNDING * axes.values[0]).then(|| {
        let rotation = Rotation3::from_matrix_unchecked(axes.right * axes.left.transpose());
        UnitQuaternion::from_rotation_matrix(&rotation)
    })
}

/// Singular vectors of a 3×3 matrix `left · diag(values) · rightᵀ`, completed to right-handed bases.
///
/// The third value is not needed and not given; the third vectors are the cross products of the first two, so that
/// both bases are rotations whatever the sign of the determinant.
struct SingularVectors {
    left: Matrix3<f64>,
    right: Matrix3<f64>,
    values: [f64; 2],
}

impl SingularVectors {
    /// One-sided Jacobi: turns pairs of columns until all are orthogonal. It never forms `HᵀH` and so keeps the
    /// small singular values of thin clouds.
    fn of(matrix: &Matrix3<f64>) -> Self {
        const SWEEPS: usize = 30;
        // Squares of squares of coordinates are formed below; in units of the largest entry they stay finite.
        let unit = if matrix.amax() > 0.0 { matrix.amax() } else { 1.0 };
        let columns_of = |m: Matrix3<f64>| [0, 1, 2].map(|k| m.column(k).into_owned());
        let (mut columns, mut right) = (columns_of(matrix / unit), columns_of(Matrix3::identity()));
        for _ in 0..SWEEPS {
            let mut turned = false;
            for (i, j) in [(0, 1), (0, 2), (1, 2)] {
                let (a, b) = (columns[i].norm_squared(), columns[j].norm_squared());
                let c = columns[i].dot(&columns[j]);
                if c * c <= f64::EPSILON * f64::EPSILON * a * b {
                    continue;
                }
                turned = true;
                let zeta = (b - a) / (2.0 * c);
                let tangent = zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
                let cosine = (1.0 + tangent * tangent).sqrt().recip();
                for m in [&mut columns, &mut right] {
                    (m[i], m[j]) = ((m[i] - m[j] * tangent) * cosine, (m[j] + m[i] * tangent) * cosine);
                }
            }
            if !turned {
                break;
            }
        }
        let norms = columns.map(|column| column.norm());
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| norms[j].total_cmp(&norms[i]));
        let right_handed = |m: &[Vector3<f64>; 3]| {
            // Columns vanish when points coincide or lie exactly on a line; any perpendicular direction will do then.
            let first = m[order[0]].try_normalize(0.0).unwrap_or_else(Vector3::x);
            let second = m[order[1]].try_normalize(0.0).unwrap_or_default();
            let beside = (second - first * first.dot(&second)).try_normalize(0.5);
            let second = beside.unwrap_or_else(|| first.cross(&Vector3::ith(first.iamin(), 1.0)).normalize());
            Matrix3::from_columns(&[first, second, first.cross(&second)])
        };
        let values = [norms[order[0]] * unit, norms[order[1]] * unit];
        Self { left: right_handed(&columns), right: right_handed(&right), values }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of unit coordinates, some operations long, radians.
    const EXACT: f64 = 1e-12;

    fn turn(axis: [f64; 3], angle: f64) -> Pose {
        let axis = nalgebra::Unit::new_normalize(Vector3::from(axis));
        Pose::from_parts(Translation3::new(0.3, -0.2, 1.5), UnitQuaternion::from_axis_angle(&axis, angle))
    }

    fn error(source: &[Point3<f64>], truth: Pose) -> f64 {
        let target: Vec<_> = source.iter().map(|p| truth * p).collect();
        let found = register(source.iter().zip(&target)).expect("solvable");
        (found.inverse() * truth).rotation.angle()
    }

    /// Nine points in a box of size 1 × `b` × `c`, seen in general orientation.
    fn cloud(b: f64, c: f64) -> Vec<Point3<f64>> {
        let general = turn([0.3, -0.7, 0.5], 1.1);
        (0..9)
            .map(|i| {
                let x = |k: usize| ((i * k) as f64 * 0.618_033_988_75).fract() - 0.5;
                general * Point3::new(x(1), b * x(3), c * x(7))
            })
            .collect()
    }

    #[test]
    fn flat_thin_and_full_clouds_are_recovered() {
        for (b, c, tolerance) in [
            (1.0, 1.0, EXACT),
            (0.5, 0.0, EXACT),
            (1e-2, 1e-2, EXACT),
            (1e-2, 0.0, EXACT),
            // Coordinates are rounded to 1e-16, so a thickness of 1e-6 leaves some 1e-10 rad.
            (1e-4, 1e-4, 1e-11),
            (1e-6, 1e-6, 2e-9),
            (1e-6, 0.0, 2e-9),
        ] {
            for angle in [0.0, 0.5, 3.0, std::f64::consts::PI, -2.0] {
                let off = error(&cloud(b, c), turn([0.5, 0.2, -0.9], angle));
                assert!(off < tolerance, "1 × {b} × {c} turned by {angle}: {off:e} rad off");
            }
        }
    }

    #[test]
    fn a_mirrored_flat_body_gives_a_rotation() {
        let source = cloud(1.0, 0.0);
        let target: Vec<_> = source.iter().map(|p| Point3::new(p.x, p.y, -p.z)).collect();
        let found = register(source.iter().zip(&target)).expect("solvable").rotation.to_rotation_matrix();
        assert!((found.matrix().determinant() - 1.0).abs() < EXACT);
    }

    #[test]
    fn collinear_coincident_and_too_few_points_are_refused_by_name() {
        let line: Vec<_> = (0..5).map(|i| Point3::from(Vector3::new(0.1, 0.2, 0.3) * f64::from(i))).collect();
        let same = vec![Point3::new(1.0, 2.0, 3.0); 4];
        for points in [&line, &same] {
            let refused = register(points.iter().zip(points)).expect_err("refused");
            assert!(matches!(refused, RegistrationError::Collinear { .. }), "{refused}");
        }
        let far: Vec<_> = line.iter().map(|p| p + Vector3::repeat(1e4)).collect();
        assert!(register(far.iter().zip(&far)).is_err(), "rounding at 10 km must not pass as thickness");
        let refused = register(line[..2].iter().zip(&line[..2])).expect_err("refused");
        assert_eq!(refused, RegistrationError::TooFewPoints { found: 2 });
    }
}
