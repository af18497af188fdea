//! A joint model written outside the project's crates is listed, explained, and takes part in a run.

use std::process::{Command, Output};

fn program(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_jointscope-with-common-centre"))
        .args(arguments)
        .output()
        .expect("the program starts")
}

fn text(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

#[test]
fn it_is_listed_with_its_crate_and_explained_with_its_settings() {
    let list = text(&program(&["models"]));
    let line = list.lines().find(|line| line.contains("common-centre")).expect("its line");
    assert!(line.contains("jointscope-tests") && line.contains("features keep their distances from one point"));
    let explanation = text(&program(&["models", "common-centre"]));
    assert!(explanation.contains("tolerance = 0.02") && explanation.contains("0 < x"), "{explanation}");
}

#[test]
fn it_takes_part_in_a_run_and_wins_on_its_own_motion() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let config = folder.path().join("ball.toml");
    let text_of = |scene: &str| {
        format!(
            "[recording]\nscene = '{scene}'\nnoise = 0.0005\n[models.rigid]\nkind = 'thesis-rigid'\n\
             [models.spherical]\nkind = 'common-centre'\n[scoring]\nrule = 'cascade'\norder = ['rigid', 'spherical']"
        )
    };
    let verdict = |scene: &str| {
        std::fs::write(&config, text_of(scene)).expect("written");
        let json = text(&program(&["run", "--format", "json", "--config", &config.to_string_lossy()]));
        let detection: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        let pair = detection["pairs"][0].clone();
        assert!(pair["models"]["spherical"]["parts"]["mean_distance"].is_f64(), "{pair}");
        (pair["joint"].as_str().expect("a joint").to_owned(), pair["axis"].clone())
    };
    let (joint, axis) = verdict("spherical");
    assert_eq!(joint, "spherical");
    assert!(axis["point"].is_array() && axis["direction"].is_null(), "a spherical joint has a centre only: {axis}");
    assert_eq!(verdict("disconnected").0, "disconnected");
}
