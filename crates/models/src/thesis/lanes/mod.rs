//! What the thesis's models ask of trajectories, several frames in the lanes of a register.
//!
//! It is what the models ask of single points, for features that are always seen; results differ by rounding only.
//! Kernels are written once for all instruction sets; what is not inlined into the place where these are found would
//! lose them, so everything here is.

#![expect(clippy::inline_always, reason = "what is not inlined loses the instruction set")]

mod arc;
mod eigen;
mod tube;
mod turned;

pub(super) use arc::on_circle;
pub(super) use eigen::principal_axes;
pub(super) use tube::{Tallied, along_tube};
pub(super) use turned::Turned;

use pulp::Simd;

/// Frames that are filled up together: the lanes of the widest registers.
const BLOCK: usize = 8;
/// Adding and subtracting this rounds to a whole number; adding it alone shows a small whole number in the lower bits:
/// 3·2⁵¹.
const ROUNDS: f64 = 6_755_399_441_055_744.0;

/// The whole number to which [`ROUNDS`] was added.
#[inline(always)]
fn bits_shown(number: f64) -> usize {
    (number.to_bits() & 0xFFFF_FFFF) as usize
}

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
    let sum = simd.mul_add_f64s(a[1], b[1], sum);
    simd.mul_add_f64s(a[2], b[2], sum)
}

/// Scalar products, and a constant.
#[inline(always)]
fn along<S: Simd>(simd: S, a: [S::f64s; 3], b: [S::f64s; 3], constant: S::f64s) -> S::f64s {
    let sum = simd.mul_add_f64s(a[0], b[0], constant);
    let sum = simd.mul_add_f64s(a[1], b[1], sum);
    simd.mul_add_f64s(a[2], b[2], sum)
}

#[cfg(test)]
mod tests;
