//! Trajectories of features that are always seen, coordinate by coordinate.

#![expect(clippy::inline_always, reason = "what is not inlined loses the instruction set")]
#![expect(clippy::needless_range_loop, reason = "one index runs through several arrays of registers")]

mod aligned;
mod summary;

pub use summary::Summary;

use aligned::Aligned;
use summary::Sums;

use std::cell::Cell;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use bytemuck::cast_slice;
use nalgebra::Point3;
use pulp::{Simd, WithSimd};

use crate::extent::FarEnds;
use crate::flat_rows::lanes_lack;
use crate::instructions::arch;
use crate::prefetch::ahead_of;
use crate::tracks::SeenAtScale;
use crate::{Extents, Pose, Tracks, evenly};

/// Frames that are taken together: the lanes of the widest registers.
const BLOCK: usize = 8;
/// Numbers of the maps of a block.
const MAP: usize = 12 * BLOCK;
/// Blocks whose maps the fastest cache holds beside positions.
const TILE: usize = 16;
/// Blocks whose rows are written together, so that each row is visited for more than one register.
const TOGETHER: usize = 4;

/// Numbers that are kept, 32 MB of them; trajectories that have more are computed anew for everyone who looks at them.
const KEPT: usize = 1 << 22;
/// Numbers that are computed together then: of some features in all frames, 20 MB of them, or of all features in some
/// frames, so that caches hold them.
const BLOCKWISE: usize = 2_500_000;
const IN_TURN: usize = 1 << 17;
/// Numbers of the frames, evenly over time, that tell beforehand where trajectories end.
const GLANCE: usize = 1 << 20;

/// Positions of the features of a body all of which are seen in all frames that count, in the reference body's
/// coordinates, metres.
///
/// # Memory
/// Those of a long recording are not kept as a whole, but computed anew for everyone who looks at them: some frames of all
/// features after another, which reads the recording once in its order, or some features in all frames, where a look cannot
/// be interrupted.
#[derive(Debug, Clone, Copy)]
pub struct Columns<'a> {
    seen: SeenAtScale<'a>,
    frames: &'a [usize],
    placed: &'a Placed,
}

/// One feature's positions in successive frames: three rows, of its x, y and z, with frames side by side, so that a register
/// holds a coordinate of several frames.
///
/// # Convention
/// Rows are filled up to whole registers with the position of the very first frame.
#[derive(Debug, Clone, Copy)]
pub struct Rows<'a> {
    /// x, y and z, metres.
    pub coordinates: [&'a [f64]; 3],
    /// 1 for every frame, and 0 for what rows are filled up with.
    pub weights: &'a [f64],
    /// Number of frames.
    pub frames: usize,
}

impl Rows<'_> {
    /// The position in the frame of that index among these, metres.
    pub fn point(&self, index: usize) -> Point3<f64> {
        let [x, y, z] = self.coordinates;
        Point3::new(x[index], y[index], z[index])
    }
}

/// Rotations row by row, then translations, of eight frames each; what is filled up is the first frame. And the weights of
/// frames, 0 of what is filled up.
#[derive(Debug, Clone)]
pub(crate) struct Maps {
    numbers: Arc<Aligned>,
    weights: Arc<Aligned>,
}

impl Maps {
    /// Of the `pose` of each of some frames.
    pub(crate) fn of(frames: &[usize], pose: impl Fn(usize) -> Pose) -> Self {
        let mut maps = Aligned::zeros(MAP * frames.len().div_ceil(BLOCK));
        for index in 0..frames.len().next_multiple_of(BLOCK) {
            let pose = pose(frames[if index < frames.len() { index } else { 0 }]);
            let (maps, lane) = (&mut maps[index / BLOCK * MAP..][..MAP], index % BLOCK);
            let rotation = pose.rotation.to_rotation_matrix();
            for k in 0..9 {
                maps[k * BLOCK + lane] = rotation[(k / 3, k % 3)];
            }
            for axis in 0..3 {
                maps[(9 + axis) * BLOCK + lane] = pose.translation.vector[axis];
            }
        }
        Self::with(maps, frames.len())
    }

    fn with(numbers: Aligned, frames: usize) -> Self {
        let mut weights = Aligned::zeros(frames.next_multiple_of(BLOCK));
        weights[..frames].fill(1.0);
        Self { numbers: Arc::new(numbers), weights: Arc::new(weights) }
    }

    /// Those of the frames with these indices.
    fn some(&self, indices: &[usize]) -> Self {
        let mut maps = Aligned::zeros(MAP * indices.len().div_ceil(BLOCK));
        for lane in 0..indices.len().next_multiple_of(BLOCK) {
            let index = indices[if lane < indices.len() { lane } else { 0 }];
            for k in 0..MAP / BLOCK {
                maps[lane / BLOCK * MAP + k * BLOCK + lane % BLOCK] =
                    self.numbers[index / BLOCK * MAP + k * BLOCK + index % BLOCK];
            }
        }
        Self::with(maps, indices.len())
    }
}

/// Positions in the recording's coordinates, in rows, to be multiplied by a factor.
#[derive(Debug, Clone)]
pub(crate) struct RowsAsSeen {
    numbers: Arc<Aligned>,
    factor: f64,
}

impl RowsAsSeen {
    /// All positions multiplied by a factor.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self { numbers: self.numbers.clone(), factor: factor * self.factor }
    }
}

/// The positions of all features in all frames as the recording has them, in rows; `None` where one is missing, or where
/// there are so many that they are not kept.
pub(crate) fn rows_as_seen(tracks: &Tracks) -> Option<RowsAsSeen> {
    let frames: Vec<usize> = (0..tracks.frames()).collect();
    let (features, row) = (tracks.features(), frames.len().next_multiple_of(BLOCK));
    if 3 * features * row > KEPT || !shows_all(tracks, &frames) {
        return None;
    }
    let mut numbers = Aligned::zeros(3 * features * row);
    let of = Part { frames: 0..frames.len(), features: 0..features };
    let seen = SeenAtScale { tracks, factor: 1.0 };
    arch().dispatch(Place { seen, frames: &frames, maps: None, of, numbers: &mut numbers });
    Some(RowsAsSeen { numbers: Arc::new(numbers), factor: 1.0 })
}

/// Whether there are features, all of which are seen in each of some frames.
fn shows_all(tracks: &Tracks, frames: &[usize]) -> bool {
    let features = tracks.features();
    features > 0 && frames.iter().all(|&frame| tracks.seen_count(frame) == features)
}

/// What columns are computed from, and the columns themselves unless these are many.
#[derive(Debug, Clone)]
pub(crate) struct Placed {
    maps: Maps,
    numbers: Option<Buffer>,
    summaries: OnceLock<Vec<Summary>>,
}

impl Placed {
    /// A body's features where the poses `target_from_recording` of some frames put them; `None` unless all are seen in
    /// all of these frames. Rows of the recording's positions in these frames are used if they are at hand.
    pub(crate) fn of(seen: SeenAtScale<'_>, frames: &[usize], maps: Maps, rows: Option<&RowsAsSeen>) -> Option<Self> {
        if frames.is_empty() || rows.is_none() && !shows_all(seen.tracks, frames) {
            return None;
        }
        let (features, row) = (seen.tracks.features(), frames.len().next_multiple_of(BLOCK));
        let mut placed = Self { maps, numbers: None, summaries: OnceLock::new() };
        if 3 * features * row <= KEPT {
            let mut numbers = Buffer::of(3 * features * row);
            match rows {
                Some(rows) => {
                    arch().dispatch(Turn { rows, maps: &placed.maps.numbers, numbers: &mut numbers.0 });
                }
                None => {
                    placed.place(seen, frames, Part { frames: 0..frames.len(), features: 0..features }, &mut numbers.0);
                }
            }
            placed.numbers = Some(numbers);
        }
        Some(placed)
    }

    fn place(&self, seen: SeenAtScale<'_>, frames: &[usize], of: Part, numbers: &mut [f64]) {
        arch().dispatch(Place { seen, frames, maps: Some(&self.maps.numbers), of, numbers });
    }

    /// The rows of a part's feature, given the numbers of the part.
    fn rows<'a>(&'a self, numbers: &'a [f64], frames: &Range<usize>, feature: usize) -> Rows<'a> {
        let row = frames.len().next_multiple_of(BLOCK);
        let coordinates = [0, 1, 2].map(|axis| &numbers[(3 * feature + axis) * row..][..row]);
        Rows { coordinates, weights: &self.maps.weights[frames.start..][..row], frames: frames.len() }
    }

    fn rows_of_all<'a>(&'a self, numbers: &'a [f64], frames: &Range<usize>, features: usize) -> Vec<Rows<'a>> {
        (0..features).map(|feature| self.rows(numbers, frames, feature)).collect()
    }
}

/// Some of the frames that count, beginning with a whole block, and some features.
#[derive(Debug, Clone)]
struct Part {
    frames: Range<usize>,
    features: Range<usize>,
}

impl<'a> Columns<'a> {
    pub(crate) fn new(seen: SeenAtScale<'a>, frames: &'a [usize], placed: &'a Placed) -> Self {
        Self { seen, frames, placed }
    }

    /// Number of features.
    pub fn features(&self) -> usize {
        self.seen.tracks.features()
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.frames.len()
    }

    /// Looks at the rows of all features in some frames, then in the next ones: given the index of the first of these frames
    /// among those that count, and the rows of every feature.
    ///
    /// One look has all frames unless there are many.
    pub fn in_turn(&self, mut look: impl FnMut(usize, &[Rows<'_>])) {
        let (features, frames, placed) = (self.features(), self.frames(), self.placed);
        if let Some(numbers) = &placed.numbers {
            return look(0, &placed.rows_of_all(&numbers.0, &(0..frames), features));
        }
        let together = (IN_TURN / (3 * features) / BLOCK * BLOCK).max(TOGETHER * BLOCK);
        let mut numbers = Aligned::zeros(3 * features * together);
        for first in (0..frames).step_by(together) {
            let some = first..frames.min(first + together);
            let numbers = &mut numbers[..3 * features * some.len().next_multiple_of(BLOCK)];
            placed.place(self.seen, self.frames, Part { frames: some.clone(), features: 0..features }, numbers);
            look(first, &placed.rows_of_all(numbers, &some, features));
        }
    }

    /// What the rows of all features in all frames show, one after another.
    pub fn map<R>(&self, mut look: impl FnMut(usize, Rows<'_>) -> R) -> Vec<R> {
        let (features, all, placed) = (self.features(), 0..self.frames(), self.placed);
        if let Some(numbers) = &placed.numbers {
            return (0..features).map(|feature| look(feature, placed.rows(&numbers.0, &all, feature))).collect();
        }
        let row = placed.maps.weights.len();
        // Whole registers of every frame, if as many fit.
        let fit = BLOCKWISE / (3 * row);
        let together = (if fit < BLOCK { fit } else { fit / BLOCK * BLOCK }).clamp(1, features);
        let mut numbers = Aligned::zeros(3 * together * row);
        let mut shown = Vec::with_capacity(features);
        for first in (0..features).step_by(together) {
            let some = first..features.min(first + together);
            placed.place(self.seen, self.frames, Part { frames: all.clone(), features: some.clone() }, &mut numbers);
            shown.extend(some.map(|feature| look(feature, placed.rows(&numbers, &all, feature - first))));
        }
        shown
    }

    /// What every feature's trajectory shows at a glance; found once, for whoever asks.
    pub fn summaries(&self) -> &'a [Summary] {
        self.placed.summaries.get_or_init(|| {
            if self.placed.numbers.is_some() {
                // Caches hold one feature's rows.
                return Extents::one_after_another(|alike| {
                    self.map(|_, rows| {
                        let mut sums = Sums::default();
                        sums.add(rows);
                        sums.summary(alike.of_rows(rows.coordinates))
                    })
                });
            }
            let mut sums = vec![Sums::default(); self.features()];
            let mut far = self.far_ends();
            self.in_turn(|_, rows| {
                sums.iter_mut().zip(rows).for_each(|(sums, rows)| sums.add(*rows));
                far.iter_mut().flatten().zip(rows).for_each(|(far, rows)| far.add(rows.coordinates));
            });
            let told = far.and_then(|far| far.into_iter().map(FarEnds::extent).collect::<Option<Vec<f64>>>());
            let anew = || Extents::one_after_another(|alike| self.map(|_, rows| alike.of_rows(rows.coordinates)));
            let extents = told.unwrap_or_else(anew);
            sums.iter().zip(extents).map(|(sums, extent)| sums.summary(extent)).collect()
        })
    }

    /// Where the ends of the features' trajectories may be, as a few frames tell.
    fn far_ends(&self) -> Option<Vec<FarEnds>> {
        let (features, count) = (self.features(), self.frames());
        let indices = evenly(count, (GLANCE / (3 * features)).max(TOGETHER * BLOCK));
        let frames: Vec<usize> = indices.iter().map(|index| self.frames[*index]).collect();
        let some = Placed::of(self.seen, &frames, self.placed.maps.some(&indices), None)?;
        let glance = Columns::new(self.seen, &frames, &some);
        Some(Extents::one_after_another(|alike| glance.map(|_, rows| FarEnds::by_some(rows.coordinates, count, alike))))
    }

    /// What the rows of one feature show.
    pub fn of<R>(&self, feature: usize, look: impl FnOnce(Rows<'_>) -> R) -> R {
        let (all, placed) = (0..self.frames(), self.placed);
        if let Some(numbers) = &placed.numbers {
            return look(placed.rows(&numbers.0, &all, feature));
        }
        let mut numbers = Aligned::zeros(3 * placed.maps.weights.len());
        let of = Part { frames: all.clone(), features: feature..feature + 1 };
        placed.place(self.seen, self.frames, of, &mut numbers);
        look(placed.rows(&numbers, &all, 0))
    }
}

/// Room for numbers, which whoever comes next in the same thread takes over: what caches hold stays of use, and nothing
/// is cleared that will be written.
#[derive(Debug, Clone)]
struct Buffer(Aligned);

thread_local! {
    static LEFT: Cell<Aligned> = Cell::new(Aligned::default());
}

impl Buffer {
    /// Of so many numbers, whatever they are.
    fn of(length: usize) -> Self {
        Self(LEFT.take().resized(length))
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // A thread that ends keeps nothing.
        _ = LEFT.try_with(|left| left.set(std::mem::take(&mut self.0)));
    }
}

struct Place<'a> {
    seen: SeenAtScale<'a>,
    frames: &'a [usize],
    /// Left out to have positions as the recording has them.
    maps: Option<&'a [f64]>,
    of: Part,
    numbers: &'a mut [f64],
}

impl WithSimd for Place<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { seen: SeenAtScale { tracks, factor }, frames, maps, of, numbers } = self;
        let Part { frames: some, features } = of;
        let row = some.len().next_multiple_of(BLOCK);
        let maps = maps.map(|maps| &maps[some.start / BLOCK * MAP..]);
        let coordinates = 3 * features.len();
        let width = coordinates.next_multiple_of(BLOCK);
        let mut seen = vec![0.0; TOGETHER * width * BLOCK];
        let later = BLOCK * tracks.features() * size_of::<Point3<f64>>();
        for start in (0..row).step_by(TOGETHER * BLOCK) {
            let blocks = TOGETHER.min((row - start) / BLOCK);
            let maps = maps.map(|maps| &maps[start / BLOCK * MAP..]);
            for number in 0..blocks {
                let start = start + number * BLOCK;
                let mut block = [&[][..]; BLOCK];
                for lane in 0..BLOCK {
                    let index = if start + lane < some.len() { some.start + start + lane } else { 0 };
                    block[lane] = cast_slice(&tracks.frame(frames[index])[features.clone()]);
                }
                side_by_side(simd, block, later, &mut seen[number * width * BLOCK..][..width * BLOCK]);
            }
            for some in (0..features.len()).step_by(BLOCK) {
                for number in 0..blocks {
                    for feature in some..(some + BLOCK).min(features.len()) {
                        let seen = &seen[(number * width + 3 * feature) * BLOCK..][..3 * BLOCK];
                        let at = start + number * BLOCK;
                        match maps {
                            Some(maps) => {
                                let (of_x, rest) = numbers[3 * feature * row..][..3 * row].split_at_mut(row);
                                let (of_y, of_z) = rest.split_at_mut(row);
                                let out =
                                    [&mut of_x[at..][..BLOCK], &mut of_y[at..][..BLOCK], &mut of_z[at..][..BLOCK]];
                                let seen = [&seen[..BLOCK], &seen[BLOCK..2 * BLOCK], &seen[2 * BLOCK..]];
                                turn(simd, &maps[number * MAP..][..MAP], factor, seen, out);
                            }
                            None => {
                                for axis in 0..3 {
                                    numbers[(3 * feature + axis) * row + at..][..BLOCK]
                                        .copy_from_slice(&seen[axis * BLOCK..][..BLOCK]);
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

struct Turn<'a> {
    rows: &'a RowsAsSeen,
    maps: &'a [f64],
    numbers: &'a mut [f64],
}

impl WithSimd for Turn<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows: RowsAsSeen { numbers: seen, factor }, maps, numbers } = self;
        let row = maps.len() / MAP * BLOCK;
        // Some frames of all features, then the next ones, so that caches hold their maps.
        for (tile, maps) in maps.chunks(TILE * MAP).enumerate() {
            let rows = seen.chunks_exact(3 * row).zip(numbers.chunks_exact_mut(3 * row));
            for (seen, numbers) in rows {
                let (start, frames) = (tile * TILE * BLOCK, maps.len() / MAP * BLOCK);
                let [x, y, z] = [0, 1, 2].map(|axis| &seen[axis * row + start..][..frames]);
                let (of_x, rest) = numbers.split_at_mut(row);
                let (of_y, of_z) = rest.split_at_mut(row);
                let [of_x, of_y, of_z] = [of_x, of_y, of_z].map(|row| &mut row[start..][..frames]);
                let blocks = x.chunks_exact(BLOCK).zip(y.chunks_exact(BLOCK)).zip(z.chunks_exact(BLOCK));
                let of_blocks =
                    of_x.chunks_exact_mut(BLOCK).zip(of_y.chunks_exact_mut(BLOCK)).zip(of_z.chunks_exact_mut(BLOCK));
                for ((map, ((x, y), z)), ((of_x, of_y), of_z)) in maps.chunks_exact(MAP).zip(blocks).zip(of_blocks) {
                    turn(simd, map, *factor, [x, y, z], [of_x, of_y, of_z]);
                }
            }
        }
    }
}

/// Places eight positions, multiplied by a factor, by eight maps.
#[inline(always)]
fn turn<S: Simd>(simd: S, map: &[f64], factor: f64, seen: [&[f64]; 3], out: [&mut [f64]; 3]) {
    let (x, y, z) = (S::as_simd_f64s(seen[0]).0, S::as_simd_f64s(seen[1]).0, S::as_simd_f64s(seen[2]).0);
    let [of_x, of_y, of_z] = out;
    let (of_x, of_y, of_z) = (S::as_mut_simd_f64s(of_x).0, S::as_mut_simd_f64s(of_y).0, S::as_mut_simd_f64s(of_z).0);
    let factor = simd.splat_f64s(factor);
    for part in 0..x.len() {
        let (x, y, z) =
            (simd.mul_f64s(factor, x[part]), simd.mul_f64s(factor, y[part]), simd.mul_f64s(factor, z[part]));
        of_x[part] = placed(simd, map, 0, part, [x, y, z]);
        of_y[part] = placed(simd, map, 1, part, [x, y, z]);
        of_z[part] = placed(simd, map, 2, part, [x, y, z]);
    }
}

/// A coordinate of a register of placed positions, `part` being the register's place in its block.
#[inline(always)]
fn placed<S: Simd>(simd: S, map: &[f64], axis: usize, part: usize, [x, y, z]: [S::f64s; 3]) -> S::f64s {
    let by_x = S::as_simd_f64s(&map[3 * axis * BLOCK..][..BLOCK]).0[part];
    let by_y = S::as_simd_f64s(&map[(3 * axis + 1) * BLOCK..][..BLOCK]).0[part];
    let by_z = S::as_simd_f64s(&map[(3 * axis + 2) * BLOCK..][..BLOCK]).0[part];
    let shift = S::as_simd_f64s(&map[(9 + axis) * BLOCK..][..BLOCK]).0[part];
    let sum = simd.mul_add_f64s(by_x, x, shift);
    let sum = simd.mul_add_f64s(by_y, y, sum);
    simd.mul_add_f64s(by_z, z, sum)
}

/// Puts the numbers of several frames side by side: `out` has a block for every coordinate. Asks for what comes so many
/// bytes later.
#[inline(always)]
fn side_by_side<S: Simd>(simd: S, frames: [&[f64]; BLOCK], later: usize, out: &mut [f64]) {
    let lanes = S::F64_LANES;
    let out = S::as_mut_simd_f64s(out).0;
    let parts = BLOCK / lanes;
    let zero = simd.splat_f64s(0.0);
    let lacks = lanes_lack(simd);
    let count = frames[0].len();
    for first in (0..count).step_by(lanes) {
        for part in 0..parts {
            let mut square = [zero; BLOCK];
            for k in 0..lanes {
                let numbers = &frames[part * lanes + k][first..];
                ahead_of(numbers.as_ptr(), later);
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

#[cfg(test)]
mod tests;
