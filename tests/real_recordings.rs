//! Every real recording goes through the program, the page about them is true, and the likelihood models judge them well.

use std::{path::Path, process::Command, sync::LazyLock};

use jointscope_tests::real::{self, EXPLANATIONS, Outcome, Truth};

const PROJECT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// What comes out of all cases; nothing where the recordings are absent.
static OUTCOMES: LazyLock<Vec<Outcome>> =
    LazyLock::new(|| real::folder().map(|folder| real::outcomes(&folder)).unwrap_or_default());

/// The names of the cases whose likelihood verdict is such.
fn those(condition: impl Fn(&Outcome) -> bool) -> Vec<&'static str> {
    OUTCOMES.iter().filter(|outcome| condition(outcome)).map(|outcome| outcome.case.name.as_str()).collect()
}

fn is_certain(outcome: &Outcome) -> bool {
    matches!(outcome.case.truth, Truth::Joint(_))
}

fn is_missed(outcome: &Outcome) -> bool {
    outcome.case.truth.agrees(&outcome.likelihood) == Some(false)
}

#[test]
fn the_program_analyses_every_recording_that_it_reads() {
    let Some(folder) = real::folder() else { return };
    let configurations = tempfile::tempdir().expect("a temporary folder");
    let thesis = std::fs::read_to_string(Path::new(PROJECT).join("configs/thesis.toml")).expect("the thesis's");
    let cases: Vec<_> = real::cases(&folder).into_iter().filter(|case| case.configuration().is_some()).collect();
    assert_eq!(
        cases.len(),
        13 + 36 + 2 + 9 + 4 + 4,
        "the kitchen, single points, the rectangle detector, C3D, Qualisys"
    );
    for (number, case) in cases.into_iter().enumerate() {
        let configuration = case.configuration().expect("read by the program");
        let is_single = configuration.is_empty() || configuration.lines().count() == 2;
        let path = configurations.path().join(format!("{number}.toml"));
        std::fs::write(&path, format!("{thesis}\n{configuration}")).expect("written");
        let output = Command::new(env!("CARGO_BIN_EXE_jointscope-with-common-centre"))
            .args(["run", "--format", "json", "--config"])
            .arg(path)
            .arg("--input")
            .arg(&case.path)
            .output()
            .expect("the program starts");
        assert!(output.status.success(), "{}: {}", case.name, String::from_utf8_lossy(&output.stderr));
        let detection: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let pair = &detection["pairs"][0];
        assert_eq!(pair["reference"] == "world", is_single, "{}", case.name);
        let confidences = pair["confidences"].as_object().expect("confidences");
        let sum: f64 = confidences.values().filter_map(serde_json::Value::as_f64).sum();
        assert!((sum - 1.0).abs() < 1e-12, "{}: confidences sum to {sum}", case.name);
    }
}

#[test]
fn the_joints_of_56_pairs_are_certain() {
    let Some(folder) = real::folder() else { return };
    let cases = real::cases(&folder);
    let count = |truth: fn(Truth) -> bool| cases.iter().filter(|case| truth(case.truth)).count();
    assert_eq!(count(|truth| matches!(truth, Truth::Joint(_))), 56);
    assert_eq!(count(|truth| truth == Truth::Undecidable), 5);
    assert_eq!(count(|truth| matches!(truth, Truth::Not(_))), 2);
}

#[test]
fn the_page_about_them_shows_what_comes_out() {
    if real::folder().is_none() {
        return;
    }
    let page = std::fs::read_to_string(Path::new(PROJECT).join("docs/real-recordings.md")).expect("the page");
    assert!(page == real::page(&OUTCOMES), "docs/real-recordings.md is out of date; it says how to write it anew");
}

#[test]
fn every_miss_of_the_likelihood_models_and_nothing_else_is_explained() {
    if real::folder().is_none() {
        return;
    }
    let mut explained: Vec<&str> = EXPLANATIONS.iter().map(|(case, _)| *case).collect();
    let mut missed = those(is_missed);
    explained.sort_unstable();
    missed.sort_unstable();
    assert_eq!(missed, explained, "missed on the left, explained on the right");
}

#[test]
fn the_likelihood_models_find_all_but_two_certain_joints() {
    let missed = those(|outcome| is_certain(outcome) && is_missed(outcome));
    assert!(missed.len() <= 2, "{missed:?}");
}

#[test]
fn the_likelihood_models_are_sure_of_at_most_one_wrong_joint() {
    let sure = those(|outcome| is_certain(outcome) && is_missed(outcome) && outcome.likelihood.determined);
    assert!(sure.len() <= 1, "{sure:?}");
}

#[test]
fn the_likelihood_models_do_not_decide_the_undecidable() {
    assert_eq!(those(|outcome| outcome.case.truth == Truth::Undecidable && is_missed(outcome)), [""; 0]);
}

#[test]
fn the_likelihood_models_do_not_make_a_hinge_of_markers_on_a_line() {
    assert_eq!(those(|outcome| matches!(outcome.case.truth, Truth::Not(_)) && is_missed(outcome)), [""; 0]);
}

#[test]
fn the_likelihood_models_are_never_sure_of_a_hinge_that_is_a_slider_of_a_kitchen_or_the_reverse() {
    let confused = |outcome: &Outcome| {
        let found = outcome.likelihood.verdict.joint.as_str();
        let pair = (outcome.case.truth, found);
        let opposite = [(Truth::Joint("prismatic"), "revolute"), (Truth::Joint("revolute"), "prismatic")];
        outcome.likelihood.determined && opposite.contains(&pair)
    };
    assert_eq!(those(|outcome| outcome.case.name.starts_with("tum_") && confused(outcome)), [""; 0]);
}
