//! Where the points of a trajectory are along a tube.

use jointscope_motion::{Rows, arch, sum_of_lanes};
use nalgebra::{Point3, Vector3};
use pulp::{Simd, WithSimd};

use super::super::prismatic::{END, Overshoot, Section};
use super::{BLOCK, ROUNDS, bits_shown, dot, minus, registers, splat};

/// What is counted along a tube.
pub(in super::super) struct Tallied {
    /// From the start to the end of the tube, metres.
    line: Vector3<f64>,
    /// Its radius, in its length.
    radius: f64,
    overshoot: Overshoot,
    sections: usize,
    /// Points of every kind in every section, for every lane if lanes count side by side.
    counts: Vec<usize>,
    /// Shares of the line that the features have gone since the first frame, summed up, by frame.
    gone: Vec<f64>,
}

/// Most sections in which lanes count side by side.
const SECTIONS_BESIDE: usize = 128;
/// Kinds of points in a section, by whether they count (1) and are inside (2).
const KINDS: usize = 4;
/// Points that are placed before any is counted.
const TOGETHER: usize = 256;
/// A little less than half, so that whole numbers less it are rounded up.
const HALF: f64 = 0.5 - 1e-12;
const LANES: [f64; BLOCK] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

impl Tallied {
    pub(in super::super) fn new(
        line: Vector3<f64>,
        radius: f64,
        overshoot: Overshoot,
        sections: usize,
        frames: usize,
    ) -> Self {
        let counts = vec![0; sections * KINDS * beside(sections)];
        Self { line, radius, overshoot, sections, counts, gone: vec![0.0; frames.next_multiple_of(BLOCK)] }
    }

    /// What was counted in every section.
    pub(in super::super) fn sections(&self) -> Vec<Section> {
        let beside = beside(self.sections);
        let of_kind = |counts: &[usize], kind: usize| counts[kind * beside..(kind + 1) * beside].iter().sum::<usize>();
        let of_section = |counts: &[usize]| Section::new(of_kind(counts, 1) + of_kind(counts, 3), of_kind(counts, 3));
        self.counts.chunks_exact(KINDS * beside).map(of_section).collect()
    }

    /// How far so many features have gone in the mean since the first frame, metres, by frame.
    pub(in super::super) fn slides(&self, features: usize) -> Vec<f64> {
        let mean = self.line.norm() / features as f64;
        self.gone.iter().map(|gone| gone * mean).collect()
    }
}

/// Lanes that count side by side.
fn beside(sections: usize) -> usize {
    if sections <= SECTIONS_BESIDE { BLOCK } else { 1 }
}

/// Counts a feature's positions from a frame on, shifted so that its very first one is where the tube starts, in their
/// sections; gives the sum of squared distances from the line, in lengths of the tube.
pub(in super::super) fn along_tube(rows: Rows<'_>, start: Point3<f64>, frame: usize, tallied: &mut Tallied) -> f64 {
    arch().dispatch(Kernel { rows, start, frame, tallied })
}

struct Kernel<'a> {
    rows: Rows<'a>,
    start: Point3<f64>,
    frame: usize,
    tallied: &'a mut Tallied,
}

impl WithSimd for Kernel<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { rows: all, start, frame, tallied } = self;
        let rows = registers(simd, all.coordinates);
        let weights = S::as_simd_f64s(all.weights).0;
        let start_place = splat(simd, start.coords.into());
        let length = tallied.line.norm();
        let direction = splat(simd, (tallied.line / (length * length)).into());
        let back = splat(simd, (-tallied.line).into());
        let (zero, radius) = (simd.splat_f64s(0.0), simd.splat_f64s((tallied.radius * length).powi(2)));
        let gone = S::as_mut_simd_f64s(&mut tallied.gone[frame..]).0;
        let drops = tallied.overshoot == Overshoot::Drop;
        let (two, end) = (simd.splat_f64s(2.0), simd.splat_f64s(END));
        let sections = tallied.sections as f64;
        let (parts, last) = (simd.splat_f64s(sections), simd.splat_f64s(sections - 1.0));
        let (rounds, half) = (simd.splat_f64s(ROUNDS), simd.splat_f64s(HALF));
        // Lanes count side by side, so that no count waits for another.
        let beside = beside(tallied.sections);
        let per_kind = simd.splat_f64s(beside as f64);
        let per_section = simd.splat_f64s((KINDS * beside) as f64);
        let lane = if beside == 1 { zero } else { S::as_simd_f64s(&LANES[..S::F64_LANES]).0[0] };
        // Of narrow registers, as many as hold what a wide one would: lane by lane the same.
        let (mut squares, of_block) = ([0.0; BLOCK], BLOCK / S::F64_LANES);
        let sums = S::as_mut_simd_f64s(&mut squares).0;
        let mut numbers = [0.0; TOGETHER];
        for start in (0..weights.len()).step_by(TOGETHER / S::F64_LANES) {
            let registers = (TOGETHER / S::F64_LANES).min(weights.len() - start);
            for (k, number) in (start..).zip(&mut S::as_mut_simd_f64s(&mut numbers).0[..registers]) {
                let d = minus(simd, [rows[0][k], rows[1][k], rows[2][k]], start_place);
                let along = dot(simd, direction, d);
                let mut off = d;
                for axis in 0..3 {
                    off[axis] = simd.mul_add_f64s(along, back[axis], d[axis]);
                }
                // Squared distances tell as well what is inside, without a root.
                let off = dot(simd, off, off);
                sums[k % of_block] = simd.mul_add_f64s(off, weights[k], sums[k % of_block]);
                gone[k] = simd.add_f64s(gone[k], along);
                let mut counted = weights[k];
                if drops {
                    counted = simd.select_f64s(simd.less_than_f64s(along, zero), zero, counted);
                    counted = simd.select_f64s(simd.less_than_f64s(end, along), zero, counted);
                }
                let inside = simd.select_f64s(simd.less_than_f64s(off, radius), counted, zero);
                let place = simd.min_f64s(simd.max_f64s(simd.mul_f64s(along, parts), zero), last);
                // Half a section less is rounded to the section's number.
                let section = simd.sub_f64s(simd.add_f64s(simd.sub_f64s(place, half), rounds), rounds);
                let kind = simd.mul_add_f64s(inside, two, counted);
                let count = simd.mul_add_f64s(section, per_section, simd.mul_add_f64s(kind, per_kind, lane));
                *number = simd.add_f64s(count, rounds);
            }
            for number in &numbers[..registers * S::F64_LANES] {
                tallied.counts[bits_shown(*number)] += 1;
            }
        }
        sum_of_lanes(&squares) / (length * length)
    }
}
