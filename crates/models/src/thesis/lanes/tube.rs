//! Where the points of a trajectory are along a tube.

use jointscope_motion::Rows;
use nalgebra::Vector3;
use pulp::{Arch, Simd, WithSimd};

use super::super::prismatic::{Overshoot, Section};
use super::{BLOCK, ROUNDS, SHOWS_BITS, bits_shown, cross, dot, minus, registers, splat};

/// What is counted along a tube.
pub(in super::super) struct Tallied<'a> {
    /// From the start to the end of the tube, metres.
    pub line: Vector3<f64>,
    /// Its radius, in its length.
    pub radius: f64,
    pub overshoot: Overshoot,
    pub sections: &'a mut [Section],
    counts: Vec<u64>,
    /// Shares of the line that the features have gone since the first frame, summed up, by frame.
    gone: Vec<f64>,
}

/// Most sections in which lanes count side by side.
const SECTIONS_BESIDE: usize = 128;
/// What one point adds to its section, by whether it counts and is inside: all points in the lower half, those inside in
/// the upper.
const COUNTS: [u64; 4] = [0, 1, 0, 1 << 32 | 1];

impl<'a> Tallied<'a> {
    pub(in super::super) fn new(
        line: Vector3<f64>,
        radius: f64,
        overshoot: Overshoot,
        sections: &'a mut [Section],
        frames: usize,
    ) -> Self {
        let counts = vec![0; sections.len().max(SECTIONS_BESIDE * BLOCK)];
        Self { line, radius, overshoot, sections, counts, gone: vec![0.0; frames.next_multiple_of(BLOCK)] }
    }

    /// How far so many features have gone in the mean since the first frame, metres, by frame.
    pub(in super::super) fn slides(&self, features: usize) -> Vec<f64> {
        let mean = self.line.norm() / features as f64;
        self.gone.iter().map(|gone| gone * mean).collect()
    }
}

/// Counts a feature, shifted to start where the tube starts, in its sections; gives the sum of squared distances from
/// the line, in lengths of the tube.
pub(in super::super) fn along_tube(rows: Rows<'_>, tallied: &mut Tallied<'_>) -> f64 {
    Arch::new().dispatch(Kernel { rows, tallied })
}

struct Kernel<'a, 's> {
    rows: Rows<'a>,
    tallied: &'a mut Tallied<'s>,
}

impl WithSimd for Kernel<'_, '_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { rows: all, tallied } = self;
        let rows = registers(simd, all.coordinates);
        let weights = S::as_simd_f64s(all.weights).0;
        let start = splat(simd, all.point(0).coords.into());
        let length = tallied.line.norm();
        let direction = splat(simd, (tallied.line / (length * length)).into());
        let (zero, radius) = (simd.splat_f64s(0.0), simd.splat_f64s(tallied.radius * tallied.radius));
        let gone = S::as_mut_simd_f64s(&mut tallied.gone).0;
        let sections = tallied.sections.len();
        let drops = tallied.overshoot == Overshoot::Drop;
        let (one, two, four) = (simd.splat_f64s(1.0), simd.splat_f64s(2.0), simd.splat_f64s(4.0));
        let (parts, last) = (simd.splat_f64s(sections as f64), simd.splat_f64s((sections - 1) as f64));
        let (rounds, shown) = (simd.splat_f64s(ROUNDS), simd.splat_f64s(SHOWS_BITS));
        let mut squares = zero;
        // Lanes count side by side, so that no count waits for another.
        let beside = if sections <= SECTIONS_BESIDE { BLOCK } else { 1 };
        let counts = &mut tallied.counts[..sections * beside];
        let mut codes = [0.0; BLOCK];
        for (k, (weight, gone)) in weights.iter().zip(gone).enumerate() {
            let d = minus(simd, [rows[0][k], rows[1][k], rows[2][k]], start);
            let (along, off) = (dot(simd, direction, d), cross(simd, direction, d));
            // Squared distances tell as well what is inside, without a root.
            let off = dot(simd, off, off);
            squares = simd.mul_add_e_f64s(off, *weight, squares);
            *gone = simd.add_f64s(*gone, along);
            let mut counted = *weight;
            if drops {
                counted = simd.select_f64s(simd.less_than_f64s(along, zero), zero, counted);
                counted = simd.select_f64s(simd.less_than_f64s(one, along), zero, counted);
            }
            let inside = simd.select_f64s(simd.less_than_f64s(off, radius), counted, zero);
            let place = simd.min_f64s(simd.max_f64s(simd.mul_f64s(along, parts), zero), last);
            let whole = simd.sub_f64s(simd.add_f64s(place, rounds), rounds);
            let above = simd.less_than_f64s(place, whole);
            let section = simd.select_f64s(above, simd.sub_f64s(whole, one), whole);
            // Section, whether it is inside, and whether it counts, as one number.
            let code = simd.mul_add_e_f64s(section, four, simd.mul_add_e_f64s(inside, two, counted));
            S::as_mut_simd_f64s(&mut codes[..S::F64_LANES]).0[0] = simd.add_f64s(code, shown);
            for (lane, code) in codes[..S::F64_LANES].iter().enumerate() {
                let code = bits_shown(*code);
                counts[(code >> 2) * beside + lane % beside] += COUNTS[code & 3];
            }
        }
        for (section, counts) in tallied.sections.iter_mut().zip(counts.chunks_exact_mut(beside)) {
            for count in counts {
                let count = std::mem::take(count);
                section.add((count & 0xFFFF_FFFF) as usize, (count >> 32) as usize);
            }
        }
        simd.reduce_sum_f64s(squares)
    }
}
