//! The shape that thesis registrations do not fit, settled on the side, and the noise that residuals from it show.

#![expect(clippy::inline_always, reason = "what is not inlined loses the instruction set")]
#![expect(clippy::needless_range_loop, reason = "one index runs through several arrays of registers")]

use nalgebra::{Point3, Vector3};
use pulp::{Arch, Simd, WithSimd};

use crate::flat_rows::{Frame, expanded, padded};
use crate::noise::{Noisy, OfFrame, Residuals};
use crate::poses::{SHAPE_CONVERGED, Shape, change, mean_shape, posed, rebase, spread};
use crate::{Pose, Tracks, register_frames};

/// Most rounds that bring the shape close enough to measure noise, and the change of the shape, as a share of that noise,
/// from which on another round would not change the noise in its sixth digit.
const ROUNDS: usize = 3;
const CLOSE: f64 = 1e-3;

/// What is found beside thesis registrations.
pub(crate) struct Settled {
    /// In coordinates that are the recording's in the first posed frame.
    pub(crate) shape: Shape,
    pub(crate) noisy: Noisy,
    /// Correlation of the residuals with those of the frame before.
    pub(crate) drift: f64,
    /// No coordinate of a residual is larger, metres.
    largest: f64,
    poses: Vec<Option<Pose>>,
}

/// Alternates between shape and poses, beginning with poses, until noise is told.
///
/// A round reads the positions twice: once to register all frames to the shape, once for the mean shape of these poses
/// together with the residuals.
pub(crate) fn settled(tracks: &Tracks, mut poses: Vec<Option<Pose>>) -> Settled {
    let mut shape = mean_shape(tracks, &poses);
    let mut round = 1;
    loop {
        register_frames(&shape, tracks, &mut poses);
        let Looked { counts, sums, frames, lag: [product, squares], largest } =
            Arch::new().dispatch(Look { tracks, poses: &poses, shape: &shape });
        let mean = |(count, sum): (&f64, &Vector3<f64>)| (*count > 0.0).then(|| Point3::from(sum / *count));
        let next: Shape = counts.iter().zip(&sums).map(mean).collect();
        // Squares about the mean are less than about another place.
        let moved = counts.iter().zip(shape.iter().zip(&next));
        let less = moved
            .filter_map(|(count, (before, after))| Some(count * (before.as_ref()? - after.as_ref()?).norm_squared()));
        let noisy = Noisy::of(&frames, less.sum(), counts.iter().filter(|count| **count > 0.0).count(), tracks);
        let close = f64::max(CLOSE * noisy.typical.unwrap_or(0.0), SHAPE_CONVERGED * spread(&next).trace().sqrt());
        let rests = change(&shape, &next) <= close;
        shape = next;
        if rests || round == ROUNDS {
            rebase(&mut poses, &mut shape);
            let drift = if squares > 0.0 { 2.0 * product / squares } else { 0.0 };
            return Settled { shape, noisy, drift, largest, poses };
        }
        round += 1;
    }
}

impl Settled {
    /// The sample farthest from where the shape puts it, if it may be farther than so many metres.
    pub(crate) fn worst_beyond(&self, tracks: &Tracks, distance: f64) -> Option<(usize, usize, f64)> {
        let may_be = 3.0 * self.largest.powi(2) > distance.powi(2);
        may_be.then(|| Residuals::of(tracks, &self.poses, &self.shape, |_, _| true).worst)?
    }
}

struct Look<'a> {
    tracks: &'a Tracks,
    poses: &'a [Option<Pose>],
    shape: &'a Shape,
}

/// Exact repetitions of a frame count once.
struct Looked {
    /// Of every feature, how many samples it has, and the sum of its places in the body's coordinates.
    counts: Vec<f64>,
    sums: Vec<Vector3<f64>>,
    frames: Vec<OfFrame>,
    /// Sums over successive frames of the products of their residuals, and of their squares.
    lag: [f64; 2],
    largest: f64,
}

impl WithSimd for Look<'_> {
    type Output = Looked;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Looked {
        let Self { tracks, poses, shape } = self;
        let features = tracks.features();
        let length = padded::<S>(features);
        let complete = shape.iter().all(Option::is_some);
        let place = |place: &Option<Point3<f64>>| place.map_or_else(Vector3::zeros, |place| place.coords);
        let places = expanded::<S>(&shape.iter().map(place).collect::<Vec<_>>());
        let places = [0, 1, 2].map(|axis| S::as_simd_f64s(&places[axis]).0);
        let counts_in = |frame: usize, feature: usize| shape[feature].is_some() && tracks.is_visible(frame, feature);
        // A feature without a place gets one by the mean of its samples, and has no residuals yet; nor has what rows are
        // filled up with.
        let known: Vec<f64> = shape.iter().flat_map(|place| [f64::from(u8::from(place.is_some())); 3]).collect();
        let known = [known, vec![0.0; length - 3 * features]].concat();
        let known = S::as_simd_f64s(&known).0;
        let full = 3 * features / S::F64_LANES;
        let (mut row, mut now, mut before) = (vec![0.0; length], vec![0.0; length], vec![0.0; length]);
        let mut sums = [0, 1, 2].map(|_| vec![0.0; length]);
        let (mut whole_frames, mut counts) = (0.0, vec![0.0; features]);
        let mut frames = Vec::with_capacity(poses.len());
        let zero = simd.splat_f64s(0.0);
        let (mut products, mut largest, mut lag_squares) = (zero, zero, 0.0);
        // The latest posed frame, whether it was whole, and its squares.
        let mut latest: Option<(usize, bool, f64)> = None;
        for (number, pose) in posed(poses) {
            if let Some((last, ..)) = &mut latest
                && *last + 1 == number
                && tracks.repeats_previous(number)
            {
                *last = number;
                continue;
            }
            let whole = complete && tracks.seen_count(number) == features;
            let mut samples = features;
            if whole {
                whole_frames += 1.0;
            } else {
                samples = 0;
                for feature in 0..features {
                    samples += usize::from(counts_in(number, feature));
                    let weight = if tracks.is_visible(number, feature) { 1.0 } else { 0.0 };
                    counts[feature] += weight;
                    row[3 * feature..3 * feature + 3].fill(weight);
                }
            }
            let follows = latest.is_some_and(|(last, ..)| last + 1 == number);
            let frame = Frame::of(simd, tracks, number, pose);
            let mask = S::as_simd_f64s(&row).0;
            let residuals = S::as_mut_simd_f64s(&mut now).0;
            let earlier = S::as_simd_f64s(&before).0;
            let [x, y, z] = &mut sums;
            let (x, y, z) = (S::as_mut_simd_f64s(x).0, S::as_mut_simd_f64s(y).0, S::as_mut_simd_f64s(z).0);
            let (mut squares, mut product) = ([zero; 3], zero);
            for triple in 0..residuals.len() / 3 {
                for k in 0..3 {
                    let at = 3 * triple + k;
                    let mut d = frame.about_the_body(simd, at, k);
                    let turn = frame.turn[k];
                    let place = simd.mul_f64s(turn[0], places[0][at]);
                    let place = simd.mul_add_e_f64s(turn[1], places[1][at], place);
                    let mut place = simd.mul_add_e_f64s(turn[2], places[2][at], place);
                    if !whole {
                        (d, place) = (simd.mul_f64s(d, mask[at]), simd.mul_f64s(place, mask[at]));
                    }
                    let mut off = simd.sub_f64s(d, place);
                    if !complete || at >= full {
                        off = simd.mul_f64s(off, known[at]);
                    }
                    x[at] = simd.mul_add_e_f64s(turn[0], d, x[at]);
                    y[at] = simd.mul_add_e_f64s(turn[1], d, y[at]);
                    z[at] = simd.mul_add_e_f64s(turn[2], d, z[at]);
                    squares[k] = simd.mul_add_e_f64s(off, off, squares[k]);
                    product = simd.mul_add_e_f64s(off, earlier[at], product);
                    largest = simd.max_f64s(largest, simd.abs_f64s(off));
                    residuals[at] = off;
                }
            }
            let squares = simd.add_f64s(simd.add_f64s(squares[0], squares[1]), squares[2]);
            let squares = simd.reduce_sum_f64s(squares);
            frames.push(OfFrame { samples, squares });
            if follows {
                products = simd.add_f64s(products, product);
                lag_squares += match latest {
                    Some((_, true, earlier)) if whole => earlier + squares,
                    _ => (0..features)
                        .filter(|&feature| counts_in(number - 1, feature) && counts_in(number, feature))
                        .flat_map(|feature| 3 * feature..3 * feature + 3)
                        .map(|at| before[at] * before[at] + now[at] * now[at])
                        .sum(),
                };
            }
            latest = Some((number, whole, squares));
            std::mem::swap(&mut now, &mut before);
        }
        let sum = |axis: usize, feature: usize| sums[axis][3 * feature..3 * feature + 3].iter().sum::<f64>();
        Looked {
            counts: counts.iter().map(|count| count + whole_frames).collect(),
            sums: (0..features).map(|feature| Vector3::from_fn(|axis, _| sum(axis, feature))).collect(),
            frames,
            lag: [simd.reduce_sum_f64s(products), lag_squares],
            largest: simd.reduce_max_f64s(largest),
        }
    }
}
