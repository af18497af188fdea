//! The thesis's rule: a chain in which every model vetoes the ones behind it.

use std::collections::BTreeSet;

use crate::{
    Account, Explanation, Findings, Quantity, RuleError, RuleKind, ScoringSettings, Verdict, explanation::number,
};

/// `p_k = c_k Π_{j<k} (1 - c_j)` for the models in order, and `Π_j (1 - c_j)` for the joint that remains.
///
/// The confidences sum to 1 whatever the models say. A model that gave no finding says no.
///
/// # References
/// Thesis equations (48)-(51), for any number of models.
#[derive(Debug, Clone, PartialEq)]
pub struct Cascade {
    order: Vec<String>,
    otherwise: String,
    margin: f64,
}

impl Cascade {
    /// The chain over `models`, each of which must stand in the order once.
    ///
    /// # Errors
    /// [`RuleError`].
    pub fn new(settings: &ScoringSettings, models: &[&str]) -> Result<Self, RuleError> {
        let ScoringSettings { order, otherwise, margin, .. } = settings.clone();
        let list = |names: &[&str]| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        let in_order = |message: String, help: String| Err(RuleError::new("order", message, help));
        let mut seen = BTreeSet::new();
        for name in &order {
            if !models.contains(&name.as_str()) {
                let help = format!("models: {}; add [models.{name}], or take it out of `order`", list(models));
                return in_order(format!("the cascade's order names `{name}`, which is not among the models"), help);
            }
            if !seen.insert(name.as_str()) {
                return in_order(format!("the cascade's order names `{name}` twice"), "name each model once".into());
            }
        }
        if let Some(missing) = models.iter().find(|model| !seen.contains(**model)) {
            let help = format!("add it where it should be asked: order = [{}]", quoted(&order, missing));
            return in_order(
                format!("the model `{missing}` is not in the cascade's order, so it would not count"),
                help,
            );
        }
        if order.is_empty() {
            return in_order("the cascade has no models".into(), "name at least one".into());
        }
        check_otherwise(&otherwise)?;
        if seen.contains(otherwise.as_str()) {
            let message = format!("`{otherwise}` is both a model and what remains when all models say no");
            return Err(RuleError::new("otherwise", message, "give the remainder a name of its own"));
        }
        Ok(Self { order, otherwise, margin })
    }

    /// Judges one pair.
    pub fn apply(&self, findings: &Findings) -> Verdict {
        let mut left = 1.0;
        let mut confidences = Vec::with_capacity(self.order.len() + 1);
        for name in &self.order {
            let says = findings.get(name).map_or(0.0, |finding| finding.confidence.value());
            confidences.push((name.clone(), left * says));
            left *= 1.0 - says;
        }
        confidences.push((self.otherwise.clone(), left));
        Verdict::of(confidences, self.margin)
    }

    /// All joints equally likely, named after what remains when no model finds its joint.
    pub fn ignorance(&self) -> Verdict {
        Verdict::ignorance(self.order.iter().chain([&self.otherwise]).cloned().collect(), &self.otherwise)
    }

    /// The arithmetic of [`apply`](Self::apply).
    pub fn explain(&self, findings: &Findings) -> Explanation {
        let quantities = vec![
            Quantity { name: "says", meaning: "the confidence of the model by itself" },
            Quantity { name: "left", meaning: "what the joints before it leave: product of 1 - says" },
            Quantity { name: "confidence", meaning: "left · says; of what remains, left" },
        ];
        let verdict = self.apply(findings);
        let (mut left, mut vetoes) = (1.0, Vec::new());
        let account = |(joint, confidence): &(String, f64)| {
            let remains = *joint == self.otherwise;
            let says = (!remains).then(|| findings.get(joint).map_or(0.0, |finding| finding.confidence.value()));
            let factors = vetoes.iter().cloned().chain(says.map(number)).collect::<Vec<_>>().join(" · ");
            let values = vec![says, Some(left), Some(*confidence)];
            if let Some(says) = says {
                left *= 1.0 - says;
                vetoes.push(format!("(1 - {})", number(says)));
            }
            Account { joint: joint.clone(), values, arithmetic: format!("{factors} = {}", number(*confidence)) }
        };
        let accounts = verdict.confidences.iter().map(account).collect();
        let reasons = reasons(&verdict, self.margin);
        Explanation { rule: RuleKind::Cascade, quantities, accounts, reasons, by_evidence: None }
    }
}

/// Refuses a remainder without a name.
pub(crate) fn check_otherwise(otherwise: &str) -> Result<(), RuleError> {
    if otherwise.trim().is_empty() {
        let message = "what remains when all models say no has no name".into();
        return Err(RuleError::new("otherwise", message, "name it, \"disconnected\" say"));
    }
    Ok(())
}

/// Why the joint with the greatest confidence won, and by how much.
pub(crate) fn reasons(verdict: &Verdict, margin: f64) -> Vec<String> {
    let Verdict { joint, confidence, .. } = verdict;
    let mut reasons = vec![format!("{joint} has the greatest confidence, {}", number(*confidence))];
    let others = verdict.confidences.iter().filter(|(name, _)| name != joint);
    if let Some((next, follows)) = others.max_by(|a, b| a.1.total_cmp(&b.1)) {
        let lead = confidence - follows;
        let enough = if lead < margin { "less than" } else { "at least" };
        reasons.push(format!(
            "it leads {next} by {}, {enough} the margin of {} that decides",
            number(lead),
            number(margin)
        ));
    }
    reasons.extend(verdict.doubts.iter().cloned());
    reasons
}

fn quoted(order: &[String], last: &str) -> String {
    let names = order.iter().map(String::as_str).chain([last]);
    names.map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use jointscope_models::Confidence;

    const MODELS: [&str; 3] = ["prismatic", "revolute", "rigid"];

    fn findings(rigid: f64, prismatic: f64, revolute: f64) -> Findings {
        [("rigid", rigid), ("prismatic", prismatic), ("revolute", revolute)]
            .map(|(name, c)| (name.to_owned(), Confidence::new(c).expect("in range").into()))
            .into()
    }

    #[test]
    fn equations_48_to_51_by_hand() {
        let cascade = Cascade::new(&ScoringSettings::default(), &MODELS).expect("valid");
        let verdict = cascade.apply(&findings(0.2, 0.5, 0.75));
        // 0.2; 0.8 · 0.5; 0.8 · 0.5 · 0.75; 0.8 · 0.5 · 0.25.
        let expected = [("rigid", 0.2), ("prismatic", 0.4), ("revolute", 0.3), ("disconnected", 0.1)];
        for ((name, confidence), (expected_name, expected)) in verdict.confidences.iter().zip(expected) {
            assert_eq!(name, expected_name);
            assert!((confidence - expected).abs() < 1e-15);
        }
        assert_eq!(verdict.joint, "prismatic");
        assert_eq!(verdict.doubts, ["revolute (0.300) is nearly as likely as prismatic (0.400)"]);
        assert!(cascade.apply(&findings(0.9, 0.0, 0.0)).doubts.is_empty());
    }

    #[test]
    fn a_model_without_finding_says_no() {
        let cascade = Cascade::new(&ScoringSettings::default(), &MODELS).expect("valid");
        assert_eq!(cascade.apply(&Findings::new()).joint, "disconnected");
    }

    #[test]
    fn ignorance_spreads_evenly() {
        let verdict = Cascade::new(&ScoringSettings::default(), &MODELS).expect("valid").ignorance();
        assert_eq!((verdict.joint.as_str(), verdict.confidence), ("disconnected", 0.25));
        assert!(verdict.confidences.iter().all(|(_, confidence)| *confidence == 0.25));
    }

    #[test]
    fn an_order_must_name_every_model_once() {
        let with = |order: &[&str], otherwise: &str| {
            let order = order.iter().map(ToString::to_string).collect();
            let settings = ScoringSettings { order, otherwise: otherwise.into(), ..Default::default() };
            Cascade::new(&settings, &MODELS).expect_err("refused").message
        };
        assert!(with(&["rigid", "screw"], "free").contains("`screw`, which is not among the models"));
        assert!(with(&["rigid", "rigid"], "free").contains("twice"));
        assert!(with(&["rigid", "prismatic"], "free").contains("`revolute` is not in the cascade's order"));
        assert!(with(&["rigid", "prismatic", "revolute"], "rigid").contains("both a model and what remains"));
        assert!(with(&["rigid", "prismatic", "revolute"], " ").contains("has no name"));
        assert!(Cascade::new(&ScoringSettings { order: vec![], ..Default::default() }, &[]).is_err());
    }
}
