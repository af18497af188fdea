//! Moments of a trajectory in its plane, up to the fourth.

use jointscope_motion::Rows;
use nalgebra::Vector3;
use pulp::{Arch, Simd, WithSimd};

use super::{add_products, dot, means, minus, registers, splat};

/// Means of products of plane coordinates `x`, `y` about the centroid, and of `z = x² + y²` less its mean.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct PlaneMoments {
    /// Mean of `x² + y²`.
    pub square: f64,
    pub xx: f64,
    pub xy: f64,
    pub yy: f64,
    pub xz: f64,
    pub yz: f64,
    pub zz: f64,
}

impl PlaneMoments {
    /// Of a feature about its centroid, with coordinates along two axes, which are unit vectors over the unit of length;
    /// `square` is the mean of `x² + y²`, up to rounding.
    pub(in super::super) fn of(rows: Rows<'_>, centroid: Vector3<f64>, axes: [Vector3<f64>; 2], square: f64) -> Self {
        Arch::new().dispatch(Kernel { rows, centroid, axes, square })
    }
}

struct Kernel<'a> {
    rows: Rows<'a>,
    centroid: Vector3<f64>,
    axes: [Vector3<f64>; 2],
    square: f64,
}

impl WithSimd for Kernel<'_> {
    type Output = PlaneMoments;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> PlaneMoments {
        let Self { rows: all, centroid, axes, square } = self;
        let rows = registers(simd, all.coordinates);
        let weights = S::as_simd_f64s(all.weights).0;
        let centroid = splat(simd, centroid.into());
        let (x_axis, y_axis) = (splat(simd, axes[0].into()), splat(simd, axes[1].into()));
        let mean = simd.splat_f64s(square);
        let mut sums = [simd.splat_f64s(0.0); 6];
        for (k, weight) in weights.iter().enumerate() {
            let d = minus(simd, [rows[0][k], rows[1][k], rows[2][k]], centroid);
            let (x, y) = (dot(simd, x_axis, d), dot(simd, y_axis, d));
            let z = simd.sub_f64s(simd.mul_add_e_f64s(x, x, simd.mul_f64s(y, y)), mean);
            add_products(simd, *weight, [x, y, z], &mut sums);
        }
        let [xx, xy, yy, xz, yz, zz] = means(simd, sums, all.frames as f64);
        PlaneMoments { square, xx, xy, yy, xz, yz, zz }
    }
}
