//! What a single camera did to scales and depths, sought and undone.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use jointscope_motion::{
    Body, BodyMotion, FrameByFrame, MotionSettings, Recording, RelativeMotion, Undone, linear_scales,
};
use rayon::prelude::*;

use super::{Detector, Views};
use crate::pairs::Pair;
use crate::scale::{Belief, Estimate, Shown, agree, estimate};
use crate::watched::Watched;
use crate::{PairDetection, ScaledBody};

impl Detector {
    /// How far scales usually are from 1.
    pub(super) fn usual_scale(&self) -> Belief {
        Belief { mean: 0.0, deviation: self.configuration.scale.spread }
    }

    /// The scale that every model asks for.
    pub(super) fn scales(&self, motion: &RelativeMotion<'_>, belief: Belief) -> BTreeMap<String, Estimate> {
        let starts = linear_scales(motion.reference(), motion.moving());
        let models = self.configuration.models.iter();
        models
            .filter_map(|named| Some((named.name.clone(), estimate(&*named.model, motion, &starts, belief)?)))
            .collect()
    }

    /// What joint a pair has instead of this one at a scale beyond those that were tried, and by what the body is multiplied
    /// there.
    pub(super) fn found_beyond(&self, motion: &RelativeMotion<'_>, joint: &str) -> Option<(String, f64)> {
        /// Scales that `from` and `to` may have.
        const SENSIBLE: RangeInclusive<f64> = 0.05..=20.0;
        let settings = &self.configuration.scale;
        let tried = settings.factors();
        let tried = *tried.first()?..=*tried.last()?;
        let fitted = self.scales(motion, Belief::about(0.0)).into_values().filter(Estimate::is_observable);
        let scales = linear_scales(motion.reference(), motion.moving()).into_iter();
        scales.chain(fitted.map(|estimate| estimate.factor())).find_map(|scale| {
            let factor = match settings.body {
                ScaledBody::Moving => scale,
                ScaledBody::Reference => 1.0 / scale,
            };
            if tried.contains(&factor) || !SENSIBLE.contains(&factor) {
                return None;
            }
            let scaled = motion.moving().scaled(scale);
            let there = motion.rescaled(motion.reference(), &scaled).ok()?;
            let found = self.conclude(&self.fits(&Views::of(there))).joint;
            (found != joint).then_some((found, factor))
        })
    }

    /// Lets all pairs agree on the scales of the bodies: what the others show of a pair is what is known of it
    /// beforehand when it is judged again. Gives what the pairs showed.
    pub(super) fn agree_on_scales(
        &self,
        watched: &[Watched<'_>],
        pairs: &[Pair],
        judged: &mut [PairDetection],
    ) -> Vec<Shown> {
        /// Of standard errors, by which a scale may miss what the others agree on.
        const CONTRADICTS: f64 = 4.0;
        let shown_by = |judged: &[PairDetection]| -> Vec<Option<Shown>> {
            let of_pair = |(pair, judged): (&Pair, &PairDetection)| {
                let scale = judged.scale.as_ref().filter(|scale| scale.observable)?;
                let (factor, error) = scale.factor.zip(scale.standard_error)?;
                Some(Shown { pair: *pair, logarithm: factor.ln(), standard_error: error / factor })
            };
            pairs.iter().zip(judged).map(of_pair).collect()
        };
        let own = shown_by(judged);
        let all: Vec<Shown> = own.iter().flatten().copied().collect();
        let usual = self.usual_scale();
        let judge = |(number, pair): (usize, &Pair)| {
            let others: Vec<Shown> =
                own.iter().enumerate().filter(|(k, _)| *k != number).filter_map(|(_, s)| *s).collect();
            let told = agree(watched.len(), &others, *pair).filter(|told| told.deviation < usual.deviation)?;
            let mut again = self.judge(&watched[pair.0], &watched[pair.1], told);
            let scale = again.scale.as_mut()?;
            let together = agree(watched.len(), &all, *pair).unwrap_or(told);
            scale.factor = Some(together.mean.exp());
            scale.standard_error = Some(together.mean.exp() * together.deviation);
            scale.observable = true;
            if let Some(own) = own[number] {
                scale.closure_error = Some((own.logarithm - together.mean).exp_m1());
                if (own.logarithm - told.mean).abs() > CONTRADICTS * own.standard_error.hypot(told.deviation) {
                    again.determined = false;
                    again.notes.push(format!(
                        "its own motion asks for a scale of {:.4}, the other pairs for {:.4}: one of their joints is not \
                         what it seems",
                        own.logarithm.exp(),
                        told.mean.exp()
                    ));
                }
            }
            Some(again)
        };
        let again: Vec<Option<PairDetection>> = pairs.par_iter().enumerate().map(judge).collect();
        for (judged, again) in judged.iter_mut().zip(again) {
            if let Some(again) = again {
                *judged = again;
            }
        }
        all
    }
}

/// The recording with what a single camera did undone, if anything was.
pub(super) fn repaired(
    recording: &Recording,
    bodies: &[(&Body, Option<&Undone>)],
    scales: Option<&[f64]>,
) -> Option<Recording> {
    let changed = |(_, undone): &(&Body, Option<&Undone>)| undone.is_some_and(|undone| undone.gain.gain != 1.0);
    let scaled = scales.is_some_and(|scales| scales.iter().any(|factor| *factor != 1.0));
    if !scaled && !bodies.iter().any(changed) {
        return None;
    }
    let factor = |index: usize| scales.map_or(1.0, |scales| scales[index]);
    let bodies = bodies.iter().enumerate().map(|(index, (body, _))| body.scaled(factor(index))).collect();
    let (numbers, times) = (recording.frame_numbers().to_vec(), recording.times().map(<[f64]>::to_vec));
    Some(Recording::new(numbers, times, bodies).expect("names and frames are those of a recording"))
}

/// A body's motion, its poses as uncertain as the depth gain that was undone; `known` are poses of what was not changed.
pub(super) fn registered<'r>(
    body: &'r Body,
    undone: Option<&Undone>,
    known: Option<&FrameByFrame>,
    settings: &MotionSettings,
) -> BodyMotion<'r> {
    /// Standard errors of a gain that a drift by them counts as chance: the errors of all frames are the same one.
    const ERRORS: f64 = 2.0;
    let motion = match known.filter(|_| undone.is_none()) {
        Some(poses) => BodyMotion::of_registered(body, poses, settings),
        None => BodyMotion::of(body, settings),
    };
    match undone.and_then(|undone| undone.by_larger_gain.as_ref()) {
        Some(elsewhere) => motion.uncertain_towards(&BodyMotion::of(elsewhere, settings), ERRORS),
        None => motion,
    }
}

/// Whether both bodies move, but one shows no orientation, so that its scale cannot be sought.
pub(super) fn moves_without_poses(motion: &RelativeMotion<'_>) -> bool {
    motion.pose_series().is_none() && both_move(motion)
}

/// Whether a pair can show a scale at all: both bodies have poses, and neither rests.
pub(super) fn shows_scale(motion: &RelativeMotion<'_>) -> bool {
    motion.pose_series().is_some() && both_move(motion)
}

fn both_move(motion: &RelativeMotion<'_>) -> bool {
    !motion.reference().rests() && !motion.moving().rests()
}
