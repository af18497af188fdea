//! Rules that turn what joint models say into a verdict.
//!
//! A rule sees names, confidences, parts and evidence, never a point or a pose.
//!
//! ```
//! use jointscope_models::Confidence;
//! use jointscope_scoring::{Announcement, Finding, Findings, Rule, RuleKind, ScoringSettings};
//!
//! let expressions = [("slide", "slide"), ("hinge", "(1 - slide) * hinge")];
//! let settings = ScoringSettings {
//!     rule: RuleKind::Expressions,
//!     expressions: expressions.map(|(joint, text)| (joint.to_owned(), text.to_owned())).into(),
//!     ..ScoringSettings::default()
//! };
//! let models = ["slide", "hinge"].map(|name| Announcement { name, parts: &[], states_evidence: false });
//! let rule = Rule::new(&settings, &models)?;
//!
//! let says = |confidence| Finding::from(Confidence::new(confidence).expect("in [0, 1]"));
//! let findings: Findings = [("slide".to_owned(), says(0.1)), ("hinge".to_owned(), says(0.9))].into();
//! let verdict = rule.apply(&findings)?;
//! assert_eq!(verdict.joint, "hinge");
//! assert_eq!(rule.explain(&findings)?.accounts[0].arithmetic, "(1 - slide) * hinge = (1 - 0.100) * 0.900 = 0.810");
//! # Ok::<(), jointscope_scoring::RuleError>(())
//! ```

mod cascade;
mod explanation;
mod expression;
mod expressions;
mod likelihood;
mod order;
mod verdict;

use std::{collections::BTreeMap, ops::Range};

use jointscope_models::{Confidence, Evidence, JointFit, Rival};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use cascade::Cascade;
pub use explanation::{Account, Explanation, Quantity};
pub use expressions::Expressions;
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
    /// The partial scores and measures behind it, by name.
    pub parts: BTreeMap<&'static str, f64>,
}

/// What a model says about itself, before it sees a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Announcement<'m> {
    /// Its name in the configuration.
    pub name: &'m str,
    /// Names of the parts that its fits may have.
    pub parts: &'m [&'static str],
    /// Whether its fits state evidence.
    pub states_evidence: bool,
}

impl From<&JointFit> for Finding {
    fn from(fit: &JointFit) -> Self {
        let evidence = fit.evidence.iter().chain(&fit.alternatives).copied().collect();
        Self { confidence: fit.confidence, evidence, parts: fit.parts.clone() }
    }
}

impl From<Confidence> for Finding {
    fn from(confidence: Confidence) -> Self {
        Self { confidence, evidence: Vec::new(), parts: BTreeMap::new() }
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
    /// `cascade`, `expressions`: name of the joint that remains when all models say no, or that has what the values of
    /// the expressions leave of 1.
    pub otherwise: String,
    /// `cascade`, `expressions`: least lead of the verdict over the next joint for the pair to count as determined.
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
    /// `expressions`: whether values are weights, divided by their sum; if not, they are the confidences themselves.
    pub normalise: bool,
    /// `expressions`: the value of every joint, by arithmetic over the names of models, whose value is their
    /// confidence, and their parts.
    pub expressions: BTreeMap<String, String>,
}

/// The rules there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RuleKind {
    /// Joints compared by evidence.
    Likelihood,
    /// The thesis's veto chain.
    Cascade,
    /// What the configuration writes.
    Expressions,
}

impl RuleKind {
    /// The word that configurations use.
    pub fn word(self) -> &'static str {
        match self {
            Self::Likelihood => "likelihood",
            Self::Cascade => "cascade",
            Self::Expressions => "expressions",
        }
    }

    /// The keys of `[scoring]` that this rule has, beside `rule`; `likelihood`'s priors and temperature also count for
    /// expressions that ask for it.
    pub fn keys(self) -> &'static [&'static str] {
        match self {
            Self::Likelihood => &["priors", "lead", "lead_over_richer", "temperature"],
            Self::Cascade => &["order", "otherwise", "margin"],
            Self::Expressions => &["expressions", "normalise", "otherwise", "margin", "priors", "temperature"],
        }
    }
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
            normalise: false,
            expressions: BTreeMap::new(),
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
    /// What the configuration writes.
    Expressions(Expressions),
}

/// Why settings make no rule, or why a rule has no verdict: the key that is wrong, and how.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct RuleError {
    /// The key of `[scoring]`.
    pub key: &'static str,
    /// The key of the table under it, a joint of `[scoring.expressions]`.
    pub entry: Option<String>,
    /// Bytes of the text that this key has; may lie at its end.
    pub within: Option<Range<usize>>,
    /// What was expected and found.
    pub message: String,
    /// What to do about it.
    pub help: String,
}

impl RuleError {
    /// Something wrong with a key.
    pub fn new(key: &'static str, message: String, help: impl Into<String>) -> Self {
        Self { key, entry: None, within: None, message, help: help.into() }
    }

    /// Something wrong inside a joint's expression.
    fn within(joint: &str, mistake: expression::Mistake) -> Self {
        let expression::Mistake { message, help, span } = mistake;
        Self { key: "expressions", entry: Some(joint.to_owned()), within: Some(span), message, help }
    }
}

impl Rule {
    /// Makes a rule for the models of a configuration.
    ///
    /// # Errors
    /// [`RuleError`] if the rule names unknown models, one twice, or leaves one out; of expressions, also their syntax.
    pub fn new(settings: &ScoringSettings, models: &[Announcement<'_>]) -> Result<Self, RuleError> {
        let names: Vec<&str> = models.iter().map(|model| model.name).collect();
        match settings.rule {
            RuleKind::Likelihood => Likelihood::new(settings, &names).map(Self::Likelihood),
            RuleKind::Cascade => Cascade::new(settings, &names).map(Self::Cascade),
            RuleKind::Expressions => Expressions::new(settings, models).map(Self::Expressions),
        }
    }

    /// Which rule this is.
    pub fn kind(&self) -> RuleKind {
        match self {
            Self::Likelihood(_) => RuleKind::Likelihood,
            Self::Cascade(_) => RuleKind::Cascade,
            Self::Expressions(_) => RuleKind::Expressions,
        }
    }

    /// Whether evidence counts.
    pub fn compares_evidence(&self) -> bool {
        match self {
            Self::Likelihood(_) => true,
            Self::Cascade(_) => false,
            Self::Expressions(expressions) => expressions.compares_evidence(),
        }
    }

    /// What a joint that explains any motion leaves to others, where evidence alone counts.
    pub fn rival(&self, name: &str, evidence: &Evidence) -> Option<Rival> {
        match self {
            Self::Likelihood(likelihood) => likelihood.rival(name, evidence),
            Self::Cascade(_) | Self::Expressions(_) => None,
        }
    }

    /// Judges one pair.
    ///
    /// # Errors
    /// [`RuleError`] if an expression has a value that is no confidence.
    pub fn apply(&self, findings: &Findings) -> Result<Verdict, RuleError> {
        match self {
            Self::Likelihood(likelihood) => Ok(likelihood.apply(findings)),
            Self::Cascade(cascade) => Ok(cascade.apply(findings)),
            Self::Expressions(expressions) => expressions.apply(findings),
        }
    }

    /// The arithmetic of [`apply`](Self::apply).
    ///
    /// # Errors
    /// As [`apply`](Self::apply).
    pub fn explain(&self, findings: &Findings) -> Result<Explanation, RuleError> {
        match self {
            Self::Likelihood(likelihood) => Ok(likelihood.explain(findings)),
            Self::Cascade(cascade) => Ok(cascade.explain(findings)),
            Self::Expressions(expressions) => expressions.explain(findings),
        }
    }

    /// The verdict about a pair of which nothing is known: every joint is equally likely.
    pub fn ignorance(&self) -> Verdict {
        match self {
            Self::Likelihood(likelihood) => likelihood.ignorance(),
            Self::Cascade(cascade) => cascade.ignorance(),
            Self::Expressions(expressions) => expressions.ignorance(),
        }
    }
}
