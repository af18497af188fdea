//! What the program does with input that is wrong, thin, huge or strange.
//!
//! Every refusal is checked for its exit code, for a message that says where, what and what to do, for an empty
//! standard output, and for leaving no file behind.

use std::{
    collections::BTreeMap,
    fmt::Write as _,
    fs,
    io::Read,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use tempfile::TempDir;

const DATA: i32 = 1;
const USAGE: i32 = 2;

/// A folder to run the program in.
struct Place(TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    /// A folder with an empty configuration, which means the default models, and a recording.
    fn with(recording: impl AsRef<[u8]>) -> Self {
        let place = Self::new();
        place.write("c.toml", "");
        place.write("r.csv", recording);
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        fs::write(path, content).expect("written");
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_jointscope"));
        command.args(arguments).current_dir(self.0.path()).stdin(Stdio::null());
        for variable in ["FORCE_COLOR", "CLICOLOR_FORCE", "NO_GRAPHICS"] {
            command.env_remove(variable);
        }
        command
    }

    fn run(&self, arguments: &[&str]) -> Outcome {
        let output = self.command(arguments).output().expect("the program starts");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
        let outcome = Outcome { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) };
        assert!(!outcome.stderr.contains("panicked"), "{arguments:?}: {outcome:?}");
        outcome
    }

    /// Runs the program, which must refuse and leave everything as it was.
    fn refused(&self, arguments: &[&str], code: i32, message: &[&str]) {
        let before = self.files();
        let outcome = self.run(arguments);
        assert_eq!(outcome.code, Some(code), "{arguments:?}: {outcome:?}");
        assert_eq!(outcome.stdout, "", "{arguments:?}");
        for part in message {
            assert!(outcome.stderr.contains(part), "{arguments:?}: `{part}` is missing in\n{}", outcome.stderr);
        }
        assert_eq!(self.files(), before, "{arguments:?}");
    }

    /// Runs the program, which must do it and say nothing beside the result; gives the result.
    fn done(&self, arguments: &[&str]) -> String {
        let outcome = self.run(arguments);
        assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""), "{arguments:?}: {outcome:?}");
        outcome.stdout
    }

    /// Every file and folder below, with its size.
    fn files(&self) -> BTreeMap<PathBuf, u64> {
        let mut files = BTreeMap::new();
        let mut folders = vec![self.0.path().to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).expect("a folder") {
                let path = entry.expect("an entry").path();
                let metadata = path.symlink_metadata().expect("metadata");
                if metadata.is_dir() {
                    folders.push(path.clone());
                }
                files.insert(path, if metadata.is_file() { metadata.len() } else { 0 });
            }
        }
        files
    }
}

#[derive(Debug)]
struct Outcome {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

const RUN: [&str; 5] = ["run", "--config", "c.toml", "--input", "r.csv"];
const RUN_JSON: [&str; 7] = ["run", "--config", "c.toml", "--input", "r.csv", "--format", "json"];

/// Features of every body, from its hinge: neither on one line nor in one plane, and all away from the hinge.
const SHAPE: [[f64; 3]; 4] = [[0.5, 0., 0.], [0.7, 0., 0.1], [0.5, 0.2, 0.25], [0.6, 0.1, 0.4]];

/// A recording of some bodies, frames and features; `sample` gives x, y, z as text.
fn table(
    bodies: &[&str],
    frames: usize,
    features: usize,
    sample: impl Fn(usize, usize, usize) -> Option<[String; 3]>,
) -> String {
    let mut text = "frame,body,feature,x,y,z\n".to_owned();
    for frame in 0..frames {
        for (body, name) in bodies.iter().enumerate() {
            for feature in 0..features {
                if let Some([x, y, z]) = sample(frame, body, feature) {
                    writeln!(text, "{frame},{name},{feature},{x},{y},{z}").expect("a text grows");
                }
            }
        }
    }
    text
}

/// Bodies that turn about parallel axes: the first rests, every further one turns faster.
fn turning(frame: usize, body: usize, feature: usize) -> [f64; 3] {
    let [x, y, z] = SHAPE[feature % SHAPE.len()];
    let (sine, cosine) = (0.1 * (frame * body) as f64).sin_cos();
    [body as f64 + x * cosine - y * sine, x * sine + y * cosine, z]
}

fn shown(xyz: [f64; 3]) -> [String; 3] {
    xyz.map(|x| x.to_string())
}

/// A wall and a door that turns by 63 degrees.
fn door() -> String {
    table(&["wall", "door"], 12, 4, |frame, body, feature| Some(shown(turning(frame, body, feature))))
}

/// The door with one cell of line 32 replaced.
fn door_with(cell: &str) -> String {
    table(&["wall", "door"], 12, 4, |frame, body, feature| {
        let mut sample = shown(turning(frame, body, feature));
        if (frame, body, feature) == (3, 1, 2) {
            cell.clone_into(&mut sample[0]);
        }
        Some(sample)
    })
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).expect("JSON")
}

/// The notes of the first pair, one per line.
fn notes(result: &serde_json::Value) -> String {
    let notes = result["pairs"][0]["notes"].as_array().expect("notes").iter();
    notes.map(|note| note.as_str().expect("text")).collect::<Vec<_>>().join("\n")
}

/// Runs a recording that is legal but decides nothing; gives the result after checking joint and doubt.
fn undecided(recording: &str, joint: &str, note: &str) -> serde_json::Value {
    let place = Place::with(recording);
    let table = place.done(&RUN);
    assert!(table.contains(&format!("{joint} ?")) && table.contains(note), "{table}");
    let result = json(&place.done(&RUN_JSON));
    let pair = &result["pairs"][0];
    assert_eq!((pair["joint"].as_str(), pair["determined"].as_bool()), (Some(joint), Some(false)));
    assert!(notes(&result).contains(note), "{}", notes(&result));
    result
}

// Recordings that are refused.

#[test]
fn an_empty_file_is_refused() {
    Place::with("").refused(&RUN, DATA, &["r.csv: the file is empty; needed a header line and rows"]);
    Place::with("\n\n").refused(&RUN, DATA, &["r.csv: the file is empty"]);
}

#[test]
fn a_header_alone_is_refused() {
    let place = Place::with("frame,body,feature,x,y,z\n");
    place.refused(&RUN, DATA, &["r.csv: the table has a header but no rows; needed at least one sample"]);
}

#[test]
fn a_missing_column_is_named() {
    let place = Place::with("frame,body,feature,x,y\n0,wall,0,1,2\n");
    place.refused(
        &RUN,
        DATA,
        &["r.csv, line 1: column `z` is missing, found only frame, body", "add it to the header"],
    );
}

#[test]
fn a_misspelt_column_gets_the_nearest_name() {
    let place = Place::with("fram,body,feature,x,y,z\n0,wall,0,1,2,3\n");
    place.refused(&RUN, DATA, &["r.csv, line 1: column `fram` is unknown", "did you mean `frame`?"]);
}

#[test]
fn text_in_place_of_a_number_is_shown_with_its_line_and_column() {
    let place = Place::with(door_with("left"));
    place.refused(&RUN, DATA, &["r.csv, line 32: column `x`: needed a number, found `left`", "leave missing samples"]);
}

#[test]
fn infinity_is_refused_and_nan_is_a_missing_sample() {
    for infinity in ["inf", "-Infinity", "1e999"] {
        let place = Place::with(door_with(infinity));
        let found = format!("r.csv, line 32: column `x`: needed a finite number, found `{infinity}`");
        place.refused(&RUN, DATA, &[&found, "leave missing samples empty or NaN"]);
    }
    let missing = ["NaN", "nan", ""].map(|cell| Place::with(door_with(cell)).done(&RUN));
    assert!(missing[0].contains("revolute"), "{}", missing[0]);
    assert!(missing.iter().all(|table| *table == missing[0]));
}

#[test]
fn a_row_that_occurs_twice_is_refused_with_both_lines() {
    let text = door();
    let mut lines: Vec<&str> = text.lines().collect();
    lines.insert(7, lines[5]);
    let place = Place::with(lines.join("\n"));
    place.refused(
        &RUN,
        DATA,
        &["r.csv, line 8: needed one row per sample", "body `door`", "after line 6", "remove one"],
    );
}

#[test]
fn a_million_rows_without_a_sample_are_refused() {
    let mut text = "frame,body,feature,x,y,z\n".to_owned();
    for frame in 0..1_000_000 {
        writeln!(text, "{frame},wall,0,,,").expect("a text grows");
    }
    Place::with(text).refused(&RUN, DATA, &["r.csv: body `wall` has no sample in any frame", "check its columns"]);
}

#[test]
fn a_frame_number_of_ten_to_the_fifteen_costs_no_memory() {
    let one = "frame,body,feature,x,y,z\n1000000000000000,wall,0,1,2,3\n";
    let result = undecided(one, "rigid", "1 frame shows both bodies, at least 6 are needed; record more");
    assert_eq!(result["recording"]["frames"], 1);
    let place = Place::with("frame,body,feature,x,y,z\n99999999999999999999,wall,0,1,2,3\n");
    place.refused(&RUN, DATA, &["r.csv, line 2: column `frame`: needed a whole number from 0"]);
}

#[test]
fn a_recording_that_is_not_utf_8_is_refused_with_the_line() {
    let mut bytes = door().into_bytes();
    let at = bytes.iter().position(|byte| *byte == b'w').expect("wall");
    bytes[at] = 0xfc;
    Place::with(bytes).refused(
        &RUN,
        DATA,
        &["r.csv, line 2: needed UTF-8 text, but byte 27", "save the file as UTF-8"],
    );
}

#[test]
fn coordinates_beyond_measure_are_refused_with_body_feature_and_frame() {
    let huge = |frame, body, feature| Some(shown(turning(frame, body, feature).map(|x| x * 1e70)));
    let place = Place::with(table(&["wall", "door"], 12, 4, huge));
    place.refused(&RUN, DATA, &["r.csv: body `wall`, feature `0`, frame 0", "check the unit"]);
}

#[test]
fn coordinates_of_any_other_size_give_a_result_without_nan() {
    for scale in [1e59, 1e30, 1e-150, 1e-300] {
        let scaled = |frame, body, feature| Some(shown(turning(frame, body, feature).map(|x| x * scale)));
        let place = Place::with(table(&["wall", "door"], 12, 4, scaled));
        let result = json(&place.done(&RUN_JSON));
        let confidence = result["pairs"][0]["confidence"].as_f64().expect("a number");
        assert!((0.0..=1.0).contains(&confidence), "{scale}: {confidence}");
        let table = place.done(&RUN);
        assert!(!table.contains("NaN") && table.lines().all(|line| line.chars().count() < 200), "{table}");
    }
}

#[test]
fn bodies_that_are_all_at_the_origin_never_move_and_have_no_orientation() {
    let zero = table(&["wall", "door"], 12, 4, |_, _, _| Some(shown([0.0; 3])));
    let result = undecided(&zero, "rigid", "neither body moves");
    assert!(notes(&result).contains("wall: its orientation is not observed"));
}

// Recordings that decide nothing.

#[test]
fn bodies_of_one_or_two_features_say_that_their_orientation_is_not_observed() {
    for features in [1, 2] {
        let thin =
            table(&["wall", "door"], 12, features, |frame, body, feature| Some(shown(turning(frame, body, feature))));
        let result = undecided(&thin, "disconnected", "the orientation of neither body is observed");
        let notes = notes(&result);
        for body in ["wall", "door"] {
            assert!(notes.contains(&format!("{body}: its orientation is not observed")), "{notes}");
        }
        assert!(notes.contains(&format!("found {features}")) && notes.contains("track three features"), "{notes}");
        assert_eq!(notes.lines().count(), 3, "{notes}");
    }
}

#[test]
fn one_collinear_body_is_seen_from_the_other() {
    let rod = table(&["rod", "wall"], 12, 4, |frame, body, feature| {
        let line = [0.1 * feature as f64, 0.05 * frame as f64, 0.0];
        Some(shown(if body == 0 { line } else { turning(0, body, feature) }))
    });
    let place = Place::with(rod);
    let result = json(&place.done(&RUN_JSON));
    assert_eq!(result["pairs"][0]["joint"], "prismatic");
    let notes = notes(&result);
    assert!(notes.contains("rod: its orientation is not observed") && notes.contains("collinear"), "{notes}");
    assert!(notes.contains("as seen from `wall`"), "{notes}");
}

#[test]
fn one_frame_two_and_three_are_too_few_to_decide() {
    for (frames, joint, note) in [
        (1, "rigid", "1 frame shows both bodies, at least 6 are needed; record more"),
        (2, "prismatic", "2 frames show both bodies, at least 6 are needed; record more"),
        (3, "prismatic", "3 frames show both bodies, at least 6 are needed; record more"),
    ] {
        let short = table(&["wall", "door"], frames, 4, |frame, body, feature| {
            let [x, y, z] = turning(0, body, feature);
            Some(shown([x + 0.1 * (frame * body) as f64, y, z]))
        });
        let result = undecided(&short, joint, note);
        assert!(!notes(&result).contains("neither body moves"), "one frame shows no rest: {}", notes(&result));
    }
}

#[test]
fn bodies_that_are_never_seen_together_are_named() {
    let apart = table(&["wall", "door"], 12, 4, |frame, body, feature| {
        ((frame < 6) == (body == 0)).then(|| shown(turning(frame, body, feature)))
    });
    undecided(&apart, "disconnected", "`wall` and `door` are never seen in the same frame");
}

#[test]
fn two_bodies_at_rest_are_rigid_but_undetermined() {
    let still = table(&["wall", "door"], 12, 4, |_, body, feature| Some(shown(turning(0, body, feature))));
    undecided(&still, "rigid", "neither body moves: every joint at rest looks rigid; record them moving");
}

#[test]
fn a_body_at_rest_beside_one_that_moves_is_a_reference_like_any_other() {
    let result = json(&Place::with(door()).done(&RUN_JSON));
    let pair = &result["pairs"][0];
    assert_eq!((pair["joint"].as_str(), pair["determined"].as_bool()), (Some("revolute"), Some(true)));
    assert_eq!(notes(&result), "");
}

#[test]
fn bodies_with_the_same_coordinates_are_rigid() {
    let same = |frame: usize, _, feature| Some(shown(turning(frame, 1, feature)));
    let result = json(&Place::with(table(&["one", "two"], 12, 4, same)).done(&RUN_JSON));
    let pair = &result["pairs"][0];
    assert_eq!((pair["joint"].as_str(), pair["determined"].as_bool()), (Some("rigid"), Some(true)));
}

#[test]
fn one_body_alone_is_looked_at_from_the_world() {
    let alone = |name: &'static str| table(&[name], 12, 4, |frame, _, feature| Some(shown(turning(frame, 1, feature))));
    let result = json(&Place::with(alone("door")).done(&RUN_JSON));
    let pair = &result["pairs"][0];
    assert_eq!((pair["reference"].as_str(), pair["joint"].as_str()), (Some("world"), Some("revolute")));
    let advice = ["`world`", "give the world another name by `world` under [recording]"];
    Place::with(alone("world")).refused(&RUN, USAGE, &advice);
}

// Names that would disturb a table.

#[test]
fn control_characters_in_names_disturb_neither_table_nor_json_nor_messages() {
    let names = ["two words", "\"a\nb\"", "es\u{1b}[31mcape", "Kühlschrank 冷蔵庫", "\u{202e}back"];
    let strange = table(&names, 12, 4, |frame, body, feature| Some(shown(turning(frame, body, feature))));
    let place = Place::with(strange);
    let table = place.done(&RUN);
    assert!(table.contains("a\\nb") && table.contains("es\\u{1b}[31mcape") && table.contains("冷蔵庫"), "{table}");
    let unsafe_characters: Vec<char> = table.chars().filter(|c| c.is_control() && *c != '\n').collect();
    assert!(unsafe_characters.is_empty() && !table.contains('\u{202e}'), "{table}");
    let pairs = names.len() * (names.len() - 1) / 2;
    assert_eq!(table.lines().skip(3).take_while(|line| !line.is_empty()).count(), pairs, "{table}");
    let result = json(&place.done(&RUN_JSON));
    assert_eq!(result["recording"]["bodies"][1], "a\nb");
    assert_eq!(result["recording"]["bodies"][2], "es\u{1b}[31mcape");

    let place = Place::with("frame,body,feature,x,y,z\n0,\"es\u{1b}[31mcape\",0,,,\n");
    let outcome = place.run(&RUN);
    assert_eq!(outcome.code, Some(DATA));
    assert!(outcome.stderr.contains("body `es\\u{1b}[31mcape` has no sample"), "{}", outcome.stderr);
}

#[test]
fn fifty_bodies_give_a_row_per_pair_and_every_note_once() {
    let names: Vec<String> = (0..50).map(|body| format!("body {body}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let many = table(&names, 4, 1, |frame, body, feature| Some(shown(turning(frame, body, feature))));
    let table = Place::with(many).done(&RUN);
    assert_eq!(table.lines().filter(|line| line.contains("disconnected ?")).count(), 50 * 49 / 2);
    assert_eq!(table.matches("its orientation is not observed").count(), 50);
    assert_eq!(table.matches("the orientation of neither body is observed").count(), 1);
    assert!(table.contains("and 1221 other pairs"), "{table}");
}

#[test]
fn the_table_shows_no_negative_zero() {
    let table = Place::with(door()).done(&RUN);
    assert!(table.contains("0.0 .. 63.0 deg") && !table.contains("-0.0"), "{table}");
}

// Paths.

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
fn no_configuration_and_no_recording_are_usage_errors_that_say_what_to_give() {
    let place = Place::with(door());
    place.refused(&["run", "--input", "r.csv"], USAGE, &["--config <FILE>"]);
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

// Configurations.

/// Runs the door with a configuration that is refused at a place of it, given as line:column.
fn misconfigured(configuration: &str, place_in_it: &str, message: &[&str]) {
    let place = Place::with(door());
    place.write("c.toml", configuration);
    let shown = format!("[c.toml:{place_in_it}]");
    place.refused(&RUN, USAGE, &[&[&*shown], message].concat());
}

#[test]
fn unknown_tables_keys_and_models_point_at_themselves_and_know_the_nearest_name() {
    misconfigured("[recordng]\n", "1:2", &["unknown table `recordng`", "did you mean `recording`?"]);
    misconfigured(
        "[motion]\nregistraton = 'shape'",
        "2:1",
        &["unknown key `registraton`", "did you mean `registration`?"],
    );
    let message = ["unknown joint model `thesis-rigit`", "did you mean `thesis-rigid`?", "use that_crate as _;"];
    misconfigured("[models.rigid]\nkind = 'thesis-rigit'", "2:8", &message);
    misconfigured("[models]", "1:1", &["`models` has no model", "leave [models] out"]);
}

#[test]
fn wrong_types_and_numbers_out_of_range_point_at_the_value() {
    misconfigured("[motion]\npose_radius = 'x'", "2:15", &["`pose_radius`: expected a number, found the text \"x\""]);
    let message = ["`sections`: 0 is out of range", "1 <= x"];
    misconfigured("[models.p]\nkind = 'thesis-prismatic'\nsections = 0", "3:12", &message);
    misconfigured("[scoring]\nmargin = nan", "2:10", &["`margin`: NaN is out of range", "0 <= x <= 1"]);
    misconfigured("[recording]\nframes = 1", "2:10", &["`frames`: 1 is out of range", "2 <= x"]);
}

#[test]
fn what_is_not_toml_points_at_the_place() {
    misconfigured("[motion\nnoise = 0", "1:8", &["this is not TOML"]);
    misconfigured("[motion]\nnoise = 0\nnoise = 1", "3:1", &["this is not TOML: duplicate key"]);
}

#[test]
fn a_unit_or_format_that_does_not_exist_points_at_the_word() {
    misconfigured("[recording]\nunit = 'km'", "2:8", &["no unit is named `km`; known are m, cm, mm and in"]);
    misconfigured("[recording]\nformat = 'cvs'", "2:10", &["no format is named `cvs`; known are csv, poses and npz"]);
}

#[test]
fn the_unit_of_a_file_makes_metres() {
    let place = Place::with(door());
    let metres = json(&place.done(&RUN_JSON));
    place.write("c.toml", "[recording]\nunit = 'mm'");
    let millimetres = json(&place.done(&RUN_JSON));
    let x = |result: &serde_json::Value| result["pairs"][0]["axis"]["point"][0].as_f64().expect("a number");
    assert!((x(&metres) - 1.0).abs() < 1e-6, "the door's hinge is at 1 m: {}", x(&metres));
    assert!((1000.0 * x(&millimetres) - x(&metres)).abs() < 1e-6);
}

#[test]
fn a_configuration_that_is_not_utf_8_is_refused_with_the_line() {
    let place = Place::with(door());
    place.write("c.toml", b"# a comment\n[motion]\n# \xfc\n");
    place.refused(&RUN, USAGE, &["c.toml, line 3: needed UTF-8 text, but byte 23", "save the file as UTF-8"]);
}

#[test]
fn a_byte_order_mark_and_carriage_returns_are_no_part_of_a_configuration() {
    let place = Place::with(door());
    place.write("c.toml", "\u{feff}[motion]\r\nregistration = \"chained\"\r\n");
    assert!(place.done(&RUN).contains("revolute"));
    misconfigured("\u{feff}[motoin]\r\n", "1:2", &["did you mean `motion`?"]);
    misconfigured("\u{feff}[motion]\r\nnoise = -1\r\n", "2:9", &["out of range"]);
}

#[test]
fn pairs_of_unknown_bodies_or_of_one_body_point_at_the_name() {
    let message = ["the recording has no body `dor`", "did you mean `door`? known: `wall`, `door`"];
    misconfigured("[recording]\npairs = [['wall', 'door'], ['wall', 'dor']]", "2:37", &message);
    let message = ["the pair [`wall`, `wall`] names one body twice", "name two bodies, the reference first"];
    misconfigured("[recording]\npairs = [['wall', 'wall']]", "2:11", &message);
}

#[test]
fn the_world_needs_a_name_of_its_own() {
    misconfigured("[recording]\nworld = 'wall'", "2:9", &["has a body `wall` of its own", "that no body has"]);
    misconfigured("[recording]\nworld = ''", "2:9", &["the world needs a name", "world = \"world\""]);
}

#[test]
fn settings_that_could_not_have_an_effect_are_refused() {
    let message = ["`seed` is for a `scene`, but the recording is a file", "take `seed` out"];
    misconfigured("[recording]\npath = 'r.csv'\nseed = 1", "3:8", &message);
    misconfigured("[recording]\nscene = 'door'\nunit = 'mm'", "3:8", &["`unit` is for a file", "take `unit` out"]);
    let both = ["either a `path` or a `scene`, not both", "take one of them out"];
    misconfigured("[recording]\npath = 'r.csv'\nscene = 'door'", "3:9", &both);
}

#[test]
fn an_unknown_scene_gets_the_nearest_name_wherever_it_was_named() {
    let place = Place::new();
    place.write("c.toml", "[recording]\nscene = 'frigde'");
    let message = ["unknown scene `frigde`", "did you mean `fridge`?"];
    place.refused(&["run", "--config", "c.toml"], USAGE, &[&message[..], &["[c.toml:2:9]"]].concat());
    place.write("c.toml", "");
    place.refused(&["run", "--config", "c.toml", "--scene", "frigde"], USAGE, &message);
    place.refused(&["simulate", "frigde", "--out", "r.csv"], USAGE, &message);
}

#[test]
fn a_scene_that_turns_too_fast_says_what_to_change() {
    let place = Place::new();
    place.write("c.toml", "[recording]\nscene = 'tricycle'\nframes = 2");
    place.refused(
        &["run", "--config", "c.toml"],
        USAGE,
        &["[c.toml:2:9]", "from one frame to the next", "raise `frames`"],
    );
}

#[test]
fn an_unknown_joint_model_gets_the_nearest_name() {
    let message = ["unknown joint model `thesis-revolut`", "did you mean `thesis-revolute`?"];
    Place::new().refused(&["models", "thesis-revolut"], USAGE, &message);
}

// The command line.

#[test]
fn input_and_scene_exclude_each_other() {
    let place = Place::with(door());
    place.refused(&[&RUN[..], &["--scene", "door"]].concat(), USAGE, &["--scene", "cannot be used with", "--input"]);
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
fn quiet_says_nothing_beside_the_result_and_changes_nothing_of_it() {
    let place = Place::with(door());
    // That nothing goes to the standard error is checked by `done`.
    assert_eq!(place.done(&[&RUN[..], &["--quiet"]].concat()), place.done(&RUN));
}

// Results in files.

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

// Output that nobody reads.

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

// Simulations.

#[test]
fn a_simulation_is_written_with_its_truth_and_can_be_read() {
    let place = Place::new();
    assert_eq!(place.done(&["simulate", "door", "--out", "deep/r.csv", "--frames", "40"]), "");
    assert_eq!(place.done(&["simulate", "door", "--out", "deep/r.npz", "--frames", "40"]), "");
    assert_eq!(json(&fs::read_to_string(place.path("deep/truth.json")).expect("the truth"))["scene"], "door");
    place.write("c.toml", "");
    let [csv, npz] =
        ["deep/r.csv", "deep/r.npz"].map(|path| place.done(&["run", "--config", "c.toml", "--input", path]));
    assert_eq!(csv, npz);
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
        ("--scale", "0", "0.01 to 100"),
        ("--depth-gain", "-0.6", "0.01 to 100"),
    ] {
        refused(&[option, value], &[&*format!("{option} must be {range}"), &*format!("found {value}")]);
    }
    refused(&["--frames", "many"], &["invalid value 'many' for '--frames <FRAMES>'"]);
    refused(&["--seed", "-1"], &["invalid value '-1' for '--seed <SEED>'"]);
    refused(&["--monocular"], &["--monocular does not apply to scene `revolute`", "leave it out"]);
    let message = ["--frames times --features must be at most 10000000", "found 10000000000", "lower one of them"];
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
