//! Joint models written outside the project's crates are listed, explained, and take part in runs.

use std::fmt::Write as _;
use std::process::{Command, Output};

use jointscope_tests as _;
use rand::SeedableRng as _;
use rand_distr::Distribution as _;

fn program(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_jointscope-with-common-centre"))
        .args(arguments)
        .output()
        .expect("the program starts")
}

fn text(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

#[test]
fn it_is_listed_with_its_crate_and_explained_with_its_settings() {
    let list = text(&program(&["models"]));
    let line = list.lines().find(|line| line.contains("common-centre")).expect("its line");
    assert!(line.contains("jointscope-tests") && line.contains("features keep their distances from one point"));
    let explanation = text(&program(&["models", "common-centre"]));
    assert!(explanation.contains("tolerance = 0.02") && explanation.contains("0 < x"), "{explanation}");
}

#[test]
fn models_written_outside_conform() {
    for name in ["common-centre", "gantry"] {
        jointscope_models::conformance::check_linked(name);
    }
}

#[test]
fn a_model_without_mechanism_competes_by_likelihood() {
    let configuration = "[models.rigid]\n[models.prismatic]\n[models.revolute]\n[models.planar]\n[models.gantry]\n\
                         [models.disconnected]\nkind = 'free'\n";
    // A body that goes in all directions and does not turn, and the scenes of other joints.
    let mut moves = String::from("frame,body,x,y,z,qx,qy,qz,qw\n");
    let mut chance = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    for frame in 0..60 {
        let s = f64::from(frame) * 0.1;
        let places = [[0.0; 3], [0.4 + 0.2 * s.sin(), 0.15 * (1.7 * s).cos(), 1.0 + 0.1 * (2.3 * s).sin()]];
        for (body, place) in ["base", "tool"].iter().zip(places) {
            let mut noise = |sigma: f64| rand_distr::Normal::new(0.0, sigma).expect("sound").sample(&mut chance);
            let [x, y, z] = place.map(|x| x + noise(1e-3));
            let [qx, qy, qz] = [0.3, -0.2, 0.1].map(|q| q + noise(5e-4));
            let qw = (1.0 - qx * qx - qy * qy - qz * qz).sqrt();
            writeln!(moves, "{frame},{body},{x},{y},{z},{qx},{qy},{qz},{qw}").expect("a text grows");
        }
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [config, recording] = ["c.toml", "r.csv"].map(|name| folder.path().join(name));
    std::fs::write(&config, configuration).expect("written");
    std::fs::write(&recording, moves).expect("written");
    let [config, recording] = [&config, &recording].map(|path| path.to_string_lossy());
    let verdict = |pair: [&str; 2], from: [&str; 2]| {
        let json = text(&program(&["run", "--format", "json", "--config", &config, from[0], from[1]]));
        let detection: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        let found = detection["pairs"][0].clone();
        assert_eq!([&found["reference"], &found["moving"]], pair, "{found}");
        found
    };
    let found = verdict(["base", "tool"], ["--input", &recording]);
    assert_eq!((&found["joint"], &found["determined"]), (&"gantry".into(), &true.into()), "{found}");
    let last = &found["positions"][59];
    let went = [0.2 * (5.9_f64).sin(), 0.15 * ((1.7 * 5.9_f64).cos() - 1.0), 0.1 * (2.3 * 5.9_f64).sin()];
    // In the base's axes, which are the recording's at the first frame; noise of two places.
    for (axis, went) in went.iter().enumerate() {
        assert!((last[axis].as_f64().expect("a number") - went).abs() < 0.01, "{last} is not {went}");
    }
    for scene in ["rigid", "prismatic", "revolute", "planar"] {
        assert_eq!(verdict(["base", "part"], ["--scene", scene])["joint"], scene);
    }
}

#[test]
fn it_takes_part_in_a_run_and_wins_on_its_own_motion() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let config = folder.path().join("ball.toml");
    let text_of = |scene: &str| {
        format!(
            "[recording]\nscene = '{scene}'\nnoise = 0.0005\n[models.rigid]\nkind = 'thesis-rigid'\n\
             [models.spherical]\nkind = 'common-centre'\n[scoring]\nrule = 'cascade'\norder = ['rigid', 'spherical']"
        )
    };
    let verdict = |scene: &str| {
        std::fs::write(&config, text_of(scene)).expect("written");
        let json = text(&program(&["run", "--format", "json", "--config", &config.to_string_lossy()]));
        let detection: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        let pair = detection["pairs"][0].clone();
        assert!(pair["models"]["spherical"]["parts"]["mean_distance"].is_f64(), "{pair}");
        (pair["joint"].as_str().expect("a joint").to_owned(), pair["axis"].clone())
    };
    let (joint, axis) = verdict("spherical");
    assert_eq!(joint, "spherical");
    assert!(axis["point"].is_array() && axis["direction"].is_null(), "a spherical joint has a centre only: {axis}");
    assert_eq!(verdict("disconnected").0, "disconnected");
}
