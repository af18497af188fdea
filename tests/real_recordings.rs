//! Every real recording that is readable so far goes through the program, and the page about them is true.

use std::{path::Path, process::Command};

use jointscope_tests::real;

const PROJECT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

#[test]
fn the_program_analyses_every_pose_log_and_point_log() {
    let Some(folder) = real::folder() else { return };
    let recordings = real::recordings(&folder);
    assert_eq!(recordings.len(), 13 + 36, "the recordings of the kitchen and of single points");
    for recording in recordings {
        let output = Command::new(env!("CARGO_BIN_EXE_jointscope-with-common-centre"))
            .args(["run", "--format", "json", "--config"])
            .arg(Path::new(PROJECT).join("configs/thesis.toml"))
            .arg("--input")
            .arg(&recording.path)
            .output()
            .expect("the program starts");
        assert!(output.status.success(), "{}: {}", recording.name, String::from_utf8_lossy(&output.stderr));
        let detection: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let pair = &detection["pairs"][0];
        assert_eq!(pair["reference"], "world", "{}", recording.name);
        let confidences = pair["confidences"].as_object().expect("confidences");
        let sum: f64 = confidences.values().filter_map(serde_json::Value::as_f64).sum();
        assert!((sum - 1.0).abs() < 1e-12, "{}: confidences sum to {sum}", recording.name);
    }
}

#[test]
fn the_page_about_them_shows_what_comes_out() {
    let Some(folder) = real::folder() else { return };
    let page = std::fs::read_to_string(Path::new(PROJECT).join("docs/real-recordings.md")).expect("the page");
    assert!(page == real::page(&folder), "docs/real-recordings.md is out of date; it says how to write it anew");
}
