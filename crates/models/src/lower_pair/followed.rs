//! Fits to motions that are nearly the same, each from where the one before it ended.

use jointscope_motion::PoseSeries;
use nalgebra::Vector3;

use super::engine::Fit;
use super::judge::{Weights, chi_squared, weighted};
use super::{Mechanism, Placement, judge_series};
use crate::{Evidence, FitError};

/// A mechanism fitted to poses by their noise, that can be followed to where poses are a little different: those of bodies
/// seen at another scale, say.
#[derive(Debug, Clone)]
pub struct Followed<'m> {
    mechanism: &'m dyn Mechanism,
    evidence: Evidence,
    placement: Placement,
    positions: Vec<Vector3<f64>>,
    weights: Vec<Weights>,
    frames: Vec<usize>,
    reversed: bool,
}

impl<'m> Followed<'m> {
    /// The fit to a series of poses.
    ///
    /// # Errors
    /// As [`judge_series`].
    pub fn begin(mechanism: &'m dyn Mechanism, series: &PoseSeries) -> Result<Self, FitError> {
        let judged = judge_series(mechanism, series)?;
        Ok(Self {
            mechanism,
            evidence: judged.evidence,
            placement: judged.ideal.placement,
            positions: judged.ideal.positions,
            weights: judged.weights,
            frames: series.frames().to_vec(),
            reversed: series.reversed(),
        })
    }

    /// Likelihood terms of the series that it began with.
    pub fn evidence(&self) -> &Evidence {
        &self.evidence
    }

    /// [`Evidence::chi_squared`] of poses that are nearly those before, in the same frames; frames that were wrong there
    /// are so here. `None` if these are other frames, or the bodies are exchanged.
    pub fn chi_squared(&mut self, series: &PoseSeries) -> Option<f64> {
        if series.frames() != self.frames || series.reversed() != self.reversed {
            return None;
        }
        let (roots, positions) = (weighted(series.whitening(), &self.weights), std::mem::take(&mut self.positions));
        let mut fit = Fit::near(self.mechanism, series.poses(), roots, self.placement, positions);
        fit.settle();
        let found = chi_squared(series, fit.residuals());
        (self.placement, self.positions) = fit.place();
        found.is_finite().then_some(found)
    }
}
