//! How far the features have turned in every frame since the first, summed up, and how far they are from circles.

use jointscope_motion::{Columns, Rows, arch, sum_of_lanes};
use nalgebra::{Complex, Point3, Vector3};
use pulp::{Simd, WithSimd};

use super::{BLOCK, dot, minus, registers, splat};

/// Products of places in a plane with the conjugate of the first place, summed up over features, by frame; places are told
/// by the gradients of their two coordinates about a point.
pub(in super::super) struct Turned {
    point: Point3<f64>,
    axes: [Vector3<f64>; 2],
    /// Where each feature was at first.
    starts: Vec<Point3<f64>>,
    sums: [Vec<f64>; 2],
    off: Vec<Off>,
}

/// Sums, and sums of squares, of how much farther from the axis and higher than at first a feature is.
#[derive(Clone, Default)]
struct Off {
    sums: [f64; 2],
    squares: [f64; 2],
}

impl Turned {
    /// Of nothing yet.
    pub(in super::super) fn about(point: Point3<f64>, axes: [Vector3<f64>; 2], columns: Columns<'_>) -> Self {
        let none = vec![0.0; columns.frames().next_multiple_of(BLOCK)];
        let starts: Vec<Point3<f64>> = columns.summaries().iter().map(|known| known.first).collect();
        Self { point, axes, off: vec![Off::default(); starts.len()], starts, sums: [none.clone(), none] }
    }

    /// Of all features.
    pub(in super::super) fn of_all(point: Point3<f64>, axes: [Vector3<f64>; 2], columns: Columns<'_>) -> Self {
        let mut turned = Self::about(point, axes, columns);
        columns.in_turn(|frame, rows| {
            for (feature, rows) in rows.iter().enumerate() {
                turned.add(frame, feature, *rows);
            }
        });
        turned
    }

    /// Adds a feature's positions in some frames, beginning with the one given.
    pub(in super::super) fn add(&mut self, frame: usize, feature: usize, rows: Rows<'_>) {
        let Self { point, axes, starts, sums: [real, imaginary], off } = self;
        let [real, imaginary] = [real, imaginary].map(|sums| &mut sums[frame..][..rows.weights.len()]);
        let (start, off) = (starts[feature], &mut off[feature]);
        arch().dispatch(Kernel { rows, point: *point, axes: *axes, start, sums: [real, imaginary], off });
    }

    /// If the gradients are unit vectors at right angles: the sum of squared distances of a feature's positions, of which
    /// there are so many, from the circle about the axis across them that is nearest, of mean radius and height.
    pub(in super::super) fn off_circle(&self, feature: usize, count: usize) -> f64 {
        let Off { sums, squares } = &self.off[feature];
        (0..2).map(|k| (squares[k] - sums[k] * sums[k] / count as f64).max(0.0)).sum()
    }

    pub(in super::super) fn sums(&self) -> impl Iterator<Item = Complex<f64>> + '_ {
        self.sums[0].iter().zip(&self.sums[1]).map(|(re, im)| Complex::new(*re, *im))
    }
}

struct Kernel<'a> {
    rows: Rows<'a>,
    point: Point3<f64>,
    axes: [Vector3<f64>; 2],
    start: Point3<f64>,
    sums: [&'a mut [f64]; 2],
    off: &'a mut Off,
}

impl WithSimd for Kernel<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows: all, point, axes, start, sums: [real, imaginary], off } = self;
        let rows = registers(simd, all.coordinates);
        let weights = S::as_simd_f64s(all.weights).0;
        let about = splat(simd, point.coords.into());
        let axis = axes[0].cross(&axes[1]);
        let (x_axis, y_axis, z_axis) =
            (splat(simd, axes[0].into()), splat(simd, axes[1].into()), splat(simd, axis.into()));
        // About the first position sums of squares lose no digits.
        let start = start - point;
        let [x, y, z] = [axes[0], axes[1], axis].map(|axis| axis.dot(&start));
        let (start_x, start_y, height) = (simd.splat_f64s(x), simd.splat_f64s(y), simd.splat_f64s(z));
        let radius = simd.splat_f64s(x.hypot(y));
        let zero = simd.splat_f64s(0.0);
        let (real, imaginary) = (S::as_mut_simd_f64s(real).0, S::as_mut_simd_f64s(imaginary).0);
        let (mut lanes_of_sums, mut lanes_of_squares) = ([[0.0; BLOCK]; 2], [[0.0; BLOCK]; 2]);
        // Of narrow registers, as many as hold what a wide one would, one after another: lane by lane the same.
        let parts = BLOCK / S::F64_LANES;
        for part in 0..parts {
            let (mut sums, mut squares) = ([zero; 2], [zero; 2]);
            for k in (part..weights.len()).step_by(parts) {
                let d = minus(simd, [rows[0][k], rows[1][k], rows[2][k]], about);
                let (x, y) = (dot(simd, x_axis, d), dot(simd, y_axis, d));
                let re = simd.mul_add_f64s(start_x, x, simd.mul_f64s(start_y, y));
                let im = simd.sub_f64s(simd.mul_f64s(start_x, y), simd.mul_f64s(start_y, x));
                real[k] = simd.add_f64s(real[k], re);
                imaginary[k] = simd.add_f64s(imaginary[k], im);
                let length = simd.sqrt_f64s(simd.mul_add_f64s(x, x, simd.mul_f64s(y, y)));
                let wider = simd.sub_f64s(length, radius);
                let higher = simd.sub_f64s(dot(simd, z_axis, d), height);
                let (weighted_wider, weighted_higher) =
                    (simd.mul_f64s(weights[k], wider), simd.mul_f64s(weights[k], higher));
                sums[0] = simd.add_f64s(sums[0], weighted_wider);
                sums[1] = simd.add_f64s(sums[1], weighted_higher);
                squares[0] = simd.mul_add_f64s(weighted_wider, wider, squares[0]);
                squares[1] = simd.mul_add_f64s(weighted_higher, higher, squares[1]);
            }
            for k in 0..2 {
                S::as_mut_simd_f64s(&mut lanes_of_sums[k]).0[part] = sums[k];
                S::as_mut_simd_f64s(&mut lanes_of_squares[k]).0[part] = squares[k];
            }
        }
        for k in 0..2 {
            off.sums[k] += sum_of_lanes(&lanes_of_sums[k]);
            off.squares[k] += sum_of_lanes(&lanes_of_squares[k]);
        }
    }
}
