//! Scales of a range, all of them as the thesis tries them, or those that are likely.

use std::collections::{BTreeMap, BTreeSet};

use jointscope_motion::RelativeMotion;
use rayon::prelude::*;

use super::{ScaleCurve, ScaleSearch, ScaleSettings, ScaledBody, moments};
use crate::{ModelFinding, NamedModel};

/// Confidence of a joint from which its best scale is looked for beside likely ones.
const WORTH: f64 = 0.01;

/// Every model at the scale at which it scores best.
pub(crate) struct GridFit {
    /// What each found there.
    pub(crate) models: BTreeMap<String, ModelFinding>,
    /// Which factor of the moving body that is.
    pub(crate) factors: BTreeMap<String, f64>,
    /// Whether the range ends where each does best, beyond which it may do better.
    pub(crate) at_an_end: BTreeMap<String, bool>,
    /// The scores at all scales that were tried.
    pub(crate) curve: ScaleCurve,
}

/// Tries all scales, or the likely ones, for `weigh` to fit `models` at each; registrations are shared, since scaling turns
/// nothing.
///
/// Likely are those with which [`moments::begin`], and then the neighbours of each model's best scale until these are no
/// better.
///
/// The best scale of a model is that of its highest confidence; for one that states evidence, of its least misfit. Of
/// equals, that nearest to 1.
///
/// # References
/// Thesis section 5.5: all scales in [0.5, 1.5] by steps of 0.01, best score of every joint.
pub(crate) fn over_the_grid(
    plain: &RelativeMotion<'_>,
    settings: &ScaleSettings,
    models: &[NamedModel],
    weigh: impl Fn(&RelativeMotion<'_>) -> BTreeMap<String, ModelFinding> + Sync,
) -> GridFit {
    let (reference, moving) = (plain.reference(), plain.moving());
    let factors = settings.factors();
    let evidence = models.iter().any(|named| named.model.states_evidence());
    if !evidence {
        // Once they were looked at coordinate by coordinate, positions at all scales are.
        _ = plain.columns();
    }
    let at = |&factor: &f64| {
        let scaled = moving.scaled(factor);
        let motion = if evidence {
            plain.rescaled(reference, &scaled)
        } else {
            // Nobody compares what poses tell at other scales.
            RelativeMotion::between(reference, &scaled)
        };
        motion.map_or_else(|_| BTreeMap::new(), |motion| weigh(&motion))
    };
    // Joints have no size: the reference is multiplied by dividing the moving body, and coordinates stay those seen.
    let of_moving: Vec<f64> = match settings.body {
        ScaledBody::Moving => factors.clone(),
        ScaledBody::Reference => factors.iter().map(|factor| 1.0 / factor).collect(),
    };
    let mut found: BTreeMap<usize, BTreeMap<String, ModelFinding>> = BTreeMap::new();
    let mut next: BTreeSet<usize> = match settings.search {
        ScaleSearch::Moments => moments::begin(plain, &of_moving, models),
        _ => (0..factors.len()).collect(),
    };
    let mut best = BTreeMap::new();
    while !next.is_empty() {
        let indices: Vec<usize> = next.into_iter().collect();
        let models: Vec<_> = indices.par_iter().map(|&index| at(&of_moving[index])).collect();
        found.extend(indices.into_iter().zip(models));
        best = best_of_each(&found, &of_moving);
        // A likelihood says how far off a scale is, a confidence of next to nothing does not.
        let worth = |(name, index): &(&String, &usize)| {
            let finding = &found[*index][*name];
            finding.as_ref().is_ok_and(|fit| fit.evidence.is_some()) || score(finding) >= WORTH
        };
        let beside = best
            .iter()
            .filter(worth)
            .flat_map(|(_, &index)| [index.saturating_sub(1), (index + 1).min(factors.len() - 1)]);
        next = beside.filter(|index| !found.contains_key(index)).collect();
    }
    let body = match settings.body {
        ScaledBody::Moving => moving.name(),
        ScaledBody::Reference => reference.name(),
    };
    let mut scores: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for (name, finding) in found.values().flatten() {
        scores.entry(name.clone()).or_default().push(score(finding));
    }
    let tried = found.keys().map(|&index| factors[index]).collect();
    let taken = |(name, index): (&String, &usize)| Some((name.clone(), found.get_mut(index)?.remove(name)?));
    let last = factors.len() - 1;
    GridFit {
        at_an_end: best
            .iter()
            .map(|(name, &index)| (name.clone(), last > 0 && (index == 0 || index == last)))
            .collect(),
        factors: best.iter().map(|(name, &index)| (name.clone(), of_moving[index])).collect(),
        models: best.iter().filter_map(taken).collect(),
        curve: ScaleCurve { body: body.into(), factors: tried, scores },
    }
}

/// At which of the scales that were tried each model does best.
fn best_of_each(found: &BTreeMap<usize, BTreeMap<String, ModelFinding>>, factors: &[f64]) -> BTreeMap<String, usize> {
    let mut best: BTreeMap<String, (f64, f64, usize)> = BTreeMap::new();
    for (&index, models) in found {
        for (name, finding) in models {
            let this = (rank(finding), (factors[index] - 1.0).abs(), index);
            match best.get_mut(name) {
                Some(best) if (this.0, this.1) < (best.0, best.1) => *best = this,
                Some(_) => {}
                None => _ = best.insert(name.clone(), this),
            }
        }
    }
    best.into_iter().map(|(name, (_, _, index))| (name, index)).collect()
}

fn score(finding: &ModelFinding) -> f64 {
    finding.as_ref().map_or(0.0, |fit| fit.confidence.value())
}

/// The less, the better.
fn rank(finding: &ModelFinding) -> f64 {
    match finding {
        Ok(fit) => {
            fit.evidence.map_or(-fit.confidence.value(), |evidence| evidence.chi_squared / evidence.correlation_time)
        }
        Err(_) => f64::INFINITY,
    }
}
