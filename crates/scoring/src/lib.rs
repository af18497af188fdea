//! Rules that turn what joint models say into a verdict.
//!
//! A rule sees names and confidences, never a point or a pose.

mod cascade;
mod likelihood;
mod verdict;

use std::collections::BTreeMap;

use jointscope_models::{Confidence, Evidence, JointFit};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use cascade::Cascade;
pub use likelihood::Likelihood;
pub use verdict::Verdict;

/// What the models say about one pair, by the model's name in the configuration.
pub type Findings = BTreeMap<String, Finding>;

/// What one model says about a pair.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// How sure it is by itself.
    pub confidence: Confidence,
    /// Its evidence, in all the ways in which its joint may explain the motion; empty for models that state none.
    pub evidence: Vec<Evidence>,
}

impl From<&JointFit> for Finding {
    fn from(fit: &JointFit) -> Self {
        let evidence = fit.evidence.iter().chain(&fit.alternatives).copied().collect();
        Self { confidence: fit.confidence, evidence }
    }
}

impl From<Confidence> for Finding {
    fn from(confidence: Confidence) -> Self {
        Self { confidence, evidence: Vec::new() }
    }
}

/// How verdicts are reached.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ScoringSettings {
    /// The rule.
    pub rule: RuleKind,
    /// `cascade`: the models in the order in which they are asked; each counts as far as all before it say no.
    pub order: Vec<String>,
    /// `cascade`: name of the joint that remains when all models say no.
    pub otherwise: String,
    /// `cascade`: least lead of the verdict over the next joint for the pair to count as determined.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub margin: f64,
    /// `likelihood`: how likely each joint is beforehand, as weights; those left out have 1.
    pub priors: BTreeMap<String, f64>,
    /// `likelihood`: least lead of the verdict over the next joint for the pair to count as determined, in units of
    /// -2 log likelihood.
    #[schemars(range(min = 0.0))]
    pub lead: f64,
    /// `likelihood`: the same over joints that can do all that the verdict's can, and more.
    #[schemars(range(min = 0.0))]
    pub lead_over_richer: f64,
    /// `likelihood`: divides all differences of cost in the confidences. More than 1 makes them more cautious.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub temperature: f64,
}

/// The rules there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RuleKind {
    /// Joints compared by evidence.
    Likelihood,
    /// The thesis's veto chain.
    Cascade,
}

impl Default for ScoringSettings {
    fn default() -> Self {
        Self {
            rule: RuleKind::Likelihood,
            order: ["rigid", "prismatic", "revolute"].map(String::from).into(),
            otherwise: "disconnected".into(),
            margin: 0.2,
            priors: BTreeMap::new(),
            lead: 6.0,
            lead_over_richer: 2.0,
            temperature: 1.0,
        }
    }
}

/// A rule that was checked against the models it judges.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Rule {
    /// Joints compared by evidence.
    Likelihood(Likelihood),
    /// The thesis's veto chain.
    Cascade(Cascade),
}

/// Why settings make no rule: the key that is wrong, and how.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct RuleError {
    /// The key of `[scoring]`.
    pub key: &'static str,
    /// What was expected and found.
    pub message: String,
    /// What to do about it.
    pub help: String,
}

impl Rule {
    /// Makes a rule for the models of a configuration.
    ///
    /// # Errors
    /// [`RuleError`] if the rule names unknown models, one twice, or leaves one out.
    pub fn new(settings: &ScoringSettings, models: &[&str]) -> Result<Self, RuleError> {
        match settings.rule {
            RuleKind::Likelihood => Likelihood::new(settings, models).map(Self::Likelihood),
            RuleKind::Cascade => Cascade::new(settings, models).map(Self::Cascade),
        }
    }

    /// Judges one pair.
    pub fn apply(&self, findings: &Findings) -> Verdict {
        match self {
            Self::Likelihood(likelihood) => likelihood.apply(findings),
            Self::Cascade(cascade) => cascade.apply(findings),
        }
    }

    /// The verdict about a pair of which nothing is known: every joint is equally likely.
    pub fn ignorance(&self) -> Verdict {
        match self {
            Self::Likelihood(likelihood) => likelihood.ignorance(),
            Self::Cascade(cascade) => cascade.ignorance(),
        }
    }
}
