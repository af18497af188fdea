//! Frames read as the flat rows of numbers that they are, several numbers in the lanes of a register: mean places of
//! features in the body's coordinates, and residuals.
//!
//! Three registers hold whole features, and lane `i` of the register `k` of such a triple always holds the coordinate
//! `(k·lanes + i) mod 3`. What is not inlined into the place where the instruction set is found would lose it.

#![expect(clippy::inline_always, reason = "what is not inlined loses the instruction set")]
#![expect(clippy::needless_range_loop, reason = "one index runs through several arrays of registers")]

use bytemuck::cast_slice;
use nalgebra::{Point3, Vector3};
use pulp::{Simd, WithSimd};

use crate::instructions::arch;
use crate::{Pose, Tracks};

/// Lanes of the widest registers.
const WIDEST: usize = 8;

/// Of every feature, the sum of the weights of its samples, and the weighted sum of its places in the body's coordinates,
/// over some posed frames. Weights are those of samples, frame-major, and 0 where they are missing; 1 if left out.
pub(crate) fn sums_of_places<'p>(
    tracks: &Tracks,
    poses: impl Iterator<Item = (usize, &'p Pose)>,
    weights: Option<&[f64]>,
) -> Vec<(f64, Vector3<f64>)> {
    arch().dispatch(Places { tracks, poses, weights })
}

/// Shows what every sample of some posed frames is off from where pose and shape put it, metres, frame by frame. Of
/// samples that are missing, or of unknown features, the numbers mean nothing.
pub(crate) fn for_residuals<'p>(
    tracks: &Tracks,
    poses: impl Iterator<Item = (usize, &'p Pose)>,
    shape: &[Option<Point3<f64>>],
    look: impl FnMut(usize, &[Vector3<f64>]),
) {
    arch().dispatch(Residuals { tracks, poses, shape, look });
}

/// Sum of the distances that all features go from each of some frames to the next; all must be seen.
pub(crate) fn way(tracks: &Tracks, frames: &[usize]) -> f64 {
    arch().dispatch(Way { tracks, frames })
}

struct Places<'a, I> {
    tracks: &'a Tracks,
    poses: I,
    weights: Option<&'a [f64]>,
}

impl<'p, I: Iterator<Item = (usize, &'p Pose)>> WithSimd for Places<'_, I> {
    type Output = Vec<(f64, Vector3<f64>)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { tracks, poses, weights } = self;
        let features = tracks.features();
        let length = padded(features);
        let mut sums = [0, 1, 2].map(|_| vec![0.0; length]);
        let mut row = vec![0.0; length];
        let (mut whole_frames, mut counts) = (0.0, vec![0.0; features]);
        for (frame, pose) in poses {
            let weights = weights.map(|weights| &weights[frame * features..(frame + 1) * features]);
            let whole = tracks.seen_count(frame) == features
                && weights.is_none_or(|weights| weights.iter().all(|weight| *weight == 1.0));
            if whole {
                whole_frames += 1.0;
            } else {
                for feature in 0..features {
                    let seen = tracks.is_visible(frame, feature);
                    let weight = if seen { weights.map_or(1.0, |weights| weights[feature]) } else { 0.0 };
                    counts[feature] += weight;
                    row[3 * feature..3 * feature + 3].fill(weight);
                }
            }
            let frame = Frame::of(simd, tracks, frame, pose);
            let row = S::as_simd_f64s(&row).0;
            let [x, y, z] = &mut sums;
            let sums = [S::as_mut_simd_f64s(x).0, S::as_mut_simd_f64s(y).0, S::as_mut_simd_f64s(z).0];
            for at in 0..row.len() {
                let mut d = frame.about_the_body(simd, at, at % 3);
                if !whole {
                    d = simd.mul_f64s(d, row[at]);
                }
                for axis in 0..3 {
                    sums[axis][at] = simd.mul_add_f64s(frame.turn[at % 3][axis], d, sums[axis][at]);
                }
            }
        }
        let sum = |axis: usize, feature: usize| sums[axis][3 * feature..3 * feature + 3].iter().sum::<f64>();
        let of_feature = |feature| (counts[feature] + whole_frames, Vector3::from_fn(|axis, _| sum(axis, feature)));
        (0..features).map(of_feature).collect()
    }
}

struct Residuals<'a, I, F> {
    tracks: &'a Tracks,
    poses: I,
    shape: &'a [Option<Point3<f64>>],
    look: F,
}

impl<'p, I: Iterator<Item = (usize, &'p Pose)>, F: FnMut(usize, &[Vector3<f64>])> WithSimd for Residuals<'_, I, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { tracks, poses, shape, mut look } = self;
        let features = tracks.features();
        let length = padded(features);
        let known = |place: &Option<Point3<f64>>| place.map_or_else(Vector3::zeros, |place| place.coords);
        let places = expanded(&shape.iter().map(known).collect::<Vec<_>>());
        let places = [0, 1, 2].map(|axis| S::as_simd_f64s(&places[axis]).0);
        let mut residuals = vec![0.0; length];
        for (number, pose) in poses {
            let frame = Frame::of(simd, tracks, number, pose);
            let row = S::as_mut_simd_f64s(&mut residuals).0;
            for at in 0..row.len() {
                let mut off = frame.about_the_body(simd, at, at % 3);
                for axis in 0..3 {
                    let product = simd.mul_f64s(frame.turn[at % 3][axis], places[axis][at]);
                    off = simd.sub_f64s(off, product);
                }
                row[at] = off;
            }
            look(number, cast_slice(&residuals[..3 * features]));
        }
    }
}

struct Way<'a> {
    tracks: &'a Tracks,
    frames: &'a [usize],
}

impl WithSimd for Way<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { tracks, frames } = self;
        let (strides, mut gone) = (Strides::new(simd), Gone::of(tracks.features()));
        for step in frames.windows(2) {
            strides.add(simd, tracks, [step[0], step[1]], &mut gone);
        }
        gone.sum()
    }
}

/// How far features have gone, metres, in the lanes that hold their x of registers that hold so many.
pub(crate) struct Gone {
    distances: Vec<f64>,
    lanes: usize,
}

impl Gone {
    pub(crate) fn of(features: usize) -> Self {
        Self { distances: vec![0.0; padded(features) / 3], lanes: 1 }
    }

    /// The sum over features, in their order whichever lanes these are in.
    pub(crate) fn sum(&self) -> f64 {
        // The x of the next feature is the third number on, round the register.
        let registers = self.distances.chunks_exact(self.lanes);
        registers.flat_map(|register| (0..self.lanes).map(|feature| register[3 * feature % self.lanes])).sum()
    }
}

/// What adds up the squares of the coordinates of points that lie one after another in registers.
pub(crate) struct Strides<S: Simd> {
    is_0: S::m64s,
    is_1: S::m64s,
    /// The lane before which a register ends, where numbers of the next one follow.
    ends: [S::m64s; 2],
}

impl<S: Simd> Strides<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S) -> Self {
        let [is_0, is_1] = first_holds(simd);
        Self { is_0, is_1, ends: [last_lanes(simd, 1), last_lanes(simd, 2)] }
    }

    /// Adds how far every feature goes from one frame to another; all must be seen.
    #[inline(always)]
    pub(crate) fn add(&self, simd: S, tracks: &Tracks, [from, to]: [usize; 2], gone: &mut Gone) {
        let (from, rest_from) = S::as_simd_f64s(cast_slice(tracks.frame(from)));
        let (to, rest_to) = S::as_simd_f64s(cast_slice(tracks.frame(to)));
        gone.lanes = S::F64_LANES;
        let triples = (0..(3 * tracks.features()).div_ceil(S::F64_LANES)).step_by(3);
        for (triple, gone) in triples.zip(S::as_mut_simd_f64s(&mut gone.distances).0) {
            let mut squares = [simd.splat_f64s(0.0); 5];
            for k in 0..3 {
                let (a, b) = (numbers(simd, from, rest_from, triple + k), numbers(simd, to, rest_to, triple + k));
                let d = simd.sub_f64s(b, a);
                squares[k] = simd.mul_f64s(d, d);
            }
            // Of the lanes that hold an x, every one adds the two numbers that follow.
            let mut of_points = [squares[0]; 3];
            for k in 0..3 {
                let next = shifted(simd, squares[k], squares[k + 1], 1, self.ends[0]);
                let last = if S::F64_LANES == 1 {
                    squares[k + 2]
                } else {
                    shifted(simd, squares[k], squares[k + 1], 2, self.ends[1])
                };
                of_points[k] = simd.add_f64s(simd.add_f64s(squares[k], next), last);
            }
            // The three registers hold them in different lanes.
            let [a, b, c] = of_points;
            let (second, third) = if S::F64_LANES % 3 == 1 { (c, b) } else { (b, c) };
            let of_points = simd.select_f64s(self.is_0, a, simd.select_f64s(self.is_1, second, third));
            *gone = simd.add_f64s(*gone, simd.sqrt_f64s(of_points));
        }
    }
}

/// A register of a frame's numbers; beyond the frame it is 0.
#[inline(always)]
fn numbers<S: Simd>(simd: S, full: &[S::f64s], rest: &[f64], at: usize) -> S::f64s {
    match at.cmp(&full.len()) {
        std::cmp::Ordering::Less => full[at],
        std::cmp::Ordering::Equal => simd.partial_load_f64s(rest),
        std::cmp::Ordering::Greater => simd.splat_f64s(0.0),
    }
}

/// The lanes from `by` before the last on.
#[inline(always)]
fn last_lanes<S: Simd>(simd: S, by: usize) -> S::m64s {
    const NUMBERS: [f64; WIDEST] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
    let lane = simd.partial_load_f64s(&NUMBERS[..S::F64_LANES.min(WIDEST)]);
    simd.greater_than_or_equal_f64s(lane, simd.splat_f64s((S::F64_LANES.saturating_sub(by)) as f64))
}

/// Every lane's number `by` lanes on, over the end of a register into the next one.
#[inline(always)]
fn shifted<S: Simd>(simd: S, here: S::f64s, next: S::f64s, by: usize, ends: S::m64s) -> S::f64s {
    simd.select_f64s(ends, simd.rotate_left_f64s(next, by), simd.rotate_left_f64s(here, by))
}

/// For each axis, that coordinate of every place three times over, so that it meets each of the place's three coordinates in
/// a frame; with zeros to whole triples of registers.
pub(crate) fn expanded(places: &[Vector3<f64>]) -> [Vec<f64>; 3] {
    [0, 1, 2].map(|axis| {
        let mut row: Vec<f64> = places.iter().flat_map(|place| [place[axis]; 3]).collect();
        row.resize(padded(places.len()), 0.0);
        row
    })
}

/// Numbers of a row that fills whole triples of the widest registers, and of narrower ones.
pub(crate) fn padded(features: usize) -> usize {
    (3 * features).next_multiple_of(3 * WIDEST)
}

/// Lanes whose number lacks the bit 1, 2 or 4.
#[inline(always)]
pub(crate) fn lanes_lack<S: Simd>(simd: S) -> [S::m64s; 3] {
    const LACKS: [[f64; WIDEST]; 3] =
        [[0., 1., 0., 1., 0., 1., 0., 1.], [0., 0., 1., 1., 0., 0., 1., 1.], [0., 0., 0., 0., 1., 1., 1., 1.]];
    let lacks = [0, 1, 2].map(|bit: usize| S::as_simd_f64s(&LACKS[bit][..S::F64_LANES]).0[0]);
    let zero = simd.splat_f64s(0.0);
    [simd.equal_f64s(lacks[0], zero), simd.equal_f64s(lacks[1], zero), simd.equal_f64s(lacks[2], zero)]
}

/// Which lanes of a triple's first register hold the coordinate 0, and which 1.
#[inline(always)]
fn first_holds<S: Simd>(simd: S) -> [S::m64s; 2] {
    holds(simd, 0)
}

/// The same of one of the registers that hold what the widest one would.
#[inline(always)]
pub(crate) fn holds<S: Simd>(simd: S, part: usize) -> [S::m64s; 2] {
    const COORDINATES: [f64; WIDEST] = [0.0, 1.0, 2.0, 0.0, 1.0, 2.0, 0.0, 1.0];
    let lanes = S::F64_LANES.min(WIDEST);
    let coordinate = simd.partial_load_f64s(&COORDINATES[part * lanes..(part + 1) * lanes]);
    [simd.equal_f64s(coordinate, simd.splat_f64s(0.0)), simd.equal_f64s(coordinate, simd.splat_f64s(1.0))]
}

/// The three registers of a triple in which every lane holds that of three numbers which belongs to its coordinate.
#[inline(always)]
fn by_coordinate<S: Simd>(simd: S, numbers: [f64; 3]) -> [S::f64s; 3] {
    let [is_0, is_1] = first_holds(simd);
    let of = [simd.splat_f64s(numbers[0]), simd.splat_f64s(numbers[1]), simd.splat_f64s(numbers[2])];
    let mut registers = of;
    for k in 0..3 {
        let first = k * S::F64_LANES;
        let later = simd.select_f64s(is_1, of[(first + 1) % 3], of[(first + 2) % 3]);
        registers[k] = simd.select_f64s(is_0, of[first % 3], later);
    }
    registers
}

/// A frame's numbers, and its pose in the order in which registers meet them; registers lie on the lines of caches.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Frame<'a, S: Simd> {
    /// `turn[k][a]` of a lane that holds coordinate `b` is `R[b][a]`.
    pub(crate) turn: [[S::f64s; 3]; 3],
    shift: [S::f64s; 3],
    full: &'a [S::f64s],
    rest: &'a [f64],
}

impl<'a, S: Simd> Frame<'a, S> {
    #[inline(always)]
    pub(crate) fn of(simd: S, tracks: &'a Tracks, frame: usize, pose: &Pose) -> Self {
        let rotation = pose.rotation.to_rotation_matrix();
        let zero = simd.splat_f64s(0.0);
        let mut turn = [[zero; 3]; 3];
        for axis in 0..3 {
            let registers = by_coordinate(simd, rotation.matrix().column(axis).into_owned().into());
            for k in 0..3 {
                turn[k][axis] = registers[k];
            }
        }
        let (full, rest) = S::as_simd_f64s(cast_slice(tracks.frame(frame)));
        Self { full, rest, turn, shift: by_coordinate(simd, pose.translation.vector.into()) }
    }

    /// A register of positions less the pose's translation, `k` being its place in its triple; full of the frame's numbers.
    #[inline(always)]
    pub(crate) fn inside(&self, simd: S, at: usize, k: usize) -> S::f64s {
        simd.sub_f64s(self.full[at], self.shift[k])
    }

    /// A register of positions less the pose's translation, `k` being its place in its triple; beyond the frame it means nothing.
    #[inline(always)]
    pub(crate) fn about_the_body(&self, simd: S, at: usize, k: usize) -> S::f64s {
        simd.sub_f64s(numbers(simd, self.full, self.rest, at), self.shift[k])
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;

    /// Rounding of sums of a few numbers of the size of 1, metres.
    const EXACT: f64 = 1e-12;

    fn wild(seed: usize) -> f64 {
        (seed as f64 * 12.9898).sin().mul_add(43_758.545_3, 0.5).rem_euclid(1.0) * 2.0 - 1.0
    }

    fn point(seed: usize) -> Point3<f64> {
        Point3::new(wild(3 * seed), wild(3 * seed + 1), wild(3 * seed + 2))
    }

    #[test]
    fn ways_are_sums_of_distances_in_any_register() {
        for features in [1, 2, 3, 8, 13, 40] {
            let positions = (0..5 * features).map(point).collect();
            let tracks = Tracks::new(features, positions).expect("whole frames");
            let frames = [0, 1, 3, 4];
            let step = |step: &[usize]| {
                (0..features)
                    .map(|f| nalgebra::distance(&tracks.frame(step[0])[f], &tracks.frame(step[1])[f]))
                    .sum::<f64>()
            };
            let expected: f64 = frames.windows(2).map(step).sum();
            let scalar = Way { tracks: &tracks, frames: &frames }.with_simd(pulp::Scalar);
            for found in [way(&tracks, &frames), scalar] {
                assert!((found - expected).abs() < EXACT * expected, "{features} features: {found}, not {expected}");
            }
        }
    }

    #[test]
    fn sums_and_residuals_are_those_of_single_samples() {
        for features in [1, 3, 5, 8, 40] {
            let frames = 7;
            let missing = |frame: usize, feature: usize| frame == 2 && feature.is_multiple_of(3);
            let sample = |frame, feature| {
                if missing(frame, feature) { Point3::new(f64::NAN, 0.0, 0.0) } else { point(100 * frame + feature) }
            };
            let positions = (0..frames).flat_map(|frame| (0..features).map(move |feature| sample(frame, feature)));
            let tracks = Tracks::new(features, positions.collect()).expect("whole frames");
            let shape: Vec<Option<Point3<f64>>> = (0..features).map(|f| (f != 4).then(|| point(900 + f))).collect();
            let pose = |frame| {
                let turn = UnitQuaternion::from_scaled_axis(point(1000 + frame).coords * 2.0);
                Pose::from_parts(point(2000 + frame).coords.into(), turn)
            };
            let poses: Vec<Pose> = (0..frames).map(pose).collect();
            let weigh = |sample: usize| if sample / features == 5 { 1.0 } else { wild(sample).abs() };
            let weights: Vec<f64> = (0..frames * features).map(weigh).collect();
            for weights in [None, Some(&weights[..])] {
                let found = sums_of_places(&tracks, poses.iter().enumerate(), weights);
                for (feature, (total, sum)) in found.into_iter().enumerate() {
                    let (mut expected_total, mut expected) = (0.0, Vector3::zeros());
                    for (frame, pose) in poses.iter().enumerate() {
                        if let Some(position) = tracks.get(frame, feature) {
                            let weight = weights.map_or(1.0, |weights| weights[frame * features + feature]);
                            expected_total += weight;
                            expected += pose.inverse_transform_point(position).coords * weight;
                        }
                    }
                    assert!((total - expected_total).abs() < EXACT);
                    assert!((sum - expected).norm() < EXACT, "{sum} {expected}");
                }
            }
            let mut looked = 0;
            for_residuals(&tracks, poses.iter().enumerate(), &shape, |frame, residuals| {
                for (feature, position) in tracks.seen(frame) {
                    let Some(place) = shape[feature] else { continue };
                    assert!((residuals[feature] - (position - poses[frame] * place)).norm() < EXACT);
                    looked += 1;
                }
            });
            let known = shape.iter().flatten().count();
            assert_eq!(looked, frames * known - (0..features).filter(|&f| missing(2, f) && shape[f].is_some()).count());
        }
    }
}
