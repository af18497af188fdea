//! The scale of bodies that a single camera saw: unknown for each of them, and found where their joints show it.
//!
//! Only ratios can be found. A body is multiplied about the camera's centre, the origin of the recording.

mod closed_form;
mod consistent;
mod grid;
mod moments;
mod one_scale;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub(crate) use closed_form::{Belief, Estimate, estimate, shown_at};
pub(crate) use consistent::{Shown, agree, factors};
pub(crate) use grid::over_the_grid;
pub(crate) use one_scale::rescale;

use jointscope_models::{JointModel, lower_pair};

use crate::JointKind;

/// How the scale of a pair is sought.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ScaleSearch {
    /// Recordings are metric, or scaled alike.
    #[default]
    None,
    /// All scales of a range are tried, as the thesis does, and the best of every joint counts.
    Grid,
    /// As the grid, but only scales are tried to which moments of the trajectories point, and what is better beside them.
    Moments,
    /// The scale is a parameter of every joint, fitted with a standard error; for models that state evidence.
    ClosedForm,
}

impl ScaleSearch {
    /// The keys of `[scale]` that this search has, beside `search`.
    pub fn keys(self) -> &'static [&'static str] {
        match self {
            Self::None => &[],
            Self::Grid | Self::Moments => &["body", "from", "to", "step"],
            Self::ClosedForm => &["spread"],
        }
    }

    /// Whether scales of a range are tried.
    pub fn tries_scales(self) -> bool {
        matches!(self, Self::Grid | Self::Moments)
    }

    /// Its word in a configuration.
    pub fn word(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Grid => "grid",
            Self::Moments => "moments",
            Self::ClosedForm => "closed-form",
        }
    }
}

/// Which body of a pair the grid multiplies.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ScaledBody {
    /// The moving one.
    #[default]
    Moving,
    /// The reference.
    Reference,
}

/// How the unknown scales of a single camera are treated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ScaleSettings {
    /// "none"; "grid": all scales of a range, as the thesis; "moments": the likely ones of these; "closed-form": a
    /// parameter of every joint.
    pub search: ScaleSearch,
    /// Of grid and moments: which body is multiplied, "moving" or "reference".
    pub body: ScaledBody,
    /// Of grid and moments: the first factor that is tried.
    #[schemars(range(min = 0.05, max = 20.0))]
    pub from: f64,
    /// Of grid and moments: the last one.
    #[schemars(range(min = 0.05, max = 20.0))]
    pub to: f64,
    /// Of grid and moments: from one to the next.
    #[schemars(range(min = 0.0001, max = 20.0))]
    pub step: f64,
    /// Of the closed form: how far scales usually are from 1, as the standard deviation of their logarithm.
    #[schemars(range(min = 0.001, max = 10.0))]
    pub spread: f64,
}

impl Default for ScaleSettings {
    fn default() -> Self {
        let (search, body) = (ScaleSearch::None, ScaledBody::Moving);
        Self { search, body, from: 0.5, to: 1.5, step: 0.01, spread: 0.2 }
    }
}

impl ScaleSettings {
    /// The factors of the grid; 101 by default.
    pub fn factors(&self) -> Vec<f64> {
        /// Steps by which the last factor may be missed, by rounding.
        const NEARLY: f64 = 1e-6;
        let steps = ((self.to - self.from) / self.step + NEARLY).floor().max(0.0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "settings keep it below 200 000")]
        let steps = steps as u32;
        // As they would be written: 1.43, not the 1.4300000000000002 that sums of steps come to.
        let tens = 10_f64.powf(6.0 - self.step.log10().floor());
        let written = |factor: f64| (factor * tens).round() / tens;
        (0..=steps).map(|k| if k == 0 { self.from } else { written(self.from + f64::from(k) * self.step) }).collect()
    }
}

/// The lower pair by whose likelihood it is told whether a joint of this kind shows its scale, whatever model found it.
pub(crate) fn stand_in(kind: JointKind) -> Option<Box<dyn JointModel>> {
    Some(match kind {
        JointKind::Rigid => Box::new(lower_pair::Rigid::default()),
        JointKind::Prismatic => Box::new(lower_pair::Prismatic::default()),
        // An ellipse shows the scale as the circle that it once was.
        JointKind::Revolute | JointKind::Elliptical { .. } => Box::new(lower_pair::Revolute::default()),
        JointKind::Screw { .. } => Box::new(lower_pair::Screw::default()),
        JointKind::Cylindrical => Box::new(lower_pair::Cylindrical::default()),
        JointKind::Planar => Box::new(lower_pair::Planar::default()),
        JointKind::Spherical | JointKind::Universal => Box::new(lower_pair::Spherical::default()),
        JointKind::Disconnected => return None,
    })
}

/// The scale of a pair.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PairScale {
    /// What the moving body's observed positions must be multiplied by, about the camera's centre, to agree with the
    /// reference's; `None` where the motion does not show it.
    pub factor: Option<f64>,
    /// Its standard error, where a likelihood tells.
    pub standard_error: Option<f64>,
    /// Whether the motion shows it, and scores tell it.
    pub observable: bool,
    /// How much the scale shows: what remains of it after the joint's own unknowns are fitted, root mean square per
    /// frame, for a factor of e and in standard deviations of the noise.
    pub signal: Option<f64>,
    /// By which share the pair's own factor is off the one that all pairs of the recording agree on; `None` if nothing
    /// else tells it.
    pub closure_error: Option<f64>,
    /// The least and the largest factor at which the verdict's joint does as well as at any, but for rounding, where they
    /// are so far apart that none is told.
    pub alike: Option<[f64; 2]>,
    /// Scores over scales, where several were tried.
    pub curve: Option<ScaleCurve>,
}

/// The scores of all models over the scales that were tried.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ScaleCurve {
    /// The body that was multiplied.
    pub body: String,
    /// By which factors.
    pub factors: Vec<f64>,
    /// Confidence of every model at each of them; 0 where it could not judge.
    pub scores: BTreeMap<String, Vec<f64>>,
}
