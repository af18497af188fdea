//! Scales of a range, all of them as the thesis tries them, or those that are likely.

use std::collections::BTreeMap;

use jointscope_motion::RelativeMotion;
use rayon::prelude::*;

use super::{ScaleCurve, ScaleSearch, ScaleSettings, ScaledBody, moments};
use crate::{ModelFinding, NamedModel};

/// Confidence of a joint from which its best scale is looked for beside likely ones.
const WORTH: f64 = 0.01;
/// By how little scores, and misfits, differ that are equal but for rounding.
const EQUAL: f64 = 1e-9;
/// Share by which the least and the largest of equal scales may differ for one of them to be told: a little more than the
/// neighbours of one do in the thesis's grid.
const APART: f64 = 0.025;
/// Rounds in which scales between those of the range are tried: parabolas converge in fewer unless the valley is none.
const ROUNDS: usize = 8;

/// Every model at the scale at which it scores best.
pub(crate) struct GridFit {
    /// What each found there.
    pub(crate) models: BTreeMap<String, ModelFinding>,
    /// Which scale that is.
    pub(crate) scales: BTreeMap<String, BestScale>,
    /// The scores at all scales that were tried.
    pub(crate) curve: ScaleCurve,
}

/// Where a model does best.
pub(crate) struct BestScale {
    /// Of the moving body.
    pub(crate) factor: f64,
    /// Whether the range ends there, beyond which it may do better.
    pub(crate) at_an_end: bool,
    /// The least and the largest factor at which it does as well, if they are so far apart that none is told.
    pub(crate) alike: Option<[f64; 2]>,
}

/// What every model finds at one scale.
struct Tried {
    /// Of the body that is multiplied.
    factor: f64,
    models: BTreeMap<String, ModelFinding>,
}

/// Tries all scales, or the likely ones, for `weigh` to fit `models` at each; registrations are shared, since scaling turns
/// nothing.
///
/// Likely are those with which [`moments::begin`], and then the neighbours of each model's best scale until these are no
/// better. The valley of a model that states evidence may be narrower than a step: scales between those of the range are
/// tried as well, where parabolas through its misfits have their least.
///
/// The best scale of a model is that of its highest confidence; for one that states evidence, of its least misfit. Of
/// those that are equal but for rounding, the one nearest to 1.
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
    // Joints have no size: the reference is multiplied by dividing the moving body, and coordinates stay those seen.
    let of_moving = |factor: f64| match settings.body {
        ScaledBody::Moving => factor,
        ScaledBody::Reference => 1.0 / factor,
    };
    let at = |&factor: &f64| {
        let scaled = moving.scaled(of_moving(factor));
        let motion = if evidence {
            plain.rescaled(reference, &scaled)
        } else {
            // Nobody compares what poses tell at other scales.
            RelativeMotion::between(reference, &scaled)
        };
        Tried { factor, models: motion.map_or_else(|_| BTreeMap::new(), |motion| weigh(&motion)) }
    };
    let mut next = match settings.search {
        ScaleSearch::Moments => {
            let all: Vec<f64> = factors.iter().map(|factor| of_moving(*factor)).collect();
            moments::begin(plain, &all, models).into_iter().map(|index| factors[index]).collect()
        }
        _ => factors.clone(),
    };
    let (mut tried, mut best) = (Vec::new(), BTreeMap::new());
    let mut rounds_between = 0;
    while !next.is_empty() {
        tried.extend(next.par_iter().map(at).collect::<Vec<Tried>>());
        tried.sort_by(|a, b| a.factor.total_cmp(&b.factor));
        best = best_of_each(&tried, of_moving);
        next = best.iter().flat_map(|(name, best)| beside(&tried, name, best, &factors)).collect();
        if next.is_empty() && rounds_between < ROUNDS {
            rounds_between += 1;
            next = best.iter().filter_map(|(name, best)| between(&tried, name, best.place)).collect();
        }
        next.sort_by(f64::total_cmp);
        next.dedup();
    }
    let body = match settings.body {
        ScaledBody::Moving => moving.name(),
        ScaledBody::Reference => reference.name(),
    };
    let mut scores: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for (name, finding) in tried.iter().flat_map(|tried| &tried.models) {
        scores.entry(name.clone()).or_default().push(score(finding));
    }
    let curve = ScaleCurve { body: body.into(), factors: tried.iter().map(|tried| tried.factor).collect(), scores };
    let ends = [factors.first(), factors.last()];
    let scale = |best: &Best| {
        let mut alike = best.alike.map(|place| of_moving(curve.factors[place]));
        alike.sort_by(f64::total_cmp);
        BestScale {
            factor: of_moving(curve.factors[best.place]),
            at_an_end: factors.len() > 1 && ends.contains(&Some(&curve.factors[best.place])),
            alike: (alike[1] > (1.0 + APART) * alike[0]).then_some(alike),
        }
    };
    let taken = |(name, best): (&String, &Best)| Some((name.clone(), tried[best.place].models.remove(name)?));
    GridFit {
        scales: best.iter().map(|(name, best)| (name.clone(), scale(best))).collect(),
        models: best.iter().filter_map(taken).collect(),
        curve,
    }
}

/// Which of the scales that were tried is best, and the first and the last that are equal to it.
struct Best {
    place: usize,
    alike: [usize; 2],
}

/// At which of the scales that were tried each model does best.
fn best_of_each(tried: &[Tried], of_moving: impl Fn(f64) -> f64) -> BTreeMap<String, Best> {
    let mut ranks: BTreeMap<&String, Vec<(usize, f64)>> = BTreeMap::new();
    for (place, Tried { models, .. }) in tried.iter().enumerate() {
        for (name, finding) in models {
            ranks.entry(name).or_default().push((place, rank(finding)));
        }
    }
    let off = |place: usize| (of_moving(tried[place].factor) - 1.0).abs();
    let best = |ranks: Vec<(usize, f64)>| {
        let least = ranks.iter().map(|(_, rank)| *rank).fold(f64::INFINITY, f64::min);
        let equal: Vec<usize> =
            ranks.iter().filter(|(_, rank)| *rank <= least + EQUAL).map(|(place, _)| *place).collect();
        let place = equal.iter().copied().min_by(|a, b| off(*a).total_cmp(&off(*b)))?;
        Some(Best { place, alike: [*equal.first()?, *equal.last()?] })
    };
    ranks.into_iter().filter_map(|(name, ranks)| Some((name.clone(), best(ranks)?))).collect()
}

/// The neighbours in the range of a model's best scale that were not tried yet, and of those that are equal to it while
/// these may tell a scale, if they may be worth it.
fn beside(tried: &[Tried], name: &str, best: &Best, factors: &[f64]) -> Vec<f64> {
    let Tried { factor, models } = &tried[best.place];
    let [first, last] = best.alike.map(|place| tried[place].factor);
    let [first, last] = if last > (1.0 + APART) * first { [*factor; 2] } else { [first, last] };
    // A likelihood says how far off a scale is, a confidence of next to nothing does not.
    let finding = &models[name];
    if score(finding) < WORTH && !finding.as_ref().is_ok_and(|fit| fit.evidence.is_some()) {
        return Vec::new();
    }
    let below = |factor: f64| factors.iter().rev().find(move |other| **other < factor);
    let above = |factor: f64| factors.iter().find(move |other| **other > factor);
    let known = |factor: f64| tried.iter().any(|tried| tried.factor == factor);
    [below(first), below(*factor), above(*factor), above(last)]
        .into_iter()
        .flatten()
        .copied()
        .filter(|factor| !known(*factor))
        .collect()
}

/// Where a parabola through a model's misfits at its best scale and beside it has its least, if that would be a better one.
fn between(tried: &[Tried], name: &str, place: usize) -> Option<f64> {
    /// By which a misfit must fall, in units of -2 log likelihood: chance moves it by as much.
    const BETTER: f64 = 1.0;
    let [left, here, right] = [place.checked_sub(1)?, place, place + 1].map(|place| {
        let tried = tried.get(place)?;
        let finding = tried.models.get(name)?;
        finding.as_ref().ok()?.evidence.is_some().then(|| (tried.factor, rank(finding)))
    });
    let ((left, of_left), (here, of_here), (right, of_right)) = (left?, here?, right?);
    let (below, above) = ((of_here - of_left) / (here - left), (of_right - of_here) / (right - here));
    let bend = (above - below) / (right - left);
    let slope = (below * (right - here) + above * (here - left)) / (right - left);
    let least = here - 0.5 * slope / bend;
    let better = bend > 0.0 && 0.25 * slope * slope / bend > BETTER;
    (better && (left..=right).contains(&least) && ![left, here, right].contains(&least)).then_some(least)
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
