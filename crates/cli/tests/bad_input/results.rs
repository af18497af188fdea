//! Results in files.

use std::fs;

use crate::place::{DATA, Place, RUN, RUN_JSON, USAGE, door};

#[test]
fn a_file_in_place_of_the_folder_for_results_is_refused_and_kept() {
    let place = Place::with(door());
    for out in ["r.csv", "r.csv/deeper"] {
        let message = [&*format!("{out}: cannot be written"), "name another folder"];
        place.refused(&[&RUN[..], &["--out", out]].concat(), DATA, &message);
    }
    assert_eq!(fs::read_to_string(place.path("r.csv")).expect("kept"), door());
}

#[cfg(unix)]
#[test]
fn a_read_only_folder_for_results_is_named() {
    use std::os::unix::fs::PermissionsExt;

    let place = Place::with(door());
    fs::create_dir(place.path("locked")).expect("made");
    fs::set_permissions(place.path("locked"), fs::Permissions::from_mode(0o555)).expect("set");
    if fs::write(place.path("locked/probe"), "").is_ok() {
        println!("skipped: this user may write into every folder");
        return;
    }
    for out in ["locked", "locked/deeper"] {
        place.refused(
            &[&RUN[..], &["--out", out]].concat(),
            DATA,
            &["locked", "cannot be written", "check the permissions"],
        );
    }
}

#[test]
fn results_replace_older_ones_whole_and_leave_everything_else() {
    let place = Place::with(door());
    place.write("out/detection.json", "x".repeat(100_000));
    place.write("out/mine.txt", "mine");
    let printed = place.done(&[&RUN_JSON[..], &["--out", "out"]].concat());
    assert_eq!(fs::read_to_string(place.path("out/detection.json")).expect("written"), printed);
    let mut names: Vec<_> =
        fs::read_dir(place.path("out")).expect("a folder").map(|entry| entry.expect("an entry").file_name()).collect();
    names.sort();
    assert_eq!(names, ["detection.json", "mine.txt"]);
    let table = place.done(&[&RUN[..], &["--out", "new/deep"]].concat());
    assert!(table.contains("revolute"), "{table}");
    assert_eq!(fs::read_to_string(place.path("new/deep/detection.json")).expect("written"), printed);
}

#[test]
fn a_folder_in_place_of_the_result_is_refused_and_nothing_is_left() {
    let place = Place::with(door());
    fs::create_dir_all(place.path("out/detection.json")).expect("made");
    let message = ["detection.json: cannot be written", "a folder has this name"];
    place.refused(&[&RUN[..], &["--out", "out"]].concat(), DATA, &message);
}

#[test]
fn a_refused_recording_makes_no_folder_for_results() {
    let place = Place::with(door());
    place.write("c.toml", "[recording]\npairs = [['wall', 'dor']]");
    place.refused(&[&RUN[..], &["--out", "out"]].concat(), USAGE, &["the recording has no body `dor`"]);
    place.write("c.toml", "");
    place.write("r.csv", "");
    place.refused(&[&RUN[..], &["--out", "out"]].concat(), DATA, &["the file is empty"]);
}
