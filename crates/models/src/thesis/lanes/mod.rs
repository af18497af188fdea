//! What the thesis's models ask of trajectories, several frames in the lanes of a register.
//!
//! It is what the models ask of single points, for features that are always seen; results differ by rounding only.
//! Kernels are written once for all instruction sets; what is not inlined into the place where these are found would
//! lose them, so everything here is.

#![expect(clippy::inline_always, reason = "what is not inlined loses the instruction set")]
#![expect(clippy::needless_range_loop, reason = "one index runs through several rows")]

mod arc;
mod follow;
mod moments;
mod off_circle;
mod plane;
mod tube;

pub(super) use arc::on_circle;
pub(super) use follow::{slides, turns};
pub(super) use moments::Moments;
pub(super) use off_circle::off_circle;
pub(super) use plane::PlaneMoments;
pub(super) use tube::{Tallied, along_tube};

use pulp::Simd;

/// Frames that are filled up together: the lanes of the widest registers.
const BLOCK: usize = 8;

/// The registers of three rows.
#[inline(always)]
fn registers<S: Simd>(_: S, rows: [&[f64]; 3]) -> [&[S::f64s]; 3] {
    [S::as_simd_f64s(rows[0]).0, S::as_simd_f64s(rows[1]).0, S::as_simd_f64s(rows[2]).0]
}

/// Three numbers, each in all lanes.
#[inline(always)]
fn splat<S: Simd>(simd: S, numbers: [f64; 3]) -> [S::f64s; 3] {
    [simd.splat_f64s(numbers[0]), simd.splat_f64s(numbers[1]), simd.splat_f64s(numbers[2])]
}

/// Differences.
#[inline(always)]
fn minus<S: Simd>(simd: S, a: [S::f64s; 3], b: [S::f64s; 3]) -> [S::f64s; 3] {
    [simd.sub_f64s(a[0], b[0]), simd.sub_f64s(a[1], b[1]), simd.sub_f64s(a[2], b[2])]
}

/// Scalar products.
#[inline(always)]
fn dot<S: Simd>(simd: S, a: [S::f64s; 3], b: [S::f64s; 3]) -> S::f64s {
    let sum = simd.mul_f64s(a[0], b[0]);
    let sum = simd.mul_add_e_f64s(a[1], b[1], sum);
    simd.mul_add_e_f64s(a[2], b[2], sum)
}

/// Lengths of vector products.
#[inline(always)]
fn cross_length<S: Simd>(simd: S, a: [S::f64s; 3], b: [S::f64s; 3]) -> S::f64s {
    let x = simd.sub_f64s(simd.mul_f64s(a[1], b[2]), simd.mul_f64s(a[2], b[1]));
    let y = simd.sub_f64s(simd.mul_f64s(a[2], b[0]), simd.mul_f64s(a[0], b[2]));
    let z = simd.sub_f64s(simd.mul_f64s(a[0], b[1]), simd.mul_f64s(a[1], b[0]));
    simd.sqrt_f64s(dot(simd, [x, y, z], [x, y, z]))
}

#[cfg(test)]
mod tests;
