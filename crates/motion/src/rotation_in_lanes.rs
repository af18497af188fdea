//! Rotations that fit cross-covariances, several in the lanes of a vector register.

#![expect(clippy::inline_always, reason = "what is not inlined loses the instruction set")]
#![expect(clippy::needless_range_loop, reason = "one index runs through several arrays of registers")]

use std::ops::RangeInclusive;

use nalgebra::{Matrix3, Quaternion, UnitQuaternion};
use pulp::{Simd, WithSimd};

use crate::instructions::arch;
use crate::registration::rotation_of;

/// Rotations that are solved together: the lanes of the widest registers.
pub(crate) const BLOCK: usize = 8;
/// Steps of Halley's iteration, which comes from above and does not oscillate, and the step after which nothing is left
/// to do, as a share of the eigenvalue: errors fall with the third power.
const STEPS: usize = 30;
const RESTS: f64 = 3e-7;
/// Product of the largest eigenvalue's distances to the others, in cubes of it, below which the solve in lanes loses
/// digits: of a cube it is 2.4, of a thin body it goes to 0.
const LEAST_GAP: f64 = 0.02;
/// Eigenvalues whose sixth powers are numbers.
const EIGENVALUES: RangeInclusive<f64> = 1e-40..=1e40;
/// Covariances that are brought into lanes at a time.
const BATCH: usize = 64;

/// The rotations that fit cross-covariances `H = Σ (p - p̄)(q - q̄)ᵀ` best: `R` with the least `Σ |q - q̄ - R (p - p̄)|²`;
/// `None` where points on a line, or in one place, leave it open.
///
/// For users who have sums rather than points: as [`register_frames`](crate::register_frames), which see, without reading
/// positions. Units do not matter. Nothing is allocated.
///
/// # Panics
/// If `rotations` has not one place per covariance.
///
/// ```
/// use jointscope_motion::{fit_rotations, nalgebra::{Matrix3, UnitQuaternion, Vector3}};
/// let truth = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -1.0, 2.0));
/// let covariance = Matrix3::from_diagonal(&Vector3::new(3.0, 2.0, 1.0)) * truth.inverse().to_rotation_matrix();
/// let mut target_from_source = [None];
/// fit_rotations(&[covariance], &mut target_from_source);
/// assert!(target_from_source[0].expect("solvable").angle_to(&truth) < 1e-12);
/// ```
pub fn fit_rotations(covariances: &[Matrix3<f64>], rotations: &mut [Option<UnitQuaternion<f64>>]) {
    assert_eq!(covariances.len(), rotations.len(), "one place per covariance");
    arch().dispatch(Covariances { covariances, rotations });
}

struct Covariances<'a> {
    covariances: &'a [Matrix3<f64>],
    rotations: &'a mut [Option<UnitQuaternion<f64>>],
}

impl WithSimd for Covariances<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        // What was written number by number is not read as a register at once.
        let mut rows = [[0.0; BATCH]; 9];
        let (mut quaternions, mut trusted) = ([[0.0; BATCH]; 4], [0.0; BATCH]);
        let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
        for (batch, rotations) in self.covariances.chunks(BATCH).zip(self.rotations.chunks_mut(BATCH)) {
            for (lane, covariance) in batch.iter().enumerate() {
                // Column by column.
                let numbers = covariance.as_slice();
                for axis in 0..3 {
                    for other in 0..3 {
                        rows[3 * axis + other][lane] = numbers[axis + 3 * other];
                    }
                }
            }
            // Two registers at a time, so that no step of the one waits for its own last result alone.
            for pair in (0..batch.len().div_ceil(S::F64_LANES)).step_by(2) {
                let mut h = [[simd.splat_f64s(0.0); 9]; 2];
                for part in 0..2 {
                    for k in 0..9 {
                        h[part][k] = S::as_simd_f64s(&rows[k]).0[pair + part];
                    }
                }
                let found = solve_rotations(simd, &h);
                for part in 0..2 {
                    let (quaternion, eigenvalue, gap) = found[part];
                    for k in 0..4 {
                        S::as_mut_simd_f64s(&mut quaternions[k]).0[pair + part] = quaternion[k];
                    }
                    S::as_mut_simd_f64s(&mut trusted).0[pair + part] =
                        simd.select_f64s(have_digits(simd, gap, eigenvalue), one, zero);
                }
            }
            let [w, x, y, z] = &quaternions;
            for (lane, rotation) in rotations.iter_mut().enumerate() {
                *rotation = Some(UnitQuaternion::new_unchecked(Quaternion::new(w[lane], x[lane], y[lane], z[lane])));
            }
            for lane in (0..batch.len()).filter(|lane| trusted[*lane] == 0.0) {
                rotations[lane] = rotation_of(&batch[lane]);
            }
        }
    }
}

/// Which lanes' rotations have all their digits; none that are not numbers.
#[inline(always)]
pub(crate) fn have_digits<S: Simd>(simd: S, gap: S::f64s, eigenvalue: S::f64s) -> S::m64s {
    let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
    let wide = simd.less_than_f64s(simd.splat_f64s(LEAST_GAP), gap);
    let large = simd.less_than_or_equal_f64s(simd.splat_f64s(*EIGENVALUES.start()), eigenvalue);
    let small = simd.less_than_or_equal_f64s(eigenvalue, simd.splat_f64s(*EIGENVALUES.end()));
    let all = simd.select_f64s(wide, simd.select_f64s(large, simd.select_f64s(small, one, zero), zero), zero);
    simd.equal_f64s(all, one)
}

/// Sums and products of registers.
macro_rules! f {
    ($simd:ident, $a:ident + $b:ident) => {
        $simd.add_f64s($a, $b)
    };
    ($simd:ident, $a:ident - $b:ident) => {
        $simd.sub_f64s($a, $b)
    };
    ($simd:ident, $a:ident * $b:ident) => {
        $simd.mul_f64s($a, $b)
    };
    // a b - c d
    ($simd:ident, $a:ident * $b:ident - $c:ident * $d:ident) => {
        $simd.sub_f64s($simd.mul_f64s($a, $b), $simd.mul_f64s($c, $d))
    };
    // a b - c d + e f
    ($simd:ident, $a:ident * $b:ident - $c:ident * $d:ident + $e:ident * $g:ident) => {
        $simd.mul_add_f64s($e, $g, f!($simd, $a * $b - $c * $d))
    };
    // a b - c d - e f
    ($simd:ident, $a:ident * $b:ident - $c:ident * $d:ident - $e:ident * $g:ident) => {
        $simd.sub_f64s(f!($simd, $a * $b - $c * $d), $simd.mul_f64s($e, $g))
    };
}
/// The 2×2 minors of the two upper and the two lower rows of a symmetric matrix, from its diagonal and what is above.
#[inline(always)]
fn minors<S: Simd>(simd: S, diagonal: [S::f64s; 4], above: [S::f64s; 6]) -> ([S::f64s; 6], [S::f64s; 6]) {
    let ([k00, k11, k22, k33], [k01, k02, k03, k12, k13, k23]) = (diagonal, above);
    let upper = [
        f!(simd, k00 * k11 - k01 * k01),
        f!(simd, k00 * k12 - k01 * k02),
        f!(simd, k00 * k13 - k01 * k03),
        f!(simd, k01 * k12 - k11 * k02),
        f!(simd, k01 * k13 - k11 * k03),
        f!(simd, k02 * k13 - k12 * k03),
    ];
    let lower = [
        f!(simd, k02 * k13 - k03 * k12),
        f!(simd, k02 * k23 - k03 * k22),
        f!(simd, k02 * k33 - k03 * k23),
        f!(simd, k12 * k23 - k13 * k22),
        f!(simd, k12 * k33 - k13 * k23),
        f!(simd, k22 * k33 - k23 * k23),
    ];
    (upper, lower)
}

/// A register of unit quaternions, the eigenvalues and the gaps by which they can be trusted.
type Found<S> = ([<S as Simd>::f64s; 4], <S as Simd>::f64s, <S as Simd>::f64s);

/// Unit quaternions, of real parts that are not negative, of the rotations that fit covariances `Σ p qᵀ`, row by row.
///
/// *Definition.* The eigenvector of the largest eigenvalue `λ` of Horn's symmetric matrix `K`, a column of the adjugate
/// of `K - λI`. Halley's iteration for `λ` starts at `√3 |H|`, above all eigenvalues. The adjugate's trace is the product
/// of the distances of `λ` to the other eigenvalues, up to its sign; the gap is that by `λ³`.
#[inline(always)]
pub(crate) fn solve_rotations<S: Simd, const COUNT: usize>(simd: S, h: &[[S::f64s; 9]; COUNT]) -> [Found<S>; COUNT] {
    let mut matrices = [horn(simd, &h[0]); COUNT];
    for k in 1..COUNT {
        matrices[k] = horn(simd, &h[k]);
    }
    let eigenvalues = largest(simd, &matrices);
    let mut found = [eigenvector(simd, &matrices[0], eigenvalues[0]); COUNT];
    for k in 1..COUNT {
        found[k] = eigenvector(simd, &matrices[k], eigenvalues[k]);
    }
    found
}

/// Horn's matrices, their characteristic polynomials `λ⁴ + c₂ λ² + c₁ λ + c₀`, and something above all their eigenvalues.
#[derive(Clone, Copy)]
struct Horn<S: Simd> {
    diagonal: [S::f64s; 4],
    above: [S::f64s; 6],
    polynomial: [S::f64s; 3],
    bound: S::f64s,
}

#[inline(always)]
fn horn<S: Simd>(simd: S, h: &[S::f64s; 9]) -> Horn<S> {
    let [xx, xy, xz, yx, yy, yz, zx, zy, zz] = *h;
    let (k01, k02, k03) = (f!(simd, yz - zy), f!(simd, zx - xz), f!(simd, xy - yx));
    let (k12, k13, k23) = (f!(simd, xy + yx), f!(simd, zx + xz), f!(simd, yz + zy));
    let (beside, less) = (f!(simd, yy + zz), f!(simd, yy - zz));
    let (k00, k11) = (f!(simd, xx + beside), f!(simd, xx - beside));
    let (k22, k33) = (f!(simd, less - xx), {
        let minus = f!(simd, less + xx);
        simd.neg_f64s(minus)
    });
    let mut squares = f!(simd, xx * xx);
    for entry in &h[1..] {
        squares = simd.mul_add_f64s(*entry, *entry, squares);
    }
    let (m0, m1, m2) = (f!(simd, yy * zz - yz * zy), f!(simd, yx * zz - yz * zx), f!(simd, yx * zy - yy * zx));
    let determinant = f!(simd, xx * m0 - xy * m1 + xz * m2);
    let (two, eight) = (simd.splat_f64s(-2.0), simd.splat_f64s(-8.0));
    let (c2, c1) = (f!(simd, two * squares), f!(simd, eight * determinant));
    let ([s0, s1, s2, s3, s4, s5], [l0, l1, l2, l3, l4, l5]) =
        minors(simd, [k00, k11, k22, k33], [k01, k02, k03, k12, k13, k23]);
    let (near, far) = (f!(simd, s0 * l5 - s1 * l4 + s2 * l3), f!(simd, s3 * l2 - s4 * l1 + s5 * l0));
    let c0 = f!(simd, near + far);
    Horn {
        diagonal: [k00, k11, k22, k33],
        above: [k01, k02, k03, k12, k13, k23],
        polynomial: [c0, c1, c2],
        bound: simd.sqrt_f64s(simd.mul_f64s(simd.splat_f64s(3.0), squares)),
    }
}

/// The largest eigenvalues.
#[inline(always)]
fn largest<S: Simd, const COUNT: usize>(simd: S, matrices: &[Horn<S>; COUNT]) -> [S::f64s; COUNT] {
    let rests = simd.splat_f64s(RESTS);
    let mut eigenvalues = [rests; COUNT];
    for k in 0..COUNT {
        eigenvalues[k] = matrices[k].bound;
    }
    let mut moves = [simd.equal_f64s(rests, rests); COUNT];
    for _ in 0..STEPS {
        let mut resting = true;
        for k in 0..COUNT {
            let ([c0, c1, c2], lambda) = (matrices[k].polynomial, eigenvalues[k]);
            let square = f!(simd, lambda * lambda);
            let b = {
                let sum = f!(simd, square + c2);
                f!(simd, sum * lambda)
            };
            let a = f!(simd, b + c1);
            let value = simd.mul_add_f64s(a, lambda, c0);
            let twice = simd.mul_f64s(simd.splat_f64s(2.0), square);
            let inner = f!(simd, a + b);
            let slope = simd.mul_add_f64s(twice, lambda, inner);
            let half_bend = simd.mul_add_f64s(simd.splat_f64s(6.0), square, c2);
            let (above, below) = (f!(simd, value * slope), f!(simd, slope * slope - value * half_bend));
            let step = simd.div_f64s(above, below);
            // A lane that rests does so whatever its neighbours do, of which others have more.
            let next = f!(simd, lambda - step);
            eigenvalues[k] = simd.select_f64s(moves[k], next, lambda);
            let (size, small) = (simd.abs_f64s(step), f!(simd, rests * next));
            moves[k] = simd.and_m64s(moves[k], simd.greater_than_f64s(size, small));
            resting &= simd.first_true_m64s(moves[k]) >= S::F64_LANES;
        }
        if resting {
            break;
        }
    }
    eigenvalues
}

/// The eigenvectors to the largest eigenvalues.
#[inline(always)]
fn eigenvector<S: Simd>(simd: S, matrix: &Horn<S>, lambda: S::f64s) -> Found<S> {
    let ([k00, k11, k22, k33], [k01, k02, k03, k12, k13, k23]) = (matrix.diagonal, matrix.above);
    let (k00, k11, k22, k33) =
        (f!(simd, k00 - lambda), f!(simd, k11 - lambda), f!(simd, k22 - lambda), f!(simd, k33 - lambda));
    let ([s0, s1, s2, s3, s4, s5], [_, l1, l2, l3, l4, l5]) =
        minors(simd, [k00, k11, k22, k33], [k01, k02, k03, k12, k13, k23]);
    let b00 = f!(simd, k11 * l5 - k12 * l4 + k13 * l3);
    let b01 = f!(simd, k02 * l4 - k01 * l5 - k03 * l3);
    let b02 = {
        let rest = f!(simd, k13 * s5 - k23 * s4);
        simd.mul_add_f64s(k33, s3, rest)
    };
    let b03 = f!(simd, k22 * s4 - k12 * s5 - k23 * s3);
    let b11 = f!(simd, k00 * l5 - k02 * l2 + k03 * l1);
    let b12 = f!(simd, k23 * s2 - k03 * s5 - k33 * s1);
    let b13 = {
        let rest = f!(simd, k02 * s5 - k22 * s2);
        simd.mul_add_f64s(k23, s1, rest)
    };
    let b22 = {
        let rest = f!(simd, k03 * s4 - k13 * s2);
        simd.mul_add_f64s(k33, s0, rest)
    };
    let b23 = f!(simd, k12 * s2 - k02 * s4 - k23 * s0);
    let b33 = {
        let rest = f!(simd, k02 * s3 - k12 * s1);
        simd.mul_add_f64s(k22, s0, rest)
    };
    let (mut column, mut most) = ([b00, b01, b02, b03], simd.abs_f64s(b00));
    for (other, diagonal) in [([b01, b11, b12, b13], b11), ([b02, b12, b22, b23], b22), ([b03, b13, b23, b33], b33)] {
        let size = simd.abs_f64s(diagonal);
        let larger = simd.greater_than_f64s(size, most);
        for k in 0..4 {
            column[k] = simd.select_f64s(larger, other[k], column[k]);
        }
        most = simd.select_f64s(larger, size, most);
    }
    let [w, x, y, z] = column;
    let mut norm = f!(simd, w * w);
    for entry in [x, y, z] {
        norm = simd.mul_add_f64s(entry, entry, norm);
    }
    // Of the two quaternions of a rotation that with the positive real part.
    let sign =
        simd.select_f64s(simd.less_than_f64s(w, simd.splat_f64s(0.0)), simd.splat_f64s(-1.0), simd.splat_f64s(1.0));
    let scale = simd.div_f64s(sign, simd.sqrt_f64s(norm));
    let (left, right) = (f!(simd, b00 + b11), f!(simd, b22 + b33));
    let cube = {
        let square = f!(simd, lambda * lambda);
        f!(simd, square * lambda)
    };
    let gap = simd.div_f64s(simd.abs_f64s(f!(simd, left + right)), cube);
    ([f!(simd, w * scale), f!(simd, x * scale), f!(simd, y * scale), f!(simd, z * scale)], lambda, gap)
}

#[cfg(test)]
mod tests;
