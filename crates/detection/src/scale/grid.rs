//! All scales of a range, as the thesis tries them.

use std::collections::BTreeMap;

use jointscope_motion::RelativeMotion;
use rayon::prelude::*;

use super::{ScaleCurve, ScaleSettings, ScaledBody};
use crate::ModelFinding;

/// Every model at the scale at which it scores best.
pub(crate) struct GridFit {
    /// What each found there.
    pub(crate) models: BTreeMap<String, ModelFinding>,
    /// Which factor of the moving body that is.
    pub(crate) factors: BTreeMap<String, f64>,
    /// The scores at all scales.
    pub(crate) curve: ScaleCurve,
}

/// Tries all scales; registrations are shared, since scaling turns nothing. `evidence` says whether any model states it.
///
/// The best scale of a model is that of its highest confidence; for one that states evidence, of its least misfit. Of
/// equals, that nearest to 1.
///
/// # References
/// Thesis section 5.5: all scales in [0.5, 1.5] by steps of 0.01, best score of every joint.
pub(crate) fn over_the_grid(
    plain: &RelativeMotion<'_>,
    settings: &ScaleSettings,
    evidence: bool,
    weigh: impl Fn(&RelativeMotion<'_>) -> BTreeMap<String, ModelFinding> + Sync,
) -> GridFit {
    let (reference, moving) = (plain.reference(), plain.moving());
    let factors = settings.factors();
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
    let found: Vec<BTreeMap<String, ModelFinding>> = of_moving.par_iter().map(at).collect();
    let body = match settings.body {
        ScaledBody::Moving => moving.name(),
        ScaledBody::Reference => reference.name(),
    };
    let mut fit = GridFit {
        models: BTreeMap::new(),
        factors: BTreeMap::new(),
        curve: ScaleCurve { body: body.into(), factors, scores: BTreeMap::new() },
    };
    for (models, factor) in found.into_iter().zip(&of_moving) {
        for (name, finding) in models {
            let score = finding.as_ref().map_or(0.0, |fit| fit.confidence.value());
            fit.curve.scores.entry(name.clone()).or_default().push(score);
            let better = match fit.models.get(&name) {
                None => true,
                Some(best) => {
                    let (old, new) = (rank(best), rank(&finding));
                    let nearer = (factor - 1.0).abs() < (fit.factors[&name] - 1.0).abs();
                    new < old || (new == old && nearer)
                }
            };
            if better {
                fit.factors.insert(name.clone(), *factor);
                fit.models.insert(name, finding);
            }
        }
    }
    fit
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
