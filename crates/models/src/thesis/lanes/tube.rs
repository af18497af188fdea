//! Where the points of a trajectory are along a tube.

use jointscope_motion::Columns;
use nalgebra::Vector3;
use pulp::{Arch, Simd, WithSimd};

use super::super::prismatic::{Overshoot, Section};
use super::{BLOCK, cross_length, dot, minus, registers, splat};

/// What is counted along a tube.
pub(in super::super) struct Tallied<'a> {
    /// From the start to the end of the tube, metres.
    pub line: Vector3<f64>,
    /// Its radius, in its length.
    pub radius: f64,
    pub overshoot: Overshoot,
    pub sections: &'a mut [Section],
}

/// Counts a feature, shifted to start where the tube starts, in its sections; gives the sum of squared distances from
/// the line, in lengths of the tube.
pub(in super::super) fn along_tube(columns: &Columns, feature: usize, tallied: &mut Tallied<'_>) -> f64 {
    Arch::new().dispatch(Kernel { columns, feature, tallied })
}

struct Kernel<'a, 's> {
    columns: &'a Columns,
    feature: usize,
    tallied: &'a mut Tallied<'s>,
}

impl WithSimd for Kernel<'_, '_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { columns, feature, tallied } = self;
        let rows = registers(simd, columns.rows(feature));
        let weights = S::as_simd_f64s(columns.weights()).0;
        let start = splat(simd, columns.point(feature, 0).coords.into());
        let length = tallied.line.norm();
        let direction = splat(simd, (tallied.line / (length * length)).into());
        let (zero, radius) = (simd.splat_f64s(0.0), simd.splat_f64s(tallied.radius));
        let sections = tallied.sections.len();
        let drops = tallied.overshoot == Overshoot::Drop;
        let mut squares = zero;
        let (mut places, mut counts) = ([0.0; BLOCK], [0.0; BLOCK]);
        for (k, weight) in weights.iter().enumerate() {
            let d = minus(simd, [rows[0][k], rows[1][k], rows[2][k]], start);
            let (along, off) = (dot(simd, direction, d), cross_length(simd, direction, d));
            squares = simd.mul_add_e_f64s(simd.mul_f64s(off, off), *weight, squares);
            let inside = simd.select_f64s(simd.less_than_f64s(off, radius), *weight, zero);
            // Successive points are mostly in one section, and counted together.
            let (least, most) = (simd.reduce_min_f64s(along), simd.reduce_max_f64s(along));
            let (first, last) = (section(least, sections), section(most, sections));
            let all_count = (k + 1) * S::F64_LANES <= columns.frames() && !(drops && (least < 0.0 || most > 1.0));
            if first == last && all_count {
                tallied.sections[first].add(S::F64_LANES, whole(simd.reduce_sum_f64s(inside)));
                continue;
            }
            simd.partial_store_f64s(&mut places[..S::F64_LANES], along);
            simd.partial_store_f64s(&mut counts[..S::F64_LANES], inside);
            let left = (columns.frames() - (k * S::F64_LANES).min(columns.frames())).min(S::F64_LANES);
            for lane in 0..left {
                if !drops || (0.0..=1.0).contains(&places[lane]) {
                    tallied.sections[section(places[lane], sections)].add(1, whole(counts[lane]));
                }
            }
        }
        simd.reduce_sum_f64s(squares)
    }
}

/// A count.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a sum of ones")]
fn whole(count: f64) -> usize {
    count as usize
}

/// The section of a place, given as a share of the length; places beyond the ends are in the first and the last.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a negative share becomes section 0")]
fn section(along: f64, sections: usize) -> usize {
    ((along * sections as f64) as usize).min(sections - 1)
}
