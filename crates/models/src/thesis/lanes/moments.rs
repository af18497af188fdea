//! Mean and covariance of a trajectory.

use jointscope_motion::Rows;
use nalgebra::{Matrix3, Vector3};
use pulp::{Arch, Simd, WithSimd};

use super::{add_products, means, minus, registers, splat};

/// Mean and covariance of a trajectory, and how far it moves.
pub(in super::super) struct Moments {
    pub mean: Vector3<f64>,
    pub covariance: Matrix3<f64>,
    /// Largest coordinate.
    pub magnitude: f64,
    /// Largest coordinate of a difference from the first position.
    pub moved: f64,
}

impl Moments {
    pub(in super::super) fn of(rows: Rows<'_>) -> Self {
        Arch::new().dispatch(Kernel { rows })
    }
}

struct Kernel<'a> {
    rows: Rows<'a>,
}

impl WithSimd for Kernel<'_> {
    type Output = Moments;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Moments {
        let Self { rows: all } = self;
        let count = all.frames as f64;
        let rows = registers(simd, all.coordinates);
        let weights = S::as_simd_f64s(all.weights).0;
        let first = all.point(0).coords;
        let from = splat(simd, first.into());
        let zero = simd.splat_f64s(0.0);
        let (mut sums, mut magnitude, mut moved) = ([zero; 3], zero, zero);
        for k in 0..weights.len() {
            for axis in 0..3 {
                let step = simd.sub_f64s(rows[axis][k], from[axis]);
                // What rows are filled up with is the first position, and adds nothing.
                sums[axis] = simd.add_f64s(sums[axis], step);
                moved = simd.max_f64s(moved, simd.abs_f64s(step));
                magnitude = simd.max_f64s(magnitude, simd.abs_f64s(rows[axis][k]));
            }
        }
        let sum =
            Vector3::new(simd.reduce_sum_f64s(sums[0]), simd.reduce_sum_f64s(sums[1]), simd.reduce_sum_f64s(sums[2]));
        let mean = first + sum / count;
        let about = splat(simd, mean.into());
        let mut products = [zero; 6];
        for (k, weight) in weights.iter().enumerate() {
            let d = minus(simd, [rows[0][k], rows[1][k], rows[2][k]], about);
            add_products(simd, *weight, d, &mut products);
        }
        let [xx, xy, yy, xz, yz, zz] = means(simd, products, count);
        let covariance = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        Moments { mean, covariance, magnitude: simd.reduce_max_f64s(magnitude), moved: simd.reduce_max_f64s(moved) }
    }
}
