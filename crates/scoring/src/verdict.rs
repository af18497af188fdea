//! What a rule concludes.

use crate::RuleError;

/// The conclusion about one pair of bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// The joint with the greatest confidence.
    pub joint: String,
    /// Its confidence.
    pub confidence: f64,
    /// The confidence of every joint, in the rule's order; they sum to 1.
    pub confidences: Vec<(String, f64)>,
    /// Why the data do not decide, if they do not.
    pub doubts: Vec<String>,
    /// A joint that can do more than this one and that the data show beyond noise and play.
    pub richer: Option<String>,
    /// Cost of the joint in units of -2 log likelihood, from rules that compare evidence.
    pub cost: Option<f64>,
    /// Why the rule has no verdict, if it has none; all joints are then equally likely.
    pub fault: Option<RuleError>,
}

impl Verdict {
    /// The verdict from confidences; of equals the first. It is in doubt if its lead over the next is below `margin`.
    pub(crate) fn of(confidences: Vec<(String, f64)>, margin: f64) -> Self {
        let mut ranked: Vec<&(String, f64)> = confidences.iter().collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        let (joint, confidence) = ranked[0].clone();
        let close = ranked.get(1).filter(|(_, next)| confidence - next < margin);
        let doubts =
            close.map(|(rival, next)| format!("{rival} ({next:.3}) is nearly as likely as {joint} ({confidence:.3})"));
        Self {
            joint,
            confidence,
            doubts: doubts.into_iter().collect(),
            confidences,
            richer: None,
            cost: None,
            fault: None,
        }
    }

    /// All joints equally likely; `named` is the verdict.
    pub(crate) fn ignorance(joints: Vec<String>, named: &str) -> Self {
        let share = 1.0 / joints.len() as f64;
        Self {
            joint: named.to_owned(),
            confidence: share,
            confidences: joints.into_iter().map(|joint| (joint, share)).collect(),
            doubts: Vec::new(),
            richer: None,
            cost: None,
            fault: None,
        }
    }
}
