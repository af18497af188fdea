//! The recording is what it says it is, and the program finds the gears in it.

use std::{fmt::Write, path::Path, process::Command};

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

/// Teeth of the sun and the planet, and the distance of their axes in metres.
const TEETH: [f64; 2] = [24.0, 12.0];
const DISTANCE: f64 = 0.18;
/// Standard deviation of a coordinate, metres.
const NOISE: f64 = 0.001;
const FRAMES: usize = 80;

/// A sun wheel that turns slowly, and a planet that an arm carries around it, as a camera sees them.
fn recording() -> String {
    let mut state = 24_u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut gaussian = || (-2.0 * (1.0 - uniform()).ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos();
    let about_z = |angle: f64| Isometry3::rotation(Vector3::z() * angle);
    let camera =
        Isometry3::from_parts(Vector3::new(0.1, -0.05, 1.2).into(), UnitQuaternion::new(Vector3::new(2.6, 0.3, 0.2)));
    let feature = |index: usize, radius: f64| {
        let angle = 2.4 * index as f64;
        let radius = radius * (0.5 + 0.5 * ((index * 5) % 8) as f64 / 7.0);
        Point3::new(radius * angle.cos(), radius * angle.sin(), 0.02 * ((index * 3) % 4) as f64)
    };
    let mut text = String::from("frame,body,feature,x,y,z\n");
    for frame in 0..FRAMES {
        let phase = frame as f64 / (FRAMES - 1) as f64;
        let (sun, arm) = (0.6 * phase, 0.6 * phase + 3.5 * phase * phase * (3.0 - 2.0 * phase));
        // The teeth mesh: seen from the arm, the wheels turn against each other.
        let planet = arm + (arm - sun) * TEETH[0] / TEETH[1];
        let planet = about_z(arm) * Isometry3::translation(DISTANCE, 0.0, 0.0) * about_z(planet - arm);
        for (body, pose, radius) in [("sun", about_z(sun), 0.12), ("planet", planet, 0.06)] {
            for index in 0..8 {
                let seen = camera * pose * feature(index, radius);
                let [x, y, z] = [seen.x, seen.y, seen.z].map(|x| x + NOISE * gaussian());
                writeln!(text, "{frame},{body},{index},{x:.5},{y:.5},{z:.5}").expect("text grows");
            }
        }
    }
    text
}

#[test]
fn the_recording_is_what_it_says_it_is() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("recording.csv");
    if std::env::var_os("WRITE_RECORDING").is_some() {
        std::fs::write(&path, recording()).expect("written");
    }
    assert!(std::fs::read_to_string(path).expect("there") == recording(), "write it anew with WRITE_RECORDING=1");
}

#[test]
fn the_gears_are_found() {
    let run = Command::new(env!("CARGO_BIN_EXE_gear-coupled"))
        .args(["run", "--config", "gears.toml", "--format", "json"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("the program starts");
    let json = String::from_utf8(run.stdout).expect("UTF-8");
    assert!(json.contains("\"joint\": \"gear-coupled\"") && json.contains("\"determined\": true"), "{json}");
    let of_model = json.split("\"gear-coupled\": {").nth(1).expect("its finding");
    let distance = of_model.split("\"distance\": ").nth(1).and_then(|text| text.split(',').next()).expect("a distance");
    let distance: f64 = distance.trim().parse().expect("a number");
    // Noise of 1 mm in 80 frames of 8 features is 0.04 mm; the axes are known less well.
    assert!((distance - DISTANCE).abs() < 0.001, "{distance}");
}
