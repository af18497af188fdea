//! Joints that cannot win are not fitted to the end, and that changes no verdict.

use jointscope_detection::{Detector, PairDetection};
use jointscope_models::{FitError, JointFit, JointModel, joint_model, lower_pair::Free};
use jointscope_motion::RelativeMotion;
use jointscope_scenes::{SceneOptions, simulate};
use jointscope_tests::detector;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Free motion under another kind: nobody knows beforehand that it explains everything.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Secretly {}

joint_model!(Secretly, "secretly-free", "any motion, unannounced");

impl JointModel for Secretly {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        Free::default().fit(motion)
    }

    fn states_evidence(&self) -> bool {
        true
    }

    fn parts(&self) -> &'static [&'static str] {
        &["misfit_distance", "departure", "chi_squared_per_freedom", "leap_share"]
    }
}

const JOINTS: [&str; 9] =
    ["rigid", "prismatic", "revolute", "screw", "cylindrical", "planar", "spherical", "disconnected", "universal"];

fn config(free: &str) -> Detector {
    let joints = "[models.rigid]\n[models.prismatic]\n[models.revolute]\n[models.screw]\n[models.cylindrical]\n\
         [models.planar]\n[models.spherical]\n";
    detector(&format!("{joints}[models.disconnected]\nkind = '{free}'\n"))
}

/// Scenes as they are, noisy, drifting, with wild samples, worn, long, filtered, and as poses.
fn conditions() -> [SceneOptions; 9] {
    let nominal = SceneOptions::default;
    [
        nominal(),
        SceneOptions { noise: Some(2e-4), sweep_deg: Some(120.0), ..nominal() },
        SceneOptions { noise: Some(0.01), sweep_deg: Some(15.0), travel: Some(0.04), ..nominal() },
        SceneOptions { drift: Some(0.9), ..nominal() },
        SceneOptions { outlier_samples: Some(0.1), frames: Some(80), ..nominal() },
        SceneOptions { play: Some(0.004), noise: Some(5e-4), ..nominal() },
        SceneOptions { frames: Some(200), noise: Some(0.001), ..nominal() },
        SceneOptions { filter: Some(3.0), frames: Some(150), ..nominal() },
        SceneOptions { poses: true, flips: Some(0.1), ..nominal() },
    ]
}

fn detected(detector: &Detector, joint: &str, options: &SceneOptions) -> PairDetection {
    let recording = simulate(joint, options).expect("a scene").recording;
    detector.detect(recording, None).expect("two bodies").pairs.remove(0)
}

/// Costs that fits which end elsewhere state: of those that are given up.
fn given_up(roughly: &PairDetection, wholly: &PairDetection) -> usize {
    let chi_squared = |pair: &PairDetection, name: &String| {
        pair.models[name].as_ref().ok().and_then(|fit| fit.evidence).map(|evidence| evidence.chi_squared)
    };
    roughly.models.keys().filter(|name| chi_squared(roughly, name) != chi_squared(wholly, name)).count()
}

#[test]
fn verdicts_are_those_of_fits_to_the_end() {
    /// Share of the verdict that joints which are given up have at most.
    const NONE: f64 = 1e-9;
    let (gives_up, fits_all) = (config("free"), config("secretly-free"));
    let mut all = 0;
    for (number, condition) in conditions().into_iter().enumerate() {
        for joint in JOINTS {
            for seed in 1..=3 {
                let options = SceneOptions { seed, ..condition.clone() };
                let (roughly, wholly) = (detected(&gives_up, joint, &options), detected(&fits_all, joint, &options));
                let what = format!("{joint}, condition {number}, seed {seed}");
                assert_eq!(roughly.verdict.joint, wholly.verdict.joint, "{what}");
                assert_eq!((roughly.determined, &roughly.notes), (wholly.determined, &wholly.notes), "{what}");
                for ((name, a), (_, b)) in roughly.verdict.confidences.iter().zip(&wholly.verdict.confidences) {
                    assert!((a - b).abs() < NONE, "{what}: {name} has {a}, fitted to the end {b}");
                }
                all += given_up(&roughly, &wholly);
            }
        }
    }
    // More than one of the seven joints of a scene, on average.
    assert!(all > conditions().len() * JOINTS.len() * 3, "{all} fits were given up");
}
