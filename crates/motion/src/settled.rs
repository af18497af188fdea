//! The shape that thesis registrations do not fit, settled on the side, and the noise that residuals from it show.

#![expect(clippy::inline_always, reason = "what is not inlined loses the instruction set")]

use std::ops::Range;

use nalgebra::{Point3, Vector3};
use pulp::Simd;

use crate::flat_rows::{Frame, Gone, Strides, expanded, padded};
use crate::instructions::sum_of_lanes;
use crate::noise::{Noisy, OfFrame, lag_one};
use crate::poses::{SHAPE_CONVERGED, Shape, change, mean_shape, pose_of, rebase, spread, start};
use crate::registration_in_lanes::{Look, register_and_look};
use crate::rotation_in_lanes::BLOCK;
use crate::{Pose, RegistrationError, Tracks, evenly, register_frames};

/// Most rounds that bring the shape close enough to measure noise.
const ROUNDS: usize = 4;
/// Share by which another round would change the squares of the residuals, from which on none is needed: by chance those of
/// a hundred million samples differ by more.
const CLOSE: f64 = 1e-4;
/// Frames, evenly over time, whose mean is what residuals are measured from at first.
const GLANCE: usize = 16;

/// What is found beside thesis registrations.
pub(crate) struct Settled {
    /// In coordinates that are the recording's in the first posed frame.
    pub(crate) shape: Shape,
    pub(crate) noisy: Noisy,
    /// Of every frame, what no coordinate of a residual exceeds, metres.
    largest: Vec<(usize, f64)>,
    /// Sum of the distances that features go from each frame to the next, metres; `None` where one is not seen.
    pub(crate) way: Option<f64>,
}

/// Registers every frame to the first one, by the features that the first one shows, and settles the shape.
///
/// # Errors
/// [`RegistrationError`] if no frame can be posed.
pub(crate) fn first(tracks: &Tracks) -> Result<(Vec<Option<Pose>>, Settled), RegistrationError> {
    let (start, shape) = start(tracks, 0..tracks.frames())?;
    let mut poses = vec![None; tracks.frames()];
    let places = at_a_glance(tracks, &shape);
    let seen = Seen::in_frames(tracks, &shape, &places, Some(Gone::of(tracks.features())), &mut poses);
    let settled = further(tracks, places, &poses, seen);
    poses[start] = Some(Pose::identity());
    Ok((poses, settled))
}

/// Settles the shape of a body that was registered in another way.
pub(crate) fn settled(tracks: &Tracks, registered: &[Option<Pose>]) -> Settled {
    let start = registered.iter().position(Option::is_some).unwrap_or(0);
    // A frame that shows everything is as good a beginning as the mean, which takes a look at all frames.
    let shape: Shape = (0..tracks.features()).map(|feature| tracks.get(start, feature).copied()).collect();
    let shape =
        if shape.iter().all(Option::is_some) { at_a_glance(tracks, &shape) } else { mean_shape(tracks, registered) };
    let mut poses = vec![None; tracks.frames()];
    let seen = Seen::in_frames(tracks, &shape, &shape, Some(Gone::of(tracks.features())), &mut poses);
    further(tracks, shape, &poses, seen)
}

/// The mean of some frames after these are registered to a shape.
fn at_a_glance(tracks: &Tracks, shape: &Shape) -> Shape {
    let missing = Point3::from([f64::NAN; 3]);
    let sample = |frame, feature| tracks.get(frame, feature).copied().unwrap_or(missing);
    // What repeats a frame exactly says nothing new.
    let fresh: Vec<usize> = (0..tracks.frames()).filter(|frame| !tracks.repeats_previous(*frame)).collect();
    let frames = evenly(fresh.len(), GLANCE).into_iter().map(|index| fresh[index]);
    let positions = frames.flat_map(|frame| (0..tracks.features()).map(move |feature| sample(frame, feature)));
    let some = Tracks::new(tracks.features(), positions.collect()).expect("whole frames");
    let mean = mean_shape(&some, &poses_to(&some, shape));
    // What these frames do not show is where the shape has it, if it does.
    mean.into_iter().zip(shape).map(|(mean, place)| mean.or(*place)).collect()
}

/// Alternates between poses and shape, beginning with frames whose residuals from some places were seen when they were
/// registered, until noise is told.
///
/// A frame is registered, and looked at for the mean shape and its residuals, in one visit. What is wrong with the shape
/// moves all poses alike, which nobody sees, as long as frames show the same features; beyond that it changes squares of
/// residuals by the share `(error / size)² / (3 features - 6)` only. Where features are missing it adds its own square.
fn further<'t>(tracks: &'t Tracks, mut places: Shape, poses: &[Option<Pose>], mut seen: Seen<'t>) -> Settled {
    let way = seen.gone.as_ref().map(Gone::sum);
    let mut start = poses.iter().flatten().next().copied();
    let mut round = 1;
    loop {
        let Seen { counts, sums, frames, mut largest, whole_frames, .. } = seen;
        let mean = |(count, sum): (&f64, &Vector3<f64>)| (*count > 0.0).then(|| Point3::from(sum / *count));
        let mut shape: Shape = counts.iter().zip(&sums).map(mean).collect();
        // Squares about the mean are less than about another place.
        let moved = counts.iter().zip(places.iter().zip(&shape));
        let less: f64 = moved
            .filter_map(|(count, (before, after))| Some(count * (before.as_ref()? - after.as_ref()?).norm_squared()))
            .sum();
        let features = counts.iter().filter(|count| **count > 0.0).count();
        let noisy = Noisy::of(&frames, less, features, tracks);
        let error = change(&places, &shape);
        // The shape that frames were registered to may be a single frame at first.
        let error_of_shape = if round == 1 { error.max(3_f64.sqrt() * noisy.typical.unwrap_or(0.0)) } else { error };
        let freedom = (3.0 * features as f64 - 6.0).max(1.0);
        let harmless = if whole_frames == frames.len() as f64 {
            freedom * spread(&shape).trace() / features as f64
        } else {
            noisy.typical.unwrap_or(0.0).powi(2).max(SHAPE_CONVERGED.powi(2) / CLOSE * spread(&shape).trace())
        };
        let rests = error_of_shape.powi(2) <= CLOSE * harmless;
        if rests || round == ROUNDS {
            for (_, largest) in &mut largest {
                *largest += error;
            }
            rebase(&mut [start], &mut shape);
            return Settled { shape, noisy, largest, way };
        }
        let mut poses = vec![None; tracks.frames()];
        seen = Seen::in_frames(tracks, &shape, &shape, None, &mut poses);
        start = poses.into_iter().flatten().next();
        places = shape;
        round += 1;
    }
}

impl Settled {
    /// The sample farthest from where the shape puts it, if it is farther than so many metres: its frame, its feature, and
    /// how far it is, metres.
    pub(crate) fn worst_beyond(&self, tracks: &Tracks, distance: f64) -> Option<(usize, usize, f64)> {
        let may_be = |(frame, largest): &(usize, f64)| (3.0 * largest.powi(2) > distance.powi(2)).then_some(*frame);
        let residuals = |frame| {
            let pose = pose_of(tracks, frame, &self.shape).ok()?;
            let off = |(feature, place): (usize, &Point3<f64>)| {
                Some((frame, feature, nalgebra::distance(place, &(pose * self.shape[feature]?))))
            };
            tracks.seen(frame).filter_map(off).max_by(|a, b| a.2.total_cmp(&b.2))
        };
        let worst = self.largest.iter().filter_map(may_be).filter_map(residuals).max_by(|a, b| a.2.total_cmp(&b.2));
        worst.filter(|(_, _, found)| *found > distance)
    }
}

/// Correlation of the residuals from a shape with those of the frame before.
pub(crate) fn drift(tracks: &Tracks, shape: &Shape) -> f64 {
    lag_one(tracks, &poses_to(tracks, shape), shape, |_, _| true)
}

fn poses_to(tracks: &Tracks, shape: &Shape) -> Vec<Option<Pose>> {
    let mut poses = vec![None; tracks.frames()];
    register_frames(shape, tracks, &mut poses);
    poses
}

/// What posed frames show beside a shape. Exact repetitions of a frame count once.
struct Seen<'a> {
    tracks: &'a Tracks,
    complete: bool,
    /// Where residuals are measured from, and 1 where a feature has a place, as a frame's row meets them. A feature without one gets it by the mean
    /// of its samples, and has no residuals yet; nor has what rows are filled up with.
    places: [Vec<f64>; 3],
    known: Vec<f64>,
    is_known: Vec<bool>,
    /// 1 for every coordinate that is seen in a frame, for the frames that are looked at together; and which of them are not
    /// whole.
    masks: Vec<f64>,
    masked: [bool; BLOCK],
    whole_frames: f64,
    rows: [Vec<f64>; 3],

    /// How far the features went in these frames; `None` where one is not seen, or where nobody asked.
    gone: Option<Gone>,
    /// Of every feature, how many samples it has, and the sum of its places in the body's coordinates.
    counts: Vec<f64>,
    sums: Vec<Vector3<f64>>,
    frames: Vec<OfFrame>,
    /// Of every one of these frames, the largest coordinate of a residual, metres.
    largest: Vec<(usize, f64)>,
}

impl<'a> Seen<'a> {
    /// Registers all frames to a shape, looks at their residuals from some places, and adds to how far features went, if it
    /// is asked for.
    fn in_frames(
        tracks: &'a Tracks,
        shape: &Shape,
        places: &Shape,
        gone: Option<Gone>,
        poses: &mut [Option<Pose>],
    ) -> Self {
        let features = tracks.features();
        let place = |place: &Option<Point3<f64>>| place.map_or_else(Vector3::zeros, |place| place.coords);
        let length = padded(features);
        let mut known: Vec<f64> = places.iter().flat_map(|place| [f64::from(u8::from(place.is_some())); 3]).collect();
        known.resize(length, 0.0);
        let mut seen = Self {
            tracks,
            complete: places.iter().all(Option::is_some),
            places: expanded(&places.iter().map(place).collect::<Vec<_>>()),
            known,
            is_known: places.iter().map(Option::is_some).collect(),
            masks: vec![1.0; BLOCK * length],
            masked: [false; BLOCK],
            whole_frames: 0.0,
            rows: [0, 1, 2].map(|_| vec![0.0; length]),
            gone,
            counts: vec![0.0; features],
            sums: Vec::new(),
            frames: Vec::with_capacity(tracks.frames()),
            largest: Vec::with_capacity(tracks.frames()),
        };
        register_and_look(shape, tracks, None, poses, &mut seen);
        let sum = |axis: usize, feature: usize| seen.rows[axis][3 * feature..3 * feature + 3].iter().sum::<f64>();
        seen.sums = (0..features).map(|feature| Vector3::from_fn(|axis, _| sum(axis, feature))).collect();
        seen.counts.iter_mut().for_each(|count| *count += seen.whole_frames);
        seen
    }

    /// Takes note of which features a frame shows, its coordinates in a mask; gives how many have residuals.
    fn note(&mut self, frame: usize, mask: usize) -> usize {
        self.masked[mask] = true;
        let mut samples = 0;
        for feature in 0..self.is_known.len() {
            let weight = if self.tracks.is_visible(frame, feature) { 1.0 } else { 0.0 };
            samples += usize::from(weight > 0.0 && self.is_known[feature]);
            self.counts[feature] += weight;
            let coordinate = mask * self.known.len() + 3 * feature;
            self.masks[coordinate..coordinate + 3].fill(weight);
        }
        samples
    }
}

impl Seen<'_> {
    /// Adds the ways to some frames from those before them, if they are asked for and all features are seen.
    #[inline(always)]
    fn go<S: Simd>(&mut self, simd: S, frames: Range<usize>) {
        let tracks = self.tracks;
        let lacks = |frame| tracks.seen_count(frame) < tracks.features();
        _ = self.gone.take_if(|_| frames.clone().any(lacks));
        let Some(gone) = &mut self.gone else { return };
        let strides = Strides::new(simd);
        for frame in frames.filter(|frame| *frame > 0) {
            strides.add(simd, tracks, [frame - 1, frame], gone);
        }
    }
}

impl Look for Seen<'_> {
    #[inline(always)]
    fn look<S: Simd>(&mut self, simd: S, first: usize, poses: &[Option<Pose>]) {
        self.go(simd, first..first + poses.len());
        let (tracks, features, length) = (self.tracks, self.is_known.len(), self.known.len());
        let Some(any) = poses.iter().flatten().next() else { return };
        let mut frames = [Frame::of(simd, tracks, first, any); BLOCK];
        let (mut whole, mut samples, mut numbers, mut count) = ([true; BLOCK], [features; BLOCK], [0; BLOCK], 0);
        for (number, pose) in (first..).zip(poses) {
            let Some(pose) = pose else { continue };
            // A repeated frame has the same pose.
            if tracks.repeats_previous(number) {
                continue;
            }
            frames[count] = Frame::of(simd, tracks, number, pose);
            numbers[count] = number;
            whole[count] = self.complete && tracks.seen_count(number) == features;
            if whole[count] {
                self.whole_frames += 1.0;
                if std::mem::take(&mut self.masked[count]) {
                    self.masks[count * length..(count + 1) * length].fill(1.0);
                }
            } else {
                samples[count] = self.note(number, count);
            }
            count += 1;
        }
        let zero = simd.splat_f64s(0.0);
        // Of narrow registers, as many as hold what a wide one would, each with a sum of its own: lane by lane the same.
        let parts = BLOCK / S::F64_LANES;
        let (mut squares, mut largest) = ([[0.0; BLOCK]; BLOCK], [zero; BLOCK]);
        let of_frames = S::as_mut_simd_f64s(squares.as_flattened_mut()).0;
        let masks = S::as_simd_f64s(&self.masks).0;
        let row = length / S::F64_LANES;
        let known = S::as_simd_f64s(&self.known).0;
        let places = [
            S::as_simd_f64s(&self.places[0]).0,
            S::as_simd_f64s(&self.places[1]).0,
            S::as_simd_f64s(&self.places[2]).0,
        ];
        let [x, y, z] = &mut self.rows;
        let (x, y, z) = (S::as_mut_simd_f64s(x).0, S::as_mut_simd_f64s(y).0, S::as_mut_simd_f64s(z).0);
        let full = 3 * features / S::F64_LANES;
        let plain = self.complete && whole == [true; BLOCK];
        for at in 0..(3 * features).div_ceil(S::F64_LANES) {
            let k = at % 3;
            let place = [places[0][at], places[1][at], places[2][at]];
            let mut sums = [x[at], y[at], z[at]];
            let plain = plain && at < full;
            let squares = of_frames.chunks_exact_mut(parts).map(|of_frame| &mut of_frame[at % parts]);
            for ((frame, mask), (squares, largest)) in
                frames.iter().zip(masks.chunks_exact(row)).zip(squares.zip(&mut largest)).take(count)
            {
                let turn = frame.turn[k];
                let mut d = if plain { frame.inside(simd, at, k) } else { frame.about_the_body(simd, at, k) };
                let there = simd.mul_f64s(turn[0], place[0]);
                let there = simd.mul_add_f64s(turn[1], place[1], there);
                let there = simd.mul_add_f64s(turn[2], place[2], there);
                let mut off = simd.sub_f64s(d, there);
                if !plain {
                    d = simd.mul_f64s(d, mask[at]);
                    off = simd.mul_f64s(simd.mul_f64s(off, mask[at]), known[at]);
                }
                sums[0] = simd.mul_add_f64s(turn[0], d, sums[0]);
                sums[1] = simd.mul_add_f64s(turn[1], d, sums[1]);
                sums[2] = simd.mul_add_f64s(turn[2], d, sums[2]);
                *squares = simd.mul_add_f64s(off, off, *squares);
                *largest = simd.max_f64s(*largest, simd.abs_f64s(off));
            }
            [x[at], y[at], z[at]] = sums;
        }
        for number in 0..count {
            self.largest.push((numbers[number], simd.reduce_max_f64s(largest[number])));
            let squares = sum_of_lanes(&squares[number]);
            self.frames.push(OfFrame { samples: samples[number], squares });
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::poses::{chained, settle};

    /// Share by which noise told in one visit may differ from that of poses and shape alternated to the end: half of what
    /// squares may, twice over for the rounds' own estimate of it.
    const SAME: f64 = CLOSE;

    fn number(seed: usize) -> f64 {
        (seed as f64 * 12.9898).sin().mul_add(43_758.545_3, 0.5).rem_euclid(1.0) - 0.5
    }

    fn vector(seed: usize) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| number(3 * seed + axis))
    }

    /// A body of 0.3 m that flies about, seen with a noise in metres; its fourth feature is missing in every fifth frame if
    /// there are `gaps`.
    fn seen(features: usize, noise: f64, gaps: bool) -> Tracks {
        let sample = |frame: usize, feature: usize| {
            if gaps && frame % 5 == 4 && feature == 3 {
                return Point3::from([f64::NAN; 3]);
            }
            let turn = UnitQuaternion::from_scaled_axis(vector(7 * frame) * 3.0);
            let pose = Pose::from_parts((vector(11 * frame) + Vector3::z() * 2.0).into(), turn);
            pose * Point3::from(0.3 * vector(1000 + feature)) + 2.0 * noise * vector(2000 + 100 * frame + feature)
        };
        let positions = (0..60).flat_map(|frame| (0..features).map(move |feature| sample(frame, feature)));
        Tracks::new(features, positions.collect()).expect("whole frames")
    }

    #[test]
    fn noise_of_one_visit_is_that_of_poses_and_shape_alternated_to_the_end() {
        for features in [5, 8, 30] {
            for (noise, gaps) in [(1e-4, false), (1e-3, false), (5e-3, false), (1e-3, true)] {
                let tracks = seen(features, noise, gaps);
                let (poses, shape) = settle(&tracks, chained(&tracks).expect("seen"), 200);
                let expected = Noisy::of_residuals(&tracks, &poses, &shape, |_, _| true).sigma.expect("told");
                let by_first = first(&tracks).expect("seen").1;
                let by_chain = settled(&tracks, &chained(&tracks).expect("seen"));
                for found in [by_first, by_chain].map(|settled| settled.noisy.sigma.expect("told")) {
                    let off = (found / expected - 1.0).abs();
                    assert!(off < SAME, "{features} features, noise {noise} m, gaps {gaps}: off by {off:e}");
                }
            }
        }
    }
}
