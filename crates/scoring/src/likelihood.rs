//! The rule that compares joints by evidence.

use std::collections::BTreeMap;

use jointscope_models::Evidence;

use crate::{Findings, RuleError, ScoringSettings, Verdict};

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

/// The usual order of joints, the simple ones first and free motion last; others stand before free motion.
const ORDER: [&str; 9] =
    ["rigid", "prismatic", "revolute", "screw", "cylindrical", "planar", "universal", "spherical", "elliptical"];

fn place(name: &str) -> usize {
    let last = ["disconnected", "free"].contains(&name);
    ORDER.iter().position(|known| *known == name).unwrap_or(ORDER.len() + usize::from(last))
}

/// Squared departure of bodies that count as rigid, in standard deviations of play, beyond which a motion that another
/// joint explains is told, and by how much noise must speak for it.
const WOBBLES: f64 = 6.0;
const SURELY: f64 = 100.0;

/// What one joint costs.
struct Candidate<'f> {
    name: &'f str,
    evidence: Evidence,
    charge: f64,
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
            return Err(RuleError { key: "rule", message, help: "name at least one under [models]".into() });
        }
        if let Some(name) = settings.priors.keys().find(|name| !models.contains(&name.as_str())) {
            let message = format!("a prior is given for `{name}`, which is not among the models");
            return Err(RuleError { key: "priors", message, help: format!("models: {}", list()) });
        }
        if let Some((name, prior)) = settings.priors.iter().find(|(_, prior)| !(prior.is_finite() && **prior > 0.0)) {
            let message = format!("the prior of `{name}` is {prior}, which is not a positive number");
            let help =
                "priors are weights: 1 is as good as any, 2 twice as likely; to rule a joint out, leave its model out";
            return Err(RuleError { key: "priors", message, help: help.into() });
        }
        let mut names: Vec<String> = models.iter().map(ToString::to_string).collect();
        names.sort_by_key(|name| (place(name), name.clone()));
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
        let mut charged: Vec<(&str, Evidence, f64)> = all()
            .map(|(name, evidence)| {
                let noise = by_noise(&evidence);
                (name.as_str(), evidence, evidence.departure.map_or(noise, |departure| departure.charge(noise)))
            })
            .collect();
        charged.sort_by(|a, b| b.1.mobility.parameters.cmp(&a.1.mobility.parameters).then_with(|| a.0.cmp(b.0)));
        for index in 0..charged.len() {
            let (before, rest) = charged.split_at_mut(index);
            let (_, evidence, charge) = &mut rest[0];
            for (_, richer, its_charge) in before.iter() {
                if richer.mobility.contains(&evidence.mobility) {
                    let step = (by_noise(evidence) - by_noise(richer)).max(0.0);
                    *charge = charge.min(its_charge + step);
                }
            }
        }
        let mut best: BTreeMap<&str, Candidate<'_>> = BTreeMap::new();
        for (name, evidence, charge) in charged {
            let prior = self.priors.get(name).copied().unwrap_or(1.0);
            let parameters = evidence.mobility.parameters as f64;
            let cost =
                charge + parameters * evidence.observations.max(1.0).ln() + evidence.prior_cost - 2.0 * prior.ln();
            if cost.is_finite() && best.get(name).is_none_or(|other| cost < other.cost) {
                best.insert(name, Candidate { name, evidence, charge, cost });
            }
        }
        best.into_values().collect()
    }

    /// Why the evidence does not decide.
    fn doubts(&self, best: &Candidate<'_>, candidates: &[Candidate<'_>]) -> Vec<String> {
        let mut doubts = Vec::new();
        let lead = |other: &Candidate<'_>| {
            // A joint that can do more fits always; it is a rival only where it is nearly as simple.
            let mobility = other.evidence.mobility;
            let free = mobility.turns == 3 && mobility.slides == 3;
            let richer = mobility.contains(&best.evidence.mobility) && !free;
            if richer { self.lead_over_richer } else { self.lead }
        };
        let rivals = candidates.iter().filter(|c| c.name != best.name && c.cost - best.cost < lead(c));
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
        let better = candidates.iter().find(|other| far_off(best) && !far_off(other) && gain(other) > self.lead);
        if let Some(better) = better {
            doubts.push(format!(
                "{} is the simplest, but leaves a motion that {} explains; noise or drift are too large to be sure",
                best.name, better.name
            ));
        }
        let still = best.evidence.mobility.turns + best.evidence.mobility.slides == 0;
        let wobbles = still && best.evidence.departure.is_some_and(|d| d.squared > WOBBLES);
        let within_play = |c: &Candidate<'_>| c.evidence.departure.is_some_and(|d| d.squared < 1.0);
        let explained = candidates.iter().find(|other| within_play(other) && gain(other) > SURELY);
        if let Some(joint) = explained.filter(|_| wobbles && !far_off(best)) {
            doubts.push(format!(
                "{} with more play than usual, or {}: noise does not explain the motion between the bodies",
                best.name, joint.name
            ));
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

    /// All joints equally likely; named after the last, which explains everything.
    pub fn ignorance(&self) -> Verdict {
        let share = 1.0 / self.names.len() as f64;
        let free = self.names.iter().find(|name| ["disconnected", "free"].contains(&name.as_str()));
        Verdict {
            joint: free.unwrap_or(&self.names[self.names.len() - 1]).clone(),
            confidence: share,
            confidences: self.names.iter().map(|name| (name.clone(), share)).collect(),
            doubts: Vec::new(),
            richer: None,
            cost: None,
        }
    }
}

/// A joint that can do more than the verdict's and that the data show beyond noise and play.
fn richer<'c>(best: &Candidate<'_>, candidates: &[Candidate<'c>]) -> Option<&'c str> {
    /// Charge that it must save.
    const WORTH_TELLING: f64 = 3.0;
    let more = candidates.iter().filter(|c| {
        let mobility = c.evidence.mobility;
        mobility.contains(&best.evidence.mobility)
            && !(mobility.turns == 3 && mobility.slides == 3)
            && best.charge - c.charge > WORTH_TELLING
    });
    more.min_by(|a, b| a.cost.total_cmp(&b.cost)).map(|candidate| candidate.name)
}
