//! Recordings of a single camera: compressed depth.

use jointscope_detection::{Configuration, Detector};
use jointscope_models::Catalog;
use jointscope_motion::{DepthGain, DepthGainSetting, undo_depth_gain};
use jointscope_scenes::{SceneOptions, simulate};

const SEEDS: u64 = 8;

fn gain_of(scene: &str, options: &SceneOptions, setting: DepthGainSetting) -> DepthGain {
    let simulation = simulate(scene, options).expect("simulated");
    undo_depth_gain(&simulation.recording.bodies()[1], setting).expect("asked for").gain
}

#[test]
fn depth_gains_are_told_by_rigidity() {
    for (gain, noise, most) in [(0.6, 0.0005, 0.007), (0.6, 0.002, 0.015), (0.9, 0.0005, 0.007), (0.9, 0.002, 0.015)] {
        for scene in ["revolute", "rigid"] {
            let (mut square, mut told) = (0.0, 0.0);
            for seed in 0..SEEDS {
                let options =
                    SceneOptions { seed, noise: Some(noise), depth_gain: Some(gain), ..SceneOptions::default() };
                let found = gain_of(scene, &options, DepthGainSetting::Estimate);
                assert!(found.observable, "{scene} {gain} {noise} {seed}");
                square += (found.gain / gain - 1.0).powi(2) / SEEDS as f64;
                told += (found.standard_error.expect("estimated") / gain).powi(2) / SEEDS as f64;
            }
            assert!(square.sqrt() < most, "{scene} {gain} {noise}: off by {:.4}", square.sqrt());
            // Of eight runs, a root mean square is known to about a quarter.
            let ratio = (square / told).sqrt();
            assert!((0.4..1.9).contains(&ratio), "{scene} {gain} {noise}: error over stated error {ratio:.2}");
        }
    }
}

#[test]
fn a_body_that_does_not_turn_out_of_the_image_plane_tells_no_gain() {
    for seed in 0..SEEDS {
        let options = SceneOptions { seed, still_base: true, ..SceneOptions::default() };
        for scene in ["prismatic", "rigid"] {
            let found = gain_of(scene, &options, DepthGainSetting::Estimate);
            assert_eq!((found.observable, found.gain), (false, 1.0), "{scene} {seed}: {found:?}");
        }
    }
}

#[test]
fn wild_samples_and_features_do_not_spoil_a_gain() {
    for seed in 0..SEEDS {
        let options = SceneOptions {
            seed,
            noise: Some(0.001),
            depth_gain: Some(0.7),
            dropout: Some(0.2),
            outlier_samples: Some(0.05),
            outlier_features: Some(0.1),
            ..SceneOptions::default()
        };
        let found = gain_of("revolute", &options, DepthGainSetting::Estimate);
        assert!(found.observable && (found.gain / 0.7 - 1.0).abs() < 0.04, "{seed}: {found:?}");
    }
}

#[test]
fn with_its_depth_gain_undone_the_door_of_the_fridge_is_a_hinge() {
    for setting in ["'estimate'", "0.6"] {
        let text = format!("motion.depth_gain = {setting}");
        let configuration = Configuration::parse(&text, &Catalog::linked().expect("unique")).expect("valid");
        let simulation = simulate("fridge", &SceneOptions::default()).expect("simulated");
        let pair = [["background".to_owned(), "door1".to_owned()]];
        let detection = Detector::new(configuration).detect(simulation.recording, Some(&pair)).expect("detected");
        let pair = &detection.pairs[0];
        assert_eq!(pair.verdict.joint, "revolute", "{setting}: {:?}", pair.notes);
        let [resting, moving] = pair.depth_gain.expect("asked for");
        assert_eq!((resting.gain, resting.observable), (1.0, false), "the background never moves");
        assert!((moving.gain - 0.6).abs() < 0.01 && moving.observable, "{setting}: {moving:?}");
    }
}
