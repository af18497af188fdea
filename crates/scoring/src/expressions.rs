//! The rule that is written in the configuration: one expression per joint.

use std::collections::{BTreeMap, BTreeSet};

use crate::{
    Account, Announcement, Explanation, Findings, Likelihood, Quantity, RuleError, RuleKind, ScoringSettings, Verdict,
    cascade,
    explanation::number,
    expression::{Expression, Mistake, Name},
    order,
};

/// Names, beside the parts of a model, of what its evidence says.
const LIKELIHOOD: &str = "likelihood";
const COST: &str = "cost";

/// What confidences may sum to more than 1 by rounding.
const ROUNDING: f64 = 1e-9;

/// Confidences by expressions over what the models say.
///
/// *Definition.* Every joint has a value, its expression's. Without `normalise` the values are the confidences, and
/// what they leave of 1 is that of the joint `otherwise`; with it they are weights, divided by their sum, and
/// `otherwise` has all where they are 0.
///
/// *Names.* `revolute` is the confidence of the model of that name, by itself; `revolute.circle_fit` one of its parts,
/// as the model announces them. Of models that state evidence there are also `revolute.likelihood`, the confidence
/// that the rule [`Likelihood`] gives it among all models with evidence, by the settings of that rule; and
/// `revolute.cost`, its cost above that of the likeliest joint, in units of -2 log likelihood.
///
/// *Degenerate cases.* A model that gave no finding has the confidence and likelihood 0. A joint whose expression needs
/// a part that the model did not give has the value 0, and the verdict is in doubt.
#[derive(Debug, Clone, PartialEq)]
pub struct Expressions {
    joints: Vec<(String, Expression)>,
    otherwise: String,
    normalise: bool,
    margin: f64,
    likelihood: Option<Likelihood>,
}

impl Expressions {
    /// The rule over `models`, each of which must count for something.
    ///
    /// # Errors
    /// [`RuleError`] for wrong syntax, unknown names, models that would not count, and priors without evidence.
    pub fn new(settings: &ScoringSettings, models: &[Announcement<'_>]) -> Result<Self, RuleError> {
        let fail = |key, message: String, help: &str| Err(RuleError::new(key, message, help));
        if settings.expressions.is_empty() {
            let help = "write, for example, [scoring.expressions] and revolute = \"(1 - rigid) * revolute\"";
            return fail("rule", "the rule \"expressions\" has no expressions".into(), help);
        }
        cascade::check_otherwise(&settings.otherwise)?;
        let mut joints = Vec::new();
        let mut named = BTreeSet::new();
        let mut by_evidence = false;
        for (joint, text) in &settings.expressions {
            if joint.trim().is_empty() {
                return fail("expressions", "a joint needs a name".into(), "write NAME = \"EXPRESSION\"");
            }
            let expression = Expression::parse(text).map_err(|mistake| RuleError::within(joint, mistake))?;
            for name in expression.names() {
                by_evidence |= check_name(name, models).map_err(|mistake| RuleError::within(joint, mistake))?;
                named.insert(name.model.clone());
            }
            joints.push((joint.clone(), expression));
        }
        joints.sort_by_key(|(joint, _)| order::place(joint));
        let otherwise = &settings.otherwise;
        if !settings.normalise && settings.expressions.contains_key(otherwise) {
            let message = format!("`{otherwise}` has an expression, and is also what remains of 1");
            let help = "write normalise = true under [scoring] to divide by the sum, or give `otherwise` another name";
            return Err(RuleError { entry: Some(otherwise.clone()), ..RuleError::new("expressions", message, help) });
        }
        let counts = |model: &Announcement<'_>| named.contains(model.name) || (by_evidence && model.states_evidence);
        if let Some(idle) = models.iter().find(|model| !counts(model)) {
            let message = format!("the model `{}` is in no expression, so it would not count", idle.name);
            return fail("expressions", message, "name it in an expression, or take it out of [models]");
        }
        if !by_evidence && !settings.priors.is_empty() {
            let message = "priors count where an expression names a `likelihood` or `cost`, and none does".into();
            return fail("priors", message, "take them out, or name, for example, `revolute.likelihood`");
        }
        let evident: Vec<&str> = models.iter().filter(|model| model.states_evidence).map(|model| model.name).collect();
        let likelihood = by_evidence.then(|| Likelihood::new(settings, &evident)).transpose()?;
        let ScoringSettings { normalise, margin, .. } = *settings;
        Ok(Self { joints, otherwise: otherwise.clone(), normalise, margin, likelihood })
    }

    /// Whether evidence counts.
    pub fn compares_evidence(&self) -> bool {
        self.likelihood.is_some()
    }

    /// Judges one pair.
    ///
    /// # Errors
    /// [`RuleError`] where a value is negative or not finite, or where confidences sum to more than 1.
    pub fn apply(&self, findings: &Findings) -> Result<Verdict, RuleError> {
        let said = Said::of(self, findings);
        let values = self.joints.iter().map(|(joint, expression)| said.value(joint, expression));
        let values = values.collect::<Result<Vec<f64>, _>>()?;
        let confidences = self.confidences(&values, &said)?;
        let mut verdict = Verdict::of(confidences, self.margin);
        verdict.cost = said.cost;
        let missing = self.joints.iter().filter_map(|(joint, expression)| {
            let name = said.missing(expression)?;
            Some(format!(
                "{joint} counts nothing: its expression needs {}, which the model does not give here",
                told(name)
            ))
        });
        verdict.doubts.extend(missing);
        Ok(verdict)
    }

    /// The confidences in the rule's order, `otherwise` last if it has no expression.
    fn confidences(&self, values: &[f64], said: &Said<'_>) -> Result<Vec<(String, f64)>, RuleError> {
        let sum: f64 = values.iter().sum();
        if !sum.is_finite() {
            return Err(RuleError::new("expressions", "the expressions sum to infinity".into(), "scale them down"));
        }
        if !self.normalise && sum > 1.0 + ROUNDING {
            let all = self.joints.iter().zip(values).map(|((joint, _), value)| format!("{joint} {}", number(*value)));
            let message = format!("the expressions sum to {}: {}", number(sum), all.collect::<Vec<_>>().join(", "));
            let help =
                "write normalise = true under [scoring], or make them exclude each other, \"(1 - rigid) * revolute\"";
            let largest = (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(0);
            let (joint, expression) = &self.joints[largest];
            let help = format!("{help}; here {}", said.told(expression));
            return Err(RuleError::within(joint, Mistake { message, help, span: expression.span() }));
        }
        let whole = if self.normalise { sum } else { sum.max(1.0) };
        let rest = if self.normalise { f64::from(sum == 0.0) } else { (1.0 - sum).max(0.0) };
        let share = |value: f64| if sum > 0.0 { value / whole } else { 0.0 };
        let mut confidences: Vec<(String, f64)> =
            self.joints.iter().zip(values).map(|((joint, _), value)| (joint.clone(), share(*value))).collect();
        match confidences.iter_mut().find(|(joint, _)| *joint == self.otherwise) {
            Some((_, confidence)) => *confidence += rest,
            None => confidences.push((self.otherwise.clone(), rest)),
        }
        Ok(confidences)
    }

    /// All joints equally likely, named after what remains.
    pub fn ignorance(&self) -> Verdict {
        let joints = self.joints.iter().map(|(joint, _)| joint);
        let others = joints.filter(|joint| **joint != self.otherwise).chain([&self.otherwise]);
        Verdict::ignorance(others.cloned().collect(), &self.otherwise)
    }

    /// The arithmetic of [`apply`](Self::apply).
    ///
    /// # Errors
    /// As [`apply`](Self::apply).
    pub fn explain(&self, findings: &Findings) -> Result<Explanation, RuleError> {
        let quantities = vec![
            Quantity { name: "value", meaning: "the joint's expression" },
            if self.normalise {
                Quantity { name: "confidence", meaning: "value / sum of all values" }
            } else {
                Quantity { name: "confidence", meaning: "value; of what remains, 1 - sum of all values" }
            },
        ];
        let verdict = self.apply(findings)?;
        let said = Said::of(self, findings);
        let account = |(joint, confidence): &(String, f64)| {
            let found = self.joints.iter().find(|(name, _)| name == joint);
            let (value, arithmetic) = match found.map(|(_, expression)| expression) {
                None => (None, format!("what remains: {}", number(*confidence))),
                Some(expression) => {
                    let value =
                        said.missing(expression).is_none().then(|| expression.value(&|name| said.or_zero(name)));
                    let missing = |name: &Name| format!("{}: {} is not given here", expression.text(), told(name));
                    let worked = || {
                        format!("{} = {} = {}", expression.text(), said.told(expression), number(value.unwrap_or(0.0)))
                    };
                    (value.or(Some(0.0)), said.missing(expression).map_or_else(worked, missing))
                }
            };
            // An expression of several lines is told in one.
            let arithmetic = arithmetic.split_whitespace().collect::<Vec<_>>().join(" ");
            Account { joint: joint.clone(), values: vec![value, Some(*confidence)], arithmetic }
        };
        let accounts = verdict.confidences.iter().map(account).collect();
        let reasons = crate::cascade::reasons(&verdict, self.margin);
        let by_evidence = self.likelihood.as_ref().map(|likelihood| Box::new(likelihood.explain(findings)));
        Ok(Explanation { rule: RuleKind::Expressions, quantities, accounts, reasons, by_evidence })
    }
}

/// What models say about one pair, by names of expressions.
struct Said<'f> {
    findings: &'f Findings,
    shares: BTreeMap<String, f64>,
    costs: BTreeMap<String, f64>,
    cost: Option<f64>,
}

impl<'f> Said<'f> {
    fn of(rule: &Expressions, findings: &'f Findings) -> Self {
        let Some(likelihood) = &rule.likelihood else {
            return Self { findings, shares: BTreeMap::new(), costs: BTreeMap::new(), cost: None };
        };
        let verdict = likelihood.apply(findings);
        let shares = if verdict.cost.is_some() { verdict.confidences.into_iter().collect() } else { BTreeMap::new() };
        Self { findings, shares, costs: likelihood.costs(findings), cost: verdict.cost }
    }

    /// The value of a name; `None` for a part that the model did not give.
    fn of_name(&self, name: &Name) -> Option<f64> {
        let finding = self.findings.get(&name.model);
        let Some(part) = name.part.as_deref() else {
            return Some(finding.map_or(0.0, |finding| finding.confidence.value()));
        };
        let given = finding.and_then(|finding| finding.parts.get(part).copied());
        given.or_else(|| match part {
            LIKELIHOOD => Some(self.shares.get(&name.model).copied().unwrap_or(0.0)),
            COST => self.costs.get(&name.model).copied(),
            _ => None,
        })
    }

    fn or_zero(&self, name: &Name) -> f64 {
        self.of_name(name).unwrap_or(0.0)
    }

    fn missing<'e>(&self, expression: &'e Expression) -> Option<&'e Name> {
        expression.names().into_iter().find(|name| self.of_name(name).is_none())
    }

    /// The expression with its numbers.
    fn told(&self, expression: &Expression) -> String {
        expression.worked(&|name| self.or_zero(name))
    }

    fn value(&self, joint: &str, expression: &Expression) -> Result<f64, RuleError> {
        if self.missing(expression).is_some() {
            return Ok(0.0);
        }
        let values = |name: &Name| self.or_zero(name);
        let value = expression.value(&values);
        let (message, (span, remedy)) = if !value.is_finite() {
            (format!("the value of `{joint}` is {value}, not a finite number"), expression.culprit(&values))
        } else if value < -ROUNDING {
            let message = format!("the value of `{joint}` is {}, less than 0", number(value));
            (message, (expression.span(), "values must be 0 or more: use max(0, ...)"))
        } else {
            // Adding 0 takes the sign off a zero.
            return Ok(value.max(0.0) + 0.0);
        };
        let help = format!("here {}; {remedy}", self.told(expression));
        Err(RuleError::within(joint, Mistake { message, help, span }))
    }
}

fn told(name: &Name) -> String {
    let part = name.part.as_ref().map_or_else(String::new, |part| format!(".{part}"));
    format!("`{}{part}`", name.model)
}

/// Whether a name stands for something, and for something of the evidence.
fn check_name(name: &Name, models: &[Announcement<'_>]) -> Result<bool, Mistake> {
    let fail = |message, help| Err(Mistake { message, help, span: name.span.clone() });
    let Some(model) = models.iter().find(|model| model.name == name.model) else {
        let hyphenated = models.iter().find(|model| model.name.starts_with(&format!("{}-", name.model)));
        let known = list(models.iter().map(|model| model.name));
        let help = match hyphenated {
            Some(model) => format!("a name with hyphens stands in back-quotes: `{}`; models: {known}", model.name),
            None => format!("models: {known}; add [models.{}] if it is missing", name.model),
        };
        return fail(format!("`{}` is not among the models", name.model), help);
    };
    let Some(part) = name.part.as_deref() else { return Ok(false) };
    if model.parts.contains(&part) {
        return Ok(false);
    }
    if [LIKELIHOOD, COST].contains(&part) {
        if model.states_evidence {
            return Ok(true);
        }
        let message = format!("the model `{}` states no evidence, so it has no {part}", model.name);
        return fail(message, "take its confidence, or a model of another kind, such as `revolute`".into());
    }
    let evidence = if model.states_evidence { &[LIKELIHOOD, COST][..] } else { &[] };
    let known: Vec<&str> = model.parts.iter().chain(evidence).copied().collect();
    let known = if known.is_empty() { "it has none".into() } else { format!("it has {}", list(known.into_iter())) };
    fail(format!("the model `{}` has no part `{part}`", model.name), known)
}

fn list<'n>(names: impl Iterator<Item = &'n str>) -> String {
    names.map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}
