//! How a rule came to its verdict.

use crate::RuleKind;

/// The arithmetic of a verdict: quantities in the order in which they are computed, and what they are for each joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// The rule.
    pub rule: RuleKind,
    /// What is computed, the confidence last.
    pub quantities: Vec<Quantity>,
    /// The joints, in the rule's order.
    pub accounts: Vec<Account>,
    /// Why the winner won, and what stands against it, in sentences.
    pub reasons: Vec<String>,
    /// The rule `likelihood` among the models with evidence, where the rule uses what it says.
    pub by_evidence: Option<Box<Explanation>>,
}

/// One step of a rule's arithmetic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quantity {
    /// Its name.
    pub name: &'static str,
    /// What it is, as a formula over those before it, or in words.
    pub meaning: &'static str,
}

/// What the quantities are for one joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Account {
    /// The joint.
    pub joint: String,
    /// One value per quantity; `None` where the joint has none.
    pub values: Vec<Option<f64>>,
    /// The arithmetic with its numbers.
    pub arithmetic: String,
}

impl Account {
    /// A joint that has no say.
    pub(crate) fn silent(joint: &str, quantities: usize, why: &str) -> Self {
        let mut values = vec![None; quantities];
        values[quantities - 1] = Some(0.0);
        Self { joint: joint.to_owned(), values, arithmetic: why.to_owned() }
    }
}

/// A number as arithmetic shows it.
pub(crate) fn number(x: f64) -> String {
    let plain = x == 0.0 || !x.is_finite() || (1e-3..1e7).contains(&x.abs());
    if plain { format!("{x:.3}") } else { format!("{x:.2e}") }
}
