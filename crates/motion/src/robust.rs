//! Registration of a body to its own shape in the presence of wild samples and of features that belong elsewhere.

mod residuals;

use nalgebra::{Point3, Vector3};

use crate::flat_rows::sums_of_places;
use crate::poses::{Shape, posed, rebase};
use crate::registration::register_weighted;
use crate::registration_in_lanes::register_frames_weighted;
use crate::{Pose, RegistrationError, Tracks};

/// Rounds of plain least squares before residuals mean anything.
const PLAIN_ROUNDS: usize = 4;
/// Most rounds of plain least squares while frames and features are still being found.
const MOST_PLAIN_ROUNDS: usize = 60;
/// Rounds in which the weights sharpen, and rounds in all; the last ones decide.
const SOFT_ROUNDS: usize = 15;
const ROUNDS: usize = 24;
/// Factor by which the control parameter of graduated non-convexity falls in a round.
const SHARPENING: f64 = 1.8;
/// Control parameter with which rounds begin that start from a consensus.
const BEGUN_WELL: f64 = 4.0;
/// Triples of features tried for a frame, rounds of that, and the share of a frame's features that must agree.
const TRIPLES: usize = 80;
const CONSENSUS_ROUNDS: usize = 2;
const AGREEING: f64 = 0.45;
/// Samples of a frame that are too few to tell which of them are wild.
const FEW_SAMPLES: usize = 5;
/// Scale of the Geman-McClure weights, in standard deviations of a coordinate.
pub(crate) const SCALE: f64 = 3.0;
/// Distance in standard deviations of a coordinate beyond which a sample is wild: one in ten thousand Gaussian ones is.
/// A lower limit would cut off honest noise and bias its estimate.
pub(crate) const WILD: f64 = 4.5;
/// Median residual of a feature, in medians of the body, from which it belongs to something else.
const ELSEWHERE: f64 = 2.5;
/// Median of the length of a standard normal vector of three coordinates.
pub(crate) const MEDIAN_LENGTH: f64 = 1.538;
/// Change of the shape, as a share of its size, at which the alternation rests.
const CONVERGED: f64 = 1e-10;

/// A body registered to its own shape.
#[derive(Debug, Clone)]
pub(crate) struct Registered {
    /// `recording_from_body`; the first one is the identity. A body whose poses are believed takes them over.
    pub(crate) poses: Vec<Option<Pose>>,
    /// Positions of the features in the body's coordinates.
    pub(crate) shape: Shape,
    /// Whether a sample, frame-major, took part; `None` where all that are seen did.
    pub(crate) used: Option<Vec<bool>>,
    /// Features that disagree with the rest of the body and were left out.
    pub(crate) strays: Vec<usize>,
    /// Number of samples of the other features that were left out.
    pub(crate) wild: usize,
    /// Of features registered to one frame, where not every frame shows all of them: whether that frame shows a feature,
    /// without which it took no part. The noise of that frame then enters every pose in a way of its own.
    pub(crate) shown_first: Option<Vec<bool>>,
}

impl Registered {
    /// Poses found otherwise, in which every sample took part. The shape is not known yet.
    pub(crate) fn plain(tracks: &Tracks, poses: Vec<Option<Pose>>) -> Self {
        Self { poses, shape: vec![None; tracks.features()], used: None, strays: Vec::new(), wild: 0, shown_first: None }
    }

    /// Poses found by registration to the first of them: features that it does not show took no part.
    pub(crate) fn to_the_first(tracks: &Tracks, poses: Vec<Option<Pose>>) -> Self {
        let plain = Self::plain(tracks, poses);
        let Some(start) = plain.poses.iter().position(Option::is_some) else { return plain };
        let all = |frame| tracks.seen_count(frame) == tracks.features();
        if (0..tracks.frames()).all(all) {
            return plain;
        }
        let shown = (0..tracks.features()).map(|feature| tracks.is_visible(start, feature));
        Self { shown_first: Some(shown.collect()), ..plain }
    }

    /// Whether a sample that is seen took part.
    pub(crate) fn uses(&self, frame: usize, feature: usize) -> bool {
        self.used.as_ref().is_none_or(|used| used[frame * self.shape.len() + feature])
            && self.shown_first.as_ref().is_none_or(|shown| shown[feature])
    }
}

/// Registers all frames to the body's shape by graduated non-convexity.
///
/// *Definition.* Minimises `Σ ρ(|x_tf - G_t s_f|)` over poses `G` and shape `s` in turn, with weights
/// `w = (μ c² / (μ c² + r²))²` whose `μ` falls from where all samples count to 1, and a hard limit of 4.5 σ at last.
/// Features whose typical residual is far above the body's are left out as a whole, never below four or half of them.
///
/// # Errors
/// [`RegistrationError`] if no frame can be posed.
///
/// # References
/// M. J. Black and A. Rangarajan, IJCV 19 (1996); H. Yang, P. Antonante, V. Tzoumas, L. Carlone, RA-L 5 (2020).
pub(crate) fn register_robustly(tracks: &Tracks) -> Result<Registered, RegistrationError> {
    let mut state = State::new(tracks);
    state.plainly()?;
    if !state.is_clean() {
        let mut other = state.clone();
        state.graduated(None);
        if other.by_consensus() {
            other.graduated(Some(BEGUN_WELL));
            // Of two ways to tell right from wrong, the one whose samples agree better.
            if other.disagreement() < state.disagreement() {
                state = other;
            }
        }
    }
    Ok(state.finish())
}

#[derive(Clone)]
struct State<'t> {
    tracks: &'t Tracks,
    poses: Vec<Option<Pose>>,
    shape: Shape,
    /// One per sample, frame-major; 0 where missing.
    weights: Vec<f64>,
    residuals: Vec<f64>,
    strays: Vec<bool>,
    /// Frames that are observations of their own: an exact repetition of the one before says nothing new.
    fresh: Vec<bool>,
    scratch: Vec<f64>,
}

impl<'t> State<'t> {
    fn new(tracks: &'t Tracks) -> Self {
        let (frames, features) = (tracks.frames(), tracks.features());
        let mut weights = vec![0.0; frames * features];
        for frame in 0..frames {
            for (feature, _) in tracks.seen(frame) {
                weights[frame * features + feature] = 1.0;
            }
        }
        Self {
            tracks,
            poses: vec![None; frames],
            shape: vec![None; features],
            weights,
            residuals: vec![0.0; frames * features],
            strays: vec![false; features],
            fresh: (0..frames).map(|frame| !tracks.repeats_previous(frame)).collect(),
            scratch: Vec::with_capacity(frames * features),
        }
    }

    /// Least squares from the best seen frame; frames that share no features with it are reached through others.
    fn plainly(&mut self) -> Result<(), RegistrationError> {
        let tracks = self.tracks;
        let mut order: Vec<usize> = (0..tracks.frames()).collect();
        order.sort_by_key(|&frame| std::cmp::Reverse(tracks.seen_count(frame)));
        let mut refusal = RegistrationError::TooFewPoints { found: 0 };
        let started = order.into_iter().any(|frame| {
            self.shape = (0..tracks.features()).map(|feature| tracks.get(frame, feature).copied()).collect();
            match self.pose_of(frame) {
                Ok(_) => true,
                Err(found) => {
                    if matches!(refusal, RegistrationError::TooFewPoints { found: 0 })
                        || matches!(found, RegistrationError::Collinear { .. })
                    {
                        refusal = found;
                    }
                    false
                }
            }
        });
        if !started {
            return Err(refusal);
        }
        let mut posed = 0;
        for round in 0..MOST_PLAIN_ROUNDS {
            let change = self.alternate();
            let now = self.poses.iter().flatten().count();
            if round >= PLAIN_ROUNDS && now == posed && change <= CONVERGED * 1e3 {
                break;
            }
            posed = now;
        }
        Ok(())
    }

    fn pose_of(&self, frame: usize) -> Result<Pose, RegistrationError> {
        let weights = &self.weights[frame * self.shape.len()..];
        register_weighted(
            self.tracks.seen(frame).filter_map(|(f, target)| Some((self.shape[f].as_ref()?, target, weights[f]))),
        )
    }

    /// Poses from the shape, the shape from the poses; gives how far the shape moved as a share of its size.
    fn alternate(&mut self) -> f64 {
        register_frames_weighted(&self.shape, self.tracks, Some(&self.weights), &mut self.poses);
        let fresh = posed(&self.poses).filter(|(frame, _)| self.fresh[*frame]);
        let sums = sums_of_places(self.tracks, fresh, Some(&self.weights));
        let (mut change, mut low, mut high) = (0.0_f64, Vector3::repeat(f64::MAX), Vector3::repeat(f64::MIN));
        for ((total, sum), old) in sums.into_iter().zip(&mut self.shape) {
            if total > 1e-3 {
                let new = sum / total;
                change = old.map_or(f64::INFINITY, |old| change.max((new - old.coords).norm()));
                (low, high) = (low.inf(&new), high.sup(&new));
                *old = Some(Point3::from(new));
            }
        }
        change / (high - low).norm().max(f64::MIN_POSITIVE)
    }

    /// Starts anew from what most samples agree on: every frame is registered to the best seen one by the triple of
    /// features that brings most others together, and the shape is the median of what results. A third of the samples
    /// may be wild; least squares is then nowhere near. Says whether every frame that had a pose has one still.
    fn by_consensus(&mut self) -> bool {
        let tracks = self.tracks;
        let Some(best) = (0..tracks.frames()).max_by_key(|&t| (tracks.seen_count(t), std::cmp::Reverse(t))) else {
            return false;
        };
        let posed = self.poses.iter().flatten().count();
        self.shape = (0..tracks.features()).map(|feature| tracks.get(best, feature).copied()).collect();
        for _ in 0..CONSENSUS_ROUNDS {
            for frame in 0..tracks.frames() {
                self.poses[frame] = self.consensus(frame);
            }
            let features = self.shape.len();
            for feature in 0..features {
                let places: Vec<Vector3<f64>> = (0..tracks.frames())
                    .filter_map(|frame| {
                        Some(self.poses[frame]?.inverse_transform_point(tracks.get(frame, feature)?).coords)
                    })
                    .collect();
                if !places.is_empty() {
                    self.shape[feature] = Some(Point3::from(Vector3::from_fn(|axis, _| {
                        let mut column: Vec<f64> = places.iter().map(|place| place[axis]).collect();
                        let middle = column.len() / 2;
                        *column.select_nth_unstable_by(middle, f64::total_cmp).1
                    })));
                }
            }
        }
        self.poses.iter().flatten().count() >= posed
    }

    /// Tries the consensus on frames whose samples agree with their pose no more than by chance.
    fn retry(&mut self) {
        let features = self.shape.len();
        self.measure();
        let Some(median) = self.median(None) else { return };
        let limit = WILD * median / MEDIAN_LENGTH;
        for frame in 0..self.poses.len() {
            let seen = self.tracks.seen_count(frame);
            if seen <= FEW_SAMPLES {
                continue;
            }
            let agree = |pose: &Pose| {
                let close = |(feature, position): &(usize, &Point3<f64>)| {
                    !self.strays[*feature]
                        && self.shape[*feature].is_some_and(|place| (*position - pose * place).norm() < limit)
                };
                self.tracks.seen(frame).filter(close).count()
            };
            let now = self.poses[frame].as_ref().map_or(0, agree);
            if 5 * now >= 3 * seen {
                continue;
            }
            if let Some(pose) = self.consensus(frame)
                && agree(&pose) > now
            {
                for (feature, position) in self.tracks.seen(frame) {
                    let place = self.shape[feature];
                    let near = place.is_some_and(|place| (position - pose * place).norm() < limit);
                    self.weights[frame * features + feature] = f64::from(u8::from(near && !self.strays[feature]));
                }
                self.poses[frame] = Some(pose);
            }
        }
    }

    /// The pose of a frame under which the nearest [`AGREEING`] share of its features is nearest to the shape.
    fn consensus(&self, frame: usize) -> Option<Pose> {
        let pairs: Vec<(&Point3<f64>, &Point3<f64>)> =
            self.tracks.seen(frame).filter_map(|(f, target)| Some((self.shape[f].as_ref()?, target))).collect();
        let count = pairs.len();
        if count < 3 {
            return None;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of the count")]
        let agreeing = ((AGREEING * count as f64).ceil() as usize).clamp(3, count);
        let mut best: Option<(f64, Pose)> = None;
        let mut residuals: Vec<(f64, usize)> = Vec::with_capacity(count);
        let mut measure = |pose: &Pose| {
            residuals.clear();
            residuals.extend(pairs.iter().enumerate().map(|(k, (p, q))| ((*q - pose * *p).norm_squared(), k)));
            residuals.select_nth_unstable_by(agreeing - 1, |a, b| a.0.total_cmp(&b.0));
            (residuals[agreeing - 1].0, residuals[..agreeing].iter().map(|(_, k)| *k).collect::<Vec<_>>())
        };
        let mut state = 0x9E37_79B9_7F4A_7C15_u64 ^ frame as u64;
        let mut draw = || {
            // A linear congruential generator: only variety is needed, always the same.
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % count
        };
        for _ in 0..TRIPLES {
            let chosen = [draw(), draw(), draw()];
            if chosen[0] == chosen[1] || chosen[0] == chosen[2] || chosen[1] == chosen[2] {
                continue;
            }
            let Ok(pose) = register_weighted(chosen.iter().map(|&k| (pairs[k].0, pairs[k].1, 1.0))) else { continue };
            let (limit, _) = measure(&pose);
            if best.as_ref().is_none_or(|(least, _)| limit < *least) {
                best = Some((limit, pose));
            }
        }
        let mut pose = best?.1;
        for _ in 0..3 {
            let (_, nearest) = measure(&pose);
            pose = register_weighted(nearest.iter().map(|&k| (pairs[k].0, pairs[k].1, 1.0))).unwrap_or(pose);
        }
        Some(pose)
    }

    /// Median residual of all samples that can be judged, whether they take part or not.
    fn disagreement(&mut self) -> f64 {
        self.measure();
        self.median(None).unwrap_or(f64::INFINITY)
    }

    fn graduated(&mut self, control: Option<f64>) {
        let features = self.shape.len();
        let mut control = control;
        for round in 0..ROUNDS {
            if round == SOFT_ROUNDS {
                self.retry();
            }
            self.measure();
            let Some(median) = self.median(None) else { return };
            let sigma = (median / MEDIAN_LENGTH).max(self.rounding());
            let of_features = self.feature_weights(round);
            let start = || {
                let worst = self.judged().map(|(t, f)| self.residuals[t * features + f]).fold(0.0, f64::max);
                (worst / (SCALE * sigma)).powi(2).max(1.0)
            };
            let mu = control.unwrap_or_else(start);
            let limit = mu * (SCALE * sigma).powi(2);
            for frame in 0..self.poses.len() {
                if self.poses[frame].is_none() {
                    continue;
                }
                let mut counting = 0;
                for (feature, _) in self.tracks.seen(frame) {
                    let sample = frame * features + feature;
                    let residual = self.residuals[sample];
                    let weight = if round < SOFT_ROUNDS {
                        (limit / (limit + residual * residual)).powi(2)
                    } else {
                        f64::from(u8::from(residual < WILD * sigma))
                    };
                    self.weights[sample] = weight * of_features[feature];
                    counting += usize::from(self.weights[sample] > 0.5);
                }
                // A frame of few samples keeps them, whatever they are; of many, three at least must agree.
                if counting < 3 {
                    let few = self.tracks.seen_count(frame) <= FEW_SAMPLES || round < SOFT_ROUNDS;
                    for (feature, _) in self.tracks.seen(frame) {
                        self.weights[frame * features + feature] =
                            if few { of_features[feature].max(0.01) } else { 0.0 };
                    }
                }
            }
            control = Some((mu / SHARPENING).max(1.0));
            let change = self.alternate();
            if round > SOFT_ROUNDS && change < CONVERGED {
                break;
            }
        }
    }

    /// Weight of every feature as a whole by its typical residual.
    fn feature_weights(&mut self, round: usize) -> Vec<f64> {
        let features = self.shape.len();
        if features < 6 {
            return vec![1.0; features];
        }
        let typical: Vec<f64> = (0..features).map(|feature| self.median(Some(feature)).unwrap_or(0.0)).collect();
        let mut sorted = typical.clone();
        let base = *sorted.select_nth_unstable_by(features / 2, f64::total_cmp).1;
        let weight = |typical: f64| {
            if round + 4 < SOFT_ROUNDS {
                let excess = (typical - 1.5 * base).max(0.0);
                base * base / (base * base + excess * excess + f64::MIN_POSITIVE)
            } else {
                f64::from(u8::from(typical <= ELSEWHERE * base + self.rounding()))
            }
        };
        let weights: Vec<f64> = typical.into_iter().map(weight).collect();
        let left = weights.iter().filter(|weight| **weight > 0.5).count();
        let enough = left >= 4 && 2 * left >= features;
        let weights = if enough { weights } else { vec![1.0; features] };
        self.strays = weights.iter().map(|weight| *weight <= 0.5).collect();
        weights
    }

    /// A residual that rounding explains, metres.
    fn rounding(&self) -> f64 {
        let size = self.shape.iter().flatten().map(|p| p.coords.amax()).fold(0.0, f64::max);
        1e-12 * size + f64::MIN_POSITIVE
    }

    fn finish(mut self) -> Registered {
        for _ in 0..MOST_PLAIN_ROUNDS {
            if self.alternate() < CONVERGED {
                break;
            }
        }
        let used: Vec<bool> = self.weights.iter().map(|weight| *weight > 0.5).collect();
        let features = self.shape.len();
        let wild = self.judged().filter(|&(frame, f)| !self.strays[f] && !used[frame * features + f]).count();
        let strays: Vec<usize> = (0..features).filter(|&feature| self.strays[feature]).collect();
        rebase(&mut self.poses, &mut self.shape);
        Registered { poses: self.poses, shape: self.shape, used: Some(used), strays, wild, shown_first: None }
    }
}
