//! The program looks into every real file whose format it knows, and what it makes of their markers is known to be so.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    process::Command,
};

use jointscope_recordings::{ReadOptions, read_markers, suggest};
use jointscope_tests::real;

const PROGRAM: &str = env!("CARGO_BIN_EXE_jointscope-with-common-centre");

fn printed_by(arguments: &[&str]) -> String {
    let output = Command::new(PROGRAM).args(arguments).output().expect("the program starts");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut listed: Vec<PathBuf> =
        std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    listed.sort();
    for path in listed {
        if path.is_dir() { files(&path, found) } else { found.push(path) }
    }
}

#[test]
fn inspecting_tells_what_every_file_of_a_known_format_holds() {
    let Some(folder) = real::folder() else { return };
    let mut found = Vec::new();
    files(&folder, &mut found);
    let mut formats: BTreeMap<String, usize> = BTreeMap::new();
    for path in found {
        let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
        let foreign = ["motion_capture_dynamic_exp_fast.csv", "artic_data.txt"];
        let is_foreign =
            foreign.iter().any(|name| path.ends_with(name)) || path.parent().is_some_and(|p| p.ends_with("LICENSES"));
        let is_known = ["c3d", "trc", "csv", "tsv", "log", "txt"].contains(&extension.as_str());
        if is_foreign || !is_known || path.ends_with("MANIFEST.tsv") {
            continue;
        }
        let told: serde_json::Value =
            serde_json::from_str(&printed_by(&["inspect", text(&path), "--format", "json"])).expect("JSON");
        assert_eq!((told["format"].as_str(), told["version"].as_u64()), (Some("jointscope-inspection"), Some(1)));
        assert!(told["frames"].as_u64() > Some(0), "{}", path.display());
        let holds = |key: &str| told[key].as_array().map_or(0, Vec::len);
        assert!(holds("markers") + holds("poses") > 0, "{}", path.display());
        *formats.entry(told["recording_format"].as_str().expect("a format").to_owned()).or_default() += 1;
    }
    let expected = [("c3d", 11), ("poses", 51), ("qualisys", 1), ("trc", 5), ("vicon", 1)];
    assert_eq!(formats, expected.map(|(format, count)| (format.to_owned(), count)).into());
}

/// What the program prints about a pair of bodies of a file.
fn judged(folder: &Path, file: &str, bodies: &str) -> serde_json::Value {
    let place = tempfile::tempdir().expect("a temporary folder");
    let configuration = place.path().join("c.toml");
    std::fs::write(&configuration, format!("[recording.bodies]\n{bodies}")).expect("written");
    let printed = printed_by(&[
        "run",
        "--quiet",
        "--format",
        "json",
        "--config",
        text(&configuration),
        "--input",
        text(&folder.join(file)),
    ]);
    serde_json::from_str(&printed).expect("JSON")
}

/// Whether two results say the same, numbers to within a tolerance.
fn alike(a: &serde_json::Value, b: &serde_json::Value, tolerance: f64) -> bool {
    use serde_json::Value;

    match (a, b) {
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap_or(f64::NAN), b.as_f64().unwrap_or(f64::NAN));
            (a - b).abs() <= tolerance
        }
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| alike(a, b, tolerance))
        }
        (Value::Object(a), Value::Object(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|((k, a), (l, b))| k == l && alike(a, b, tolerance))
        }
        _ => a == b,
    }
}

#[test]
fn six_encodings_of_one_trial_give_one_result() {
    let Some(folder) = real::folder() else { return };
    let encodings = ["pc_real", "pc_int", "dec_real", "dec_int", "sgi_real", "sgi_int"];
    let results: Vec<serde_json::Value> = encodings
        .iter()
        .map(|name| {
            let file = format!("kineticstoolkit/c3d_test_suite/{name}.c3d");
            judged(&folder, &file, "thigh = ['RTH?']\nshank = ['RSK?']\n")
        })
        .collect();
    let [pc_real, pc_int, dec_real, dec_int, sgi_real, sgi_int] = &results[..] else { panic!("six results") };
    assert!(pc_real == dec_real && pc_real == sgi_real, "reals are the same to the last bit");
    assert!(pc_int == sgi_int, "integers are the same to the last bit");
    // Integers are rounded to 0.28 mm; 58 of the 2976 samples of `dec_int` are one such step from those of `pc_int`.
    for (name, result) in encodings.iter().zip([pc_real, pc_int, dec_real, dec_int, sgi_real, sgi_int]) {
        let (pair, other) = (&result["pairs"][0], &pc_real["pairs"][0]);
        assert_eq!((&pair["joint"], &pair["determined"]), (&other["joint"], &other["determined"]), "{name}");
        for (key, tolerance) in [("confidences", 0.01), ("noise", 1e-5), ("axis", 1e-3)] {
            assert!(alike(&pair[key], &other[key], tolerance), "{name}: {} and {}", pair[key], other[key]);
        }
    }
}

#[test]
fn the_table_and_the_binary_file_of_one_trial_give_one_result() {
    let Some(folder) = real::folder() else { return };
    let bodies = "box = ['boite:*']\nforearm = ['Daphnee:LARM*']\n";
    let [table, binary] =
        ["pyomeca/markers.csv", "pyomeca/markers_analogs.c3d"].map(|file| judged(&folder, file, bodies));
    let joint = |result: &serde_json::Value| result["pairs"][0]["joint"].as_str().map(str::to_owned);
    assert_eq!((joint(&table), joint(&binary)), (Some("disconnected".into()), Some("disconnected".into())));
    assert_eq!(table["recording"], binary["recording"]);
    let [noise, other] = [&table, &binary].map(|result| &result["pairs"][0]["noise"]);
    // The table has six digits.
    assert!(alike(noise, other, 1e-6), "{noise} and {other}");
}

/// Of the markers of known bodies: suggested bodies that mix them, pairs of one body found together, and all of these.
fn agreement(path: &Path, known: &[&[&str]]) -> (usize, usize, usize) {
    let markers = read_markers(path, &ReadOptions::default()).expect("sound");
    let suggestion = suggest(&markers);
    let place = |name: &&str| markers.markers.iter().position(|marker| marker.name == **name).expect("a marker");
    let known: Vec<Vec<usize>> = known.iter().map(|names| names.iter().map(&place).collect()).collect();
    let together = |a: usize, b: usize| {
        suggestion.bodies.iter().any(|body| body.markers.contains(&a) && body.markers.contains(&b))
    };
    let mixed = suggestion.bodies.iter().filter(|suggested| {
        known.iter().filter(|body| body.iter().any(|marker| suggested.markers.contains(marker))).count() > 1
    });
    let pairs: Vec<(usize, usize)> = known
        .iter()
        .flat_map(|body| body.iter().enumerate().flat_map(move |(i, a)| body[i + 1..].iter().map(move |b| (*a, *b))))
        .collect();
    (mixed.count(), pairs.iter().filter(|(a, b)| together(*a, *b)).count(), pairs.len())
}

#[test]
fn suggested_bodies_agree_with_the_known_ones() {
    let Some(folder) = real::folder() else { return };
    let owned = |prefix: &str, count: usize| (1..=count).map(|i| format!("{prefix}{i}")).collect::<Vec<_>>();
    let numbered: Vec<(&str, Vec<Vec<String>>)> = vec![
        (
            "kineticstoolkit/kinematics_basket_sprint.c3d",
            ["WheelchairL:Marker", "SWL:Marker", "ArmL:Marker", "ForearmL:Marker"].map(|p| owned(p, 4)).into(),
        ),
        (
            "kineticstoolkit/c3d_test_suite/pc_real.c3d",
            ["RTH", "RSK", "RFT", "RAR", "RFA", "LTH", "LSK", "LFT", "LAR", "LFA"].map(|p| owned(p, 3)).into(),
        ),
        ("kineticstoolkit/c3d_test_suite/Eb015pi.c3d", ["RTH", "LTH", "RSK", "LSK"].map(|p| owned(p, 4)).into()),
        ("opensim/walking5.c3d", ["LTH", "RTH", "LTB", "RTB"].map(|p| owned(p, 3)).into()),
    ];
    let listed = |names: &str| names.split(' ').map(str::to_owned).collect::<Vec<_>>();
    let named = vec![
        (
            "biobuddy/right_knee.c3d",
            vec![listed("RTHI1 RTHI2 RTHI3 RGT RLFE RMFE"), listed("RLEG1 RLEG2 RLEG3 RLM RSPH")],
        ),
        (
            "pyomeca/markers_analogs.c3d",
            vec![
                listed(
                    "boite:gauche_ext boite:gauche_int boite:droite_int boite:droite_ext boite:avant_gauche \
                        boite:avant_droit boite:arriere_droit boite:arriere_gauche",
                ),
                listed("Daphnee:LARMm Daphnee:LARMl Daphnee:LARM_elb Daphnee:LARM_ant"),
            ],
        ),
        (
            "hand_embodiment/recording.tsv",
            vec![
                listed("hand_top hand_left hand_right"),
                listed("back_top back_left back_right"),
                listed("pillow_top pillow_left pillow_right"),
            ],
        ),
    ];
    let (mut all_mixed, mut all_found, mut all) = (0, 0, 0);
    for (file, bodies) in numbered.iter().chain(&named) {
        let bodies: Vec<Vec<&str>> = bodies.iter().map(|body| body.iter().map(String::as_str).collect()).collect();
        let bodies: Vec<&[&str]> = bodies.iter().map(Vec::as_slice).collect();
        let (mixed, found, pairs) = agreement(&folder.join(file), &bodies);
        println!("{file}: {mixed} mixed, {found} of {pairs} pairs together");
        (all_mixed, all_found, all) = (all_mixed + mixed, all_found + found, all + pairs);
    }
    println!("all: {all_mixed} mixed, {all_found} of {all} pairs together");
    assert_eq!(all_mixed, 0, "suggested bodies that mix known ones");
    assert!(10 * all_found >= 8 * all, "{all_found} of {all} pairs");
}

#[test]
fn what_rests_beside_a_bending_knee_is_together_and_nothing_of_the_leg_is_in_it() {
    let Some(folder) = real::folder() else { return };
    let markers = read_markers(&folder.join("biobuddy/right_knee.c3d"), &ReadOptions::default()).expect("sound");
    let suggestion = suggest(&markers);
    let names: Vec<&str> = suggestion.together.iter().map(|&marker| markers.markers[marker].name.as_str()).collect();
    for at_rest in ["LPSIS", "RPSIS", "LLEG1", "C7", "RARM2"] {
        assert!(names.contains(&at_rest), "{at_rest} is not in {names:?}");
    }
    for of_the_leg in ["RTHI1", "RLEG1", "RCAL", "RTT2", "RLFE"] {
        assert!(!names.contains(&of_the_leg), "{of_the_leg} is in {names:?}");
    }
    assert!(suggestion.together.iter().all(|marker| suggestion.ambiguous.contains(marker)));
}

#[test]
fn converted_recordings_hold_the_same_samples() {
    let Some(folder) = real::folder() else { return };
    let place = tempfile::tempdir().expect("a temporary folder");
    let original = folder.join("kineticstoolkit/kinematics_basket_sprint.c3d");
    let options = ReadOptions::default();
    let markers = |path: &Path| read_markers(path, &options).expect("sound");
    let first = markers(&original);
    let chain = ["a.csv", "b.trc", "c.csv", "d.npz", "e.trc"].map(|name| place.path().join(name));
    let mut from = original;
    for to in chain {
        printed_by(&["convert", "--quiet", text(&from), text(&to)]);
        let found = markers(&to);
        assert_eq!(found.times, first.times, "{}", to.display());
        // Bodies keep their features together, so that markers may come in another order; missing is missing.
        let mut samples = [&first, &found].map(|markers| {
            markers
                .positions
                .iter()
                .filter(|p| !p.x.is_nan())
                .map(|p| [p.x, p.y, p.z].map(f64::to_bits))
                .collect::<Vec<_>>()
        });
        for samples in &mut samples {
            samples.sort_unstable();
        }
        assert!(samples[0] == samples[1], "{}", to.display());
        from = to;
    }
}
