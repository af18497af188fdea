//! How far a trajectory is from a circle about an axis.

use jointscope_motion::Rows;
use nalgebra::{Point3, Unit, Vector3};
use pulp::{Arch, Simd, WithSimd};

use super::{cross_length, dot, minus, registers, splat};

/// Sum of squared distances of a feature's positions from the circle about an axis that is nearest to them: of its mean
/// radius and height.
pub(in super::super) fn off_circle(rows: Rows<'_>, point: Point3<f64>, direction: Unit<Vector3<f64>>) -> f64 {
    Arch::new().dispatch(Kernel { rows, point, direction })
}

struct Kernel<'a> {
    rows: Rows<'a>,
    point: Point3<f64>,
    direction: Unit<Vector3<f64>>,
}

impl WithSimd for Kernel<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { rows: all, point, direction } = self;
        let rows = registers(simd, all.coordinates);
        let weights = S::as_simd_f64s(all.weights).0;
        // About the first position sums of squares lose no digits.
        let start = all.point(0) - point;
        let radius = simd.splat_f64s(direction.cross(&start).norm());
        let height = simd.splat_f64s(direction.dot(&start));
        let (about, direction) = (splat(simd, point.coords.into()), splat(simd, direction.into_inner().into()));
        let zero = simd.splat_f64s(0.0);
        let (mut sums, mut squares) = ([zero; 2], [zero; 2]);
        for (k, weight) in weights.iter().enumerate() {
            let d = minus(simd, [rows[0][k], rows[1][k], rows[2][k]], about);
            let wider = simd.sub_f64s(cross_length(simd, direction, d), radius);
            let higher = simd.sub_f64s(dot(simd, direction, d), height);
            let (weighted_wider, weighted_higher) = (simd.mul_f64s(*weight, wider), simd.mul_f64s(*weight, higher));
            sums[0] = simd.add_f64s(sums[0], weighted_wider);
            sums[1] = simd.add_f64s(sums[1], weighted_higher);
            squares[0] = simd.mul_add_e_f64s(weighted_wider, wider, squares[0]);
            squares[1] = simd.mul_add_e_f64s(weighted_higher, higher, squares[1]);
        }
        let count = all.frames as f64;
        let mut total = 0.0;
        for k in 0..2 {
            let sum = simd.reduce_sum_f64s(sums[k]);
            total += (simd.reduce_sum_f64s(squares[k]) - sum * sum / count).max(0.0);
        }
        total
    }
}
