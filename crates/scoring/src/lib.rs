//! Rules that turn what joint models say into a verdict.
//!
//! A rule sees names and confidences, never a point or a pose.

mod cascade;
mod verdict;

use std::collections::BTreeMap;

use jointscope_models::Confidence;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use cascade::Cascade;
pub use verdict::Verdict;

/// What the models say about one pair: confidence by the model's name in the configuration.
pub type Findings = BTreeMap<String, Confidence>;

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
    /// Least lead of the verdict over the next joint for the pair to count as determined.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub margin: f64,
}

/// The rules there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RuleKind {
    /// The thesis's veto chain.
    Cascade,
}

impl Default for ScoringSettings {
    fn default() -> Self {
        Self {
            rule: RuleKind::Cascade,
            order: ["rigid", "prismatic", "revolute"].map(String::from).into(),
            otherwise: "disconnected".into(),
            margin: 0.2,
        }
    }
}

/// A rule that was checked against the models it judges.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Rule {
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
            RuleKind::Cascade => Cascade::new(settings, models).map(Self::Cascade),
        }
    }

    /// Judges one pair.
    pub fn apply(&self, findings: &Findings) -> Verdict {
        match self {
            Self::Cascade(cascade) => cascade.apply(findings),
        }
    }

    /// The verdict about a pair of which nothing is known: every joint is equally likely.
    pub fn ignorance(&self) -> Verdict {
        match self {
            Self::Cascade(cascade) => cascade.ignorance(),
        }
    }
}
