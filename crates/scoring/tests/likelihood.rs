//! The rule that compares evidence, on evidence made by hand.

use jointscope_models::{Confidence, Departure, Evidence, Mobility};
use jointscope_scoring::{Announcement, Finding, Findings, Likelihood, Rule, RuleKind, ScoringSettings, Verdict};
use proptest::{prelude::*, test_runner::RngSeed};

/// Rounding of logarithms and exponentials of costs of some hundreds, as a share of their difference or of 1.
const ROUNDING: f64 = 1e-9;
/// Departure of the sum of all confidences from 1: rounding of one term per model.
const SUM: f64 = 1e-12;
/// Number of observations, for the price of parameters.
const OBSERVATIONS: f64 = 300.0;

const RIGID: Mobility = Mobility { turns: 0, slides: 0, parameters: 6, advances: false, roams: false };
const SLIDE: Mobility = Mobility { turns: 0, slides: 1, parameters: 9, advances: false, roams: false };
const HINGE: Mobility = Mobility { turns: 1, slides: 0, parameters: 11, advances: false, roams: false };
const SCREW: Mobility = Mobility { turns: 1, slides: 0, parameters: 12, advances: true, roams: false };
const CYLINDER: Mobility = Mobility { turns: 1, slides: 1, parameters: 13, advances: true, roams: false };
const BALL: Mobility = Mobility { turns: 3, slides: 0, parameters: 15, advances: false, roams: false };
const FREE: Mobility = Mobility { turns: 3, slides: 3, parameters: 18, advances: true, roams: false };

/// Evidence of ideal joints that costs so much as noise.
fn noise(mobility: Mobility, cost: f64) -> Evidence {
    Evidence {
        chi_squared: cost,
        freedom: 250.0,
        configuration_cost: 0.0,
        prior_cost: 0.0,
        mobility,
        observations: OBSERVATIONS,
        correlation_time: 1.0,
        departure: None,
    }
}

/// Evidence that costs so much as noise, and a misfit of so many squared standard deviations as play, of which play
/// absorbs any amount.
fn play(mobility: Mobility, cost: f64, squared: f64) -> Evidence {
    let departure = Departure { squared, per_noise: f64::INFINITY, adequate: 25.0 };
    Evidence { departure: Some(departure), ..noise(mobility, cost) }
}

fn findings(says: &[(&str, Evidence)]) -> Findings {
    let mut findings = Findings::new();
    for (name, evidence) in says {
        let silent = || Finding::from(Confidence::ONE);
        findings.entry((*name).to_owned()).or_insert_with(silent).evidence.push(*evidence);
    }
    findings
}

fn judged_by(settings: &ScoringSettings, says: &[(&str, Evidence)]) -> Verdict {
    let mut names: Vec<&str> = says.iter().map(|(name, _)| *name).collect();
    names.sort_unstable();
    names.dedup();
    Likelihood::new(settings, &names).expect("a rule").apply(&findings(says))
}

fn judged(says: &[(&str, Evidence)]) -> Verdict {
    judged_by(&ScoringSettings::default(), says)
}

fn confidence(verdict: &Verdict, joint: &str) -> f64 {
    verdict.confidences.iter().find(|(name, _)| name == joint).expect("a joint").1
}

/// By how much one joint costs more than another.
fn lead(verdict: &Verdict, joint: &str, other: &str) -> f64 {
    2.0 * (confidence(verdict, joint) / confidence(verdict, other)).ln()
}

fn near(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= ROUNDING * expected.abs().max(1.0)
}

/// Price of a number of parameters.
fn price(parameters: f64) -> f64 {
    parameters * OBSERVATIONS.ln()
}

fn priors(priors: &[(&str, f64)]) -> ScoringSettings {
    let priors = priors.iter().map(|(name, prior)| ((*name).to_owned(), *prior)).collect();
    ScoringSettings { priors, ..ScoringSettings::default() }
}

#[test]
fn of_ideal_joints_the_noise_and_the_price_of_parameters_decide() {
    let verdict =
        judged(&[("hinge", noise(HINGE, 260.0)), ("ball", noise(BALL, 250.0)), ("rigid", noise(RIGID, 900.0))]);
    assert_eq!(verdict.joint, "hinge");
    // A ball saves 10 and pays for four parameters more; rest pays 640 and saves five.
    assert!(near(lead(&verdict, "hinge", "ball"), price(4.0) - 10.0));
    assert!(near(lead(&verdict, "hinge", "rigid"), 640.0 - price(5.0)));
    assert!(near(verdict.cost.expect("told"), 10.0 + price(11.0)));
    assert_eq!(verdict.confidence, confidence(&verdict, "hinge"));
}

#[test]
fn errors_that_drift_count_for_fewer_frames() {
    let drifting = |mobility, cost| Evidence { correlation_time: 4.0, ..noise(mobility, cost) };
    let verdict = judged(&[("slide", drifting(SLIDE, 500.0)), ("hinge", drifting(HINGE, 260.0))]);
    assert!(near(lead(&verdict, "hinge", "slide"), 240.0 / 4.0 - price(2.0)));
}

#[test]
fn of_equals_the_simplest_wins_and_then_the_name() {
    let verdict = judged(&[("screw", noise(SCREW, 250.0)), ("hinge", noise(HINGE, 250.0))]);
    assert_eq!(verdict.joint, "hinge");
    assert!(near(lead(&verdict, "hinge", "screw"), price(1.0)));
    let verdict = judged(&[("knee", noise(HINGE, 250.0)), ("elbow", noise(HINGE, 250.0))]);
    assert_eq!((verdict.joint.as_str(), verdict.confidence), ("elbow", 0.5));
    assert!(!verdict.doubts.is_empty());
}

#[test]
fn priors_multiply_the_odds() {
    let says = [("slide", noise(SLIDE, 262.0)), ("hinge", noise(HINGE, 250.0)), ("ball", noise(BALL, 245.0))];
    let even = judged(&says);
    let odds = |verdict: &Verdict, a: &str, b: &str| confidence(verdict, a) / confidence(verdict, b);
    for prior in [1e-6, 0.5, 2.0, 1e6] {
        let moved = judged_by(&priors(&[("ball", prior)]), &says);
        assert!(near(odds(&moved, "ball", "hinge") / odds(&even, "ball", "hinge"), prior), "{prior}");
        assert!(near(odds(&moved, "slide", "hinge"), odds(&even, "slide", "hinge")), "{prior}");
    }
    let alike = judged_by(&priors(&[("slide", 7.0), ("hinge", 7.0), ("ball", 7.0)]), &says);
    for joint in ["slide", "hinge", "ball"] {
        assert!(near(confidence(&alike, joint), confidence(&even, joint)), "{joint}");
    }
    assert_eq!(judged_by(&priors(&[("ball", 1e30)]), &says).joint, "ball");
}

#[test]
fn what_is_unlikely_beforehand_costs_what_the_model_says() {
    let far = Evidence { prior_cost: 8.0, ..noise(HINGE, 250.0) };
    let verdict = judged(&[("hinge", far), ("ball", noise(BALL, 250.0))]);
    assert!(near(lead(&verdict, "hinge", "ball"), price(4.0) - 8.0));
}

#[test]
fn the_temperature_divides_all_leads() {
    let says = [("slide", noise(SLIDE, 262.0)), ("hinge", noise(HINGE, 250.0)), ("ball", noise(BALL, 245.0))];
    let (even, warm) = (judged(&says), judged_by(&ScoringSettings { temperature: 3.0, ..Default::default() }, &says));
    for other in ["slide", "ball"] {
        assert!(near(lead(&warm, "hinge", other), lead(&even, "hinge", other) / 3.0), "{other}");
    }
    assert_eq!((&warm.joint, warm.cost), (&even.joint, even.cost));
}

/// What a misfit is charged that costs `by_noise` as noise: by the lead of a joint without any.
fn charged(evidence: Evidence, by_noise: f64) -> f64 {
    // A joint of the same size that does not contain it, so that only the charge differs.
    let other = Mobility { turns: 0, slides: 1, ..evidence.mobility };
    let verdict = judged(&[("misfit", Evidence { chi_squared: by_noise, ..evidence }), ("none", noise(other, 0.0))]);
    lead(&verdict, "none", "misfit")
}

#[test]
fn the_cheaper_of_noise_and_play_counts() {
    // Much noise, little play: what play costs, 4 (1 + 4/60), and a little less.
    let by_play = 4.0 * (1.0 + 4.0 / 60.0);
    let charge = charged(play(HINGE, 0.0, 4.0), 500.0);
    assert!(near(charge, 500.0 * by_play / (500.0 + by_play)) && charge < by_play);
    // Much play, little noise: what noise costs, and a little less.
    let by_play = 400.0 * (1.0 + 400.0 / 60.0);
    let charge = charged(play(HINGE, 0.0, 400.0), 5.0);
    assert!(near(charge, 5.0 * by_play / (5.0 + by_play)) && charge < 5.0);
    // Without play, noise is the only explanation; and what costs nothing is not charged.
    assert!(near(charged(noise(HINGE, 0.0), 5.0), 5.0));
    assert!(near(charged(play(HINGE, 0.0, 400.0), 0.0), 0.0));
    assert!(near(charged(play(HINGE, 0.0, 0.0), 500.0), 0.0));
}

#[test]
fn more_play_and_more_noise_never_cost_less() {
    let misfits = [0.0, 0.1, 1.0, 10.0, 60.0, 300.0];
    let charge = |by_noise, squared| charged(play(HINGE, 0.0, squared), by_noise);
    for pair in misfits.windows(2) {
        for other in misfits {
            assert!(charge(other, pair[0]) <= charge(other, pair[1]) + ROUNDING, "{pair:?} squared, {other}");
            assert!(charge(pair[0], other) <= charge(pair[1], other) + ROUNDING, "{pair:?} by noise, {other}");
        }
    }
}

#[test]
fn play_absorbs_no_more_than_it_can() {
    // A misfit that robust means overlook: 500 by noise is at least 5 by play, if play absorbs a hundred times as much.
    let limited = Departure { squared: 0.1, per_noise: 100.0, adequate: 25.0 };
    let evidence = Evidence { departure: Some(limited), ..noise(HINGE, 0.0) };
    let by_play = 5.0 * (1.0 + 5.0 / 60.0);
    assert!(near(charged(evidence, 500.0), 500.0 * by_play / (500.0 + by_play)));
}

#[test]
fn a_joint_costs_no_more_than_a_richer_one_and_the_noise_between_them() {
    // The screw's misfit as play is 100; but a cylinder without any is only 3 better as noise.
    let says = [
        ("screw", play(SCREW, 503.0, 100.0)),
        ("cylinder", play(CYLINDER, 500.0, 0.0)),
        ("free", play(FREE, 0.0, 0.0)),
    ];
    let verdict = judged(&says);
    assert_eq!(verdict.joint, "screw");
    assert!(near(lead(&verdict, "screw", "cylinder"), price(1.0) - 3.0));
    // A joint that cannot do what the screw can is no such step.
    let says =
        [("screw", play(SCREW, 503.0, 100.0)), ("slide", play(SLIDE, 500.0, 0.0)), ("free", play(FREE, 0.0, 0.0))];
    assert_eq!(judged(&says).joint, "slide");
}

#[test]
fn what_can_do_more_explains_noise_no_worse() {
    // The ball's fit went astray: a ball can do what the hinge does.
    let says = [("hinge", noise(HINGE, 250.0)), ("ball", noise(BALL, 900.0))];
    assert!(near(lead(&judged(&says), "hinge", "ball"), price(4.0)));
    let says = [("hinge", noise(HINGE, 250.0)), ("slide", noise(SLIDE, 900.0))];
    assert!(near(lead(&judged(&says), "hinge", "slide"), 650.0 - price(2.0)));
}

#[test]
fn of_several_explanations_of_a_joint_the_cheapest_counts() {
    let bent = Evidence { prior_cost: 1.0, ..noise(HINGE, 250.0) };
    let says = [("slide", noise(SLIDE, 900.0)), ("slide", bent), ("ball", noise(BALL, 250.0))];
    assert!(near(lead(&judged(&says), "slide", "ball"), price(4.0) - 1.0));
    let says = [("slide", noise(SLIDE, 250.0)), ("slide", bent), ("ball", noise(BALL, 250.0))];
    assert!(near(lead(&judged(&says), "slide", "ball"), price(6.0)));
}

#[test]
fn rivals_within_the_lead_are_doubts_and_others_are_not() {
    let lead_of = |other: Mobility, cost: f64| {
        let own = noise(HINGE, 1000.0);
        let parameters = other.parameters as f64 - HINGE.parameters as f64;
        judged(&[("hinge", own), ("rival", noise(other, 1000.0 + cost - price(parameters)))])
    };
    let doubted = |verdict: &Verdict| {
        assert_eq!(verdict.joint, "hinge");
        verdict.doubts.iter().any(|doubt| doubt.contains("rival is nearly as likely as hinge"))
    };
    // A slide can do other things than a hinge: 6. A cylinder can do more: 2. Free motion can do all: 6.
    for (other, lead) in [(SLIDE, 6.0), (CYLINDER, 2.0), (FREE, 6.0)] {
        assert!(doubted(&lead_of(other, lead - 0.01)), "{other:?}");
        assert!(!doubted(&lead_of(other, lead + 0.01)), "{other:?}");
    }
    let strict = ScoringSettings { lead: 20.0, lead_over_richer: 0.0, ..ScoringSettings::default() };
    let says = [
        ("hinge", noise(HINGE, 250.0)),
        ("slide", noise(SLIDE, 250.0 + price(2.0) + 19.0)),
        ("ball", noise(BALL, 250.0)),
    ];
    assert_eq!(
        judged_by(&strict, &says).doubts,
        ["slide is nearly as likely as hinge; more motion would tell them apart"]
    );
    assert!(judged(&says).doubts.is_empty());
}

#[test]
fn a_joint_that_departs_by_more_than_play_is_only_the_nearest() {
    let says = |squared| [("hinge", play(HINGE, 1e6, squared)), ("slide", play(SLIDE, 1e6 + 1.0, 1e3))];
    let with_free =
        |squared| judged(&[&says(squared)[..], &[("free", Evidence { prior_cost: 1e3, ..noise(FREE, 0.0) })]].concat());
    let departs = |verdict: &Verdict| verdict.doubts.iter().any(|doubt| doubt.contains("hinge is only the nearest"));
    // 19 (1 + 19/60) = 25.02.
    assert!(departs(&with_free(19.0)) && !departs(&with_free(18.5)));
}

#[test]
fn a_richer_joint_that_the_data_show_is_told_beside_the_verdict() {
    // The ball saves a charge of 4 (1 + 4/60), and would pay 4 ln 300 for it.
    let says = |squared| {
        [("hinge", play(HINGE, 1e5, squared)), ("ball", play(BALL, 0.0, 0.0)), ("free", play(FREE, 0.0, 0.0))]
    };
    let verdict = judged(&says(4.0));
    assert_eq!((verdict.joint.as_str(), verdict.richer.as_deref()), ("hinge", Some("ball")));
    assert_eq!(judged(&says(2.0)).richer, None);
}

#[test]
fn models_without_evidence_have_no_say() {
    let settings = ScoringSettings::default();
    let rule = Likelihood::new(&settings, &["ball", "hinge", "slide"]).expect("a rule");
    let mut findings = findings(&[("hinge", noise(HINGE, 250.0)), ("slide", noise(SLIDE, 900.0))]);
    findings.insert("ball".into(), Confidence::ONE.into());
    let verdict = rule.apply(&findings);
    assert_eq!((verdict.joint.as_str(), confidence(&verdict, "ball")), ("hinge", 0.0));
    assert_eq!(rule.apply(&Findings::new()), rule.ignorance());
    findings.retain(|name, _| name == "ball");
    assert_eq!(rule.apply(&findings), rule.ignorance());
}

#[test]
fn ignorance_spreads_evenly_and_is_named_after_what_explains_everything() {
    let ignorance = |models: &[&str]| Likelihood::new(&ScoringSettings::default(), models).expect("a rule").ignorance();
    let verdict = ignorance(&["ball", "disconnected", "hinge", "slide"]);
    assert_eq!((verdict.joint.as_str(), verdict.confidence, verdict.cost), ("disconnected", 0.25, None));
    assert!(verdict.confidences.iter().all(|(_, confidence)| *confidence == 0.25));
    assert_eq!(ignorance(&["free", "hinge"]).joint, "free");
    assert_eq!(ignorance(&["ball", "hinge"]).joint, "hinge");
}

#[test]
fn confidences_stand_in_one_order_whatever_the_models_say() {
    // A table has one head for all pairs.
    let rule = Likelihood::new(&ScoringSettings::default(), &["ball", "cylinder", "hinge"]).expect("a rule");
    let order = |verdict: &Verdict| verdict.confidences.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    let poses = [("ball", noise(BALL, 250.0)), ("cylinder", noise(CYLINDER, 250.0)), ("hinge", noise(HINGE, 250.0))];
    // Seen as a point, a ball has fewer parameters, and a cylinder says nothing.
    let point = [
        ("ball", noise(Mobility { parameters: 11, ..BALL }, 250.0)),
        ("hinge", noise(Mobility { parameters: 7, ..HINGE }, 250.0)),
    ];
    let expected = order(&rule.apply(&findings(&poses)));
    assert_eq!(order(&rule.apply(&findings(&point))), expected);
    assert_eq!(order(&rule.ignorance()), expected);
}

#[test]
fn bad_priors_are_refused_by_their_key() {
    let refused = |name: &str, prior: f64| {
        let error = Likelihood::new(&priors(&[(name, prior)]), &["hinge", "slide"]).expect_err("refused");
        assert_eq!(error.key, "priors");
        assert!(!error.help.is_empty());
        error.message
    };
    assert_eq!(refused("hing", 1.0), "a prior is given for `hing`, which is not among the models");
    for prior in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(refused("hinge", prior).contains("which is not a positive number"), "{prior}");
    }
    assert_eq!(Likelihood::new(&ScoringSettings::default(), &[]).expect_err("refused").key, "rule");
    assert_eq!(ScoringSettings::default().rule, RuleKind::Likelihood);
    let hinge = Announcement { name: "hinge", parts: &[], states_evidence: true };
    let rule = Rule::new(&ScoringSettings::default(), &[hinge]).expect("a rule");
    let verdict = rule.apply(&findings(&[("hinge", noise(HINGE, 1e9))])).expect("a verdict");
    assert_eq!((verdict.joint.as_str(), verdict.confidence), ("hinge", 1.0));
}

/// A number that is not negative: anywhere, at the ends, or next to them.
fn number() -> impl Strategy<Value = f64> {
    let edges = [0.0, f64::MIN_POSITIVE, 1e-300, f64::EPSILON, 1.0, 1e15, 1e100, 1e300];
    prop_oneof![3 => 0.0..1e4, 2 => (-12.0..12.0).prop_map(|e| 10_f64.powf(e)), 1 => prop::sample::select(edges.to_vec())]
}

fn mobility() -> impl Strategy<Value = Mobility> {
    (0..=3_u8, 0..=3_u8, 0..40_usize).prop_map(|(turns, slides, parameters)| Mobility {
        turns,
        slides,
        parameters,
        advances: false,
        roams: slides > 1,
    })
}

fn departure() -> impl Strategy<Value = Departure> {
    let infinite = prop_oneof![3 => number(), 1 => Just(f64::INFINITY)];
    (number(), infinite, number()).prop_map(|(squared, per_noise, adequate)| Departure { squared, per_noise, adequate })
}

fn evidence() -> impl Strategy<Value = Evidence> {
    let sign = prop::sample::select(vec![-1.0, 1.0]);
    let costs = (number(), number(), sign, -20.0..20.0);
    (costs, number(), number(), 1.0..1e3, mobility(), prop::option::of(departure())).prop_map(
        |(
            (chi_squared, configuration, sign, prior_cost),
            freedom,
            observations,
            correlation_time,
            mobility,
            departure,
        )| {
            let configuration_cost = sign * configuration;
            Evidence {
                chi_squared,
                freedom,
                configuration_cost,
                prior_cost,
                mobility,
                observations,
                correlation_time,
                departure,
            }
        },
    )
}

fn config() -> ProptestConfig {
    ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: RngSeed::Fixed(21), ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn confidences_lie_from_0_to_1_and_sum_to_1_whatever_the_evidence(
        all in prop::collection::vec(prop::collection::vec(evidence(), 0..3), 1..9),
        weights in prop::collection::vec(prop_oneof![Just(1.0), 1e-300..1e300], 9),
        temperature in 0.01..100.0,
    ) {
        let name = |model: usize| format!("joint {model}");
        let names: Vec<String> = (0..all.len()).map(name).collect();
        let priors = names.iter().cloned().zip(weights).collect();
        let settings = ScoringSettings { priors, temperature, ..ScoringSettings::default() };
        let rule = Likelihood::new(&settings, &names.iter().map(String::as_str).collect::<Vec<_>>()).expect("a rule");
        let finding = |evidence: &Vec<Evidence>| Finding { evidence: evidence.clone(), ..Confidence::ONE.into() };
        let verdict = rule.apply(&names.iter().cloned().zip(all.iter().map(finding)).collect());

        prop_assert_eq!(verdict.confidences.len(), all.len());
        let shares: Vec<f64> = verdict.confidences.iter().map(|(_, share)| *share).collect();
        prop_assert!(shares.iter().all(|share| (0.0..=1.0).contains(share)), "{:?}", shares);
        prop_assert!((shares.iter().sum::<f64>() - 1.0).abs() <= SUM, "{:?}", shares);
        prop_assert_eq!(verdict.confidence, confidence(&verdict, &verdict.joint));
        prop_assert!(shares.iter().all(|share| *share <= verdict.confidence));
        prop_assert!(verdict.cost.is_none_or(f64::is_finite));
        for (model, evidence) in all.iter().enumerate() {
            prop_assert!(!evidence.is_empty() || verdict.cost.is_none() || confidence(&verdict, &name(model)) == 0.0);
        }
    }

    #[test]
    fn a_cost_that_all_joints_share_changes_nothing(
        all in prop::collection::vec((mobility(), 0.0..1e3_f64, 0.0..100.0_f64), 1..9), shift in -1e3..1e3_f64,
    ) {
        let names: Vec<String> = (0..all.len()).map(|model| format!("joint {model}")).collect();
        let say = |shift: f64| {
            let one = |(name, (mobility, cost, squared)): (&String, &(Mobility, f64, f64))| {
                let evidence = Evidence { configuration_cost: shift, ..play(*mobility, *cost, *squared) };
                (name.clone(), Finding { evidence: vec![evidence], ..Confidence::ONE.into() })
            };
            names.iter().zip(&all).map(one).collect::<Findings>()
        };
        let borrowed: Vec<&str> = names.iter().map(String::as_str).collect();
        let rule = Likelihood::new(&ScoringSettings::default(), &borrowed).expect("a rule");
        let (before, after) = (rule.apply(&say(0.0)), rule.apply(&say(shift)));
        for name in borrowed {
            let [before, after] = [&before, &after].map(|verdict| confidence(verdict, name));
            prop_assert!((before - after).abs() <= ROUNDING, "{name}: {before} became {after}");
        }
    }
}
