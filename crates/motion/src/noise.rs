//! Noise of observations, from what the data themselves show.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::flat_rows::for_residuals;
use crate::poses::posed;
use crate::{Pose, Tracks, quantile};

/// Standard deviation of a sample's coordinate across and along the viewing ray, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spread {
    pub(crate) across: f64,
    pub(crate) along: f64,
}

impl Spread {
    /// Root mean square over the three coordinates, metres.
    pub(crate) fn mean(&self) -> f64 {
        ((2.0 * self.across.powi(2) + self.along.powi(2)) / 3.0).sqrt()
    }

    /// Information of a point seen along a unit ray, 1/m².
    pub(crate) fn information(&self, ray: &Vector3<f64>) -> Matrix3<f64> {
        let (across, along) = (self.across.powi(-2), self.along.powi(-2));
        Matrix3::from_diagonal_element(across) + ray * ray.transpose() * (along - across)
    }
}

/// Variance of a third difference of white noise, in variances of the noise: 1 + 9 + 9 + 1.
const THIRD_DIFFERENCE: f64 = 20.0;
/// Median of the length of a standard normal vector of three coordinates.
const NORMAL_MEDIAN: f64 = 1.538_172_254;

/// Correlation of successive errors above which they drift, and the most that is believed.
const DRIFTS: f64 = 0.2;
const MOST_DRIFT: f64 = 0.96;
/// Share of the third differences that is quiet even where samples are wild, and the quantile of that length at that
/// share.
const QUIET_SHARE: f64 = 0.2;
const NORMAL_QUIET: f64 = 1.002_584;

/// What the residuals of a registration to a shape tell of noise.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Noisy {
    /// Standard deviation of one coordinate, metres; `None` where nothing is left to tell noise by.
    ///
    /// *Definition.* `σ² = Σ |x - G s|² / dof` over the samples used, `dof = 3 n - 6 frames - 3 features + 6`: six per
    /// pose and three per feature of the shape are fitted, less the six of the coordinates' choice. Exact repetitions
    /// of a frame say nothing about noise and count once.
    pub(crate) sigma: Option<f64>,
    /// The same in a typical frame, metres: the median over frames, which a few wild samples do not move.
    pub(crate) typical: Option<f64>,
}

/// Samples of a posed frame, and the sum of their squared residuals, m².
#[derive(Debug, Clone, Copy)]
pub(crate) struct OfFrame {
    pub(crate) samples: usize,
    pub(crate) squares: f64,
}

impl Noisy {
    /// By the frames that count, with `less` squares than they have in sum, m², and by how many features they show.
    pub(crate) fn of(frames: &[OfFrame], less: f64, features: usize, tracks: &Tracks) -> Self {
        let samples: usize = frames.iter().map(|frame| frame.samples).sum();
        let squares = frames.iter().map(|frame| frame.squares).sum::<f64>() - less;
        let freedom = (3 * samples + 6).saturating_sub(6 * frames.len() + 3 * features);
        let never_changes =
            frames.len() == 1 && tracks.frames() > 1 && (1..tracks.frames()).all(|t| tracks.repeats_previous(t));
        let sigma =
            if freedom > 0 { Some((squares.max(0.0) / freedom as f64).sqrt()) } else { never_changes.then_some(0.0) };
        let telling = frames.iter().filter(|frame| frame.samples > 3);
        let mut of_frames: Vec<f64> =
            telling.map(|frame| (frame.squares / (3 * frame.samples - 6) as f64).sqrt()).collect();
        Self { sigma, typical: median(&mut of_frames).or(sigma) }
    }

    /// By the residuals of the samples for which `counts(frame, feature)` holds.
    pub(crate) fn of_residuals(
        tracks: &Tracks,
        poses: &[Option<Pose>],
        shape: &[Option<Point3<f64>>],
        counts: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let (mut used, mut frames) = (vec![false; shape.len()], Vec::new());
        for_residuals(tracks, fresh(tracks, poses), shape, |frame, residuals| {
            let mut here = OfFrame { samples: 0, squares: 0.0 };
            for (feature, residual) in residuals.iter().enumerate() {
                if shape[feature].is_some() && tracks.is_visible(frame, feature) && counts(frame, feature) {
                    used[feature] = true;
                    here.samples += 1;
                    here.squares += residual.norm_squared();
                }
            }
            frames.push(here);
        });
        Self::of(&frames, 0.0, used.iter().filter(|used| **used).count(), tracks)
    }
}

/// The drift that is believed: a small one is chance, and of a large one the fitted shape hides a part.
pub(crate) fn believed_drift(drift: f64, frames: usize) -> f64 {
    if drift > DRIFTS { unhidden(drift, frames.max(1) as f64) } else { 0.0 }
}

/// Variance of the mean of so many errors, of which each is `drift` times the one before, in those of the mean of
/// independent ones: `(1+ρ)/(1-ρ) - 2ρ(1-ρᵀ)/(T(1-ρ)²)`.
pub(crate) fn slowness(drift: f64, frames: f64) -> f64 {
    let apart = 1.0 - drift;
    (1.0 + drift) / apart - 2.0 * drift * (1.0 - drift.powf(frames)) / (frames * apart * apart)
}

/// The drift of errors whose residuals drift so much: the fitted shape takes up the mean of the errors, and so the
/// `τ/T`-th of their variance, which hides `(1-ρ) τ/T` of the correlation.
fn unhidden(drift: f64, frames: f64) -> f64 {
    (0..5).fold(drift, |whole, _| (drift + slowness(whole, frames) / frames * (1.0 - drift)).min(MOST_DRIFT))
}

/// Factor by which drifting noise is larger than its residuals say: the fitted shape follows the drift.
///
/// A feature's place is a mean, and takes up the variance of as many samples as the mean of drifting errors has more
/// variance than that of independent ones.
pub(crate) fn hidden_by_drift(drift: f64, tracks: &Tracks, used: &[bool]) -> f64 {
    let features = tracks.features();
    let samples = used.iter().filter(|used| **used).count() as f64;
    let frames = used.chunks(features).filter(|frame| frame.contains(&true)).count().max(1) as f64;
    let shown = (0..features).filter(|f| used.iter().skip(*f).step_by(features).any(|used| *used)).count() as f64;
    let slow = slowness(unhidden(drift, frames), frames);
    let freedom = |per_place: f64| 3.0 * samples - 6.0 * frames - (3.0 * shown - 6.0) * per_place;
    // Where hardly anything is left, nothing can be told.
    let left = freedom(slow.max(1.0)).max(0.25 * freedom(1.0));
    if left > 0.0 { (freedom(1.0) / left).sqrt() } else { 1.0 }
}

/// Correlation of the residuals with those of the frame before, from -1 to 1.
///
/// A tracker that drifts, a filter, or skin that slides makes successive residuals alike, and so many frames worth
/// fewer. The fitted poses and shape hide part of it. Exact repetitions of a frame do not count.
pub(crate) fn lag_one(
    tracks: &Tracks,
    poses: &[Option<Pose>],
    shape: &[Option<Point3<f64>>],
    counts: impl Fn(usize, usize) -> bool,
) -> f64 {
    let mut before = (None, vec![Vector3::zeros(); shape.len()]);
    let (mut product, mut squares) = (0.0, 0.0);
    let counts = |frame, feature| tracks.is_visible(frame, feature) && counts(frame, feature);
    for_residuals(tracks, posed(poses), shape, |frame, now| {
        let (last, before) = (before.0.replace(frame), &mut before.1);
        if last.is_some_and(|last| last + 1 == frame) && !tracks.repeats_previous(frame) {
            for (feature, (before, now)) in before.iter().zip(now).enumerate() {
                if shape[feature].is_some() && counts(frame - 1, feature) && counts(frame, feature) {
                    product += before.dot(now);
                    squares += before.norm_squared() + now.norm_squared();
                }
            }
        }
        before.copy_from_slice(now);
    });
    if squares > 0.0 { 2.0 * product / squares } else { 0.0 }
}

/// How far features slowly depart from where a rigid body has them, and what noise from frame to frame is beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deformation {
    /// Departure of a typical feature beyond noise, root mean square over the frames, metres.
    pub distance: f64,
    /// Noise of a typical feature from frame to frame, metres, as a distance too.
    pub noise: f64,
}

impl Deformation {
    /// Of the features that `counts` names; `None` where too few successive samples tell noise.
    ///
    /// *Definition.* The distance is the root of the median, over features, of `mean (r_t · r_(t+1))`, where `r` are the
    /// residuals `x - G s`: neither noise nor single wild samples are alike in successive frames, and a feature that
    /// belongs elsewhere is one of many. The noise is `√3 σ` by third differences of each feature's residuals, to which
    /// no slow departure adds.
    pub(crate) fn of(
        tracks: &Tracks,
        poses: &[Option<Pose>],
        shape: &[Option<Point3<f64>>],
        counts: impl Fn(usize) -> bool,
    ) -> Option<Self> {
        let (mut squares, mut noise) = (Vec::new(), Vec::new());
        for (feature, place) in shape.iter().enumerate().filter(|(feature, _)| counts(*feature)) {
            let residual = |frame: usize| Some(tracks.get(frame, feature)? - poses[frame]? * (*place)?);
            let series: Vec<Option<Vector3<f64>>> = (0..tracks.frames()).map(residual).collect();
            let alike = series.windows(2).filter_map(|pair| Some(pair[0]?.dot(&pair[1]?)));
            let (count, sum) = alike.fold((0.0, 0.0), |(count, sum), product| (count + 1.0, sum + product));
            if let Some(sigma) = of_series(&series).filter(|_| count > 0.0) {
                squares.push(sum / count);
                noise.push(3_f64.sqrt() * sigma);
            }
        }
        Some(Self { distance: median(&mut squares)?.max(0.0).sqrt(), noise: median(&mut noise)? })
    }
}

fn median(values: &mut [f64]) -> Option<f64> {
    (!values.is_empty()).then(|| quantile(values, 0.5))
}

/// A standard deviation of a coordinate from all lengths within 3.8 times a robust one, which knows it half as well.
fn efficient(robust: f64, lengths: &[f64]) -> f64 {
    const CUT: f64 = 3.8;
    /// Mean square per coordinate of a standard normal vector that is cut there.
    const CUT_VARIANCE: f64 = 0.989_295;
    let within = || lengths.iter().filter(|length| **length <= CUT * robust);
    let count = 3.0 * within().count() as f64;
    if count > 0.0 { (within().map(|r| r * r).sum::<f64>() / count / CUT_VARIANCE).sqrt() } else { robust }
}

/// The posed frames that are observations of their own: an exact repetition of the frame before says nothing new.
pub(crate) fn fresh<'p>(tracks: &Tracks, poses: &'p [Option<Pose>]) -> impl Iterator<Item = (usize, &'p Pose)> {
    posed(poses).filter(|&(frame, _)| !(tracks.repeats_previous(frame) && poses[frame - 1].is_some()))
}

/// Noise of features that cannot be registered, metres: the root mean square of each one's own estimate.
pub(crate) fn of_single_points(tracks: &Tracks) -> Option<f64> {
    let sigmas: Vec<f64> = (0..tracks.features())
        .filter_map(|feature| {
            let series = (0..tracks.frames()).map(|frame| tracks.get(frame, feature).map(|p| p.coords));
            of_series(&series.collect::<Vec<_>>())
        })
        .collect();
    (!sigmas.is_empty()).then(|| (sigmas.iter().map(|s| s * s).sum::<f64>() / sigmas.len() as f64).sqrt())
}

/// Noise of tracked positions, metres.
pub(crate) fn of_positions(poses: &[Option<Pose>], trust: Trust) -> Option<f64> {
    let series: Vec<_> = poses.iter().map(|pose| pose.map(|pose| pose.translation.vector)).collect();
    robust_sigma(&series, position_difference, trust)
}

/// How much of a series can be trusted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Trust {
    /// More than half of the third differences are free of wild samples: the median tells noise.
    Most,
    /// A fifth of the samples may be wild, and so more than half of the third differences: only the quiet ones tell.
    Quiet,
}

fn position_difference(w: &[Vector3<f64>; 4]) -> Vector3<f64> {
    w[3] - 3.0 * (w[2] - w[1]) - w[0]
}

/// Whether successive errors of tracked positions are alike, or do not show at all, so that nobody knows how large they are:
/// third differences of white noise follow one another with a correlation of -3/4, of noise that drifts with more, of noise
/// behind a filter with much more, and those of a smooth motion with 1.
pub(crate) fn is_smooth(poses: &[Option<Pose>]) -> bool {
    const OF_WHITE_NOISE: f64 = -0.75;
    /// Standard deviation of that correlation by chance, times the root of the number of coordinates, and how many of them
    /// are no chance.
    const CHANCE: f64 = 0.7;
    const SURELY: f64 = 3.0;
    let mut places: Vec<Option<Vector3<f64>>> =
        poses.iter().map(|pose| Some(pose.as_ref()?.translation.vector)).collect();
    places.dedup_by(|a, b| a.is_some() && a == b);
    let difference = |w: &[Option<Vector3<f64>>]| Some(position_difference(&[w[0]?, w[1]?, w[2]?, w[3]?]));
    let pairs = places.windows(5).filter_map(|w| difference(&w[..4]).zip(difference(&w[1..])));
    let (mut count, mut product, mut squares) = (0.0, 0.0, 0.0);
    for (before, after) in pairs {
        count += 1.0;
        product += before.dot(&after);
        squares += f64::midpoint(before.norm_squared(), after.norm_squared());
    }
    squares > 0.0 && product / squares > OF_WHITE_NOISE + SURELY * CHANCE / (3.0_f64 * count).sqrt()
}

/// Noise of tracked rotations, radians per coordinate of the rotation vector.
pub(crate) fn of_rotations(poses: &[Option<Pose>], trust: Trust) -> Option<f64> {
    // Rotations relative to the previous frame are small, and are first differences already.
    let steps = poses.windows(2).map(|pair| Some((pair[0]?.rotation.inverse() * pair[1]?.rotation).scaled_axis()));
    robust_sigma(&steps.collect::<Vec<_>>(), |w: &[Vector3<f64>; 3]| w[2] - 2.0 * w[1] + w[0], trust)
}

/// Standard deviation of white noise on a smooth series: the median of its third differences.
fn of_series(series: &[Option<Vector3<f64>>]) -> Option<f64> {
    robust_sigma(series, position_difference, Trust::Most)
}

fn robust_sigma<const WINDOW: usize>(
    series: &[Option<Vector3<f64>>],
    third_difference: impl Fn(&[Vector3<f64>; WINDOW]) -> Vector3<f64>,
    trust: Trust,
) -> Option<f64> {
    // Of a sample and its exact repetitions, one.
    let mut once: Vec<Option<Vector3<f64>>> = series.to_vec();
    once.dedup_by(|a, b| a.is_some() && a == b);
    let series = if once.len() < 2 * WINDOW { series } else { &once };
    let mut sizes = Vec::with_capacity(series.len());
    for window in series.windows(WINDOW) {
        let mut seen = [Vector3::zeros(); WINDOW];
        if !seen.iter_mut().zip(window).all(|(seen, sample)| sample.map(|sample| *seen = sample).is_some()) {
            continue;
        }
        // A repeated frame is not a fresh observation.
        if seen.windows(2).all(|pair| pair[0] != pair[1]) || seen.iter().all(|x| *x == seen[0]) {
            sizes.push(third_difference(&seen).norm());
        }
    }
    let normal = match trust {
        Trust::Most => efficient(median(&mut sizes)? / NORMAL_MEDIAN, &sizes),
        Trust::Quiet if sizes.is_empty() => return None,
        Trust::Quiet => quantile(&mut sizes, QUIET_SHARE) / NORMAL_QUIET,
    };
    Some(normal / THIRD_DIFFERENCE.sqrt())
}
