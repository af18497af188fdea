//! Paths.

use std::fs;

use crate::place::{DATA, Place, RUN, USAGE, door, shown, table, turning};

#[test]
fn a_missing_recording_is_a_data_error_that_names_the_path_as_it_was_typed() {
    let place = Place::with("");
    place.refused(
        &["run", "--config", "c.toml", "--input", "no/such.csv"],
        DATA,
        &["× no/such.csv: cannot be read", "check the path"],
    );
    place.write("c.toml", "[recording]\npath = 'gone.csv'");
    place.refused(&["run", "--config", "c.toml"], DATA, &["× gone.csv: cannot be read", "check the path"]);
}

#[test]
fn a_missing_configuration_is_a_usage_error() {
    let message = ["no.toml: the configuration cannot be read", "check the path"];
    Place::with(door()).refused(&["run", "--config", "no.toml", "--input", "r.csv"], USAGE, &message);
}

#[test]
fn no_recording_is_a_usage_error_that_says_what_to_give() {
    let place = Place::with(door());
    place.refused(
        &["run", "--config", "c.toml"],
        USAGE,
        &["c.toml: no recording is named", "--input PATH or --scene NAME"],
    );
    place.refused(&["run", "--config", "c.toml", "--input", ""], USAGE, &["--input <PATH>"]);
}

#[test]
fn a_folder_is_neither_recording_nor_configuration() {
    let place = Place::with(door());
    fs::create_dir(place.path("folder.csv")).expect("made");
    let message = ["folder.csv: needed a file, found a directory; name one recording in it"];
    place.refused(&["run", "--config", "c.toml", "--input", "folder.csv"], DATA, &message);
    let message = ["folder.csv: the configuration cannot be read", "name a file in it"];
    place.refused(&["run", "--config", "folder.csv", "--input", "r.csv"], USAGE, &message);
}

#[cfg(unix)]
#[test]
fn a_symbolic_link_to_itself_is_neither_recording_nor_configuration_nor_place_for_results() {
    let place = Place::with(door());
    std::os::unix::fs::symlink("loop.csv", place.path("loop.csv")).expect("linked");
    place.refused(
        &["run", "--config", "c.toml", "--input", "loop.csv"],
        DATA,
        &["loop.csv: cannot be read", "check the path"],
    );
    place.refused(
        &["run", "--config", "loop.csv", "--input", "r.csv"],
        USAGE,
        &["loop.csv: the configuration", "check the path"],
    );
    place.refused(&[&RUN[..], &["--out", "loop.csv"]].concat(), DATA, &["loop.csv: cannot be written"]);
}

#[cfg(unix)]
#[test]
fn files_without_permission_are_named() {
    use std::os::unix::fs::PermissionsExt;

    let place = Place::with(door());
    fs::set_permissions(place.path("r.csv"), fs::Permissions::from_mode(0o000)).expect("set");
    if fs::read(place.path("r.csv")).is_ok() {
        println!("skipped: this user may read every file");
        return;
    }
    place.refused(&RUN, DATA, &["r.csv: cannot be read", "check the permissions"]);
    place.refused(
        &["run", "--config", "r.csv", "--scene", "door"],
        USAGE,
        &["r.csv: the configuration", "check the permissions"],
    );
}

#[test]
fn an_unknown_extension_says_how_to_name_the_format() {
    let place = Place::with("");
    place.write("r.dat", door());
    let message = ["r.dat: the extension does not tell the format", "format = \"csv\" under [recording]"];
    place.refused(&["run", "--config", "c.toml", "--input", "r.dat"], DATA, &message);
    place.write("c.toml", "[recording]\nformat = 'csv'");
    assert!(place.done(&["run", "--config", "c.toml", "--input", "r.dat"]).contains("revolute"));
}

#[test]
fn paths_in_a_configuration_start_at_its_folder_and_those_on_the_command_line_where_one_is() {
    let place = Place::new();
    let named = |name| table(&["wall", name], 12, 4, |frame, body, feature| Some(shown(turning(frame, body, feature))));
    place.write("r.csv", named("outer"));
    place.write("sub/r.csv", named("inner"));
    place.write("sub/own.toml", "[recording]\npath = 'r.csv'");
    place.write("sub/up.toml", "[recording]\npath = '../r.csv'");
    assert!(place.done(&["run", "--config", "sub/own.toml"]).contains("inner"));
    assert!(place.done(&["run", "--config", "sub/up.toml"]).contains("outer"));
    assert!(place.done(&["run", "--config", "sub/own.toml", "--input", "r.csv"]).contains("outer"));
}
