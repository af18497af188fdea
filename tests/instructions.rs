//! Whatever instructions a machine has, results are the same, bit by bit.

use jointscope_detection::Detector;
use jointscope_motion::{Instructions, Recording};
use jointscope_report::to_json;
use jointscope_scenes::{SceneOptions, simulate};
use jointscope_tests::{detector, real};
use rayon::prelude::*;
use serde_json::Value;

/// The configurations; the last one takes long.
const CONFIGURATIONS: [&str; 4] = ["default", "thesis", "mixed", "scale"];
/// Of the real recordings, one in so many, and of all, one in so many whose scale is sought.
const EVERY: usize = 8;
const SCALED: usize = 13;
/// Scenes at least; not every joint has every condition.
const FEWEST: usize = 60;

const KINDS: [&str; 10] = [
    "rigid",
    "prismatic",
    "revolute",
    "screw",
    "cylindrical",
    "planar",
    "spherical",
    "disconnected",
    "elliptical",
    "fridge",
];

/// Scenes without noise, as they are, noisy, with noise along the ray, drifting, with gaps, with wild samples, and as poses.
fn conditions() -> [SceneOptions; 8] {
    let nominal = SceneOptions::default;
    [
        SceneOptions { noise: Some(0.0), ..nominal() },
        nominal(),
        SceneOptions { noise: Some(0.01), frames: Some(37), ..nominal() },
        SceneOptions { depth_noise: Some(4.0), ..nominal() },
        SceneOptions { drift: Some(0.9), sweep_deg: Some(12.0), ..nominal() },
        SceneOptions { dropout: Some(0.3), features: Some(7), ..nominal() },
        SceneOptions { outlier_samples: Some(0.05), noise: Some(5e-4), ..nominal() },
        SceneOptions { poses: true, ..nominal() },
    ]
}

fn scenes() -> Vec<(String, Recording)> {
    let scene = |(number, options): (usize, &SceneOptions), kind: &str| {
        simulate(kind, options).ok().map(|scene| (format!("{kind}, condition {number}"), scene.recording))
    };
    let all = conditions();
    let scenes: Vec<_> = all.iter().enumerate().flat_map(|options| KINDS.map(|kind| scene(options, kind))).collect();
    scenes.into_iter().flatten().collect()
}

/// What all configurations find in all recordings by one set of instructions; scales, which take long, in few.
fn by(set: Instructions, recordings: &[(String, Recording)]) -> Vec<Vec<String>> {
    assert!(set.choose(), "{set} is here");
    let configuration = |name: &str| {
        let path = format!("{}/../configs/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        detector(&std::fs::read_to_string(path).expect("a configuration"))
    };
    let detectors = CONFIGURATIONS.map(configuration);
    let found = |detector: &Detector, recording: &Recording| {
        detector.detect(recording.clone(), None).map_or_else(|error| error.to_string(), |found| to_json(&found))
    };
    let of_recording = |(number, (_, recording)): (usize, &(String, Recording))| {
        let few = if number % SCALED == 0 { CONFIGURATIONS.len() } else { CONFIGURATIONS.len() - 1 };
        detectors[..few].iter().map(|detector| found(detector, recording)).collect()
    };
    recordings.par_iter().enumerate().map(of_recording).collect()
}

/// Says where two results differ.
fn compare(place: &str, one: &Value, other: &Value, differ: &mut Vec<String>) {
    match (one, other) {
        (Value::Object(a), Value::Object(b)) if a.keys().eq(b.keys()) => {
            a.iter().zip(b.values()).for_each(|((key, x), y)| compare(&format!("{place}/{key}"), x, y, differ));
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).enumerate().for_each(|(k, (x, y))| compare(&format!("{place}/{k}"), x, y, differ));
        }
        (a, b) if a == b => (),
        (a, b) => differ.push(format!("{place}: {a} and {b}")),
    }
}

/// Instructions are chosen for the whole process, so that this is one test.
#[test]
fn results_are_the_same_whatever_the_instructions() {
    let mut recordings = scenes();
    assert!(recordings.len() >= FEWEST, "{} scenes", recordings.len());
    if let Some(folder) = real::folder() {
        let some = real::cases(&folder).into_iter().step_by(EVERY);
        recordings.extend(some.map(|case| (case.name.clone(), case.recording().expect("a sound recording"))));
    }
    let mut sets = Instructions::here().into_iter();
    let first = sets.next().expect("one at a time everywhere");
    let expected = by(first, &recordings);
    let mut differ = Vec::new();
    for set in sets {
        for ((name, _), (expected, found)) in recordings.iter().zip(expected.iter().zip(by(set, &recordings))) {
            for (configuration, (expected, found)) in CONFIGURATIONS.iter().zip(expected.iter().zip(&found)) {
                if expected != found {
                    let place = format!("{name}, {configuration}, {set}");
                    let [expected, found] =
                        [expected, found].map(|text| serde_json::from_str(text).unwrap_or(Value::from(&**text)));
                    compare(&place, &expected, &found, &mut differ);
                    differ.push(format!("{place}: not bit by bit what {first} finds"));
                }
            }
        }
    }
    assert!(differ.is_empty(), "{}", differ.join("\n"));
}
