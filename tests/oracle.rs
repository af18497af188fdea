//! The thesis models against an independent implementation, on the recordings and answers of `oracle/`.

use std::{fs, path::PathBuf};

use jointscope_recordings::{ReadOptions, read};
use jointscope_tests::{THESIS, detector};
use nalgebra::{Point3, Vector3};
use serde_json::Value;

/// Scores are counts and smooth functions of lengths; rounding leaves ten digits (see `oracle/README.md`).
const SCORE: f64 = 1e-9;
/// Least tolerance of a direction, radians, and of a point, metres.
const GEOMETRY: f64 = 1e-9;

fn number(answer: &Value) -> f64 {
    if answer == "inf" { f64::INFINITY } else { answer.as_f64().expect("a number") }
}

fn vector(answer: &Value) -> Vector3<f64> {
    Vector3::from_iterator((0..3).map(|i| number(&answer[i])))
}

#[test]
fn every_score_equals_the_independent_one() {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/oracle/cases"));
    let detector = detector(THESIS);
    let mut cases = 0;
    for entry in fs::read_dir(folder).expect("the cases") {
        let path = entry.expect("a file").path();
        if path.extension().is_none_or(|extension| extension != "csv") {
            continue;
        }
        cases += 1;
        let text = fs::read_to_string(path.with_extension("json")).expect("the answer");
        let answer: Value = serde_json::from_str(&text).expect("JSON");
        let name = answer["case"].as_str().expect("a name");
        let recording = read(&path, &ReadOptions::default()).expect("a recording");
        let detection = detector.detect(recording, None).expect("two bodies");
        let pair = &detection.pairs[0];
        let same = |what: &str, found: f64, expected: f64| {
            assert!(
                found == expected || (found - expected).abs() < SCORE,
                "{name}: {what} is {found}, expected {expected}"
            );
        };
        for (joint, confidence) in &pair.verdict.confidences {
            same(joint, *confidence, number(&answer[format!("confidence_{joint}").as_str()]));
        }
        let sum: f64 = pair.verdict.confidences.iter().map(|(_, confidence)| confidence).sum();
        assert!((sum - 1.0).abs() < 1e-12, "{name}: confidences sum to {sum}");
        for (model, part, key) in [
            ("rigid", "motion_ratio", "motion_ratio"),
            ("rigid", "distance_reference", "dist_reference"),
            ("rigid", "distance_moving", "dist_moving"),
            ("rigid", "distance_relative", "dist_relative"),
            ("prismatic", "cylinder_fit", "cylinder_fit"),
            ("prismatic", "lines_equal", "lines_equal"),
            ("revolute", "circle_fit", "circle_fit"),
            ("revolute", "occupied_degrees", "occupied_angle_deg"),
            ("revolute", "occupied_angle", "occupied_angle"),
            ("revolute", "axis_fit", "axis_fit"),
        ] {
            let fit = pair.models[model].as_ref().expect("a fit");
            same(part, fit.parts[part], number(&answer[key]));
        }

        let wobble = |key: &str| (100.0 * number(&answer["change_under_1e_12_m"][key])).max(GEOMETRY);
        let axis = pair.models["revolute"].as_ref().expect("a fit").joint.axis.expect("an axis");
        let off = axis.direction.expect("a direction").cross(&vector(&answer["axis_direction"])).norm();
        assert!(off < wobble("axis_direction"), "{name}: the axis is {off:e} rad off");
        let off = (axis.point - Point3::from(vector(&answer["axis_point"]))).norm();
        assert!(off < wobble("axis_point"), "{name}: the axis point is {off:e} m off");
        let axis = pair.models["prismatic"].as_ref().expect("a fit").joint.axis.expect("an axis");
        let off = axis.direction.expect("a direction").cross(&vector(&answer["prismatic_direction"])).norm();
        assert!(off < wobble("prismatic_direction"), "{name}: the slide is {off:e} rad off");
    }
    assert_eq!(cases, 17, "the cases of the oracle");
}
