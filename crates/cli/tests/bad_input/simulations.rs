//! Simulations, and the golden files.

use std::fs;
use std::path::Path;

use crate::place::{DATA, Place, USAGE, door, json};

#[test]
fn a_simulation_is_written_with_its_truth_and_can_be_read() {
    let place = Place::new();
    for recording in ["deep/r.csv", "deep/r.npz"] {
        let told = format!("{recording}: 2 bodies, 40 frames; what is true of them: deep/truth.json\n");
        assert_eq!(place.done(&["simulate", "door", "--out", recording, "--frames", "40"]), told);
    }
    assert_eq!(json(&fs::read_to_string(place.path("deep/truth.json")).expect("the truth"))["scene"], "door");
    place.write("c.toml", "");
    let [csv, npz] =
        ["deep/r.csv", "deep/r.npz"].map(|path| place.done(&["run", "--config", "c.toml", "--input", path]));
    assert_eq!(csv, npz);
}

#[test]
fn a_simulation_of_poses_is_written_and_can_be_read() {
    let place = Place::new();
    let imperfect = ["--axis-distance", "0.7", "--bend", "0.02", "--filter", "1", "--flips", "0.1"];
    let poses = ["--poses", "--rotation-noise", "0.02", "--drift", "0.5", "--play", "0.001", "--body-size", "0.2"];
    place.done(&[&["simulate", "universal", "--out", "r.csv"], &imperfect[..], &poses].concat());
    let header = fs::read_to_string(place.path("r.csv")).expect("the recording");
    assert!(header.lines().next().is_some_and(|line| line.contains("qw")));
    let truth = json(&fs::read_to_string(place.path("truth.json")).expect("the truth"));
    assert_eq!((&truth["options"]["poses"], &truth["options"]["flips"]), (&true.into(), &0.1.into()));
    place.write("c.toml", "");
    place.done(&["run", "--config", "c.toml", "--input", "r.csv"]);
}

#[test]
fn a_simulation_takes_a_shape_by_its_name() {
    let place = Place::new();
    place.done(&["simulate", "revolute", "--out", "r.csv", "--body-shape", "near-line", "--skin", "0.002"]);
    let truth = json(&fs::read_to_string(place.path("truth.json")).expect("the truth"));
    assert_eq!((&truth["options"]["body_shape"], &truth["options"]["skin"]), (&"near-line".into(), &0.002.into()));
}

#[test]
fn a_simulation_does_not_take_the_truth_of_another_recording() {
    let place = Place::new();
    place.done(&["simulate", "door", "--out", "a.csv", "--frames", "20"]);
    place.refused(
        &["simulate", "fridge", "--out", "b.csv", "--frames", "20"],
        DATA,
        &["true of another recording", "folder"],
    );
    place.done(&["simulate", "fridge", "--out", "a.csv", "--frames", "20"]);
}

#[test]
fn a_simulation_needs_a_place_and_an_extension_that_tells_the_format() {
    let place = Place::with(door());
    for out in ["x.log", "x.xyz", "x"] {
        let message = [&*format!("{out}: a scene is written as csv or npz"), "`.csv` or `.npz`"];
        place.refused(&["simulate", "door", "--out", out], USAGE, &message);
    }
    let message = ["r.csv: cannot be written", "a file is where a folder is needed"];
    place.refused(&["simulate", "door", "--out", "r.csv/x.csv"], DATA, &message);
    fs::create_dir(place.path("folder.csv")).expect("made");
    let message = ["folder.csv: cannot be written", "a folder has this name"];
    place.refused(&["simulate", "door", "--out", "folder.csv"], DATA, &message);
    fs::create_dir(place.path("truth.json")).expect("made");
    let message = ["truth.json: cannot be written", "a folder has this name"];
    place.refused(&["simulate", "door", "--out", "x.csv"], DATA, &message);
}

#[test]
fn simulation_options_out_of_range_are_named_as_they_were_typed() {
    let place = Place::new();
    let refused = |options: &[&str], message: &[&str]| {
        place.refused(&[&["simulate", "revolute", "--out", "r.csv"], options].concat(), USAGE, message);
    };
    for (option, value, range) in [
        ("--frames", "1", "2 to 1000000"),
        ("--features", "0", "1 to 10000"),
        ("--noise", "-1", "0 to 10 m"),
        ("--noise", "NaN", "0 to 10 m"),
        ("--depth-noise", "-1", "0 to"),
        ("--dropout", "1", "at least 0 and less than 1"),
        ("--outlier-features", "1.5", "0 to 1"),
        ("--outlier-samples", "-0.1", "0 to 1"),
        ("--sweep-deg", "0", "0.000001 to 36000 degrees"),
        ("--travel", "11", "0.000001 to 10 m"),
        ("--drift", "1", "at least 0 and less than 1"),
        ("--body-size", "0", "0.000001 to 10 m"),
        ("--axis-distance", "-1", "0 to 10 m"),
        ("--play", "-0.1", "0 to 10 m"),
        ("--bend", "0.6", "0 to 0.5"),
        ("--skin", "-0.01", "0 to 10 m"),
        ("--filter", "1001", "0 to 1000 frames"),
        ("--rotation-noise", "4", "0 to 3 rad"),
        ("--flips", "-0.1", "0 to 1"),
        ("--scale", "0", "0.01 to 100"),
        ("--depth-gain", "-0.6", "0.01 to 100"),
    ] {
        refused(&[option, value], &[&*format!("{option} must be {range}"), &*format!("found {value}")]);
    }
    refused(&["--frames", "many"], &["invalid value 'many' for '--frames <FRAMES>'"]);
    refused(&["--seed", "-1"], &["invalid value '-1' for '--seed <SEED>'"]);
    refused(&["--body-shape", "round"], &["invalid value 'round' for '--body-shape <SHAPE>'", "near-line"]);
    refused(&["--poses", "--features", "4"], &["--features is about tracked features", "leave out --poses"]);
    refused(&["--rotation-noise", "0.1"], &["--rotation-noise is about tracked poses", "add --poses"]);
    refused(&["--monocular"], &["--monocular does not apply to scene `revolute`", "leave it out"]);
    let message = ["--features must be at least 1, and at most 10 million samples per body", "found 10000"];
    refused(&["--frames", "1000000", "--features", "10000"], &message);
    let fast = ["--sweep-deg", "36000", "--frames", "10"];
    refused(&fast, &["from one frame to the next", "raise --frames or lower --sweep-deg"]);
    let gone = ["--dropout", "0.999", "--features", "1", "--frames", "2"];
    refused(&gone, &["lost all its samples", "lower --dropout"]);
}

#[test]
fn the_last_seed_there_is_can_be_reproduced() {
    let place = Place::new();
    let last = u64::MAX.to_string();
    let table = place.done(&["reproduce", "table2", "--runs", "2", "--seed", &last]);
    assert!(table.contains("2 runs each"), "{table}");
    place.refused(&["reproduce", "table2", "--runs", "0"], USAGE, &["invalid value '0' for '--runs <RUNS>'"]);
}

#[test]
fn golden_files_name_no_place_of_a_machine() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut checked = 0;
    for entry in fs::read_dir(folder.join("tests/golden")).expect("golden files") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|extension| extension == "trycmd") {
            let text = fs::read_to_string(&path).expect("text");
            assert!(!text.contains(&*folder.to_string_lossy()) && !text.contains('\u{1b}'), "{}", path.display());
            checked += 1;
        }
    }
    assert!(checked > 0);
}
