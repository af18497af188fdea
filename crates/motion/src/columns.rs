//! Trajectories of features that are always seen, coordinate by coordinate.

#![expect(clippy::inline_always, reason = "what is not inlined loses the instruction set")]
#![expect(clippy::needless_range_loop, reason = "one index runs through several arrays of registers")]

use bytemuck::cast_slice;
use nalgebra::Point3;
use pulp::{Arch, Simd, WithSimd};

use crate::{Pose, Tracks};

/// Frames that are taken together: the lanes of the widest registers.
const BLOCK: usize = 8;
/// Blocks whose rows are written together, so that each row is visited for more than one register.
const TOGETHER: usize = 4;

/// Positions of the features of a body all of which are seen in all frames that count, in the reference body's
/// coordinates, metres.
///
/// # Convention
/// A feature has three rows, of its x, y and z, with frames side by side, so that a register holds a coordinate of
/// several frames. Rows are filled up to whole registers with the position of the first frame; [`Columns::weights`] is
/// 1 for frames and 0 for what is filled up.
#[derive(Debug, Clone, PartialEq)]
pub struct Columns {
    frames: usize,
    weights: Vec<f64>,
    numbers: Vec<f64>,
}

impl Columns {
    /// A body's features where the poses `target_from_recording` of some frames put them; `None` unless all are seen in
    /// all of these frames.
    pub(crate) fn of(tracks: &Tracks, frames: &[usize], poses: &[Pose]) -> Option<Self> {
        let features = tracks.features();
        if frames.is_empty() || features == 0 || frames.iter().any(|&frame| tracks.seen_count(frame) < features) {
            return None;
        }
        let row = frames.len().next_multiple_of(BLOCK);
        let mut weights = vec![1.0; frames.len()];
        weights.resize(row, 0.0);
        let mut numbers = vec![0.0; 3 * features * row];
        Arch::new().dispatch(Placed { tracks, frames, poses, row, numbers: &mut numbers });
        Some(Self { frames: frames.len(), weights, numbers })
    }

    /// Number of features.
    pub fn features(&self) -> usize {
        self.numbers.len() / (3 * self.weights.len())
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// 1 for every frame, and 0 for what rows are filled up with.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The rows of a feature: its x, its y and its z, metres.
    pub fn rows(&self, feature: usize) -> [&[f64]; 3] {
        let row = self.weights.len();
        [0, 1, 2].map(|axis| &self.numbers[(3 * feature + axis) * row..][..row])
    }

    /// The position of a feature in the frame of that index among those that count, metres.
    pub fn point(&self, feature: usize, index: usize) -> Point3<f64> {
        let [x, y, z] = self.rows(feature);
        Point3::new(x[index], y[index], z[index])
    }
}

struct Placed<'a> {
    tracks: &'a Tracks,
    frames: &'a [usize],
    poses: &'a [Pose],
    row: usize,
    numbers: &'a mut [f64],
}

impl WithSimd for Placed<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { tracks, frames, poses, row, numbers } = self;
        let coordinates = 3 * tracks.features();
        let width = coordinates.next_multiple_of(BLOCK);
        let mut seen = vec![0.0; TOGETHER * width * BLOCK];
        let mut maps = [[[0.0; BLOCK]; 12]; TOGETHER];
        for start in (0..row).step_by(TOGETHER * BLOCK) {
            let blocks = TOGETHER.min((row - start) / BLOCK);
            for (number, maps) in maps[..blocks].iter_mut().enumerate() {
                let start = start + number * BLOCK;
                let mut block = [&[][..]; BLOCK];
                for lane in 0..BLOCK {
                    // What is filled up is the first frame.
                    let index = if start + lane < frames.len() { start + lane } else { 0 };
                    // Rotations row by row, then translations.
                    let rotation = poses[index].rotation.to_rotation_matrix();
                    for k in 0..9 {
                        maps[k][lane] = rotation[(k / 3, k % 3)];
                    }
                    for axis in 0..3 {
                        maps[9 + axis][lane] = poses[index].translation.vector[axis];
                    }
                    block[lane] = cast_slice(tracks.frame(frames[index]));
                }
                side_by_side(simd, block, &mut seen[number * width * BLOCK..][..width * BLOCK]);
            }
            for feature in 0..tracks.features() {
                for axis in 0..3 {
                    let out = &mut numbers[(3 * feature + axis) * row + start..][..blocks * BLOCK];
                    for number in 0..blocks {
                        let seen = &seen[(number * width + 3 * feature) * BLOCK..][..3 * BLOCK];
                        let seen = S::as_simd_f64s(seen).0;
                        let out = S::as_mut_simd_f64s(&mut out[number * BLOCK..][..BLOCK]).0;
                        let maps = &maps[number];
                        let by_x = S::as_simd_f64s(&maps[3 * axis]).0;
                        let by_y = S::as_simd_f64s(&maps[3 * axis + 1]).0;
                        let by_z = S::as_simd_f64s(&maps[3 * axis + 2]).0;
                        let shift = S::as_simd_f64s(&maps[9 + axis]).0;
                        let parts = out.len();
                        for part in 0..parts {
                            let sum = simd.mul_f64s(by_x[part], seen[part]);
                            let sum = simd.mul_add_e_f64s(by_y[part], seen[parts + part], sum);
                            let sum = simd.mul_add_e_f64s(by_z[part], seen[2 * parts + part], sum);
                            out[part] = simd.add_f64s(sum, shift[part]);
                        }
                    }
                }
            }
        }
    }
}

/// Puts the numbers of several frames side by side: `out` has a block for every coordinate.
#[inline(always)]
fn side_by_side<S: Simd>(simd: S, frames: [&[f64]; BLOCK], out: &mut [f64]) {
    const LANES: [f64; BLOCK] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
    let lanes = S::F64_LANES;
    let out = S::as_mut_simd_f64s(out).0;
    let parts = BLOCK / lanes;
    // Lanes whose number lacks the bit 1, 2 or 4.
    let number = S::as_simd_f64s(&LANES[..lanes]).0[0];
    let zero = simd.splat_f64s(0.0);
    let mut lacks = [simd.equal_f64s(number, number); 3];
    for (bit, lacks) in lacks.iter_mut().enumerate() {
        let mut of_lane = [0.0; BLOCK];
        for lane in 0..BLOCK {
            of_lane[lane] = f64::from(u8::from(lane >> bit & 1 == 1));
        }
        *lacks = simd.equal_f64s(S::as_simd_f64s(&of_lane[..lanes]).0[0], zero);
    }
    let count = frames[0].len();
    for first in (0..count).step_by(lanes) {
        for part in 0..parts {
            let mut square = [zero; BLOCK];
            for k in 0..lanes {
                let numbers = &frames[part * lanes + k][first..];
                square[k] = if first + lanes <= count {
                    S::as_simd_f64s(&numbers[..lanes]).0[0]
                } else {
                    simd.partial_load_f64s(numbers)
                };
            }
            // A square of numbers is transposed by transposing its quarters and exchanging two of them.
            for bit in (0..lanes.trailing_zeros() as usize).rev() {
                let step = 1 << bit;
                for k in 0..lanes {
                    if k & step == 0 {
                        let (a, b) = (square[k], square[k + step]);
                        square[k] = simd.select_f64s(lacks[bit], a, simd.rotate_right_f64s(b, step));
                        square[k + step] = simd.select_f64s(lacks[bit], simd.rotate_left_f64s(a, step), b);
                    }
                }
            }
            for k in 0..lanes {
                out[(first + k) * parts + part] = square[k];
            }
        }
    }
}
