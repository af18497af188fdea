//! The detector: models and a rule, applied to all pairs of a recording.

mod one_camera;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::iter;
use std::sync::atomic::{AtomicUsize, Ordering};

use jointscope_models::lower_pair::free_cost;
use jointscope_models::{Axis, Confidence};
use jointscope_motion::{
    Body, BodyMotion, FrameByFrame, PoseSeries, Recording, RelativeMotion, RelativeMotionError, Undone, scaled_pose,
    undo_depth_gain,
};
use jointscope_scoring::{Explanation, Finding, Findings, Verdict};
use rayon::prelude::*;

use one_camera::{moves_without_poses, registered, repaired, shows_scale};

use crate::configuration::NamedModel;
use crate::pairs::{Pair, WORLD, chosen, names_of};
use crate::remarks::{UNSOUGHT, beyond_the_range, connected_beyond, doubts, leapt, richer_note, scale_note, told_by};
use crate::scale::{Belief, factors, over_the_grid, rescale, shown_at, stand_in};
use crate::watched::Watched;
use crate::{
    Configuration, Detection, DetectionError, JointKind, ModelFinding, PairDetection, PairScale, ScaleSearch, Structure,
};

/// Distance of the poses from their mean, in standard deviations, below which frames are merged to see a motion.
const FAINT: f64 = 4.0;
/// Frames that remain when frames are merged; what makes the motion likeliest counts.
const MERGED_FRAMES: [usize; 4] = [24, 16, 10, 7];
/// Kind of the model that explains any motion.
const ANYTHING: &str = "free";
/// Factor on the noise by which frames that are no smooth motion are tried to be explained.
const QUIET: f64 = 0.1;

/// Detects joints by a configuration.
#[derive(Debug)]
pub struct Detector {
    configuration: Configuration,
}

impl Detector {
    /// A detector by a configuration.
    pub fn new(configuration: Configuration) -> Self {
        Self { configuration }
    }

    /// Detects the joints between all pairs of bodies, or between the pairs asked for.
    ///
    /// A recording of one body is analysed against the world. Bodies are registered, pairs judged and their models
    /// fitted in parallel on the current rayon pool; the result does not depend on the number of threads.
    ///
    /// # Errors
    /// [`DetectionError`] if a pair names no body, or the world's name is taken.
    pub fn detect(&self, recording: Recording, pairs: Option<&[[String; 2]]>) -> Result<Detection, DetectionError> {
        self.detect_watched(Cow::Owned(recording), pairs, &|_, _| ())
    }

    /// As [`Detector::detect`], telling `watch` after each pair how many are done, and of how many.
    ///
    /// # Errors
    /// As [`Detector::detect`].
    pub fn detect_watched(
        &self,
        recording: Cow<'_, Recording>,
        pairs: Option<&[[String; 2]]>,
        watch: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Detection, DetectionError> {
        self.detect_registered(recording, &[], pairs, watch)
    }

    /// As [`Detector::detect_watched`], where bodies, the last ones of the recording, have been registered frame by frame.
    pub(crate) fn detect_registered(
        &self,
        recording: Cow<'_, Recording>,
        known: &[FrameByFrame],
        pairs: Option<&[[String; 2]]>,
        watch: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Detection, DetectionError> {
        let pairs = chosen(&recording, pairs)?;
        self.check_base(&recording)?;
        let recording = match recording.bodies() {
            [_] => Cow::Owned(recording.into_owned().with_world(WORLD).map_err(DetectionError::World)?),
            _ => recording,
        };
        let base = self.configuration.output.base.as_ref();
        let base = base.and_then(|name| recording.bodies().iter().position(|body| body.name() == name));
        let settings = &self.configuration.motion;
        let undo = |body: &Body| undo_depth_gain(body, settings.depth_gain);
        let undone: Vec<Option<Undone>> = recording.bodies().par_iter().map(undo).collect();
        let bodies: Vec<(&Body, Option<&Undone>)> = recording
            .bodies()
            .iter()
            .zip(&undone)
            .map(|(body, undone)| (undone.as_ref().map_or(body, |undone| &undone.body), undone.as_ref()))
            .collect();
        let numbers = recording.frame_numbers();
        let others = bodies.len() - known.len();
        let watched: Vec<Watched<'_>> = bodies
            .par_iter()
            .enumerate()
            .map(|(index, &(body, undone))| {
                let known = index.checked_sub(others).map(|index| &known[index]);
                let motion = registered(body, undone, known, settings);
                Watched::of(motion, body, undone.map(|u| u.gain), numbers, settings)
            })
            .collect();
        let done = AtomicUsize::new(0);
        let judge = |&(reference, moving): &Pair| {
            let judged = self.judge(&watched[reference], &watched[moving], self.usual_scale());
            watch(done.fetch_add(1, Ordering::Relaxed) + 1, pairs.len());
            judged
        };
        // One moving body after another, so that its positions stay in the cache for all who see it move.
        let mut order: Vec<usize> = (0..pairs.len()).collect();
        order.sort_by_key(|&number| (pairs[number].1, pairs[number].0));
        let mut numbered: Vec<(usize, PairDetection)> =
            order.par_iter().map(|&number| (number, judge(&pairs[number]))).collect();
        numbered.sort_by_key(|(number, _)| *number);
        let mut judged: Vec<PairDetection> = numbered.into_iter().map(|(_, pair)| pair).collect();
        let scales = (self.configuration.scale.search == ScaleSearch::ClosedForm).then(|| {
            let shown = self.agree_on_scales(&watched, &pairs, &mut judged);
            factors(watched.len(), base, &shown)
        });
        for pair in &mut judged {
            pair.notes.extend(scale_note(pair));
        }
        if let Some((pair, fault)) = judged.iter().find_map(|pair| Some((pair, pair.verdict.fault.as_ref()?))) {
            let [reference, moving] = [&pair.reference, &pair.moving].map(String::clone);
            return Err(DetectionError::Rule { reference, moving, error: Box::new(fault.clone()) });
        }
        let mut poses: Vec<_> = watched.iter().map(|body| body.motion.likely_poses().to_vec()).collect();
        if let Some(scales) = &scales {
            for (poses, factor) in poses.iter_mut().zip(scales) {
                poses.iter_mut().flatten().for_each(|pose| *pose = scaled_pose(pose, *factor));
            }
            for (pair, (reference, moving)) in judged.iter_mut().zip(&pairs) {
                rescale(pair, [scales[*reference], scales[*moving]]);
            }
        }
        let repaired = repaired(&recording, &bodies, scales.as_deref());
        let structure = Structure::of(repaired.as_ref().unwrap_or(&recording).bodies(), &poses, &judged, base);
        Ok(Detection {
            bodies: bodies.iter().map(|(body, _)| body.name().to_owned()).collect(),
            frames: recording.frames(),
            duration: recording.duration(),
            pairs: judged,
            poses,
            repaired,
            scales,
            structure,
        })
    }

    /// How the rule came to the verdict about a pair that this detector judged.
    pub fn explain(&self, pair: &PairDetection) -> Explanation {
        let rule = &self.configuration.rule;
        let without = |reason: String| {
            let (quantities, accounts) = (Vec::new(), Vec::new());
            Explanation { rule: rule.kind(), quantities, accounts, reasons: vec![reason], by_evidence: None }
        };
        if pair.models.values().all(Result::is_err) {
            return without("no model could judge this pair: every joint is equally likely".into());
        }
        rule.explain(&findings(&pair.models)).unwrap_or_else(|fault| without(fault.to_string()))
    }

    /// The names of the pairs that a detection would judge, the reference first.
    ///
    /// # Errors
    /// As [`Detector::detect`].
    pub fn pairs(recording: &Recording, pairs: Option<&[[String; 2]]>) -> Result<Vec<[String; 2]>, DetectionError> {
        let names = names_of(recording);
        let pairs = chosen(recording, pairs)?;
        Ok(pairs.into_iter().map(|(reference, moving)| [names[reference].into(), names[moving].into()]).collect())
    }

    /// Refuses what detection would refuse, without the work.
    ///
    /// # Errors
    /// As [`Detector::detect`].
    pub fn check(recording: &Recording, pairs: Option<&[[String; 2]]>) -> Result<(), DetectionError> {
        chosen(recording, pairs).map(drop)
    }

    /// Refuses a recording without the body that the configuration names as base.
    ///
    /// # Errors
    /// [`DetectionError::UnknownBase`].
    pub fn check_base(&self, recording: &Recording) -> Result<(), DetectionError> {
        let Some(base) = &self.configuration.output.base else { return Ok(()) };
        let known = names_of(recording);
        if known.contains(&base.as_str()) {
            return Ok(());
        }
        let known = known.iter().map(ToString::to_string).collect();
        Err(DetectionError::UnknownBase { name: base.clone(), known })
    }

    /// Judges one pair.
    fn judge(&self, reference: &Watched<'_>, moving: &Watched<'_>, belief: Belief) -> PairDetection {
        let mut notes: Vec<String> = [reference, moving].into_iter().flat_map(|body| body.notes.clone()).collect();
        let doubts = [reference, moving].into_iter().filter_map(|body| body.doubt.clone());
        let depth_gain = reference.depth_gain.zip(moving.depth_gain).map(|(reference, moving)| [reference, moving]);
        let (reference, moving) = (&reference.motion, &moving.motion);
        let (rest, resting);
        let seen = match RelativeMotion::between(reference, moving) {
            Err(RelativeMotionError::Unposed { .. }) if moving.unposed().is_none() => {
                notes.push(format!("the motion was analysed as seen from `{}`", moving.name()));
                RelativeMotion::between(moving, reference).map(|motion| (motion, true))
            }
            // What never moves needs no orientation.
            Err(RelativeMotionError::Unposed { .. }) if reference.tracks().rest() && moving.tracks().rest() => {
                rest = Body::at_rest(reference.name(), reference.tracks().frames());
                resting = BodyMotion::of(&rest, &self.configuration.motion);
                RelativeMotion::between(&resting, moving).map(|motion| (motion, false))
            }
            seen => seen.map(|motion| (motion, false)),
        };
        let mut pair = PairDetection {
            reference: reference.name().into(),
            moving: moving.name().into(),
            verdict: self.configuration.rule.ignorance(),
            determined: false,
            axis: None,
            axis_uncertainty: None,
            axis_in_moving: None,
            positions: None,
            scale: (self.configuration.scale.search != ScaleSearch::None).then(PairScale::default),
            depth_gain,
            noise_reference: reference.noise(),
            noise_moving: moving.noise(),
            frames_used: 0,
            models: BTreeMap::new(),
            notes,
            explanation: None,
        };
        match seen {
            Ok((motion, swapped)) => self.fit(&mut pair, &motion, swapped, belief),
            Err(RelativeMotionError::Unposed { .. }) => pair.notes.push(
                "the orientation of neither body is observed: nothing is known about their joint; \
                 track three features that are not on one line on one of them"
                    .into(),
            ),
            Err(error) => pair.notes.push(format!("{error}: nothing is known about their joint")),
        }
        pair.notes.extend(doubts.inspect(|_| pair.determined = false));
        pair
    }

    fn fit(&self, pair: &mut PairDetection, motion: &RelativeMotion<'_>, swapped: bool, belief: Belief) {
        let search = self.configuration.scale.search;
        let estimates = match search {
            ScaleSearch::ClosedForm if shows_scale(motion) => self.scales(motion, belief),
            _ => BTreeMap::new(),
        };
        let bodies: Vec<BodyMotion<'_>> =
            estimates.values().map(|estimate| motion.moving().scaled(estimate.factor())).collect();
        let rescaled = estimates.iter().zip(&bodies).filter_map(|((name, estimate), body)| {
            let motion = motion.rescaled(motion.reference(), body).ok()?;
            Some((name.clone(), Priced { motion, price: estimate.price }))
        });
        let views = Views { seen: motion.clone(), at_scale: rescaled.collect() };
        pair.frames_used = motion.frames().len();
        let mut factors: BTreeMap<String, f64> =
            estimates.iter().map(|(name, estimate)| (name.clone(), estimate.factor())).collect();
        let mut best_scale = None;
        let (models, verdict, taking) = if search.tries_scales() && shows_scale(motion) {
            let weigh = |motion: &RelativeMotion<'_>| self.fits(&Views::of(motion.clone()));
            let mut grid = over_the_grid(motion, &self.configuration.scale, &self.configuration.models, weigh);
            factors = grid.scales.iter().map(|(name, scale)| (name.clone(), scale.factor)).collect();
            let verdict = self.conclude(&grid.models);
            best_scale = grid.scales.remove(&verdict.joint);
            let alike = best_scale.as_ref().and_then(|scale| scale.alike);
            pair.scale = Some(PairScale { alike, curve: Some(grid.curve), ..PairScale::default() });
            (grid.models, verdict, Taking::AsSeen)
        } else {
            self.weighed(&views)
        };
        pair.models = models;
        pair.notes.extend(taking.note().map(str::to_owned));
        if verdict.cost.is_some() {
            pair.notes.extend(motion.pose_series().and_then(leapt));
        }
        pair.notes.extend(told_by(&pair.models, &verdict));
        pair.notes.extend(richer_note(&verdict, &pair.models));
        let mut doubts = doubts(views.of_model(&verdict.joint).0, &verdict, &pair.models, taking);
        doubts.extend(best_scale.filter(|scale| scale.at_an_end).map(|_| beyond_the_range(&verdict)));
        if search != ScaleSearch::None && moves_without_poses(motion) {
            pair.scale = None;
            doubts.push(UNSOUGHT.into());
        }
        pair.determined = doubts.is_empty();
        pair.notes.extend(doubts);
        let other_side = motion.moving_from_reference();
        for (name, fit) in pair.models.iter_mut().filter_map(|(name, finding)| Some((name, finding.as_mut().ok()?))) {
            // What the fit says of the moving body is at the scale of that fit.
            let back = factors.get(name).map_or(1.0, |factor| 1.0 / factor);
            let carried = fit.joint.axis.zip(other_side).map(|(axis, other_side)| axis.seen_from(&other_side));
            let mut carried = fit.axis_in_moving.or(carried).map(|axis| axis.scaled(back));
            if swapped {
                // Seen from the other body the joint moves backwards: the same positions along the opposite direction.
                (fit.joint.axis, carried) = (carried.map(opposite), fit.joint.axis.map(opposite));
            }
            if *name == verdict.joint {
                (pair.axis, pair.axis_in_moving) = (fit.joint.axis, carried);
                pair.positions.clone_from(&fit.joint.positions);
                pair.axis_uncertainty = fit.axis_uncertainty;
            }
        }
        pair.verdict = verdict;
        if search.tries_scales() && shows_scale(motion) && pair.kind() == JointKind::Disconnected {
            let beyond = self.found_beyond(motion, &pair.verdict.joint);
            pair.determined &= beyond.is_none();
            pair.notes.extend(beyond.map(|(joint, factor)| connected_beyond(&joint, factor)));
        }
        let winner = estimates.get(&pair.verdict.joint).copied();
        let winner = match search {
            ScaleSearch::Grid | ScaleSearch::Moments => factors
                .get(&pair.verdict.joint)
                .and_then(|factor| shown_at(&*stand_in(pair.kind())?, motion, factor.ln())),
            _ => winner,
        };
        if let (Some(scale), Some(found)) = (&mut pair.scale, winner.filter(|_| !swapped)) {
            scale.signal = Some(found.signal);
            scale.observable = found.is_observable() && scale.alike.is_none();
            if scale.observable {
                scale.factor = Some(found.factor());
                // The best of a grid's scores is no estimate with an error of its own.
                let fitted = search == ScaleSearch::ClosedForm;
                scale.standard_error = fitted.then_some(found.factor() * found.standard_error);
            }
        }
    }
}

/// How the frames of a pair were taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Taking {
    /// Each by itself, with its noise.
    AsSeen,
    /// Successive ones as one.
    Merged,
    /// Each by itself, with a noise that the joint tells: neighbours have nothing in common.
    InNoOrder,
}

impl Taking {
    fn note(self) -> Option<&'static str> {
        match self {
            Self::AsSeen => None,
            Self::Merged => Some("the motion of single frames drowns in their noise: successive frames were merged"),
            Self::InNoOrder => Some("the frames are not a smooth motion: noise was told by the joint that fits them"),
        }
    }
}

/// A pair's motion as the models look at it.
struct Views<'m> {
    seen: RelativeMotion<'m>,
    /// At the scale that a model asks for, by its name.
    at_scale: BTreeMap<String, Priced<'m>>,
}

/// A motion at a scale that was fitted, and the price of fitting it.
struct Priced<'m> {
    motion: RelativeMotion<'m>,
    price: f64,
}

impl<'m> Views<'m> {
    fn of(seen: RelativeMotion<'m>) -> Self {
        Self { seen, at_scale: BTreeMap::new() }
    }

    fn of_model(&self, name: &str) -> (&RelativeMotion<'m>, f64) {
        self.at_scale.get(name).map_or((&self.seen, 0.0), |priced| (&priced.motion, priced.price))
    }

    /// All of them changed alike.
    fn changed(&self, change: impl Fn(&RelativeMotion<'m>) -> Option<RelativeMotion<'m>>) -> Option<Self> {
        let priced = |(name, priced): (&String, &Priced<'m>)| {
            Some((name.clone(), Priced { motion: change(&priced.motion)?, price: priced.price }))
        };
        Some(Self { seen: change(&self.seen)?, at_scale: self.at_scale.iter().map(priced).collect::<Option<_>>()? })
    }
}

impl Detector {
    /// What the models find, what the rule concludes, and how the motion was taken.
    fn weighed(&self, views: &Views<'_>) -> (BTreeMap<String, ModelFinding>, Verdict, Taking) {
        // Without evidence to compare nobody asks for poses and how well they are known.
        let compares = self.configuration.rule.compares_evidence();
        let Some(series) = compares.then(|| views.seen.pose_series()).flatten() else {
            let (models, verdict) = self.weigh(views);
            return (models, verdict, Taking::AsSeen);
        };
        if series.tracked()
            && series.is_unordered()
            && let Some(quiet) = views.changed(|motion| motion.with_noise(QUIET))
        {
            let (models, verdict) = self.weigh(&quiet);
            if fits_within(series, &models, &verdict) {
                return (models, verdict, Taking::InNoOrder);
            }
        }
        let merged = likeliest_merging(&views.seen).and_then(|frames| views.changed(|motion| motion.merged(frames)));
        let (models, verdict) = self.weigh(merged.as_ref().unwrap_or(views));
        (models, verdict, if merged.is_some() { Taking::Merged } else { Taking::AsSeen })
    }

    fn weigh(&self, views: &Views<'_>) -> (BTreeMap<String, ModelFinding>, Verdict) {
        let models = self.fits(views);
        let verdict = self.conclude(&models);
        (models, verdict)
    }

    /// What every model finds.
    fn fits(&self, views: &Views<'_>) -> BTreeMap<String, ModelFinding> {
        let frames = views.seen.recording_frames();
        let fit = |named: &NamedModel| {
            let (motion, price) = views.of_model(&named.name);
            let mut fit = named.model.fit(motion)?.sound(frames)?;
            for evidence in fit.evidence.iter_mut().chain(&mut fit.alternatives) {
                evidence.prior_cost += price;
            }
            Ok(fit)
        };
        // What explains any motion first: others need not be fitted to the end where they cannot come near.
        let (anything, others): (Vec<&NamedModel>, Vec<&NamedModel>) =
            self.configuration.models.iter().partition(|named| named.kind == ANYTHING);
        let mut found: BTreeMap<String, ModelFinding> =
            anything.into_iter().map(|named| (named.name.clone(), fit(named))).collect();
        let evidence = found.iter().find_map(|(name, finding)| Some((name, finding.as_ref().ok()?.evidence?)));
        if let Some(rival) = evidence.and_then(|(name, evidence)| self.configuration.rule.rival(name, &evidence)) {
            for named in &others {
                rival.tell(views.of_model(&named.name).0);
            }
        }
        found.par_extend(others.into_par_iter().map(|named| (named.name.clone(), fit(named))));
        found
    }

    /// What the rule makes of it.
    fn conclude(&self, models: &BTreeMap<String, ModelFinding>) -> Verdict {
        let rule = &self.configuration.rule;
        let judged = models.values().any(Result::is_ok);
        let verdict = if judged { rule.apply(&findings(models)) } else { Ok(rule.ignorance()) };
        verdict.unwrap_or_else(|fault| Verdict { fault: Some(fault), ..rule.ignorance() })
    }
}

/// What rules see of the models' fits.
fn findings(models: &BTreeMap<String, ModelFinding>) -> Findings {
    let finding = |finding: &ModelFinding| finding.as_ref().map_or(Confidence::ZERO.into(), Finding::from);
    models.iter().map(|(name, found)| (name.clone(), finding(found))).collect()
}

/// How many frames to merge a faint motion to, such that it is told apart from noise best: by the likelihood of a motion
/// that is free, whatever the joint; `None` to leave them as they are.
fn likeliest_merging(motion: &RelativeMotion<'_>) -> Option<usize> {
    let series = motion.pose_series().filter(|series| series.signal() < FAINT)?;
    let merged = |frames: usize| Some((free_cost(motion.merged(frames)?.pose_series()?), Some(frames)));
    let all = iter::once((free_cost(series), None)).chain(MERGED_FRAMES.into_iter().filter_map(merged));
    all.min_by(|a, b| a.0.total_cmp(&b.0))?.1
}

/// Whether a joint with freedom left explains single poses to a fifth of the scatter that was taken for noise.
fn fits_within(series: &PoseSeries, models: &BTreeMap<String, ModelFinding>, verdict: &Verdict) -> bool {
    const SHARE: f64 = 0.2;
    let Some(Ok(fit)) = models.get(&verdict.joint) else { return false };
    let constrained = fit.evidence.is_some_and(|evidence| {
        let freedom = evidence.mobility.turns + evidence.mobility.slides;
        (1..6).contains(&freedom)
    });
    let small = |part: &str, noise: f64| fit.parts.get(part).is_some_and(|misfit| *misfit < SHARE * noise);
    constrained && small("misfit_distance", series.ends()[0].shift_noise) && small("misfit_angle", series.turn_noise())
}

fn opposite(axis: Axis) -> Axis {
    Axis { direction: axis.direction.map(|direction| -direction), ..axis }
}
