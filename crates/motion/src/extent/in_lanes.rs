//! Lengths of trajectories given coordinate by coordinate, several points in the lanes of a register.

#![expect(clippy::inline_always, reason = "what is not inlined loses the instruction set")]
#![expect(clippy::needless_range_loop, reason = "one index runs through several rows")]

use std::cell::Cell;

use nalgebra::Point3;
use pulp::{Simd, WithSimd};

use crate::instructions::{arch, sum_of_lanes};

/// Points in a block, whose box is looked at first.
const BLOCK: usize = 16;
/// Points beyond which pairs of blocks are too many to look at all.
const MOST: usize = 16_384;
/// Pairs of points that are tried to begin with.
const TRIED: usize = 6;
/// By which share of its radius the ball over a pair may be left for its distance to count as nearly the largest.
const SHELL: f64 = 0.01;
/// Ends that there may be, as a part of the points, and pairs of them, per point.
const FEW: usize = 4;
const PAIRS: usize = 32;
/// Lanes of the widest registers.
const WIDEST: usize = 8;
/// Share by which squares may be off, with a wide margin.
const SURE: f64 = 1e-9;

/// As [`extent`](crate::extent), of points given by their x, y and z.
///
/// # Panics
/// If the rows have different lengths.
pub fn extent_of_rows(rows: [&[f64]; 3]) -> f64 {
    Extents::one_after_another(|extents| extents.of_rows(rows))
}

/// Extents of trajectories that are alike, one after another: where one was farthest from itself, the next one nearly is.
///
/// Of two points that are farther apart than the best pair found, one lies outside the ball over that pair: of an arc up
/// to half a circle, hardly any does. Where many do, blocks of successive points have small boxes, and a pair of blocks is
/// opened only if its boxes' far corners could beat the best distance found.
#[derive(Debug, Default)]
pub struct Extents {
    pair: [usize; 2],
    /// Whether ends were too many to be looked at.
    filled: bool,
    ends: Ends,
    boxes: Boxes,
}

thread_local! {
    /// Room for ends and boxes, which whoever comes next in the same thread takes over.
    static ROOM: Cell<Extents> = Cell::default();
}

impl Extents {
    /// Looks at some trajectories that are alike, without asking for memory anew.
    pub(crate) fn one_after_another<R>(look: impl FnOnce(&mut Self) -> R) -> R {
        // What others were like is forgotten.
        let mut extents = Self { pair: [0; 2], filled: false, ..ROOM.take() };
        let looked = look(&mut extents);
        ROOM.set(extents);
        looked
    }

    /// As [`extent_of_rows`].
    ///
    /// # Panics
    /// If the rows have different lengths.
    pub fn of_rows(&mut self, rows: [&[f64]; 3]) -> f64 {
        let [x, y, z] = rows;
        assert!(x.len() == y.len() && x.len() == z.len(), "three rows of one length");
        arch().dispatch(Extent { rows, known: self })
    }
}

/// The extent of a trajectory that comes in parts, of which a few points are known beforehand.
///
/// These give a pair whose distance is nearly the largest. Of two points that are farther apart, one lies outside the ball
/// over that pair, and the other at most as much nearer to its centre than the ball's surface; what may be one of them is
/// collected.
#[derive(Debug)]
pub(crate) struct FarEnds {
    centre: [f64; 3],
    /// Squared distance of the pair, and squared distances from its centre: from which on ends are collected, and the
    /// largest; m².
    best: f64,
    inner: f64,
    largest: f64,
    ends: Ends,
    most: usize,
}

/// Thickness of the shell about a ball over a pair of which few points were known, as a share of its radius; ends that are
/// kept, as a part of the points; and the share by which the ball may still grow where these are too many.
const THICK: f64 = 0.05;
const KEPT: usize = 16;
const GROWING: f64 = 0.002;

impl FarEnds {
    /// Of a trajectory of so many points; `alike` knows about where a similar one was farthest from itself.
    pub(crate) fn by_some(rows: [&[f64]; 3], points: usize, alike: &mut Extents) -> Self {
        alike.of_rows(rows);
        let (centre, best) = (between(rows, alike.pair), squared(rows, alike.pair));
        let inner = 0.25 * best * (1.0 - THICK).powi(2);
        Self { centre, best, inner, largest: 0.0, ends: Ends::default(), most: BLOCK + points / KEPT }
    }

    pub(crate) fn add(&mut self, rows: [&[f64]; 3]) {
        arch().dispatch(More { rows, far: self });
    }

    /// The extent; `None` if there are too many ends, or some were missed.
    pub(crate) fn extent(self) -> Option<f64> {
        let (distance, largest) = (self.best.sqrt(), self.largest.sqrt());
        let missed = ((distance - largest).max(0.0) * (1.0 - SURE)).powi(2) < self.inner;
        if self.ends.squares.len() > self.most || missed {
            return None;
        }
        Some(arch().dispatch(Across { far: &self }).sqrt())
    }
}

struct More<'a> {
    rows: [&'a [f64]; 3],
    far: &'a mut FarEnds,
}

impl WithSimd for More<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows, far } = self;
        let square = farthest(simd, rows, far.centre).0;
        far.largest = far.largest.max(square);
        // Most parts have no end.
        if square <= far.inner || far.ends.squares.len() > far.most {
            return;
        }
        far.ends.collect(simd, rows, far.centre, far.inner, usize::MAX);
        if far.ends.squares.len() > far.most {
            // A longer distance makes it enough to look at fewer ends.
            far.best = far.ends.across(simd, &mut [0; 2], far.best);
            let nearest = (far.best.sqrt() - far.largest.sqrt()) * (1.0 - GROWING);
            far.inner = far.inner.max(nearest.max(0.0).powi(2));
            far.ends.retain(far.inner);
        }
    }
}

struct Across<'a> {
    far: &'a FarEnds,
}

impl WithSimd for Across<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        self.far.ends.across(simd, &mut [0; 2], self.far.best)
    }
}

/// Points that may be the ends of the longest distance.
#[derive(Debug, Default)]
struct Ends {
    places: [Vec<f64>; 3],
    /// Squared distances from the centre of the best pair, m².
    squares: Vec<f64>,
    indices: Vec<usize>,
}

/// Boxes of blocks of successive points: their least and their most x, y and z.
#[derive(Debug, Default)]
struct Boxes {
    least: [Vec<f64>; 3],
    most: [Vec<f64>; 3],
}

/// As [`path_length`](crate::path_length), of the first so many points given by their x, y and z.
///
/// # Panics
/// If a row is shorter.
pub fn path_length_of_rows(rows: [&[f64]; 3], points: usize) -> f64 {
    if points < 2 {
        return 0.0;
    }
    arch().dispatch(Length { from: rows.map(|row| &row[..points - 1]), to: rows.map(|row| &row[1..points]) })
}

/// The index of a point that is farthest from a place; 0 if there is none.
///
/// # Panics
/// If the rows have different lengths.
pub fn farthest_of_rows(rows: [&[f64]; 3], place: &Point3<f64>) -> usize {
    let [x, y, z] = rows;
    assert!(x.len() == y.len() && x.len() == z.len(), "three rows of one length");
    arch().dispatch(Farthest { rows, place: place.coords.into() })
}

struct Farthest<'a> {
    rows: [&'a [f64]; 3],
    place: [f64; 3],
}

impl WithSimd for Farthest<'_> {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> usize {
        farthest(simd, self.rows, self.place).1
    }
}

struct Extent<'a> {
    rows: [&'a [f64]; 3],
    known: &'a mut Extents,
}

impl WithSimd for Extent<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { rows, known: Extents { pair, filled, ends, boxes } } = self;
        let count = rows[0].len();
        if count == 0 {
            return 0.0;
        }
        if pair.iter().any(|k| *k >= count) {
            *pair = [0; 2];
        }
        let mut best = squared(rows, *pair);
        if best == 0.0 {
            let from = farthest(simd, rows, at(rows, 0)).1;
            let (square, to) = farthest(simd, rows, at(rows, from));
            (best, *pair) = (square, [from, to]);
        }
        for _ in 0..TRIED {
            let (centre, radius) = (between(rows, *pair), 0.5 * best.sqrt());
            let (square, out) = farthest(simd, rows, centre);
            // The other end of a longer distance is at most so much nearer to the centre.
            let inner = (2.0 * radius - square.sqrt()).max(0.0).powi(2) * (1.0 - SURE);
            if square.sqrt() <= radius * (1.0 + SHELL) {
                ends.clear();
                if ends.collect(simd, rows, centre, inner, BLOCK + count / FEW) {
                    *filled = false;
                    return ends.across(simd, pair, best).sqrt();
                }
                break;
            }
            let (farther, to) = farthest(simd, rows, at(rows, out));
            if farther > best {
                (best, *pair) = (farther, [out, to]);
                continue;
            }
            if *filled {
                break;
            }
            ends.clear();
            if ends.collect(simd, rows, centre, inner, BLOCK + (PAIRS * count).isqrt()) {
                return ends.across(simd, pair, best).sqrt();
            }
            *filled = true;
            break;
        }
        if count > MOST {
            return by_boxes(rows);
        }
        boxes.around(simd, rows);
        for i in 0..count.div_ceil(BLOCK) {
            best = boxes.farther(simd, rows, i, best);
        }
        best.sqrt()
    }
}

/// As [`extent`](crate::extent), which needs no pair of blocks for each other.
fn by_boxes([x, y, z]: [&[f64]; 3]) -> f64 {
    let points: Vec<_> = x.iter().zip(y).zip(z).map(|((&x, &y), &z)| Point3::new(x, y, z)).collect();
    crate::extent(&points)
}

#[inline(always)]
fn at(rows: [&[f64]; 3], k: usize) -> [f64; 3] {
    [rows[0][k], rows[1][k], rows[2][k]]
}

/// The middle of two points.
#[inline(always)]
fn between(rows: [&[f64]; 3], [i, j]: [usize; 2]) -> [f64; 3] {
    [0.5 * (rows[0][i] + rows[0][j]), 0.5 * (rows[1][i] + rows[1][j]), 0.5 * (rows[2][i] + rows[2][j])]
}

/// Squared distance of two points.
#[inline(always)]
fn squared(rows: [&[f64]; 3], [i, j]: [usize; 2]) -> f64 {
    square([rows[0][j] - rows[0][i], rows[1][j] - rows[1][i], rows[2][j] - rows[2][i]])
}

/// Squared length, rounded as in lanes: the largest of them is the same, whatever finds it.
#[inline(always)]
fn square([x, y, z]: [f64; 3]) -> f64 {
    z.mul_add(z, y.mul_add(y, x * x))
}

/// As [`square`], in every lane.
#[inline(always)]
fn squares<S: Simd>(simd: S, [x, y, z]: [S::f64s; 3]) -> S::f64s {
    simd.mul_add_f64s(z, z, simd.mul_add_f64s(y, y, simd.mul_f64s(x, x)))
}

impl Ends {
    /// Adds the points whose squared distance from a centre exceeds `least`; whether there are not more than `few` then.
    #[inline(always)]
    fn collect<S: Simd>(&mut self, simd: S, rows: [&[f64]; 3], centre: [f64; 3], least: f64, few: usize) -> bool {
        let (x, _) = S::as_simd_f64s(rows[0]);
        let (y, _) = S::as_simd_f64s(rows[1]);
        let (z, _) = S::as_simd_f64s(rows[2]);
        let (cx, cy, cz) = (simd.splat_f64s(centre[0]), simd.splat_f64s(centre[1]), simd.splat_f64s(centre[2]));
        let limit = simd.splat_f64s(least);
        for k in 0..x.len() {
            let (dx, dy, dz) = (simd.sub_f64s(x[k], cx), simd.sub_f64s(y[k], cy), simd.sub_f64s(z[k], cz));
            let square = squares(simd, [dx, dy, dz]);
            if simd.first_true_m64s(simd.greater_than_f64s(square, limit)) < S::F64_LANES {
                let mut squares = [0.0; 8];
                S::as_mut_simd_f64s(&mut squares[..S::F64_LANES]).0[0] = square;
                for lane in 0..S::F64_LANES {
                    if squares[lane] > least {
                        self.push(rows, k * S::F64_LANES + lane, squares[lane]);
                    }
                }
                if self.squares.len() > few {
                    return false;
                }
            }
        }
        for k in x.len() * S::F64_LANES..rows[0].len() {
            let square = square([rows[0][k] - centre[0], rows[1][k] - centre[1], rows[2][k] - centre[2]]);
            if square > least {
                self.push(rows, k, square);
            }
        }
        true
    }

    fn clear(&mut self) {
        self.places.iter_mut().for_each(Vec::clear);
        self.squares.clear();
        self.indices.clear();
    }

    fn push(&mut self, rows: [&[f64]; 3], k: usize, square: f64) {
        for axis in 0..3 {
            self.places[axis].push(rows[axis][k]);
        }
        self.squares.push(square);
        self.indices.push(k);
    }

    /// Leaves out those whose squared distance is not beyond `least`.
    fn retain(&mut self, least: f64) {
        let mut kept = 0;
        for end in 0..self.squares.len() {
            if self.squares[end] > least {
                self.places.iter_mut().for_each(|row| row[kept] = row[end]);
                (self.squares[kept], self.indices[kept]) = (self.squares[end], self.indices[end]);
                kept += 1;
            }
        }
        self.places.iter_mut().for_each(|row| row.truncate(kept));
        self.squares.truncate(kept);
        self.indices.truncate(kept);
    }

    /// The largest squared distance of a pair that has this one, or of two ends; and what pair that is.
    #[inline(always)]
    fn across<S: Simd>(&self, simd: S, pair: &mut [usize; 2], best: f64) -> f64 {
        let mut best = best;
        let rows = [&self.places[0][..], &self.places[1], &self.places[2]];
        for end in 0..self.squares.len() {
            if self.squares[end] > 0.25 * best * (1.0 - SURE) {
                let (square, other) = farthest(simd, rows, at(rows, end));
                if square > best {
                    (best, *pair) = (square, [self.indices[end], self.indices[other]]);
                }
            }
        }
        best
    }
}

/// Largest squared distance from a place, and the first point that has it.
#[inline(always)]
fn farthest<S: Simd>(simd: S, rows: [&[f64]; 3], place: [f64; 3]) -> (f64, usize) {
    let (x, of_x) = S::as_simd_f64s(rows[0]);
    let (y, of_y) = S::as_simd_f64s(rows[1]);
    let (z, of_z) = S::as_simd_f64s(rows[2]);
    let (px, py, pz) = (simd.splat_f64s(place[0]), simd.splat_f64s(place[1]), simd.splat_f64s(place[2]));
    let mut most = simd.splat_f64s(0.0);
    let mut at = simd.splat_f64s(0.0);
    for k in 0..x.len() {
        let (dx, dy, dz) = (simd.sub_f64s(x[k], px), simd.sub_f64s(y[k], py), simd.sub_f64s(z[k], pz));
        let square = squares(simd, [dx, dy, dz]);
        let farther = simd.greater_than_f64s(square, most);
        most = simd.select_f64s(farther, square, most);
        at = simd.select_f64s(farther, simd.splat_f64s(k as f64), at);
    }
    // The lane that is farthest, and where its register was.
    let (mut squares, mut places) = ([0.0; 8], [0.0; 8]);
    S::as_mut_simd_f64s(&mut squares[..S::F64_LANES]).0[0] = most;
    S::as_mut_simd_f64s(&mut places[..S::F64_LANES]).0[0] = at;
    let (mut best, mut point) = (0.0, 0);
    for lane in 0..S::F64_LANES {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
        let of_lane = places[lane] as usize * S::F64_LANES + lane;
        if squares[lane] > best || squares[lane] == best && of_lane < point {
            (best, point) = (squares[lane], of_lane);
        }
    }
    for k in 0..of_x.len() {
        let square = square([of_x[k] - place[0], of_y[k] - place[1], of_z[k] - place[2]]);
        if square > best {
            (best, point) = (square, x.len() * S::F64_LANES + k);
        }
    }
    (best, point)
}

impl Boxes {
    /// Boxes of the blocks of successive points.
    #[inline(always)]
    fn around<S: Simd>(&mut self, simd: S, rows: [&[f64]; 3]) {
        let blocks = rows[0].len().div_ceil(BLOCK);
        for axis in 0..3 {
            // What is filled up to whole registers is nowhere.
            self.least[axis].clear();
            self.least[axis].resize(blocks + WIDEST, f64::INFINITY);
            self.most[axis].clear();
            self.most[axis].resize(blocks + WIDEST, f64::NEG_INFINITY);
            for (block, points) in rows[axis].chunks(BLOCK).enumerate() {
                let (registers, rest) = S::as_simd_f64s(points);
                let (mut low, mut high) = (simd.splat_f64s(points[0]), simd.splat_f64s(points[0]));
                for register in registers {
                    low = simd.min_f64s(low, *register);
                    high = simd.max_f64s(high, *register);
                }
                let (low, high) = (simd.reduce_min_f64s(low), simd.reduce_max_f64s(high));
                self.least[axis][block] = rest.iter().copied().fold(low, f64::min);
                self.most[axis][block] = rest.iter().copied().fold(high, f64::max);
            }
        }
    }

    /// The larger of the best squared distance and those between block `i` and all from it on.
    #[inline(always)]
    fn farther<S: Simd>(&self, simd: S, rows: [&[f64]; 3], i: usize, best: f64) -> f64 {
        let blocks = rows[0].len().div_ceil(BLOCK);
        let mut best = best;
        for first in (i..blocks).step_by(S::F64_LANES) {
            let mut bound = simd.splat_f64s(0.0);
            for axis in 0..3 {
                let (own_least, own_most) = (simd.splat_f64s(self.least[axis][i]), simd.splat_f64s(self.most[axis][i]));
                let least = S::as_simd_f64s(&self.least[axis][first..first + S::F64_LANES]).0[0];
                let most = S::as_simd_f64s(&self.most[axis][first..first + S::F64_LANES]).0[0];
                let apart = simd.max_f64s(simd.sub_f64s(most, own_least), simd.sub_f64s(own_most, least));
                let apart = simd.max_f64s(apart, simd.splat_f64s(0.0));
                bound = simd.mul_add_f64s(apart, apart, bound);
            }
            // Rounding keeps order: no distance is rounded beyond its bound.
            if simd.first_true_m64s(simd.less_than_f64s(simd.splat_f64s(best), bound)) == S::F64_LANES {
                continue;
            }
            let mut bounds = [0.0; WIDEST];
            S::as_mut_simd_f64s(&mut bounds[..S::F64_LANES]).0[0] = bound;
            for j in first..blocks.min(first + S::F64_LANES) {
                if bounds[j - first] > best {
                    best = across(simd, rows, i, j, best);
                }
            }
        }
        best
    }
}

/// The larger of the best squared distance and those between two blocks.
#[inline(always)]
fn across<S: Simd>(simd: S, rows: [&[f64]; 3], i: usize, j: usize, best: f64) -> f64 {
    let count = rows[0].len();
    let others = j * BLOCK..((j + 1) * BLOCK).min(count);
    let (x, of_x) = S::as_simd_f64s(&rows[0][others.clone()]);
    let (y, of_y) = S::as_simd_f64s(&rows[1][others.clone()]);
    let (z, of_z) = S::as_simd_f64s(&rows[2][others]);
    let (mut most, mut of_rest) = (simd.splat_f64s(0.0), best);
    for from in i * BLOCK..((i + 1) * BLOCK).min(count) {
        let place = [rows[0][from], rows[1][from], rows[2][from]];
        let (px, py, pz) = (simd.splat_f64s(place[0]), simd.splat_f64s(place[1]), simd.splat_f64s(place[2]));
        for k in 0..x.len() {
            let (dx, dy, dz) = (simd.sub_f64s(x[k], px), simd.sub_f64s(y[k], py), simd.sub_f64s(z[k], pz));
            most = simd.max_f64s(most, squares(simd, [dx, dy, dz]));
        }
        for k in 0..of_x.len() {
            of_rest = of_rest.max(square([of_x[k] - place[0], of_y[k] - place[1], of_z[k] - place[2]]));
        }
    }
    of_rest.max(simd.reduce_max_f64s(most))
}

struct Length<'a> {
    from: [&'a [f64]; 3],
    to: [&'a [f64]; 3],
}

impl WithSimd for Length<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { from, to } = self;
        let (x, of_x) = S::as_simd_f64s(from[0]);
        let (y, of_y) = S::as_simd_f64s(from[1]);
        let (z, of_z) = S::as_simd_f64s(from[2]);
        let (next_x, of_next_x) = S::as_simd_f64s(to[0]);
        let (next_y, of_next_y) = S::as_simd_f64s(to[1]);
        let (next_z, of_next_z) = S::as_simd_f64s(to[2]);
        // Of narrow registers, as many as hold what a wide one would: lane by lane the same.
        let (mut lanes, parts) = ([0.0; WIDEST], WIDEST / S::F64_LANES);
        let sums = S::as_mut_simd_f64s(&mut lanes).0;
        for k in 0..x.len() {
            let (dx, dy, dz) =
                (simd.sub_f64s(next_x[k], x[k]), simd.sub_f64s(next_y[k], y[k]), simd.sub_f64s(next_z[k], z[k]));
            sums[k % parts] = simd.add_f64s(sums[k % parts], simd.sqrt_f64s(squares(simd, [dx, dy, dz])));
        }
        for k in 0..of_x.len() {
            let step = square([of_next_x[k] - of_x[k], of_next_y[k] - of_y[k], of_next_z[k] - of_z[k]]);
            lanes[(x.len() * S::F64_LANES + k) % WIDEST] += step.sqrt();
        }
        sum_of_lanes(&lanes)
    }
}
