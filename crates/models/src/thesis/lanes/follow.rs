//! How far the features have gone in every frame since the first, summed up.

use jointscope_motion::{Columns, Rows};
use nalgebra::{Complex, Point3, Unit, Vector3};
use pulp::{Arch, Simd, WithSimd};

use super::{BLOCK, dot, minus, registers, splat};

/// Displacements along a direction, summed up over features, by frame.
pub(in super::super) struct Slid {
    direction: Vector3<f64>,
    sums: Vec<f64>,
}

impl Slid {
    pub(in super::super) fn along(direction: Unit<Vector3<f64>>, columns: Columns<'_>) -> Self {
        Self { direction: direction.into_inner(), sums: vec![0.0; columns.frames().next_multiple_of(BLOCK)] }
    }

    /// Adds a feature.
    pub(in super::super) fn add(&mut self, rows: Rows<'_>) {
        Arch::new().dispatch(Slides { rows, direction: self.direction, sums: &mut self.sums });
    }

    /// Mean displacements of so many features.
    pub(in super::super) fn means(&self, features: usize) -> impl Iterator<Item = f64> + '_ {
        self.sums.iter().map(move |sum| sum / features as f64)
    }
}

/// Products of places in a plane with the conjugate of the first place, summed up over features, by frame; places are told
/// by the gradients `x` and `y` of their coordinates about a point.
pub(in super::super) struct Turned {
    point: Point3<f64>,
    axes: [Vector3<f64>; 2],
    sums: [Vec<f64>; 2],
}

impl Turned {
    pub(in super::super) fn about(point: Point3<f64>, axes: [Vector3<f64>; 2], columns: Columns<'_>) -> Self {
        let none = vec![0.0; columns.frames().next_multiple_of(BLOCK)];
        Self { point, axes, sums: [none.clone(), none] }
    }

    /// Adds a feature.
    pub(in super::super) fn add(&mut self, rows: Rows<'_>) {
        let [real, imaginary] = &mut self.sums;
        Arch::new().dispatch(Turns { rows, point: self.point, axes: self.axes, sums: [real, imaginary] });
    }

    pub(in super::super) fn sums(&self) -> impl Iterator<Item = Complex<f64>> + '_ {
        self.sums[0].iter().zip(&self.sums[1]).map(|(re, im)| Complex::new(*re, *im))
    }
}

struct Slides<'a> {
    rows: Rows<'a>,
    direction: Vector3<f64>,
    sums: &'a mut [f64],
}

impl WithSimd for Slides<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let rows = registers(simd, self.rows.coordinates);
        let start = splat(simd, self.rows.point(0).coords.into());
        let direction = splat(simd, self.direction.into());
        for (k, sum) in S::as_mut_simd_f64s(self.sums).0.iter_mut().enumerate() {
            let d = minus(simd, [rows[0][k], rows[1][k], rows[2][k]], start);
            *sum = simd.add_f64s(*sum, dot(simd, direction, d));
        }
    }
}

struct Turns<'a> {
    rows: Rows<'a>,
    point: Point3<f64>,
    axes: [Vector3<f64>; 2],
    sums: [&'a mut [f64]; 2],
}

impl WithSimd for Turns<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows: all, point, axes, sums: [real, imaginary] } = self;
        let rows = registers(simd, all.coordinates);
        let about = splat(simd, point.coords.into());
        let (x_axis, y_axis) = (splat(simd, axes[0].into()), splat(simd, axes[1].into()));
        let start = all.point(0) - point;
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
