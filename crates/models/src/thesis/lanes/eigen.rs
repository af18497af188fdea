//! Eigenvectors of many symmetric 3×3 matrices at a time.

#![expect(clippy::needless_range_loop, reason = "one index runs through several arrays of registers")]

use jointscope_motion::arch;
use nalgebra::{Matrix3, Unit, Vector3};
use pulp::{Simd, WithSimd};

use super::BLOCK;

/// Sweeps after which nothing is left beside the diagonal of any 3×3 matrix: errors fall with the square and more.
const SWEEPS: usize = 6;

/// Eigenvalues and unit eigenvectors of symmetric matrices, the largest first.
///
/// As [`principal_axes`](super::super::principal_axes) of each, by Jacobi's rotations, eight matrices in the lanes of a
/// register.
pub(in super::super) fn principal_axes(matrices: &[Matrix3<f64>]) -> Vec<[(f64, Unit<Vector3<f64>>); 3]> {
    let mut all = Vec::with_capacity(matrices.len());
    for some in matrices.chunks(BLOCK) {
        let mut block = Block::of(some);
        arch().dispatch(Kernel { block: &mut block });
        all.extend((0..some.len()).map(|lane| block.axes(lane)));
    }
    all
}

/// Upper triangles, row by row, which become diagonal, and the rows of the eigenvectors; matrices in lanes.
struct Block {
    matrix: [[f64; BLOCK]; 6],
    vectors: [[f64; BLOCK]; 9],
}

/// Where the numbers of a symmetric matrix are in its upper triangle.
const PLACES: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

impl Block {
    fn of(matrices: &[Matrix3<f64>]) -> Self {
        let mut block = Self { matrix: [[0.0; BLOCK]; 6], vectors: [[0.0; BLOCK]; 9] };
        for (lane, matrix) in matrices.iter().enumerate() {
            for row in 0..3 {
                for column in row..3 {
                    block.matrix[PLACES[row][column]][lane] = matrix[(row, column)];
                }
                block.vectors[4 * row][lane] = 1.0;
            }
        }
        block
    }

    fn axes(&self, lane: usize) -> [(f64, Unit<Vector3<f64>>); 3] {
        let values = [0, 1, 2].map(|k: usize| self.matrix[PLACES[k][k]][lane]);
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| values[j].total_cmp(&values[i]));
        let vector = |k: usize| Vector3::from_fn(|row, _| self.vectors[3 * row + k][lane]);
        order.map(|k| (values[k], Unit::new_normalize(vector(k))))
    }
}

struct Kernel<'a> {
    block: &'a mut Block,
}

impl WithSimd for Kernel<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for part in 0..BLOCK / S::F64_LANES {
            let zero = simd.splat_f64s(0.0);
            let (mut m, mut v) = ([zero; 6], [zero; 9]);
            for k in 0..6 {
                m[k] = S::as_simd_f64s(&self.block.matrix[k]).0[part];
            }
            for k in 0..9 {
                v[k] = S::as_simd_f64s(&self.block.vectors[k]).0[part];
            }
            for _ in 0..SWEEPS {
                rotate(simd, &mut m, &mut v, [0, 1, 2]);
                rotate(simd, &mut m, &mut v, [0, 2, 1]);
                rotate(simd, &mut m, &mut v, [1, 2, 0]);
            }
            for k in 0..6 {
                S::as_mut_simd_f64s(&mut self.block.matrix[k]).0[part] = m[k];
            }
            for k in 0..9 {
                S::as_mut_simd_f64s(&mut self.block.vectors[k]).0[part] = v[k];
            }
        }
    }
}

/// Turns the coordinates `p` and `q`, of which `r` is the third, so that their product vanishes.
#[inline(always)]
fn rotate<S: Simd>(simd: S, m: &mut [S::f64s; 6], v: &mut [S::f64s; 9], [p, q, r]: [usize; 3]) {
    let (pp, qq, pq) = (PLACES[p][p], PLACES[q][q], PLACES[p][q]);
    let (pr, qr) = (PLACES[p][r], PLACES[q][r]);
    let one = simd.splat_f64s(1.0);
    // The tangent of the smaller angle: 2 m_pq / (d ± √(d² + 4 m_pq²)), where d = m_qq - m_pp.
    let difference = simd.sub_f64s(m[qq], m[pp]);
    let twice = simd.add_f64s(m[pq], m[pq]);
    let root = simd.sqrt_f64s(simd.mul_add_f64s(difference, difference, simd.mul_f64s(twice, twice)));
    let below = simd.less_than_f64s(difference, simd.splat_f64s(0.0));
    let twice = simd.select_f64s(below, simd.neg_f64s(twice), twice);
    let divisor = simd.add_f64s(simd.add_f64s(simd.abs_f64s(difference), root), simd.splat_f64s(f64::MIN_POSITIVE));
    let tangent = simd.div_f64s(twice, divisor);
    let cosine = simd.div_f64s(one, simd.sqrt_f64s(simd.mul_add_f64s(tangent, tangent, one)));
    let sine = simd.mul_f64s(tangent, cosine);
    let moved = simd.mul_f64s(tangent, m[pq]);
    m[pp] = simd.sub_f64s(m[pp], moved);
    m[qq] = simd.add_f64s(m[qq], moved);
    m[pq] = simd.splat_f64s(0.0);
    [m[pr], m[qr]] = turned(simd, [m[pr], m[qr]], cosine, sine);
    for row in 0..3 {
        let (a, b) = (3 * row + p, 3 * row + q);
        [v[a], v[b]] = turned(simd, [v[a], v[b]], cosine, sine);
    }
}

#[inline(always)]
fn turned<S: Simd>(simd: S, [a, b]: [S::f64s; 2], cosine: S::f64s, sine: S::f64s) -> [S::f64s; 2] {
    [
        simd.sub_f64s(simd.mul_f64s(cosine, a), simd.mul_f64s(sine, b)),
        simd.mul_add_f64s(sine, a, simd.mul_f64s(cosine, b)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding, as a share of the largest eigenvalue.
    const EXACT: f64 = 1e-14;

    #[test]
    fn eigenvectors_are_turned_by_their_matrices_into_multiples_of_themselves() {
        let number = |k: usize| (k as f64 * 12.9898).sin().mul_add(43_758.545_3, 0.5).rem_euclid(1.0) - 0.5;
        let mut matrices: Vec<Matrix3<f64>> = (0..100)
            .map(|k| {
                let a = Matrix3::from_fn(|i, j| number(9 * k + 3 * i + j));
                // Round, flat, thin, and of any size.
                let b = Matrix3::from_columns(&[a.column(0).into(), a.column(1) * 1e-3, a.column(2) * 1e-7]);
                [a * a.transpose(), b * b.transpose() * 1e-20, b.transpose() * b * 1e20][k % 3]
            })
            .collect();
        matrices.extend([Matrix3::zeros(), Matrix3::identity(), Matrix3::from_element(1.0)]);
        let found = principal_axes(&matrices);
        assert_eq!(found.len(), matrices.len());
        for (matrix, axes) in matrices.iter().zip(&found) {
            let size = matrix.norm();
            for (k, (value, vector)) in axes.iter().enumerate() {
                assert!(
                    (matrix * vector.into_inner() - vector.into_inner() * *value).norm() <= EXACT * size,
                    "{matrix}"
                );
                assert!(k == 0 || *value <= axes[k - 1].0);
                assert!(k == 0 || vector.dot(&axes[k - 1].1).abs() < EXACT);
            }
        }
    }
}
