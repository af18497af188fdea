//! The cascade for any number of models and any confidences.

use jointscope_models::Confidence;
use jointscope_scoring::{Announcement, Cascade, Finding, Findings, Rule, RuleKind, ScoringSettings, Verdict};
use proptest::{prelude::*, test_runner::RngSeed};

/// Departure of the sum of all shares from 1: rounding of one product per model, of which there are at most
/// [`MODELS`].
const SUM: f64 = 1e-12;
/// Departure from the product formula, a share of 1: rounding of as many products.
const PRODUCT: f64 = 1e-13;
const MODELS: usize = 150;

fn config() -> ProptestConfig {
    ProptestConfig { cases: 256, failure_persistence: None, rng_seed: RngSeed::Fixed(48), ..ProptestConfig::default() }
}

/// A confidence: anywhere, at the ends, or next to them.
fn confidence() -> impl Strategy<Value = f64> {
    let edges = [0.0, 1.0, f64::MIN_POSITIVE, f64::EPSILON, 1.0 - f64::EPSILON / 2.0, 0.997_444_869_669_572];
    prop_oneof![4 => 0.0..=1.0, 1 => prop::sample::select(edges.to_vec()), 1 => 0.0..1e-9]
}

fn confidences() -> impl Strategy<Value = Vec<f64>> {
    prop_oneof![3 => prop::collection::vec(confidence(), 1..6), 1 => prop::collection::vec(confidence(), 1..=MODELS)]
}

fn name(model: usize) -> String {
    // The order of names is not the order of models.
    format!("{}-{model}", ["slides", "turns", "holds", "bends"][model % 4])
}

fn cascade(models: usize) -> Cascade {
    let order: Vec<String> = (0..models).map(name).collect();
    let settings = ScoringSettings { order: order.clone(), ..ScoringSettings::default() };
    Cascade::new(&settings, &order.iter().map(String::as_str).collect::<Vec<_>>()).expect("an order of all models")
}

/// What a model without evidence says.
fn sure(confidence: f64) -> Finding {
    Confidence::new(confidence).expect("in range").into()
}

fn judged(says: &[f64]) -> Verdict {
    let finding = |(model, says): (usize, &f64)| (name(model), sure(*says));
    cascade(says.len()).apply(&says.iter().enumerate().map(finding).collect())
}

fn shares(verdict: &Verdict) -> Vec<f64> {
    verdict.confidences.iter().map(|(_, share)| *share).collect()
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn shares_lie_from_0_to_1_and_sum_to_1(says in confidences()) {
        let shares = shares(&judged(&says));
        prop_assert_eq!(shares.len(), says.len() + 1);
        prop_assert!(shares.iter().all(|share| (0.0..=1.0).contains(share)), "{:?}", shares);
        prop_assert!((shares.iter().sum::<f64>() - 1.0).abs() <= SUM, "{:?}", shares);
    }

    #[test]
    fn every_share_is_the_product_of_the_thesis(says in confidences()) {
        let verdict = judged(&says);
        for (model, share) in shares(&verdict).into_iter().enumerate() {
            // Equations (48)-(51); what remains is what a last model says that is always sure.
            let vetoes: f64 = says[..model].iter().map(|c| 1.0 - c).product();
            let expected = vetoes * says.get(model).copied().unwrap_or(1.0);
            prop_assert!((share - expected).abs() <= PRODUCT, "model {model}: {share}, expected {expected}");
            let expected = if model < says.len() { name(model) } else { "disconnected".into() };
            prop_assert_eq!(&verdict.confidences[model].0, &expected);
        }
    }

    #[test]
    fn a_surer_model_gains_and_takes_from_those_behind_it_only(
        says in confidences(), which in any::<prop::sample::Index>(), surer in confidence(),
    ) {
        let raised = which.index(says.len());
        let before = shares(&judged(&says));
        let mut says = says;
        says[raised] = says[raised].max(surer);
        let after = shares(&judged(&says));
        for (model, (before, after)) in before.iter().zip(&after).enumerate() {
            let fair = match model.cmp(&raised) {
                std::cmp::Ordering::Less => after == before,
                std::cmp::Ordering::Equal => after >= before,
                std::cmp::Ordering::Greater => after <= before,
            };
            prop_assert!(fair, "model {raised} is surer, and the share of {model} goes from {before} to {after}");
        }
    }

    #[test]
    fn the_verdict_is_the_first_of_the_greatest_shares_and_in_doubt_without_a_lead(says in confidences()) {
        let verdict = judged(&says);
        let shares = shares(&verdict);
        let greatest = shares.iter().copied().fold(0.0, f64::max);
        let first = shares.iter().position(|share| *share == greatest).expect("one is the greatest");
        prop_assert_eq!(&verdict.joint, &verdict.confidences[first].0);
        prop_assert_eq!(verdict.confidence, greatest);
        let others = shares.iter().enumerate().filter(|(model, _)| *model != first);
        let next = others.map(|(_, share)| *share).fold(0.0, f64::max);
        prop_assert_eq!(verdict.doubts.is_empty(), greatest - next >= ScoringSettings::default().margin);
    }

    #[test]
    fn neither_the_order_of_findings_nor_strangers_among_them_matter(
        (says, shuffled) in confidences().prop_flat_map(|says| {
            let numbered: Vec<(usize, f64)> = says.iter().copied().enumerate().collect();
            (Just(says), Just(numbered).prop_shuffle())
        }),
    ) {
        let mut findings = Findings::new();
        findings.insert("a stranger".into(), sure(1.0));
        for (model, says) in shuffled {
            findings.insert(name(model), sure(says));
        }
        prop_assert_eq!(cascade(says.len()).apply(&findings), judged(&says));
    }

    #[test]
    fn the_rule_is_the_cascade_whatever_order_its_models_are_given_in(
        (says, given) in confidences().prop_flat_map(|says| {
            let names: Vec<String> = (0..says.len()).map(name).collect();
            (Just(says), Just(names).prop_shuffle())
        }),
    ) {
        let order = (0..says.len()).map(name).collect();
        let settings = ScoringSettings { rule: RuleKind::Cascade, order, ..ScoringSettings::default() };
        let announced = |name| Announcement { name, parts: &[], states_evidence: false };
        let rule = Rule::new(&settings, &given.iter().map(|name| announced(name)).collect::<Vec<_>>()).expect("all models");
        let findings = says.iter().enumerate().map(|(i, c)| (name(i), sure(*c))).collect();
        prop_assert_eq!(rule.apply(&findings).expect("a verdict"), judged(&says));
    }
}
