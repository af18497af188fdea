//! Markers of motion capture that do not make the bodies asked for, and what `inspect` and `convert` refuse.

use std::fmt::Write as _;
use std::fs;

use crate::place::{DATA, Place, RUN, USAGE};

/// Two halves of a hinge without prefixes, as Vicon Nexus writes them.
fn trial() -> String {
    let mut text = String::from("Trajectories\n50\n,,A1,,,A2,,,A3,,,B1,,,B2,,,B3,,\nFrame,Sub Frame");
    text += &",X,Y,Z".repeat(6);
    let _ = writeln!(text, "\n,{}", ",mm".repeat(18));
    for frame in 1..=40 {
        let (sin, cos) = (0.03 * f64::from(frame)).sin_cos();
        let _ = write!(text, "{frame},0,-100,0,0,-300,20,80,-200,200,30");
        for [x, y, z] in [[100., 0., 0.], [300., 30., 90.], [200., 180., 20.]] {
            let _ = write!(text, ",{},{},{z}", x * cos - y * sin, x * sin + y * cos);
        }
        text += "\n";
    }
    text
}

fn place(configuration: &str) -> Place {
    let place = Place::with(trial());
    fs::write(place.path("c.toml"), configuration).expect("written");
    place
}

#[test]
fn markers_without_prefixes_need_bodies_and_the_way_is_shown() {
    let needed = ["r.csv: the file has 6 markers, `A1`, `A2`", "does not say which", "inspect FILE --suggest-bodies"];
    place("").refused(&RUN, DATA, &needed);
    let found = place("[recording]\nbodies = 'suggest'\n").done(&RUN);
    assert!(found.contains("revolute"), "{found}");
    let found = place("[recording.bodies]\nleft = 'A?'\nright = ['B1', 'B[23]']\n").done(&RUN);
    assert!(found.contains("left       right   revolute"), "{found}");
}

#[test]
fn a_pattern_that_matches_nothing_is_shown_with_the_nearest_names() {
    let place = place("[recording.bodies]\nleft = ['A1', 'a9*']\n");
    place.refused(
        &RUN,
        USAGE,
        &["body `left`: no marker has such a name: `a9*`", "c.toml:2:15", "the nearest names are `A"],
    );
}

#[test]
fn bodies_of_the_wrong_kind_are_refused() {
    for (configuration, needed) in [
        ("[recording]\nbodies = 'sugest'\n", "did you mean `suggest`?"),
        ("[recording]\nbodies = 3\n", "`bodies`: expected"),
        ("[recording]\nbodies = {}\n", "`bodies` names no body"),
        ("[recording.bodies]\nleft = []\n", "body `left` needs a name and at least one pattern"),
        ("[recording]\npath = 'a'\npaths = ['b']\n", "either a `path` or several `paths`"),
        ("[recording]\npaths = []\n", "`paths` names no file"),
        ("[recording]\nscene = 'revolute'\nbodies.a = 'x'\n", "`bodies` is for a file"),
    ] {
        place(configuration).refused(&RUN, USAGE, &[needed]);
    }
}

#[test]
fn a_started_configuration_runs_and_is_not_overwritten() {
    let place = place("");
    let told = place.done(&["inspect", "r.csv", "--write", "new.toml"]);
    assert!(told.contains("r.csv: vicon, unit mm (stated)") && told.contains("suggested"), "{told}");
    assert!(place.done(&["run", "--config", "new.toml"]).contains("revolute"));
    place.refused(&["inspect", "r.csv", "--write", "new.toml"], DATA, &["new.toml: there already"]);
    place.done(&["inspect", "r.csv", "--write", "deep/below/new.toml"]);
    assert!(place.done(&["run", "--config", "deep/below/new.toml"]).contains("revolute"));
    place.refused(&["inspect", "r.csv", "--write", "r.csv/new.toml"], DATA, &["a file is where a folder is needed"]);
}

#[test]
fn what_cannot_be_converted_is_refused_and_nothing_is_written() {
    let place = place("");
    place.refused(&["convert", "r.csv", "out.pdf"], USAGE, &["csv, npz, trc and parquet can be written"]);
    place.refused(&["convert", "none.csv", "out.csv"], DATA, &["none.csv: cannot be read"]);
    place.refused(&["convert", "r.csv", "out.csv", "--only", "poses"], DATA, &["the file has none of these"]);
    fs::write(place.path("p.log"), "0 0 0 0 0 0 1\n1 0 0 0 0 0 1\n").expect("written");
    place.refused(&["convert", "p.log", "out.trc"], DATA, &["found poses of body `p`"]);
    assert!(!place.path("out.csv").exists() && !place.path("out.trc").exists() && !place.path("out.pdf").exists());
    place.done(&["convert", "p.log", "p.csv"]);
    assert_eq!(fs::read_to_string(place.path("p.csv")).expect("written").lines().nth(1), Some("0,p,0,0,0,0,0,0,1"));
}

#[test]
fn a_conversion_says_what_it_overwrites_and_what_the_format_does_not_hold() {
    let place = place("");
    place.write("folder/kept.txt", "");
    for out in ["r.csv", "./r.csv", "folder/../r.csv"] {
        place.refused(&["convert", "r.csv", out], USAGE, &["is the recording itself", "name another file"]);
    }
    let told = |arguments: &[&str]| {
        let outcome = place.run(&[&["convert"], arguments].concat());
        assert_eq!((outcome.code, outcome.stdout.as_str()), (Some(0), ""), "{outcome:?}");
        outcome.stderr
    };
    let first = told(&["r.csv", "a.npz"]);
    assert!(first.contains("(1 to 40 became 0 to 39) and the names of the features"), "{first}");
    assert!(!first.contains("overwritten"), "{first}");
    assert!(told(&["r.csv", "a.npz"]).contains("a.npz: was there already, and was overwritten"));
    place.done(&["convert", "--quiet", "r.csv", "a.npz"]);
    // What is read from an archive, and bodies that prefixes tell, lose nothing.
    assert_eq!(told(&["a.npz", "b.npz"]), "");
    assert_eq!(told(&["a.npz", "b.trc"]), "");
    place.write("colons.csv", "frame,body,feature,x,y,z\n0,a,b:c,0,0,1\n1,a,b:c,0,0,1\n");
    let lost = told(&["colons.csv", "c.trc"]);
    assert!(lost.contains("c.trc: the format tells a body by") && lost.contains("`a:b:c`"), "{lost}");
    assert_eq!(told(&["colons.csv", "d.csv"]), "");
}

#[test]
fn a_body_whose_markers_go_their_own_ways_is_told_to_be_none() {
    let place = place("");
    assert!(!place.done(&["inspect", "r.csv"]).contains("no rigid body"));
    let mut person = String::from("frame,body,feature,x,y,z\n");
    for frame in 0..200 {
        for marker in 0..6 {
            let place = f64::from(marker) * 0.3 + 0.3 * (0.004 * f64::from(frame) * f64::from(marker + 1)).sin();
            let _ = writeln!(person, "{frame},person,{marker},{place},{},1", 0.1 * f64::from(marker * marker));
        }
    }
    place.write("person.csv", person);
    let told = place.done(&["inspect", "person.csv"]);
    assert!(told.contains("note: body `person`: most of its markers do not keep their distances"), "{told}");
}

#[cfg(feature = "parquet")]
#[test]
fn recordings_in_columns_are_written_read_and_inspected() {
    let place = place("");
    for (from, to) in [("r.csv", "a.parquet"), ("a.parquet", "b.csv"), ("r.csv", "c.csv")] {
        place.done(&["convert", "--quiet", from, to]);
    }
    let [through_columns, direct] = ["b.csv", "c.csv"].map(|name| fs::read(place.path(name)).expect("written"));
    assert_eq!(through_columns, direct);
    let told = place.done(&["inspect", "a.parquet"]);
    assert!(told.starts_with("a.parquet: parquet, unit m (not stated)\n40 frames (1 to 40)"), "{told}");
    assert!(told.ends_with("judges every body against the world, too\n"), "{told}");
}

#[test]
fn several_files_are_several_bodies() {
    let place = place("");
    for name in ["base", "lid"] {
        let text: String = (0..40)
            .map(|frame| {
                let half = if name == "lid" { 0.02 * f64::from(frame) } else { 0. };
                format!("{frame} 0 0 1 0 0 {} {}", half.sin(), half.cos())
            })
            .collect::<Vec<_>>()
            .join("\n");
        fs::write(place.path(&format!("{name}.tum")), text).expect("written");
    }
    let found = place.done(&["run", "--config", "c.toml", "--input", "base.tum", "--input", "lid.tum"]);
    assert!(found.contains("base       lid     revolute"), "{found}");
    fs::write(place.path("c.toml"), "[recording]\npaths = ['base.tum', 'lid.tum']\n").expect("written");
    assert_eq!(place.done(&["run", "--config", "c.toml"]), found);
    fs::write(place.path("lid.tum"), "0 0 1\n1 0 1\n").expect("written");
    place.refused(&["run", "--config", "c.toml"], DATA, &["lid.tum: the file has no times, and base.tum has"]);
}
