//! The rule that is written in the configuration: what it concludes, what it refuses, and where.

use jointscope_models::{Confidence, Departure, Evidence, Mobility};
use jointscope_scoring::{
    Announcement, Cascade, Finding, Findings, Likelihood, Rule, RuleError, RuleKind, ScoringSettings, Verdict,
};
use proptest::{prelude::*, test_runner::RngSeed};

/// The thesis's cascade, equations (48)-(51), as expressions.
const THESIS: [(&str, &str); 3] = [
    ("rigid", "rigid"),
    ("prismatic", "(1 - rigid) * prismatic"),
    ("revolute", "(1 - rigid) * (1 - prismatic) * revolute"),
];

const MODELS: [Announcement<'_>; 3] = [
    Announcement { name: "rigid", parts: &[], states_evidence: false },
    Announcement { name: "prismatic", parts: &["cylinder_fit"], states_evidence: false },
    Announcement { name: "revolute", parts: &["circle_fit", "radius"], states_evidence: false },
];

/// Two models that state evidence, and one of the thesis's beside them.
const MIXED: [Announcement<'_>; 3] = [
    Announcement { name: "slide", parts: &[], states_evidence: true },
    Announcement { name: "hinge", parts: &[], states_evidence: true },
    Announcement { name: "thesis-hinge", parts: &["circle_fit"], states_evidence: false },
];

fn settings(expressions: &[(&str, &str)]) -> ScoringSettings {
    let expressions = expressions.iter().map(|(joint, text)| ((*joint).to_owned(), (*text).to_owned())).collect();
    ScoringSettings { rule: RuleKind::Expressions, expressions, ..ScoringSettings::default() }
}

fn normalised(expressions: &[(&str, &str)]) -> ScoringSettings {
    ScoringSettings { normalise: true, ..settings(expressions) }
}

fn rule(settings: &ScoringSettings) -> Rule {
    Rule::new(settings, &MODELS).unwrap_or_else(|error| panic!("{error:?}"))
}

fn says(confidence: f64) -> Finding {
    Confidence::new(confidence).expect("in range").into()
}

fn findings([rigid, prismatic, revolute]: [f64; 3]) -> Findings {
    [("rigid", rigid), ("prismatic", prismatic), ("revolute", revolute)].map(|(n, c)| (n.to_owned(), says(c))).into()
}

fn confidence(verdict: &Verdict, joint: &str) -> f64 {
    verdict.confidences.iter().find(|(name, _)| name == joint).expect("a joint").1
}

/// The message, the help, and what of the joint's text is pointed at.
fn refused<'t>(settings: &'t ScoringSettings, models: &[Announcement<'_>]) -> (String, String, Option<&'t str>) {
    let error = Rule::new(settings, models).expect_err("refused");
    let place = error.entry.as_ref().zip(error.within).map(|(joint, within)| &settings.expressions[joint][within]);
    (error.message, error.help, place)
}

#[test]
fn values_are_confidences_and_the_rest_is_what_remains() {
    let verdict = rule(&settings(&THESIS)).apply(&findings([0.2, 0.5, 0.75])).expect("a verdict");
    for (joint, expected) in [("rigid", 0.2), ("prismatic", 0.4), ("revolute", 0.3), ("disconnected", 0.1)] {
        assert!((confidence(&verdict, joint) - expected).abs() < 1e-15, "{verdict:?}");
    }
    let names: Vec<&str> = verdict.confidences.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["rigid", "prismatic", "revolute", "disconnected"], "the usual order, not the alphabet's");
    assert_eq!(verdict.joint, "prismatic");
    assert_eq!(verdict.doubts, ["revolute (0.300) is nearly as likely as prismatic (0.400)"]);
}

#[test]
fn normalised_values_are_weights() {
    let weights = normalised(&[("rigid", "3 * rigid"), ("other", "prismatic + revolute")]);
    let verdict = rule(&weights).apply(&findings([0.5, 0.25, 0.25])).expect("a verdict");
    assert_eq!((confidence(&verdict, "rigid"), confidence(&verdict, "other")), (0.75, 0.25));
    assert_eq!(confidence(&verdict, "disconnected"), 0.0);
    let nothing = rule(&weights).apply(&findings([0.0; 3])).expect("a verdict");
    assert_eq!((nothing.joint.as_str(), nothing.confidence), ("disconnected", 1.0));
}

#[test]
fn parts_are_named_and_a_part_that_is_not_given_leaves_doubt() {
    let by_part = rule(&settings(&[("revolute", "min(revolute.circle_fit, 1 - rigid) * (1 - prismatic)")]));
    let mut found = findings([0.25, 0.0, 1.0]);
    let missing = by_part.apply(&found).expect("a verdict");
    assert_eq!(missing.joint, "disconnected");
    assert!(missing.doubts.iter().any(|doubt| doubt.contains("`revolute.circle_fit`")), "{:?}", missing.doubts);
    found.get_mut("revolute").expect("there").parts.insert("circle_fit", 0.5);
    let verdict = by_part.apply(&found).expect("a verdict");
    assert_eq!(confidence(&verdict, "revolute"), 0.5);
}

#[test]
fn values_that_are_no_confidences_point_at_the_term() {
    let at = |expressions: &[(&str, &str)], found: [f64; 3]| {
        let settings = settings(expressions);
        let error: RuleError = rule(&settings).apply(&findings(found)).expect_err("refused");
        let joint = error.entry.expect("a joint");
        (error.message, error.help, settings.expressions[&joint][error.within.expect("a place")].to_owned())
    };
    let all = "prismatic + revolute";
    let (message, help, place) = at(&[("rigid", "0.1 + 1 / rigid"), ("other", all)], [0.0; 3]);
    assert_eq!((message.as_str(), place.as_str()), ("the value of `rigid` is inf, not a finite number", "1 / rigid"));
    assert!(help.contains("0.1 + 1 / 0.000"), "{help}");
    let (message, _, place) = at(&[("rigid", "rigid - 0.5"), ("other", all)], [0.25, 0.0, 0.0]);
    assert_eq!((message.as_str(), place.as_str()), ("the value of `rigid` is -0.250, less than 0", "rigid - 0.5"));
    let (message, help, _) = at(&[("rigid", "rigid"), ("other", all)], [0.5, 0.5, 0.5]);
    assert_eq!(message, "the expressions sum to 1.500: rigid 0.500, other 1.000");
    assert!(help.contains("normalise = true"), "{help}");
}

#[test]
fn what_makes_no_rule_is_refused_with_its_place() {
    let with = |text| settings(&[("rigid", "rigid + 0 * prismatic + 0 * revolute"), ("hinge", text)]);
    for (text, message, place) in [
        ("1 - screw", "`screw` is not among the models", "screw"),
        ("revolute.circlefit", "the model `revolute` has no part `circlefit`", "revolute.circlefit"),
        ("(revolute", "this parenthesis is never closed", "("),
        (
            "revolute.likelihood",
            "the model `revolute` states no evidence, so it has no likelihood",
            "revolute.likelihood",
        ),
    ] {
        let settings = with(text);
        let (found, help, at) = refused(&settings, &MODELS);
        assert_eq!((found.as_str(), at), (message, Some(place)));
        assert!(!help.is_empty());
    }
    let hyphen = settings(&[("hinge", "thesis-hinge")]);
    assert!(refused(&hyphen, &MIXED).1.contains("back-quotes: `thesis-hinge`"));
    let message = |settings: &ScoringSettings| refused(settings, &MODELS).0;
    assert_eq!(message(&settings(&[])), "the rule \"expressions\" has no expressions");
    assert!(message(&settings(&THESIS[..2])).contains("the model `revolute` is in no expression"));
    assert!(message(&ScoringSettings { otherwise: "rigid".into(), ..settings(&THESIS) }).contains("what remains of 1"));
    assert!(message(&ScoringSettings { otherwise: " ".into(), ..settings(&THESIS) }).contains("has no name"));
    let priors = [("rigid".to_owned(), 2.0)].into();
    assert!(message(&ScoringSettings { priors, ..settings(&THESIS) }).contains("priors count where"));
}

fn evidence(parameters: usize, turns: u8, slides: u8, chi_squared: f64) -> Evidence {
    Evidence {
        chi_squared,
        freedom: 100.0,
        configuration_cost: 0.0,
        prior_cost: 0.0,
        mobility: Mobility { turns, slides, parameters, advances: false, roams: false },
        observations: 100.0,
        correlation_time: 1.0,
        departure: None,
    }
}

#[test]
fn thesis_confidences_can_be_priors_for_evidence() {
    let expressions = [
        ("slide", "slide.likelihood * (1 - `thesis-hinge`)"),
        ("hinge", "hinge.likelihood * `thesis-hinge`.circle_fit"),
    ];
    let settings = normalised(&expressions);
    let rule = Rule::new(&settings, &MIXED).expect("a rule");
    assert!(rule.compares_evidence());
    let mut found = Findings::new();
    found.insert("slide".into(), Finding { evidence: vec![evidence(9, 0, 1, 101.0)], ..says(1.0) });
    found.insert("hinge".into(), Finding { evidence: vec![evidence(9, 1, 0, 100.0)], ..says(1.0) });
    found.insert("thesis-hinge".into(), Finding { parts: [("circle_fit", 0.9)].into(), ..says(0.8) });
    let by_evidence = Likelihood::new(&ScoringSettings::default(), &["slide", "hinge"]).expect("a rule").apply(&found);
    let verdict = rule.apply(&found).expect("a verdict");
    let [slide, hinge] = ["slide", "hinge"].map(|joint| confidence(&by_evidence, joint));
    let expected = hinge * 0.9 / (hinge * 0.9 + slide * 0.2);
    assert!((confidence(&verdict, "hinge") - expected).abs() < 1e-12, "{verdict:?}");
    assert_eq!(verdict.cost, by_evidence.cost);
    let explanation = rule.explain(&found).expect("an explanation");
    assert!(explanation.accounts.iter().any(|account| account.arithmetic.contains("0.900")), "{explanation:?}");
}

#[test]
fn the_likelihood_of_a_model_is_what_the_rule_likelihood_says() {
    let settings = settings(&[("slide", "slide.likelihood"), ("hinge", "hinge.likelihood + 0 * `thesis-hinge`")]);
    let mut found = Findings::new();
    found.insert("slide".into(), Finding { evidence: vec![evidence(9, 0, 1, 104.0)], ..says(1.0) });
    found.insert("hinge".into(), Finding { evidence: vec![evidence(9, 1, 0, 100.0)], ..says(1.0) });
    let verdict = Rule::new(&settings, &MIXED).expect("a rule").apply(&found).expect("a verdict");
    let by_evidence = Likelihood::new(&ScoringSettings::default(), &["slide", "hinge"]).expect("a rule").apply(&found);
    for joint in ["slide", "hinge"] {
        assert!((confidence(&verdict, joint) - confidence(&by_evidence, joint)).abs() < 1e-15);
    }
}

fn share() -> impl Strategy<Value = f64> {
    prop_oneof![4 => 0.0..=1.0, 1 => prop::sample::select(vec![0.0, 1.0, f64::MIN_POSITIVE, 1.0 - f64::EPSILON, 0.5])]
}

/// Arithmetic that may well go wrong.
fn expression() -> impl Strategy<Value = String> {
    let leaf =
        prop::sample::select(vec!["rigid", "prismatic", "revolute", "1", "0.5", "0", "2"]).prop_map(String::from);
    leaf.prop_recursive(4, 16, 2, |inner| {
        let operator = prop::sample::select(vec!["+", "-", "*", "/", "^"]);
        let pair = (inner.clone(), operator, inner.clone()).prop_map(|(a, o, b)| format!("({a} {o} {b})"));
        let call = (prop::sample::select(vec!["exp", "ln", "sqrt", "abs", "-"]), inner.clone());
        let call = call.prop_map(|(function, a)| format!("{function}({a})"));
        let choice = (inner.clone(), inner).prop_map(|(a, b)| format!("max({a}, min({b}, 1))"));
        prop_oneof![3 => pair, 1 => call, 1 => choice]
    })
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 500, failure_persistence: None, rng_seed: RngSeed::Fixed(4851), ..ProptestConfig::default()
    })]

    #[test]
    fn the_cascade_and_its_expressions_are_equal(says in [share(), share(), share()]) {
        let found = findings(says);
        let ours = rule(&settings(&THESIS)).apply(&found).expect("a verdict");
        let thesis = Cascade::new(&ScoringSettings::default(), &["rigid", "prismatic", "revolute"]).expect("a rule").apply(&found);
        for (joint, expected) in &thesis.confidences {
            prop_assert!((confidence(&ours, joint) - expected).abs() <= 1e-15, "{ours:?} {thesis:?}");
        }
    }

    #[test]
    fn confidences_are_shares_that_sum_to_1_or_the_mistake_has_a_place(
        says in [share(), share(), share()],
        texts in [expression(), expression()],
        normalise in any::<bool>(),
    ) {
        let used = format!("{} + 0 * (rigid + prismatic + revolute)", texts[0]);
        let settings = ScoringSettings { normalise, ..settings(&[("a", &used), ("b", &texts[1])]) };
        let rule = rule(&settings);
        match rule.apply(&findings(says)) {
            Ok(verdict) => {
                let sum: f64 = verdict.confidences.iter().map(|(_, share)| share).sum();
                prop_assert!((sum - 1.0).abs() < 1e-9, "{verdict:?}");
                prop_assert!(verdict.confidences.iter().all(|(_, share)| (0.0..=1.0).contains(share)), "{verdict:?}");
                let greatest = verdict.confidences.iter().map(|(_, share)| *share).fold(0.0, f64::max);
                prop_assert_eq!(verdict.confidence, greatest);
                let explanation = rule.explain(&findings(says)).expect("explained");
                for (account, (joint, share)) in explanation.accounts.iter().zip(&verdict.confidences) {
                    prop_assert_eq!((&account.joint, account.values[1]), (joint, Some(*share)));
                }
            }
            Err(error) => {
                prop_assert!(!error.message.is_empty() && !error.help.is_empty());
                if let Some(within) = error.within.clone() {
                    let text = &settings.expressions[error.entry.as_ref().expect("a joint")];
                    prop_assert!(text.get(within).is_some_and(|place| !place.is_empty()), "{error:?}");
                }
            }
        }
    }

    #[test]
    fn any_text_is_read_or_refused_with_a_place(text in "[a-z0-9 .,()+*/^`é-]{0,30}|.{0,20}|(rigid|\\(|\\)|-|\\*|1e9|\\.|min\\(|,| ){0,12}") {
        let settings = settings(&[("a", "0 * (rigid + prismatic + revolute)"), ("b", &text)]);
        if let Err(error) = Rule::new(&settings, &MODELS) {
            prop_assert!(!error.message.is_empty() && !error.help.is_empty());
            prop_assert!(error.within.is_none_or(|within| text.get(within).is_some()));
        }
    }

    #[test]
    fn the_steps_of_a_cascade_give_its_confidences(says in [share(), share(), share()]) {
        let cascade = Cascade::new(&ScoringSettings::default(), &["rigid", "prismatic", "revolute"]).expect("a rule");
        let (verdict, explanation) = (cascade.apply(&findings(says)), cascade.explain(&findings(says)));
        for (account, (joint, share)) in explanation.accounts.iter().zip(&verdict.confidences) {
            prop_assert_eq!(&account.joint, joint);
            let [said, left, confidence] = account.values[..] else { panic!("three steps") };
            prop_assert_eq!(confidence, Some(*share));
            prop_assert!((left.unwrap_or(0.0) * said.unwrap_or(1.0) - share).abs() <= 1e-15);
        }
    }
}

#[test]
fn the_steps_of_a_likelihood_give_its_costs() {
    let mut found = Findings::new();
    found.insert("slide".into(), Finding { evidence: vec![evidence(9, 0, 1, 104.0)], ..says(1.0) });
    found.insert("hinge".into(), Finding { evidence: vec![evidence(11, 1, 0, 100.0)], ..says(1.0) });
    found.insert("silent".into(), says(1.0));
    let priors = [("hinge".to_owned(), 3.0)].into();
    let settings = ScoringSettings { priors, ..ScoringSettings::default() };
    let rule = Likelihood::new(&settings, &["slide", "hinge", "silent"]).expect("a rule");
    let (verdict, explanation) = (rule.apply(&found), rule.explain(&found));
    let place = |name: &str| explanation.quantities.iter().position(|q| q.name == name).expect("a quantity");
    for account in &explanation.accounts {
        let value = |name: &str| account.values[place(name)];
        assert_eq!(value("confidence"), Some(confidence(&verdict, &account.joint)));
        if account.joint == "silent" {
            assert_eq!(value("cost"), None);
            continue;
        }
        let part = |name: &str| value(name).expect("a value");
        let cost = part("charge") + part("parameters") * part("ln_observations") + part("prior_cost") + part("prior");
        assert!((part("cost") - cost).abs() < 1e-12);
        assert_eq!(part("noise_cost"), (part("chi_squared") + part("configuration_cost")) / part("correlation_time"));
    }
    assert!(explanation.reasons[0].starts_with("slide costs least") || explanation.reasons[0].starts_with("hinge"));
    assert_eq!(explanation.reasons.len(), 2 + verdict.doubts.len());
}

#[test]
fn the_charge_of_play_follows_from_the_steps_before_it() {
    let departure = |squared, per_noise| Some(Departure { squared, per_noise, adequate: 25.0 });
    let mut found = Findings::new();
    let slide = Evidence { departure: departure(9.0, 100.0), ..evidence(9, 0, 1, 900.0) };
    let hinge = Evidence { departure: departure(0.5, 10.0), ..evidence(11, 1, 0, 400.0) };
    found.insert("slide".into(), Finding { evidence: vec![slide], ..says(1.0) });
    found.insert("hinge".into(), Finding { evidence: vec![hinge], ..says(1.0) });
    found.insert("free".into(), Finding { evidence: vec![evidence(18, 3, 3, 100.0)], ..says(1.0) });
    let rule = Likelihood::new(&ScoringSettings::default(), &["slide", "hinge", "free"]).expect("a rule");
    let explanation = rule.explain(&found);
    let place = |name: &str| explanation.quantities.iter().position(|q| q.name == name).expect("a quantity");
    for account in explanation.accounts.iter().filter(|account| account.joint != "free") {
        let part = |name: &str| account.values[place(name)].expect("a value");
        let x = part("by_noise");
        let y = part("departure").max(x / part("per_noise"));
        let y = y * (1.0 + y / 60.0);
        assert!((part("charge") - x * y / (x + y)).abs() < 1e-9 * x, "{account:?}");
    }
}
