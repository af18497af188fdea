//! What `evaluate` prints, and what it refuses.

use std::process::{Command, Output};

/// A row of one scene, in few runs.
const TINY: [&str; 6] = ["evaluate", "A2", "--seeds", "2", "--no-times", "--quiet"];

fn jointscope(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_jointscope"))
        .args(arguments)
        .env("NO_COLOR", "1")
        .output()
        .expect("the program starts")
}

fn printed(arguments: &[&str]) -> String {
    let output = jointscope(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

fn tiny(further: &[&str]) -> String {
    printed(&[&TINY, further].concat())
}

/// The refusal's message; nothing else is printed.
fn refused(arguments: &[&str]) -> String {
    let output = jointscope(arguments);
    assert_eq!((output.status.code(), output.stdout.as_slice()), (Some(2), b"".as_slice()), "{arguments:?}");
    String::from_utf8(output.stderr).expect("UTF-8")
}

#[test]
fn unknown_rows_are_refused_with_the_known_ones_and_the_nearest() {
    let message = refused(&["evaluate", "A1", "A19"]);
    assert!(message.contains("unknown row `A19`") && message.contains("did you mean `A1"), "{message}");
    assert!(message.contains("`A21`, `P`, `B`, `S`"), "{message}");
}

#[test]
fn the_list_names_every_row_and_evaluates_none() {
    let list = printed(&["evaluate", "--list"]);
    for name in ["A1", "A12", "A13", "A14", "A15", "A16", "A17", "A18", "A21", "P", "B", "S"] {
        assert!(list.lines().any(|line| line.split_whitespace().next() == Some(name)), "{name}: {list}");
    }
    let one = printed(&["evaluate", "a7", "--list", "--seeds", "3"]);
    assert_eq!(one.lines().count(), 2, "{one}");
    // Seven conditions of eight types.
    assert!(one.contains("A7") && one.contains("168"), "{one}");
}

#[test]
fn text_and_page_hold_the_same_tables() {
    let (text, page) = (tiny(&[]), tiny(&["--format", "markdown"]));
    assert!(text.starts_with("seeds 1 to 2\n") && text.contains("\nA2  nominal scene, revolute axis\n"), "{text}");
    let table = |text: &str| text.lines().filter(|line| line.starts_with('|')).count();
    assert!(table(&text) > 6 && table(&text) == table(&page), "{text}{page}");
    for line in text.lines().filter(|line| line.starts_with('|')) {
        assert!(page.contains(line), "{line}");
    }
    assert!(page.starts_with("# Accuracy\n") && page.contains("](accuracy.svg)"), "{page}");
    for command in [
        "jointscope evaluate A2 --seeds 2 --first-seed 1 --no-times --format markdown > accuracy.md",
        "jointscope evaluate --seeds 2 --first-seed 1 --format svg > accuracy.svg",
    ] {
        assert!(page.contains(command), "{page}");
    }
}

#[test]
fn the_result_hangs_on_nothing_but_seeds() {
    let json = |threads| tiny(&["--format", "json", "--threads", threads]);
    let (one, two) = (json("1"), json("2"));
    assert_eq!(one, two);
    assert_ne!(one, tiny(&["--format", "json", "--first-seed", "2"]));
    let value: serde_json::Value = serde_json::from_str(&one).expect("JSON");
    assert_eq!((&value["format"], &value["seeds"]), (&"jointscope-evaluation".into(), &2.into()));
    assert_eq!(value["columns"], serde_json::json!(["likelihood", "thesis"]));
    let scores = &value["rows"][0]["cells"][0]["columns"][1];
    assert!(scores["scores"]["angle"]["value"].is_f64() && scores.get("milliseconds").is_none(), "{scores}");
    let goal = &value["rows"][0]["goals"][0];
    assert_eq!((&goal["measure"], &goal["must"]["at_most"]), (&"angle".into(), &1.35.into()));
    assert_eq!(goal["columns"].as_array().map(Vec::len), Some(2));
}

#[test]
fn configurations_of_ones_own_are_the_columns() {
    let thesis = concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs/thesis.toml");
    let door = concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs/door.toml");
    let text = tiny(&["--config", thesis, "--config", door]);
    assert!(text.contains("| thesis ") && text.contains("| door ") && !text.contains("likelihood"), "{text}");
    let missing = refused(&["evaluate", "--config", "no-such.toml"]);
    assert!(missing.contains("no-such.toml: the configuration cannot be read"), "{missing}");
}

#[test]
fn the_picture_has_conditions_of_its_own() {
    let message = refused(&["evaluate", "A2", "--format", "svg"]);
    assert!(message.contains("the picture has conditions of its own"), "{message}");
    let thesis = concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs/thesis.toml");
    let svg = printed(&["evaluate", "--format", "svg", "--seeds", "1", "--quiet", "--config", thesis]);
    assert!(svg.starts_with("<svg ") && svg.contains("sweep of 90 degrees") && svg.contains("thesis"), "{svg}");
}
