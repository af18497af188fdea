//! Which points of a trajectory lie on its circle, and which degrees of it they occupy.

use jointscope_motion::{Rows, arch};
use pulp::{Simd, WithSimd};

use super::super::Circle;
use super::super::occupied::Degrees;
use super::{ROUNDS, along, bits_shown, registers, splat};

/// Coefficients of an odd polynomial that is the arctangent on [0, 1] within 1e-7 degrees, the highest first.
const ARCTANGENT: [f64; 10] = [
    -0.001_701_170_09,
    0.010_487_649_4,
    -0.030_351_865_115,
    0.057_089_556_331,
    -0.083_497_249_968,
    0.109_323_415_133,
    -0.142_600_160_857,
    0.199_980_752_815,
    -0.333_332_762_92,
    0.999_999_997_161,
];
/// Distance from a whole degree, in degrees, within which that polynomial does not tell which degree it is.
const NEAR: f64 = 1e-5;
/// What is put down instead of the degree then.
const VAGUE: u16 = 500;
/// Points whose degrees are found before any is put down.
const TOGETHER: usize = 256;

/// How many of a feature's points are within `tolerance` radii of its circle; the whole degrees that they occupy are added.
pub(in super::super) fn on_circle(rows: Rows<'_>, circle: &Circle, tolerance: f64, degrees: &mut Degrees) -> f64 {
    arch().dispatch(Kernel { rows, circle, tolerance, degrees })
}

struct Kernel<'a> {
    rows: Rows<'a>,
    circle: &'a Circle,
    tolerance: f64,
    degrees: &'a mut Degrees,
}

impl WithSimd for Kernel<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { rows: all, circle, tolerance, degrees } = self;
        let rows = registers(simd, all.coordinates);
        let weights = S::as_simd_f64s(all.weights).0;
        let [x_axis, y_axis] =
            [circle.x_axis.into_inner(), circle.normal.cross(&circle.x_axis)].map(|axis| axis / circle.radius);
        let (x_shift, y_shift) = (-x_axis.dot(&circle.centre.coords), -y_axis.dot(&circle.centre.coords));
        let (x_shift, y_shift) = (simd.splat_f64s(x_shift), simd.splat_f64s(y_shift));
        let (x_axis, y_axis) = (splat(simd, x_axis.into()), splat(simd, y_axis.into()));
        let zero = simd.splat_f64s(0.0);
        // Squared radii tell as well what is near the circle, without a root.
        let nearest = simd.splat_f64s((1.0 - tolerance).max(0.0).powi(2));
        let farthest = simd.splat_f64s((1.0 + tolerance).powi(2));
        let (rounds, half, sure) = (simd.splat_f64s(ROUNDS), simd.splat_f64s(0.5), simd.splat_f64s(0.5 - NEAR));
        let vague = simd.splat_f64s(ROUNDS + f64::from(VAGUE));
        let mut inside = zero;
        let mut wholes = [0.0; TOGETHER];
        for start in (0..weights.len()).step_by(TOGETHER / S::F64_LANES) {
            let registers = (TOGETHER / S::F64_LANES).min(weights.len() - start);
            for (k, of_register) in (start..).zip(&mut S::as_mut_simd_f64s(&mut wholes).0[..registers]) {
                let place = [rows[0][k], rows[1][k], rows[2][k]];
                let (x, y) = (along(simd, x_axis, place, x_shift), along(simd, y_axis, place, y_shift));
                let square = simd.mul_add_f64s(x, x, simd.mul_f64s(y, y));
                let counts = simd.select_f64s(simd.less_than_or_equal_f64s(square, farthest), weights[k], zero);
                let counts = simd.select_f64s(simd.less_than_or_equal_f64s(nearest, square), counts, zero);
                inside = simd.add_f64s(inside, counts);
                let angle = in_degrees(simd, x, y);
                // Half a degree less is rounded to the whole degree below.
                let less = simd.sub_f64s(angle, half);
                let whole = simd.add_f64s(less, rounds);
                let from_middle = simd.sub_f64s(less, simd.sub_f64s(whole, rounds));
                let is_sure = simd.less_than_f64s(simd.abs_f64s(from_middle), sure);
                *of_register = simd.select_f64s(is_sure, whole, vague);
            }
            // What is filled up repeats the very first frame, and occupies nothing new.
            for (index, whole) in (start * S::F64_LANES..).zip(&wholes[..registers * S::F64_LANES]) {
                let degree = bits_shown(*whole);
                if degree < usize::from(VAGUE) {
                    degrees.occupy_degree(degree);
                } else {
                    let (x, y) = circle.on_unit_circle(&all.point(index));
                    degrees.occupy(x, y);
                }
            }
        }
        // Whole numbers, which are added up exactly in any order.
        simd.reduce_sum_f64s(inside)
    }
}

/// Angles of points in degrees, 0 to 360, within what the polynomial leaves.
#[inline(always)]
fn in_degrees<S: Simd>(simd: S, x: S::f64s, y: S::f64s) -> S::f64s {
    let zero = simd.splat_f64s(0.0);
    let (across, up) = (simd.abs_f64s(x), simd.abs_f64s(y));
    let (most, least) = (simd.max_f64s(across, up), simd.min_f64s(across, up));
    let tangent = simd.div_f64s(least, simd.max_f64s(most, simd.splat_f64s(f64::MIN_POSITIVE)));
    let square = simd.mul_f64s(tangent, tangent);
    let mut sum = simd.splat_f64s(ARCTANGENT[0].to_degrees());
    for coefficient in &ARCTANGENT[1..] {
        sum = simd.mul_add_f64s(sum, square, simd.splat_f64s(coefficient.to_degrees()));
    }
    let angle = simd.mul_f64s(sum, tangent);
    let steep = simd.greater_than_f64s(up, across);
    let angle = simd.select_f64s(steep, simd.sub_f64s(simd.splat_f64s(90.0), angle), angle);
    let left = simd.less_than_f64s(x, zero);
    let angle = simd.select_f64s(left, simd.sub_f64s(simd.splat_f64s(180.0), angle), angle);
    let below = simd.less_than_f64s(y, zero);
    simd.select_f64s(below, simd.sub_f64s(simd.splat_f64s(360.0), angle), angle)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_polynomial_is_the_arctangent_well_within_what_tells_degrees_apart() {
        for tangent in (0..=1000).map(|k| f64::from(k) / 1000.0) {
            let polynomial = super::ARCTANGENT.iter().fold(0.0, |sum, c| sum * tangent * tangent + c) * tangent;
            let off = (polynomial - tangent.atan()).to_degrees().abs();
            assert!(off < super::NEAR / 2.0, "{off} degrees at {tangent}");
        }
    }
}
