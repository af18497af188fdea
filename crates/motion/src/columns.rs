//! Trajectories of features that are always seen, coordinate by coordinate.

#![expect(clippy::inline_always, reason = "what is not inlined loses the instruction set")]

use nalgebra::Point3;
use pulp::{Arch, Simd, WithSimd};

use crate::{Pose, Tracks};

/// Frames that are taken together: the lanes of the widest registers.
const BLOCK: usize = 8;

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
        for start in (0..row).step_by(BLOCK) {
            // Rotations row by row, then translations; what is filled up is the first frame.
            let mut maps = [[0.0; BLOCK]; 12];
            let mut block = [&[][..]; BLOCK];
            for lane in 0..BLOCK {
                let index = if start + lane < frames.len() { start + lane } else { 0 };
                let rotation = poses[index].rotation.to_rotation_matrix();
                for k in 0..9 {
                    maps[k][lane] = rotation[(k / 3, k % 3)];
                }
                for axis in 0..3 {
                    maps[9 + axis][lane] = poses[index].translation.vector[axis];
                }
                block[lane] = tracks.frame(frames[index]);
            }
            for feature in 0..tracks.features() {
                let mut seen = [[0.0; BLOCK]; 3];
                for lane in 0..BLOCK {
                    let point = &block[lane][feature];
                    seen[0][lane] = point.x;
                    seen[1][lane] = point.y;
                    seen[2][lane] = point.z;
                }
                let x = S::as_simd_f64s(&seen[0]).0;
                let y = S::as_simd_f64s(&seen[1]).0;
                let z = S::as_simd_f64s(&seen[2]).0;
                for axis in 0..3 {
                    let out = &mut numbers[(3 * feature + axis) * row + start..][..BLOCK];
                    let out = S::as_mut_simd_f64s(out).0;
                    let by_x = S::as_simd_f64s(&maps[3 * axis]).0;
                    let by_y = S::as_simd_f64s(&maps[3 * axis + 1]).0;
                    let by_z = S::as_simd_f64s(&maps[3 * axis + 2]).0;
                    let shift = S::as_simd_f64s(&maps[9 + axis]).0;
                    for part in 0..out.len() {
                        let sum = simd.mul_f64s(by_x[part], x[part]);
                        let sum = simd.mul_add_e_f64s(by_y[part], y[part], sum);
                        let sum = simd.mul_add_e_f64s(by_z[part], z[part], sum);
                        out[part] = simd.add_f64s(sum, shift[part]);
                    }
                }
            }
        }
    }
}
