//! How far the features have gone in every frame since the first, summed up.

use jointscope_motion::Columns;
use nalgebra::{Complex, Point3, Vector3};
use pulp::{Arch, Simd, WithSimd};

use super::{dot, minus, registers, splat};

/// Displacements along a direction, of all features, by frame.
pub(in super::super) fn slides(columns: &Columns, direction: Vector3<f64>) -> Vec<f64> {
    let mut sums = vec![0.0; columns.weights().len()];
    for feature in 0..columns.features() {
        Arch::new().dispatch(Slides { columns, feature, direction, sums: &mut sums });
    }
    sums.truncate(columns.frames());
    sums
}

/// Products of places in the plane with the conjugate of the first place, of all features, by frame; places are told by
/// the gradients `x` and `y` of their coordinates about a point.
pub(in super::super) fn turns(
    columns: &Columns,
    point: Point3<f64>,
    x: Vector3<f64>,
    y: Vector3<f64>,
) -> Vec<Complex<f64>> {
    let row = columns.weights().len();
    let (mut real, mut imaginary) = (vec![0.0; row], vec![0.0; row]);
    for feature in 0..columns.features() {
        let sums = [&mut real[..], &mut imaginary[..]];
        Arch::new().dispatch(Turns { columns, feature, point, axes: [x, y], sums });
    }
    real.into_iter().zip(imaginary).take(columns.frames()).map(|(re, im)| Complex::new(re, im)).collect()
}

struct Slides<'a> {
    columns: &'a Columns,
    feature: usize,
    direction: Vector3<f64>,
    sums: &'a mut [f64],
}

impl WithSimd for Slides<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let rows = registers(simd, self.columns.rows(self.feature));
        let start = splat(simd, self.columns.point(self.feature, 0).coords.into());
        let direction = splat(simd, self.direction.into());
        for (k, sum) in S::as_mut_simd_f64s(self.sums).0.iter_mut().enumerate() {
            let d = minus(simd, [rows[0][k], rows[1][k], rows[2][k]], start);
            *sum = simd.add_f64s(*sum, dot(simd, direction, d));
        }
    }
}

struct Turns<'a> {
    columns: &'a Columns,
    feature: usize,
    point: Point3<f64>,
    axes: [Vector3<f64>; 2],
    sums: [&'a mut [f64]; 2],
}

impl WithSimd for Turns<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { columns, feature, point, axes, sums: [real, imaginary] } = self;
        let rows = registers(simd, columns.rows(feature));
        let about = splat(simd, point.coords.into());
        let (x_axis, y_axis) = (splat(simd, axes[0].into()), splat(simd, axes[1].into()));
        let start = columns.point(feature, 0) - point;
        let (start_x, start_y) = (simd.splat_f64s(axes[0].dot(&start)), simd.splat_f64s(axes[1].dot(&start)));
        let (real, imaginary) = (S::as_mut_simd_f64s(real).0, S::as_mut_simd_f64s(imaginary).0);
        for k in 0..real.len() {
            let d = minus(simd, [rows[0][k], rows[1][k], rows[2][k]], about);
            let (x, y) = (dot(simd, x_axis, d), dot(simd, y_axis, d));
            let re = simd.mul_add_e_f64s(start_x, x, simd.mul_f64s(start_y, y));
            let im = simd.sub_f64s(simd.mul_f64s(start_x, y), simd.mul_f64s(start_y, x));
            real[k] = simd.add_f64s(real[k], re);
            imaginary[k] = simd.add_f64s(imaginary[k], im);
        }
    }
}
