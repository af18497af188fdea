//! What a trajectory shows at a glance: where it is, how far it spreads and goes.

use nalgebra::{Matrix3, Vector3};
use pulp::{Arch, Simd, WithSimd};

use super::Rows;
use crate::{Extents, path_length_of_rows};

/// Mean, spread and lengths of one feature's trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Mean position, metres.
    pub mean: Vector3<f64>,
    /// Covariance about it, m².
    pub covariance: Matrix3<f64>,
    /// Largest coordinate, by its size, metres.
    pub magnitude: f64,
    /// Largest coordinate of a difference from the first position, by its size, metres.
    pub moved: f64,
    /// Sum of the distances between successive positions, metres.
    pub path: f64,
    /// Largest distance between any two positions, metres.
    pub extent: f64,
}

impl Summary {
    pub(super) fn of(rows: Rows<'_>, alike: &mut Extents) -> Self {
        let path = path_length_of_rows(rows.coordinates, rows.frames);
        let extent = alike.of_rows(rows.coordinates);
        Self { path, extent, ..Arch::new().dispatch(Moments { rows }) }
    }
}

struct Moments<'a> {
    rows: Rows<'a>,
}

impl WithSimd for Moments<'_> {
    type Output = Summary;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Summary {
        let Rows { coordinates: [x, y, z], weights, frames } = self.rows;
        let count = frames as f64;
        let rows = [S::as_simd_f64s(x).0, S::as_simd_f64s(y).0, S::as_simd_f64s(z).0];
        let weights = S::as_simd_f64s(weights).0;
        let first = self.rows.point(0).coords;
        let from = [simd.splat_f64s(first.x), simd.splat_f64s(first.y), simd.splat_f64s(first.z)];
        let zero = simd.splat_f64s(0.0);
        let (mut sums, mut magnitude, mut moved) = ([zero; 3], [zero; 3], [zero; 3]);
        for k in 0..weights.len() {
            for axis in 0..3 {
                let step = simd.sub_f64s(rows[axis][k], from[axis]);
                // What rows are filled up with is the first position, and adds nothing.
                sums[axis] = simd.add_f64s(sums[axis], step);
                moved[axis] = simd.max_f64s(moved[axis], simd.abs_f64s(step));
                magnitude[axis] = simd.max_f64s(magnitude[axis], simd.abs_f64s(rows[axis][k]));
            }
        }
        let sum =
            Vector3::new(simd.reduce_sum_f64s(sums[0]), simd.reduce_sum_f64s(sums[1]), simd.reduce_sum_f64s(sums[2]));
        let mean = first + sum / count;
        let about = [simd.splat_f64s(mean.x), simd.splat_f64s(mean.y), simd.splat_f64s(mean.z)];
        let mut products = [zero; 6];
        for k in 0..weights.len() {
            let (x, y, z) = (
                simd.sub_f64s(rows[0][k], about[0]),
                simd.sub_f64s(rows[1][k], about[1]),
                simd.sub_f64s(rows[2][k], about[2]),
            );
            let (wx, wy, wz) =
                (simd.mul_f64s(weights[k], x), simd.mul_f64s(weights[k], y), simd.mul_f64s(weights[k], z));
            products[0] = simd.mul_add_e_f64s(wx, x, products[0]);
            products[1] = simd.mul_add_e_f64s(wx, y, products[1]);
            products[2] = simd.mul_add_e_f64s(wy, y, products[2]);
            products[3] = simd.mul_add_e_f64s(wx, z, products[3]);
            products[4] = simd.mul_add_e_f64s(wy, z, products[4]);
            products[5] = simd.mul_add_e_f64s(wz, z, products[5]);
        }
        let mut of = [0.0; 6];
        for k in 0..6 {
            of[k] = simd.reduce_sum_f64s(products[k]) / count;
        }
        let [xx, xy, yy, xz, yz, zz] = of;
        let largest = |of: [S::f64s; 3]| simd.reduce_max_f64s(simd.max_f64s(simd.max_f64s(of[0], of[1]), of[2]));
        Summary {
            mean,
            covariance: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
            magnitude: largest(magnitude),
            moved: largest(moved),
            path: 0.0,
            extent: 0.0,
        }
    }
}
