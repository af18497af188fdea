//! Configurations.

use crate::place::{Place, RUN, RUN_JSON, USAGE, door, json};

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
