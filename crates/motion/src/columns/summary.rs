//! What a trajectory shows at a glance: where it is, how far it spreads and goes.

use nalgebra::{Matrix3, Point3, Vector3, distance};
use pulp::{Simd, WithSimd};

use super::{BLOCK, Rows};
use crate::instructions::{arch, sum_of_lanes};
use crate::path_length_of_rows;

/// Mean, moments and lengths of one feature's trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// First position, metres.
    pub first: Point3<f64>,
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
    third: [f64; THIRD],
    fourth: [f64; FOURTH],
}

/// Products of three and of four coordinates that differ, in alphabetical order.
const THIRD: usize = 10;
const FOURTH: usize = 15;
/// Which product of three is that of a coordinate and a pair of them: pairs are `xx`, `xy`, `xz`, `yy`, `yz`, `zz`.
const OF_THREE: [[usize; 6]; 3] = [[0, 1, 2, 3, 4, 5], [1, 3, 4, 6, 7, 8], [2, 4, 5, 7, 8, 9]];
/// Which product of four is that of two pairs.
const OF_FOUR: [[usize; 6]; 6] = [
    [0, 1, 2, 3, 4, 5],
    [1, 3, 4, 6, 7, 8],
    [2, 4, 5, 7, 8, 9],
    [3, 6, 7, 10, 11, 12],
    [4, 7, 8, 11, 12, 13],
    [5, 8, 9, 12, 13, 14],
];

impl Summary {
    /// Means of `d q` and of `q²`, where `d` is a position less the mean position and `q = dᵀ form d`, in cubes and fourth
    /// powers of metres for a form without a unit; the form is symmetric.
    ///
    /// Computed from moments about the first position, whose sizes rounding refers to.
    pub fn by_form(&self, form: &Matrix3<f64>) -> (Vector3<f64>, f64) {
        let pairs = [form.m11, 2.0 * form.m12, 2.0 * form.m13, form.m22, 2.0 * form.m23, form.m33];
        let of_pairs =
            |of: &[f64], places: &[usize; 6]| -> f64 { pairs.iter().zip(places).map(|(w, k)| w * of[*k]).sum() };
        let cubic = Vector3::from_fn(|axis, _| of_pairs(&self.third, &OF_THREE[axis]));
        let quartic: f64 = pairs.iter().zip(&OF_FOUR).map(|(w, places)| w * of_pairs(&self.fourth, places)).sum();
        // What was summed up is about the first position, from which the mean differs by `m`.
        let m = self.mean - self.first.coords;
        let second = self.covariance + m * m.transpose();
        let by_form = form * m;
        let (size, square) = (by_form.dot(&m), form.component_mul(&second).sum());
        let turned = second * by_form;
        let about_mean = cubic - 2.0 * turned + m * (2.0 * size - square);
        let squares = quartic + 4.0 * (by_form.dot(&turned) - by_form.dot(&cubic)) + size * (2.0 * square - 3.0 * size);
        (about_mean, squares)
    }
}

/// Sums over a trajectory that give its summary, but for the extent.
#[derive(Debug, Clone, Default)]
pub(super) struct Sums {
    ends: Option<[Point3<f64>; 2]>,
    count: usize,
    first: [f64; 3],
    second: [f64; 6],
    third: [f64; THIRD],
    fourth: [f64; FOURTH],
    magnitude: f64,
    moved: f64,
    path: f64,
}

impl Sums {
    /// Adds the frames that come next.
    pub(super) fn add(&mut self, rows: Rows<'_>) {
        let (begin, end) = (rows.point(0), rows.point(rows.frames - 1));
        let first = match self.ends {
            Some([first, last]) => {
                self.path += distance(&last, &begin);
                first
            }
            None => begin,
        };
        self.ends = Some([first, end]);
        self.count += rows.frames;
        self.path += path_length_of_rows(rows.coordinates, rows.frames);
        arch().dispatch(Moments { rows, first, sums: self });
    }

    pub(super) fn summary(&self, extent: f64) -> Summary {
        let count = self.count.max(1) as f64;
        let first = self.ends.map_or_else(Point3::origin, |[first, _]| first);
        let step = Vector3::from(self.first) / count;
        let [xx, xy, xz, yy, yz, zz] = self.second.map(|sum| sum / count);
        let second = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        Summary {
            first,
            mean: first.coords + step,
            covariance: second - step * step.transpose(),
            magnitude: self.magnitude,
            moved: self.moved,
            path: self.path,
            extent,
            third: self.third.map(|sum| sum / count),
            fourth: self.fourth.map(|sum| sum / count),
        }
    }
}

struct Moments<'a> {
    rows: Rows<'a>,
    first: Point3<f64>,
    sums: &'a mut Sums,
}

impl WithSimd for Moments<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows, first, sums } = self;
        let [x, y, z] = rows.coordinates;
        let rows = [S::as_simd_f64s(x).0, S::as_simd_f64s(y).0, S::as_simd_f64s(z).0];
        let from = [simd.splat_f64s(first.x), simd.splat_f64s(first.y), simd.splat_f64s(first.z)];
        let zero = simd.splat_f64s(0.0);
        let (mut magnitude, mut moved) = ([zero; 3], [zero; 3]);
        let (mut first_lanes, mut second_lanes) = ([[0.0; BLOCK]; 3], [[0.0; BLOCK]; 6]);
        let (mut third_lanes, mut fourth_lanes) = ([[0.0; BLOCK]; THIRD], [[0.0; BLOCK]; FOURTH]);
        // Of narrow registers, as many as hold what a wide one would, one after another: lane by lane the same.
        let parts = BLOCK / S::F64_LANES;
        for part in 0..parts {
            let (mut of_first, mut of_second) = ([zero; 3], [zero; 6]);
            for k in (part..rows[0].len()).step_by(parts) {
                // What rows are filled up with is the first position, and adds nothing.
                let d = steps(simd, rows, from, k);
                for axis in 0..3 {
                    of_first[axis] = simd.add_f64s(of_first[axis], d[axis]);
                    moved[axis] = simd.max_f64s(moved[axis], simd.abs_f64s(d[axis]));
                    magnitude[axis] = simd.max_f64s(magnitude[axis], simd.abs_f64s(rows[axis][k]));
                }
                let pairs = pairs(simd, d);
                for pair in 0..6 {
                    of_second[pair] = simd.add_f64s(of_second[pair], pairs[pair]);
                }
            }
            // Registers hold as many sums at a time.
            let (mut of_third, mut of_fourth) = ([zero; THIRD], [zero; FOURTH]);
            for k in (part..rows[0].len()).step_by(parts) {
                let d = steps(simd, rows, from, k);
                let [xx, xy, xz, yy, yz, zz] = pairs(simd, d);
                add(simd, d[0], &[xx, xy, xz, yy, yz, zz], &mut of_third[..6]);
                add(simd, d[1], &[yy, yz, zz], &mut of_third[6..9]);
                add(simd, d[2], &[zz], &mut of_third[9..]);
                add(simd, xx, &[xx, xy, xz, yy, yz, zz], &mut of_fourth[..6]);
                add(simd, xy, &[yy, yz, zz], &mut of_fourth[6..9]);
                add(simd, xz, &[zz], &mut of_fourth[9..10]);
                add(simd, yy, &[yy, yz, zz], &mut of_fourth[10..13]);
                add(simd, yz, &[zz], &mut of_fourth[13..14]);
                add(simd, zz, &[zz], &mut of_fourth[14..]);
            }
            store(simd, part, &of_first, &mut first_lanes);
            store(simd, part, &of_second, &mut second_lanes);
            store(simd, part, &of_third, &mut third_lanes);
            store(simd, part, &of_fourth, &mut fourth_lanes);
        }
        for k in 0..3 {
            sums.moved = sums.moved.max(simd.reduce_max_f64s(moved[k]));
            sums.magnitude = sums.magnitude.max(simd.reduce_max_f64s(magnitude[k]));
        }
        add_lanes(&first_lanes, &mut sums.first);
        add_lanes(&second_lanes, &mut sums.second);
        add_lanes(&third_lanes, &mut sums.third);
        add_lanes(&fourth_lanes, &mut sums.fourth);
    }
}

/// Writes the register of each of several sums into that part of its lanes.
#[inline(always)]
fn store<S: Simd>(_: S, part: usize, registers: &[S::f64s], lanes: &mut [[f64; BLOCK]]) {
    for (register, lanes) in registers.iter().zip(lanes) {
        S::as_mut_simd_f64s(lanes).0[part] = *register;
    }
}

#[inline(always)]
fn add_lanes(lanes: &[[f64; BLOCK]], sums: &mut [f64]) {
    for (lanes, sum) in lanes.iter().zip(sums) {
        *sum += sum_of_lanes(lanes);
    }
}

/// A register of differences from a position.
#[inline(always)]
fn steps<S: Simd>(simd: S, rows: [&[S::f64s]; 3], from: [S::f64s; 3], k: usize) -> [S::f64s; 3] {
    [simd.sub_f64s(rows[0][k], from[0]), simd.sub_f64s(rows[1][k], from[1]), simd.sub_f64s(rows[2][k], from[2])]
}

/// Products of two coordinates: `xx`, `xy`, `xz`, `yy`, `yz`, `zz`.
#[inline(always)]
fn pairs<S: Simd>(simd: S, [x, y, z]: [S::f64s; 3]) -> [S::f64s; 6] {
    [
        simd.mul_f64s(x, x),
        simd.mul_f64s(x, y),
        simd.mul_f64s(x, z),
        simd.mul_f64s(y, y),
        simd.mul_f64s(y, z),
        simd.mul_f64s(z, z),
    ]
}

/// Adds products with a common factor.
#[inline(always)]
fn add<S: Simd>(simd: S, factor: S::f64s, of: &[S::f64s], sums: &mut [S::f64s]) {
    for k in 0..of.len() {
        sums[k] = simd.mul_add_f64s(factor, of[k], sums[k]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding through fourth powers.
    const EXACT: f64 = 1e-12;

    #[test]
    fn moments_are_those_of_the_positions_also_where_these_come_in_several_parts() {
        const FRAMES: usize = 53;
        let wild = |k: usize| (k as f64 * 12.9898).sin().mul_add(43_758.545_3, 0.5).rem_euclid(1.0);
        let place = |frame: usize| Vector3::new(3.0 + wild(frame), 0.3 * wild(100 + frame), -wild(200 + frame).powi(2));
        let points: Vec<Vector3<f64>> = (0..FRAMES).map(place).collect();
        let form = Matrix3::new(1.0, 0.2, -0.3, 0.2, 0.7, 0.1, -0.3, 0.1, 1.4);
        let mean = points.iter().sum::<Vector3<f64>>() / FRAMES as f64;
        let of_all =
            |of: &dyn Fn(&Vector3<f64>) -> f64| points.iter().map(|p| of(&(p - mean))).sum::<f64>() / FRAMES as f64;
        let q = |d: &Vector3<f64>| d.dot(&(form * d));
        let expected =
            [of_all(&|d| d.x * q(d)), of_all(&|d| d.y * q(d)), of_all(&|d| d.z * q(d)), of_all(&|d| q(d).powi(2))];
        let variance = of_all(&|d| d.x * d.y);
        for part in [8, 16, FRAMES] {
            let mut sums = Sums::default();
            for some in points.chunks(part) {
                let length = some.len().next_multiple_of(8);
                let row = |axis: usize| -> Vec<f64> {
                    (0..length).map(|k| some.get(k).unwrap_or(&points[0])[axis]).collect()
                };
                let rows = [row(0), row(1), row(2)];
                let weights: Vec<f64> = (0..length).map(|k| f64::from(u8::from(k < some.len()))).collect();
                let coordinates = [&rows[0][..], &rows[1], &rows[2]];
                sums.add(Rows { coordinates, weights: &weights, frames: some.len() });
            }
            let summary = sums.summary(0.0);
            let (cubic, quartic) = summary.by_form(&form);
            for (found, expected) in [cubic.x, cubic.y, cubic.z, quartic].iter().zip(expected) {
                assert!((found - expected).abs() < EXACT, "{part}: {found} {expected}");
            }
            assert!((summary.mean - mean).norm() < EXACT && (summary.covariance.m12 - variance).abs() < EXACT);
            let path: f64 = points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
            assert!(
                (summary.path - path).abs() < EXACT
                    && summary.magnitude == points.iter().map(Vector3::amax).fold(0.0, f64::max)
            );
        }
    }
}
