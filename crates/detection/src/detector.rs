//! The detector: models and a rule, applied to all pairs of a recording.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use jointscope_models::{Axis, Confidence, JointModel};
use jointscope_motion::{Body, BodyMotion, MotionError, Observation, Recording, RelativeMotion, RelativeMotionError};
use jointscope_scoring::{Findings, Verdict};
use rayon::prelude::*;

use crate::{Configuration, Detection, DetectionError, ModelFinding, PairDetection};

/// Name of the body at rest that a recording of one body is analysed against.
const WORLD: &str = "world";
/// Frames below which no joint is determined: three points define a circle, and more must confirm it.
const FEW_FRAMES: usize = 6;

/// Detects joints by a configuration.
#[derive(Debug)]
pub struct Detector {
    configuration: Configuration,
}

/// Two bodies of a recording, by their index, the reference first.
type Pair = (usize, usize);

/// A body's motion, and what must be said of it in every pair that it is in.
struct Watched<'r> {
    motion: BodyMotion<'r>,
    notes: Vec<String>,
    /// Why no pair of this body is determined, if so.
    doubt: Option<String>,
}

impl<'r> Watched<'r> {
    fn of(motion: BodyMotion<'r>, body: &Body, frame_numbers: &[u64]) -> Self {
        let name = motion.name();
        let unposed = motion.unposed().map(|reason| format!("{name}: {reason}; only its positions count"));
        let notes = unposed.into_iter().chain(far_away(&motion)).collect();
        let labels = match body.observation() {
            Observation::Points { labels, .. } => labels.as_slice(),
            _ => &[],
        };
        let doubt = motion.outlier().and_then(|outlier| {
            Some(format!(
                "{name}: feature `{}` in frame {} is {:.3} m from where the rest of the body puts it, with a noise of \
                 {:.4} m; such samples spoil verdicts and axes, leave them out",
                labels.get(outlier.feature)?,
                frame_numbers[outlier.frame],
                outlier.distance,
                outlier.noise
            ))
        });
        Self { motion, notes, doubt }
    }
}

/// Says so if a body is so far away that its unit is likely wrong.
fn far_away(motion: &BodyMotion<'_>) -> Option<String> {
    /// Metres; no camera or marker system looks so far.
    const FAR: f64 = 200.0;
    let tracks = motion.tracks();
    let largest =
        (0..tracks.frames()).flat_map(|frame| tracks.frame(frame)).map(|p| p.coords.amax()).fold(0.0, f64::max);
    let name = motion.name();
    (largest > FAR)
        .then(|| format!("{name}: coordinates reach {largest:.3e} m; if the file is not in metres, give its `unit`"))
}

impl Detector {
    /// A detector by a configuration.
    pub fn new(configuration: Configuration) -> Self {
        Self { configuration }
    }

    /// Detects the joints between all pairs of bodies, or between the pairs asked for.
    ///
    /// A recording of one body is analysed against the world. Bodies are registered and pairs judged in parallel on
    /// the current rayon pool; the result does not depend on the number of threads.
    ///
    /// # Errors
    /// [`DetectionError`] if a pair names no body, or the world's name is taken.
    pub fn detect(&self, recording: Recording, pairs: Option<&[[String; 2]]>) -> Result<Detection, DetectionError> {
        self.detect_watched(recording, pairs, &|_, _| ())
    }

    /// As [`Detector::detect`], telling `watch` after each pair how many are done, and of how many.
    ///
    /// # Errors
    /// As [`Detector::detect`].
    pub fn detect_watched(
        &self,
        recording: Recording,
        pairs: Option<&[[String; 2]]>,
        watch: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Detection, DetectionError> {
        let pairs = chosen(&recording, pairs)?;
        let recording = match recording.bodies() {
            [_] => recording.with_world(WORLD).map_err(DetectionError::World)?,
            _ => recording,
        };
        let bodies = recording.bodies();
        let settings = &self.configuration.motion;
        let watched = |body| Watched::of(BodyMotion::of(body, settings), body, recording.frame_numbers());
        let watched: Vec<Watched<'_>> = bodies.par_iter().map(watched).collect();
        let done = AtomicUsize::new(0);
        let judge = |&(reference, moving): &Pair| {
            let judged = self.judge(&watched[reference], &watched[moving]);
            watch(done.fetch_add(1, Ordering::Relaxed) + 1, pairs.len());
            judged
        };
        Ok(Detection {
            bodies: bodies.iter().map(|body| body.name().to_owned()).collect(),
            frames: recording.frames(),
            duration: recording.duration(),
            pairs: pairs.par_iter().map(judge).collect(),
        })
    }

    /// Refuses what detection would refuse, without the work.
    ///
    /// # Errors
    /// As [`Detector::detect`].
    pub fn check(recording: &Recording, pairs: Option<&[[String; 2]]>) -> Result<(), DetectionError> {
        chosen(recording, pairs).map(drop)
    }

    /// Judges one pair.
    fn judge(&self, reference: &Watched<'_>, moving: &Watched<'_>) -> PairDetection {
        let mut notes: Vec<String> = [reference, moving].into_iter().flat_map(|body| body.notes.clone()).collect();
        let doubts = [reference, moving].into_iter().filter_map(|body| body.doubt.clone());
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
            noise_reference: reference.noise(),
            noise_moving: moving.noise(),
            frames_used: 0,
            models: BTreeMap::new(),
            notes,
        };
        match seen {
            Ok((motion, swapped)) => self.fit(&mut pair, &motion, swapped),
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

    fn fit(&self, pair: &mut PairDetection, motion: &RelativeMotion<'_>, swapped: bool) {
        pair.frames_used = motion.frames().len();
        let frames = motion.recording_frames();
        let fit = |model: &dyn JointModel| model.fit(motion).and_then(|fit| fit.sound(frames));
        pair.models = self.configuration.models.iter().map(|named| (named.name.clone(), fit(&*named.model))).collect();
        let confidence = |finding: &ModelFinding| finding.as_ref().map_or(Confidence::ZERO, |fit| fit.confidence);
        let findings: Findings =
            pair.models.iter().map(|(name, finding)| (name.clone(), confidence(finding))).collect();
        let rule = &self.configuration.rule;
        let judged = pair.models.values().any(Result::is_ok);
        let verdict = if judged { rule.apply(&findings) } else { rule.ignorance() };
        for (name, finding) in &pair.models {
            match finding {
                Ok(fit) => pair.notes.extend(fit.notes.iter().map(|note| format!("{name}: {note}"))),
                Err(error) => pair.notes.push(format!("{name}: {error}")),
            }
        }
        let doubts = doubts(motion, &verdict, &pair.models);
        pair.determined = doubts.is_empty();
        pair.notes.extend(doubts);
        let other_side = motion.moving_from_reference();
        for (name, fit) in pair.models.iter_mut().filter_map(|(name, finding)| Some((name, finding.as_mut().ok()?))) {
            let mut carried = fit.joint.axis.zip(other_side).map(|(axis, other_side)| axis.seen_from(&other_side));
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
    }
}

fn opposite(axis: Axis) -> Axis {
    Axis { direction: axis.direction.map(|direction| -direction), ..axis }
}

/// Why the data do not decide, in sentences that say what would help.
fn doubts(motion: &RelativeMotion<'_>, verdict: &Verdict, models: &BTreeMap<String, ModelFinding>) -> Vec<String> {
    let mut doubts = verdict.doubts.clone();
    let lengths = motion.path_lengths();
    let frames = motion.frames().len();
    if frames > 1 && lengths.reference == 0.0 && lengths.moving == 0.0 {
        doubts.push("neither body moves: every joint at rest looks rigid; record them moving".into());
    }
    if frames < FEW_FRAMES {
        let show = if frames == 1 { "frame shows" } else { "frames show" };
        doubts.push(format!("{frames} {show} both bodies, at least {FEW_FRAMES} are needed; record more"));
    }
    if models.values().all(Result::is_err) {
        doubts.push("no model could judge this motion".into());
    }
    doubts
}

/// The pairs asked for, or all; the world, where there will be one, counts as the first body.
fn chosen(recording: &Recording, pairs: Option<&[[String; 2]]>) -> Result<Vec<Pair>, DetectionError> {
    let mut names: Vec<&str> = recording.bodies().iter().map(Body::name).collect();
    if let [only] = names[..] {
        if only == WORLD {
            return Err(DetectionError::World(MotionError::DuplicateName { body: only.into() }));
        }
        names.insert(0, WORLD);
    }
    match pairs {
        Some(pairs) => pairs.iter().map(|pair| find_pair(&names, pair)).collect(),
        None => Ok((0..names.len()).flat_map(|i| (i + 1..names.len()).map(move |j| (i, j))).collect()),
    }
}

fn find_pair(names: &[&str], [reference, moving]: &[String; 2]) -> Result<Pair, DetectionError> {
    let find = |name: &String| {
        names.iter().position(|other| other == name).ok_or_else(|| DetectionError::UnknownBody {
            name: name.clone(),
            known: names.iter().map(ToString::to_string).collect(),
        })
    };
    if reference == moving {
        return Err(DetectionError::PairOfOne { name: reference.clone() });
    }
    Ok((find(reference)?, find(moving)?))
}
