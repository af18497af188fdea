//! Configurations.

use crate::place::{DATA, Place, RUN, RUN_JSON, USAGE, door, json, notes};

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
fn play_is_a_share_a_length_a_table_or_none() {
    for play in ["play = '0.7 %'", "play = '2%'", "play = 'none'", "play = 0.002", "play = 0", "play = { turn = 0.01 }"]
    {
        let place = Place::with(door());
        place.write("c.toml", format!("[motion]\n{play}"));
        assert!(place.done(&RUN).contains("revolute"), "{play}");
    }
    for (play, found) in
        [("a lot", "a lot"), ("0.7", "0.7"), ("-1 %", "-1 %"), ("101 %", "101 %"), ("%", "%"), ("nan %", "nan %")]
    {
        let message = format!(
            "`play`: expected a share of 0 to 100 % such as \"0.7 %\", a number of metres without quotes, or \"none\", found \"{found}\""
        );
        misconfigured(&format!("[motion]\nplay = '{play}'"), "2:8", &[&message]);
    }
    misconfigured("[motion]\nplay = -1", "2:8", &["`play`: -1 is out of range", "0 <= x"]);
    misconfigured("[motion]\nplay = inf", "2:8", &["`play`: inf is out of range"]);
    misconfigured("[motion]\nplay = true", "2:8", &["`play`: expected", "found true"]);
    let message = ["unknown key `travl`", "did you mean `travel`?", "`least_turn`"];
    misconfigured("[motion.play]\ntravl = 0.01", "2:1", &message);
    misconfigured("[motion.play]\ntravel = 2", "2:10", &["`travel`: 2 is out of range", "0 <= x <= 1"]);
    misconfigured("[motion.play]\ntravel = '1 %'", "2:10", &["`travel`: expected a number, found the text \"1 %\""]);
}

#[test]
fn priors_are_positive_numbers_of_models_that_are_there() {
    let place = Place::with(door());
    place.write("c.toml", "[scoring.priors]\nscrew = 0.1\nrevolute = 3");
    assert!(place.done(&RUN).contains("revolute"));
    let message =
        ["a prior is given for `scrw`, which is not among the models", "models: `cylindrical`, `disconnected`"];
    misconfigured("[scoring.priors]\nscrw = 2", "1:1", &message);
    for prior in ["0", "-1", "0.0", "-1e-300"] {
        let message = ["the prior of `screw` is ", "which is not a positive number", "leave its model out"];
        misconfigured(&format!("[scoring]\npriors = {{ screw = {prior} }}"), "2:10", &message);
    }
    misconfigured("[scoring.priors]\nscrew = 'low'", "2:9", &["`screw`: expected a number, found the text \"low\""]);
    misconfigured("[scoring.priors]\nscrew = nan", "2:9", &["`screw`: NaN is out of range"]);
    misconfigured("[scoring.priors]\nscrew = 1e400", "2:9", &["`screw`: inf is out of range"]);
    misconfigured("[scoring]\npriors = 3", "2:10", &["`priors`: expected a table, found the number 3"]);
}

#[test]
fn leads_and_temperature_out_of_range_point_at_the_value() {
    misconfigured("[scoring]\ntemperature = 0", "2:15", &["`temperature`: 0 is out of range", "0 < x"]);
    misconfigured("[scoring]\nlead = -1", "2:8", &["`lead`: -1 is out of range", "0 <= x"]);
    misconfigured("[scoring]\nlead_over_richer = nan", "2:20", &["`lead_over_richer`: NaN is out of range"]);
}

#[test]
fn a_rule_that_needs_what_a_model_does_not_give_names_both() {
    let message = ["the rule \"likelihood\" compares evidence", "`rigid` (kind `thesis-rigid`)", "rule = \"cascade\""];
    misconfigured("[scoring]\nrule = 'likelihood'\n[models.rigid]\nkind = 'thesis-rigid'", "2:8", &message);
    misconfigured("[models.rigid]\nkind = 'thesis-rigid'", "1:1", &message);
    let message = ["the model `cylindrical` is not in the cascade's order", "add it where it should be asked"];
    misconfigured("[scoring]\nrule = 'cascade'", "1:1", &message);
}

#[test]
fn settings_of_mechanisms_point_at_the_value() {
    misconfigured("[models.free]\nparameters = 3", "2:14", &["`parameters`: 3 is out of range", "6 <= x <= 27"]);
    misconfigured("[models.prismatic]\nbend = 0", "2:8", &["`bend`: 0 is out of range", "0 < x"]);
    misconfigured("[models.revolute]\nswep = 3", "2:1", &["unknown key `swep`", "did you mean `sweep`?"]);
    misconfigured("[motion]\nrobust = 'yes'", "2:10", &["`robust`: expected true or false, found the text \"yes\""]);
}

#[test]
fn a_model_without_settings_refuses_keys_as_all_models_do() {
    misconfigured("[models.rigid]\nsweep = 3", "2:1", &["unknown key `sweep`", "there are none here"]);
}

#[test]
fn what_is_not_toml_points_at_the_place() {
    misconfigured("[motion\nnoise = 0", "1:8", &["this is not TOML"]);
    misconfigured("[motion]\nnoise = 0\nnoise = 1", "3:1", &["this is not TOML: duplicate key"]);
}

#[test]
fn a_unit_or_format_that_does_not_exist_points_at_the_word() {
    misconfigured("[recording]\nunit = 'km'", "2:8", &["no unit is named `km`; known are m, cm, mm and in"]);
    misconfigured("[recording]\nformat = 'cvs'", "2:10", &["no format is named `cvs`; known are csv, poses, npz, c3d"]);
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
fn a_check_says_that_the_recording_was_not_read() {
    let place = Place::with("no recording at all");
    place.write("c.toml", "[recording]\npath = 'r.csv'");
    let told = place.done(&["check", "--config", "c.toml"]);
    assert!(told.contains("r.csv (there, but not read: `inspect` and `run` do that)"), "{told}");
    place.write("c.toml", "[recording]\npaths = ['r.csv', 'gone.csv']");
    let message = ["gone.csv: the recording that the configuration names is not there"];
    place.refused(&["check", "--config", "c.toml"], DATA, &message);
}

#[test]
fn a_comparison_without_free_motion_is_remarked_on_and_done() {
    let place = Place::with(door());
    place.write("c.toml", "[models.rigid]\n[models.revolute]\n");
    let said = "c.toml: no model is of the kind `free`: every motion will be one of the joints named";
    for command in [&["check", "--config", "c.toml"][..], &RUN] {
        let outcome = place.run(command);
        assert!(outcome.code == Some(0) && outcome.stderr.starts_with(said), "{outcome:?}");
    }
    assert!(place.done(&[&RUN[..], &["--quiet"]].concat()).contains("revolute"));
    place.write(
        "c.toml",
        "[models.revolute]\nkind = 'thesis-revolute'\n[scoring]\nrule = 'cascade'\norder = ['revolute']",
    );
    place.done(&["check", "--config", "c.toml"]);
}

#[test]
fn files_that_are_asked_for_without_a_folder_are_remarked_on() {
    let place = Place::with(door());
    place.write("c.toml", "[output]\nhtml = true\nurdf = true\n");
    let outcome = place.run(&RUN);
    let said = "c.toml: [output] asks for `html`, `urdf`, which is written only with --out DIR";
    assert!(outcome.code == Some(0) && outcome.stderr.starts_with(said), "{outcome:?}");
    place.done(&[&RUN[..], &["--out", "results"]].concat());
}

#[test]
fn a_long_line_is_shown_around_what_is_wrong_in_it() {
    let place = Place::with(door());
    let long = "0 * revolute + ".repeat(100);
    place.write("c.toml", format!("[scoring]\nrule = 'expressions'\nexpressions.revolute = '{long}`bäd` + {long}0'\n"));
    let outcome = place.run(&["check", "--config", "c.toml"]);
    assert_eq!(outcome.code, Some(2), "{outcome:?}");
    assert!(
        outcome.stderr.contains("[c.toml:3:1525]") && outcome.stderr.contains("revolute + `bäd` + 0"),
        "{outcome:?}"
    );
    assert!(outcome.stderr.lines().all(|line| line.chars().count() < 250), "{outcome:?}");
}

#[test]
fn a_check_refuses_what_a_run_refuses() {
    let place = Place::with(door());
    for (configuration, message) in [
        ("[recording]\npairs = [['wall', 'wall']]", "names one body twice"),
        ("[recording]\npairs = [['wall', 'door'], ['wall', 'door']]", "is there twice"),
        ("[scale]\nsearch = 'grid'\nfrom = 0.05\nto = 20\nstep = 0.0001", "more than 10000"),
    ] {
        place.write("c.toml", configuration);
        place.refused(&["check", "--config", "c.toml"], USAGE, &[message]);
        place.refused(&RUN, USAGE, &[message]);
    }
}

#[test]
fn a_noise_larger_than_the_body_decides_nothing() {
    let place = Place::with(door());
    let told_with = |noise: &str| {
        place.write("c.toml", format!("[motion]\nnoise = {noise}"));
        let result = json(&place.done(&RUN_JSON));
        (notes(&result), result["pairs"][0]["determined"].as_bool())
    };
    let (said, determined) = told_with("3");
    assert_eq!(determined, Some(false), "{said}");
    for body in ["wall", "door"] {
        let note = format!("{body}: `noise` under [motion] is 3 m, and the body itself measures 0.");
        assert!(said.contains(&note), "{said}");
    }
    assert!(!told_with("0.003").0.contains("`noise` under [motion]"));
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
