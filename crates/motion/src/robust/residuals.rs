//! How far samples are from where a registration puts them, and whether that looks like noise alone.

use std::f64::consts::FRAC_2_PI;

use nalgebra::{Matrix3, Point3, Vector3};

use super::State;
use crate::flat_rows::for_residuals;
use crate::poses::{Shape, posed};

/// Share of the bodies of Gaussian samples of which one sample may look wild by chance.
const BY_CHANCE: f64 = 0.006;
/// Samples that a body counts as having at least: of fewer, chance in their estimated noise decides.
const MANY_SAMPLES: f64 = 1000.0;
/// Median over root mean square of such lengths, and how far below it residuals without outliers may come: always, and
/// by chance, which falls with the root of their number.
const MEDIAN_SHARE: f64 = 0.888;
const MEDIAN_TOLERANCE: f64 = 0.05;
const MEDIAN_CHANCE: f64 = 1.0;
/// Share of a sample's variance that the fit must leave for the sample to be judged.
const LEAST_LEFT: f64 = 0.1;

impl State<'_> {
    /// Measures how far every sample is from where the body's pose and shape put it, in units in which noise of one
    /// standard deviation per coordinate gives the same to all.
    ///
    /// A pose bends towards the samples it is fitted to, most where they are few or far out: their residuals have
    /// `3 - h` coordinates' worth of variance, those of samples that were left out `3 + h`, where
    /// `h = 3 / W + |x|² tr A - xᵀ A x`, `W` is the sum of the frame's weights, `x` the feature's place about their
    /// centre, and `A` the inverse of their inertia. A feature's place is the mean of its samples, likewise.
    pub(super) fn measure(&mut self) {
        let features = self.shape.len();
        let mut of_features = vec![0.0; features];
        for weights in self.weights.chunks_exact(features) {
            of_features.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight);
        }
        let Self { tracks, poses, shape, weights, residuals, .. } = self;
        // Frames of which everything counts leave the same.
        let mut of_whole = None;
        for_residuals(tracks, posed(poses), shape, |frame, off| {
            let weights = &weights[frame * features..(frame + 1) * features];
            let of_frame;
            let left = if weights.iter().all(|weight| *weight == 1.0) {
                of_whole.get_or_insert_with(|| left_of_residuals(shape, weights, &of_features))
            } else {
                of_frame = left_of_residuals(shape, weights, &of_features);
                &of_frame
            };
            for (feature, left) in left.iter().enumerate() {
                residuals[frame * features + feature] = off[feature].norm() / left;
            }
        });
    }

    /// The samples that can be judged: seen, in a posed frame, of a known feature.
    pub(super) fn judged(&self) -> impl Iterator<Item = (usize, usize)> {
        let fresh = posed(&self.poses).filter(|(frame, _)| self.fresh[*frame]);
        fresh.flat_map(|(frame, _)| self.tracks.seen(frame).map(move |(feature, _)| (frame, feature)))
    }

    pub(super) fn median(&mut self, feature: Option<usize>) -> Option<f64> {
        let features = self.shape.len();
        let mut scratch = std::mem::take(&mut self.scratch);
        scratch.clear();
        scratch.extend(
            self.judged()
                .filter(|(_, f)| feature.is_none_or(|feature| feature == *f))
                .map(|(frame, f)| self.residuals[frame * features + f]),
        );
        let middle = scratch.len() / 2;
        let median = (!scratch.is_empty()).then(|| *scratch.select_nth_unstable_by(middle, f64::total_cmp).1);
        self.scratch = scratch;
        median
    }

    /// Whether residuals look like those of one Gaussian noise, so that there is nothing to leave out.
    pub(super) fn is_clean(&mut self) -> bool {
        self.measure();
        let features = self.shape.len();
        let (mut count, mut sum, mut worst) = (0_usize, 0.0, 0.0_f64);
        for (frame, feature) in self.judged() {
            let square = self.residuals[frame * features + feature].powi(2);
            (count, sum, worst) = (count + 1, sum + square, worst.max(square));
        }
        let Some(median) = self.median(None) else { return true };
        let count = count.max(1) as f64;
        let rms = (sum / count).sqrt();
        let least = MEDIAN_SHARE - MEDIAN_TOLERANCE - MEDIAN_CHANCE / count.sqrt();
        worst.sqrt() <= nothing_wild(count) * rms / 3_f64.sqrt() && median >= least * rms
    }
}

/// Distance in standard deviations of a coordinate up to which a body of so many samples shows nothing wild: 5.2 for a
/// thousand, 5.8 for forty thousand.
///
/// The length of a standard normal vector exceeds a large `r` with probability `√(2/π) r exp(-r²/2)`.
fn nothing_wild(samples: f64) -> f64 {
    let samples = samples.max(MANY_SAMPLES) / BY_CHANCE;
    (0..4).fold(5.0_f64, |r, _| (2.0 * (samples * FRAC_2_PI.sqrt() * r).ln()).sqrt())
}

/// What the fit leaves of the residual of every feature of a frame, as a standard deviation in units of the noise;
/// infinite for features whose place is unknown.
fn left_of_residuals(shape: &Shape, weights: &[f64], of_features: &[f64]) -> Vec<f64> {
    let placed = || shape.iter().zip(weights).filter_map(|(place, weight)| Some((place.as_ref()?.coords, *weight)));
    let total: f64 = placed().map(|(_, weight)| weight).sum();
    let centre = placed().map(|(place, weight)| place * weight).sum::<Vector3<f64>>() / total.max(1e-9);
    let mut inertia = Matrix3::zeros();
    for (place, weight) in placed() {
        let x = place - centre;
        inertia += (Matrix3::from_diagonal_element(x.norm_squared()) - x * x.transpose()) * weight;
    }
    let inverse = inertia.try_inverse().unwrap_or_else(Matrix3::zeros);
    let left = |(feature, place): (usize, &Option<Point3<f64>>)| {
        let Some(place) = place else { return f64::INFINITY };
        let x = place.coords - centre;
        let bends = 3.0 / total.max(1e-9) + x.norm_squared() * inverse.trace() - x.dot(&(inverse * x));
        // Half a weight's sample is neither in nor out.
        let taken = 2.0 * weights[feature] - 1.0;
        let share = 1.0 - taken * (bends / 3.0 + 1.0 / of_features[feature].max(1.0));
        share.max(LEAST_LEFT).sqrt()
    };
    shape.iter().enumerate().map(left).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_more_samples_the_wildest_may_be_wilder() {
        for (samples, limit) in [(50.0, 5.2), (1000.0, 5.2), (40_000.0, 5.9), (1e6, 6.4)] {
            let found = nothing_wild(samples);
            assert!((found - limit).abs() < 0.05, "{samples} samples: {found}");
            let beyond = FRAC_2_PI.sqrt() * found * (-0.5 * found * found).exp();
            let chance = beyond * samples.max(MANY_SAMPLES);
            assert!((chance / BY_CHANCE - 1.0).abs() < 0.01, "{samples} samples: {chance}");
        }
    }
}
