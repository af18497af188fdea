//! The command line.

use std::fs;
use std::io::Read;
use std::process::Stdio;

use crate::place::{DATA, Place, RUN, RUN_JSON, USAGE, door, json, shown, table, turning};

#[test]
fn input_and_scene_exclude_each_other() {
    let place = Place::with(door());
    place.refused(&[&RUN[..], &["--scene", "door"]].concat(), USAGE, &["--scene", "cannot be used with", "--input"]);
}

#[test]
fn a_recording_without_a_configuration_has_the_default_one() {
    let place = Place::with(door());
    assert_eq!(place.done(&["run", "--input", "r.csv"]), place.done(&RUN));
    place.refused(&["run"], USAGE, &["no recording is named", "give --input PATH or --scene NAME", "--config FILE"]);
    let message = ["unknown pair `wall`", "with a comma between them: --explain \"wall,door\""];
    place.refused(&["run", "--input", "r.csv", "--explain", "wall"], USAGE, &message);
    assert!(place.done(&["run", "--input", "r.csv", "--explain", "wall/door"]).contains("\nWhy\n"));
}

#[test]
fn format_and_unit_of_a_recording_can_be_given_beside_it() {
    let place = Place::with(door());
    place.write("r.dat", door());
    let message = ["r.dat: the extension does not tell the format", "--input-format csv"];
    for command in [&["run", "--input", "r.dat"][..], &["inspect", "r.dat"], &["convert", "r.dat", "out.csv"]] {
        place.refused(command, DATA, &message);
    }
    let given = ["run", "--input", "r.dat", "--input-format", "csv"];
    assert_eq!(place.done(&given), place.done(&RUN));
    let millimetres = json(&place.done(&[&RUN_JSON[..], &["--unit", "mm"]].concat()));
    let x = millimetres["pairs"][0]["axis"]["point"][0].as_f64().expect("a number");
    assert!((x - 1e-3).abs() < 1e-9, "the door's hinge is at 1 mm: {x}");
    place.refused(&["run", "--scene", "door", "--unit", "mm"], USAGE, &["--unit <UNIT>", "cannot be used with"]);
}

#[test]
fn more_threads_than_any_machine_has_are_refused_and_so_are_fewer_than_none() {
    let place = Place::with(door());
    for threads in ["-1", "1025", "99999999999", "many"] {
        place.refused(&[&RUN[..], &["--threads", threads]].concat(), USAGE, &["--threads <N>", threads]);
    }
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let names = ["a", "b", "c", "d", "e", "f", "g"];
    let place = Place::with(table(&names, 30, 4, |frame, body, feature| Some(shown(turning(frame, body, feature)))));
    let [one, three, all] =
        ["1", "3", "0"].map(|threads| place.done(&[&RUN_JSON[..], &["--threads", threads]].concat()));
    assert_eq!(one, three);
    assert_eq!(one, all);
}

#[test]
fn instructions_that_are_asked_for_change_no_byte_and_unknown_ones_are_refused() {
    let place = Place::with(door());
    let by =
        |set: &str| place.command(&RUN_JSON).env("JOINTSCOPE_INSTRUCTIONS", set).output().expect("the program starts");
    let expected = place.done(&RUN_JSON);
    for set in ["", "scalar"] {
        assert_eq!(String::from_utf8(by(set).stdout).expect("UTF-8"), expected, "`{set}`");
    }
    let refused = by("mmx");
    let message = String::from_utf8(refused.stderr).expect("UTF-8");
    assert_eq!((refused.status.code(), refused.stdout.len()), (Some(USAGE), 0), "{message}");
    for part in ["JOINTSCOPE_INSTRUCTIONS is `mmx`", "this machine has scalar", "unset"] {
        assert!(message.contains(part), "`{part}` is missing in\n{message}");
    }
}

#[test]
fn quiet_says_nothing_beside_the_result_and_changes_nothing_of_it() {
    let place = Place::with(door());
    // That nothing goes to the standard error is checked by `done`.
    assert_eq!(place.done(&[&RUN[..], &["--quiet"]].concat()), place.done(&RUN));
}

/// Runs the program with pipes whose other ends are closed; gives the exit code and what the open end received.
fn unread(place: &Place, arguments: &[&str], close_stdout: bool) -> (Option<i32>, String) {
    let (mut open, open_end) = std::io::pipe().expect("a pipe");
    let (closed, closed_end) = std::io::pipe().expect("a pipe");
    drop(closed);
    let (stdout, stderr) = if close_stdout { (closed_end, open_end) } else { (open_end, closed_end) };
    let mut child = place.command(arguments).stdout(stdout).stderr(stderr).spawn().expect("the program starts");
    let mut text = String::new();
    open.read_to_string(&mut text).expect("read");
    (child.wait().expect("ended").code(), text)
}

#[test]
fn a_closed_pipe_ends_the_program_quietly() {
    let place = Place::with(door());
    for arguments in [&RUN[..], &RUN_JSON, &["models"], &["models", "thesis-rigid"], &["--help"]] {
        assert_eq!(unread(&place, arguments, true), (Some(0), String::new()), "{arguments:?}");
    }
}

#[test]
fn a_pipe_that_is_closed_after_some_bytes_ends_the_program_quietly() {
    let names: Vec<String> = (0..16).map(|body| body.to_string()).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let place = Place::with(table(&names, 60, 4, |frame, body, feature| Some(shown(turning(frame, body, feature)))));
    // More than a pipe holds, so that the program is still writing when the pipe is closed.
    assert!(place.done(&RUN_JSON).len() > 200_000);
    let mut child = place.command(&RUN_JSON).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
    let mut stdout = child.stdout.take().expect("piped");
    stdout.read_exact(&mut [0; 10]).expect("ten bytes");
    drop(stdout);
    let output = child.wait_with_output().expect("ended");
    assert_eq!((output.status.code(), output.stderr.as_slice()), (Some(0), &b""[..]));
}

#[test]
fn an_error_that_nobody_reads_still_has_its_exit_code() {
    let place = Place::with("");
    assert_eq!(unread(&place, &RUN, false), (Some(DATA), String::new()));
    assert_eq!(unread(&place, &["models", "nonsense"], false), (Some(USAGE), String::new()));
}

#[cfg(target_os = "linux")]
#[test]
fn output_that_does_not_fit_is_an_error() {
    let place = Place::with(door());
    let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("a full device");
    let output = place.command(&RUN).stdout(full).output().expect("the program starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(DATA) && stderr.contains("the output cannot be written"), "{stderr}");
}
