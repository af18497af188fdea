//! The rule that compares joints by evidence.

use std::collections::BTreeMap;

use jointscope_models::{Evidence, Rival};

use crate::{
    Account, Explanation, Findings, Quantity, RuleError, RuleKind, ScoringSettings, Verdict, explanation::number, order,
};

/// Compares joints by how likely they make the motion.
///
/// *Definition.* Every joint costs `J = charge + k ln n + prior costs - 2 ln prior`, and its confidence is
/// `exp(-J / 2 T)`, divided by the sum over all joints. The *charge* is for what the joint does not explain. As noise,
/// it would cost `X`, the joint's -2 log likelihood above that of the best; as play, `Y`, the squared misfit in units
/// of what play makes likely. The cheaper explanation counts: `X Y / (X + Y)`. And a joint costs no more than another
/// one plus what noise alone says between the two, since that step may always be noise.
///
/// # References
/// G. Schwarz, Annals of Statistics 6 (1978), for the price of parameters; docs/method.md, "Evidence" and "Play".
#[derive(Debug, Clone, PartialEq)]
pub struct Likelihood {
    names: Vec<String>,
    priors: BTreeMap<String, f64>,
    lead: f64,
    lead_over_richer: f64,
    temperature: f64,
}

/// Squared departure of bodies that count as rigid, in standard deviations of play, beyond which a motion that another
/// joint explains is told, and by how much noise must speak for it.
const WOBBLES: f64 = 6.0;
const SURELY: f64 = 100.0;
/// Independent frames below which noise that drifts tells nothing.
const FEW_FRAMES: f64 = 6.0;

/// What one joint costs.
struct Candidate<'f> {
    name: &'f str,
    evidence: Evidence,
    by_noise: f64,
    charge: f64,
    /// The richer joint that the charge is taken from, if it is.
    by_step_from: Option<&'f str>,
    cost: f64,
}

impl Likelihood {
    /// The rule over `models`.
    ///
    /// # Errors
    /// [`RuleError`] if there is no model, or a prior names none or is not a positive number.
    pub fn new(settings: &ScoringSettings, models: &[&str]) -> Result<Self, RuleError> {
        let list = || models.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        if models.is_empty() {
            let message = "the likelihood rule has no models to compare".into();
            return Err(RuleError::new("rule", message, "name at least one under [models]"));
        }
        if let Some(name) = settings.priors.keys().find(|name| !models.contains(&name.as_str())) {
            let message = format!("a prior is given for `{name}`, which is not among the models");
            return Err(RuleError::new("priors", message, format!("models: {}", list())));
        }
        if let Some((name, prior)) = settings.priors.iter().find(|(_, prior)| !(prior.is_finite() && **prior > 0.0)) {
            let message = format!("the prior of `{name}` is {prior}, which is not a positive number");
            let help =
                "priors are weights: 1 is as good as any, 2 twice as likely; to rule a joint out, leave its model out";
            return Err(RuleError::new("priors", message, help));
        }
        let mut names: Vec<String> = models.iter().map(ToString::to_string).collect();
        names.sort_by_key(|name| order::place(name));
        Ok(Self {
            names,
            priors: settings.priors.clone(),
            lead: settings.lead,
            lead_over_richer: settings.lead_over_richer,
            temperature: settings.temperature,
        })
    }

    /// Judges one pair. Models that gave no evidence have no say.
    pub fn apply(&self, findings: &Findings) -> Verdict {
        let mut candidates = self.candidates(findings);
        // The simplest first, so that of equals the simplest wins, and results stand in an order that makes sense.
        candidates.sort_by(|a, b| {
            let size = |c: &Candidate<'_>| {
                let mobility = c.evidence.mobility;
                (mobility.parameters, mobility.turns + mobility.slides)
            };
            size(a).cmp(&size(b)).then_with(|| a.name.cmp(b.name))
        });
        let least = |candidates: &[Candidate<'_>]| candidates.iter().map(|c| c.cost).fold(f64::INFINITY, f64::min);
        let cheapest = least(&candidates);
        let Some(best) = candidates.iter().find(|candidate| candidate.cost <= cheapest) else {
            return self.ignorance();
        };
        let weight = |cost: f64| (-0.5 * (cost - cheapest) / self.temperature).exp();
        let sum: f64 = candidates.iter().map(|candidate| weight(candidate.cost)).sum();
        // Models without evidence have no share; the order is that of the rule, the same for every pair.
        let share = |name: &String| {
            let candidate = candidates.iter().find(|candidate| candidate.name == name);
            (name.clone(), candidate.map_or(0.0, |candidate| weight(candidate.cost) / sum))
        };
        let confidences = self.names.iter().map(share).collect();
        Verdict {
            joint: best.name.to_owned(),
            confidence: weight(best.cost) / sum,
            doubts: self.doubts(best, &candidates),
            richer: richer(best, &candidates).map(str::to_owned),
            cost: Some(best.cost),
            fault: None,
            confidences,
        }
    }

    fn candidates<'f>(&self, findings: &'f Findings) -> Vec<Candidate<'f>> {
        let all = || findings.iter().flat_map(|(name, finding)| finding.evidence.iter().map(move |e| (name, *e)));
        let cheapest = all().map(|(_, evidence)| evidence.noise_cost()).fold(f64::INFINITY, f64::min);
        // What can do more explains noise no worse, even where its fit went astray.
        let by_noise = |evidence: &Evidence| {
            let less = all().map(|(_, e)| e).filter(|e| evidence.mobility.contains(&e.mobility));
            less.map(|e| e.noise_cost()).fold(evidence.noise_cost(), f64::min) - cheapest
        };
        // The richest first: every joint is compared with those that can do more.
        let mut charged: Vec<Candidate<'_>> = all()
            .map(|(name, evidence)| {
                let by_noise = by_noise(&evidence);
                let charge = evidence.departure.map_or(by_noise, |departure| departure.charge(by_noise));
                Candidate { name: name.as_str(), evidence, by_noise, charge, by_step_from: None, cost: f64::NAN }
            })
            .collect();
        let size = |c: &Candidate<'_>| c.evidence.mobility.parameters;
        charged.sort_by(|a, b| size(b).cmp(&size(a)).then_with(|| a.name.cmp(b.name)));
        for index in 0..charged.len() {
            let (before, rest) = charged.split_at_mut(index);
            let this = &mut rest[0];
            for richer in before.iter().filter(|richer| richer.evidence.mobility.contains(&this.evidence.mobility)) {
                let charge = richer.charge + (this.by_noise - richer.by_noise).max(0.0);
                if charge < this.charge || this.charge.is_nan() {
                    (this.charge, this.by_step_from) = (charge, Some(richer.name));
                }
            }
        }
        let mut best: BTreeMap<&str, Candidate<'_>> = BTreeMap::new();
        for mut candidate in charged {
            let Candidate { name, evidence, charge, .. } = candidate;
            candidate.cost = charge + price(&evidence) + evidence.prior_cost + self.prior_cost(name);
            if candidate.cost.is_finite() && best.get(name).is_none_or(|other| candidate.cost < other.cost) {
                best.insert(name, candidate);
            }
        }
        best.into_values().collect()
    }

    fn prior(&self, name: &str) -> f64 {
        self.priors.get(name).copied().unwrap_or(1.0)
    }

    fn prior_cost(&self, name: &str) -> f64 {
        // Taken from 0, so that a prior of 1 costs 0 without a sign.
        0.0 - 2.0 * self.prior(name).ln()
    }

    /// What a joint that explains any motion leaves to others; `None` unless it does, play included.
    pub fn rival(&self, name: &str, evidence: &Evidence) -> Option<Rival> {
        /// Share of the verdict that is none.
        const NONE: f64 = 1e-12;
        evidence.departure.filter(|departure| departure.squared <= 0.0)?;
        let cost = price(evidence) + evidence.prior_cost + self.prior_cost(name);
        let least_prior = self.priors.keys().map(|name| self.prior_cost(name)).fold(0.0, f64::min);
        let charge = cost - least_prior - 2.0 * self.temperature * NONE.ln();
        Some(Rival { noise_cost: evidence.noise_cost(), charge })
    }

    /// Cost of every joint above that of the likeliest, in units of -2 log likelihood.
    pub(crate) fn costs(&self, findings: &Findings) -> BTreeMap<String, f64> {
        let candidates = self.candidates(findings);
        let least = candidates.iter().map(|c| c.cost).fold(f64::INFINITY, f64::min);
        candidates.into_iter().map(|c| (c.name.to_owned(), c.cost - least)).collect()
    }

    /// Why the evidence does not decide.
    fn doubts(&self, best: &Candidate<'_>, candidates: &[Candidate<'_>]) -> Vec<String> {
        let mut doubts = Vec::new();
        let rivals = candidates.iter().filter(|c| c.name != best.name && c.cost - best.cost < self.lead_over(best, c));
        let mut rivals: Vec<&Candidate<'_>> = rivals.collect();
        rivals.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        if !rivals.is_empty() {
            let names: Vec<&str> = rivals.iter().map(|rival| rival.name).collect();
            doubts.push(format!(
                "{} is nearly as likely as {}; more motion would tell them apart",
                names.join(", "),
                best.name
            ));
        }
        let far_off = |c: &Candidate<'_>| c.evidence.departure.is_some_and(|d| d.squared >= d.adequate);
        let gain = |other: &Candidate<'_>| best.evidence.noise_cost() - other.evidence.noise_cost();
        // Where errors drift through the whole recording, noise explains anything, and tells nothing.
        let scarce = best.evidence.correlation_time > 1.0 && best.evidence.independent_frames() < FEW_FRAMES;
        let surely = |other: &Candidate<'_>, lead: f64| if scarce { gain(other) > 0.0 } else { gain(other) > lead };
        let better = candidates.iter().find(|other| far_off(best) && !far_off(other) && surely(other, self.lead));
        if let Some(better) = better {
            doubts.push(format!(
                "{} is the simplest, but leaves a motion that {} explains; noise or drift are too large to be sure",
                best.name, better.name
            ));
        }
        let still = best.evidence.mobility.turns + best.evidence.mobility.slides == 0;
        let wobbles = still && best.evidence.departure.is_some_and(|d| d.squared > WOBBLES);
        let within_play = |c: &Candidate<'_>| c.evidence.departure.is_some_and(|d| d.squared < 1.0);
        let explained = candidates.iter().find(|other| within_play(other) && surely(other, SURELY));
        if let Some(joint) = explained.filter(|_| wobbles && !far_off(best)) {
            let why = if scarce {
                "noise drifts, and so short a recording does not tell it from motion; record longer"
            } else {
                "noise does not explain the motion between the bodies"
            };
            doubts.push(format!("{} with more play than usual, or {}: {why}", best.name, joint.name));
        }
        if let Some(departure) = best.evidence.departure
            && best.charge >= departure.adequate
        {
            doubts.push(format!(
                "the motion departs from every joint by more than play explains: {} is only the nearest",
                best.name
            ));
        }
        doubts
    }

    /// The lead over another joint that decides. A joint that can do more fits always; it is a rival only where it is
    /// nearly as simple.
    fn lead_over(&self, best: &Candidate<'_>, other: &Candidate<'_>) -> f64 {
        if is_richer(other, best) { self.lead_over_richer } else { self.lead }
    }

    /// All joints equally likely; named after the last, which explains everything.
    pub fn ignorance(&self) -> Verdict {
        let free = self.names.iter().find(|name| ["disconnected", "free"].contains(&name.as_str()));
        Verdict::ignorance(self.names.clone(), free.unwrap_or(&self.names[self.names.len() - 1]))
    }

    /// The arithmetic of [`apply`](Self::apply).
    pub fn explain(&self, findings: &Findings) -> Explanation {
        let verdict = self.apply(findings);
        let candidates = self.candidates(findings);
        let account = |(joint, confidence): &(String, f64)| match candidates.iter().find(|c| c.name == joint) {
            Some(candidate) => self.account(candidate, *confidence, &verdict),
            None => Account::silent(joint, QUANTITIES.len(), "the model gave no evidence"),
        };
        let accounts = verdict.confidences.iter().map(account).collect();
        let reasons = self.reasons(&verdict, &candidates);
        Explanation {
            rule: RuleKind::Likelihood,
            quantities: QUANTITIES.to_vec(),
            accounts,
            reasons,
            by_evidence: None,
        }
    }

    fn account(&self, candidate: &Candidate<'_>, confidence: f64, verdict: &Verdict) -> Account {
        let Candidate { name, evidence, by_noise, charge, by_step_from, cost } = candidate;
        let departure = evidence.departure;
        let (k, ln_n) = (evidence.mobility.parameters as f64, evidence.observations.max(1.0).ln());
        let values = [
            Some(evidence.chi_squared),
            Some(evidence.freedom),
            Some(evidence.configuration_cost),
            Some(evidence.correlation_time),
            Some(evidence.noise_cost()),
            Some(*by_noise),
            departure.map(|departure| departure.squared),
            departure.map(|departure| departure.per_noise),
            departure.map(|departure| departure.adequate),
            Some(*charge),
            Some(k),
            Some(ln_n),
            Some(price(evidence)),
            Some(evidence.prior_cost),
            Some(self.prior_cost(name)),
            Some(*cost),
            Some(confidence),
        ];
        let least = verdict.cost.unwrap_or(*cost);
        let step = by_step_from.map_or_else(String::new, |richer| format!(" (by the step from {richer})"));
        let arithmetic = format!(
            "cost {} = charge {}{step} + {k} · ln n {} + prior cost {} + prior {}; {} above the least",
            number(*cost),
            number(*charge),
            number(ln_n),
            number(evidence.prior_cost),
            number(self.prior_cost(name)),
            number(cost - least),
        );
        Account { joint: (*name).to_owned(), values: values.to_vec(), arithmetic }
    }

    fn reasons(&self, verdict: &Verdict, candidates: &[Candidate<'_>]) -> Vec<String> {
        let Some(best) = candidates.iter().find(|candidate| candidate.name == verdict.joint) else {
            return vec!["no model states evidence for this pair: every joint is equally likely".into()];
        };
        let mut reasons = vec![format!("{} costs least, {}", best.name, number(best.cost))];
        let mut others: Vec<&Candidate<'_>> = candidates.iter().filter(|c| c.name != best.name).collect();
        others.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let compared = others.into_iter().map(|other| {
            let (more, lead) = (other.cost - best.cost, self.lead_over(best, other));
            let (name, more) = (other.name, number(more));
            let richer = if is_richer(other, best) { ", which can do more," } else { "" };
            let judged = if other.cost - best.cost < lead { "less than" } else { "at least" };
            format!("{name}{richer} costs {more} more, {judged} the lead of {} that decides", number(lead))
        });
        reasons.extend(compared);
        reasons.extend(verdict.doubts.iter().cloned());
        reasons
    }
}

/// The steps of the arithmetic.
const QUANTITIES: [Quantity; 17] = {
    const fn quantity(name: &'static str, meaning: &'static str) -> Quantity {
        Quantity { name, meaning }
    }
    [
        quantity("chi_squared", "weighted sum of squared residuals"),
        quantity("freedom", "what chi_squared is by chance"),
        quantity("configuration_cost", "price of the joint's positions over time"),
        quantity("correlation_time", "frames that count as one because noise drifts"),
        quantity("noise_cost", "(chi_squared + configuration_cost) / correlation_time"),
        quantity("by_noise", "X: noise_cost, or less if a joint that it contains has less, above the least of all"),
        quantity("departure", "Y: squared misfit in standard deviations of play"),
        quantity(
            "per_noise",
            "what a misfit costs by noise over what it costs by play; Y counts as X / per_noise at least",
        ),
        quantity("adequate", "departure beyond which the joint is not the right one"),
        quantity(
            "charge",
            "X Y' / (X + Y') with Y' = Y (1 + Y / 60), or X of ideal joints; at most a richer joint's and the step from it",
        ),
        quantity("parameters", "k"),
        quantity("ln_observations", "ln n"),
        quantity("parameter_cost", "k ln n"),
        quantity("prior_cost", "price of what is unlikely beforehand"),
        quantity("prior", "-2 ln of the prior"),
        quantity("cost", "J = charge + parameter_cost + prior_cost + prior"),
        quantity("confidence", "exp(-(J - least J) / 2 T), divided by the sum over all joints"),
    ]
};

/// The price of parameters.
fn price(evidence: &Evidence) -> f64 {
    evidence.mobility.parameters as f64 * evidence.observations.max(1.0).ln()
}

/// Whether a joint can do more than another, and is not free motion.
fn is_richer(other: &Candidate<'_>, than: &Candidate<'_>) -> bool {
    let mobility = other.evidence.mobility;
    mobility.contains(&than.evidence.mobility) && !(mobility.turns == 3 && mobility.slides == 3)
}

/// A joint that can do more than the verdict's and that the data show beyond noise and play.
fn richer<'c>(best: &Candidate<'_>, candidates: &[Candidate<'c>]) -> Option<&'c str> {
    /// Charge that it must save.
    const WORTH_TELLING: f64 = 3.0;
    let more = candidates.iter().filter(|c| is_richer(c, best) && best.charge - c.charge > WORTH_TELLING);
    more.min_by(|a, b| a.cost.total_cmp(&b.cost)).map(|candidate| candidate.name)
}
