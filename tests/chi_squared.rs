//! What the right joint leaves unexplained is what chance leaves, whatever the noise.

use jointscope_scenes::{SceneOptions, simulate};
use jointscope_tests::detector;

/// Mean of a part of the right joint's fit over joints and seeds.
fn left_by_the_right_joint(options: &SceneOptions) -> f64 {
    const JOINTS: [&str; 5] = ["rigid", "prismatic", "revolute", "planar", "spherical"];
    const SEEDS: u64 = 12;
    let detector = detector("");
    let mut sum = 0.0;
    for joint in JOINTS {
        for seed in 1..=SEEDS {
            let recording = simulate(joint, &SceneOptions { seed, ..options.clone() }).expect("a scene").recording;
            let detection = detector.detect(recording, None).expect("two bodies");
            let fit = detection.pairs[0].models[joint].as_ref().expect("a fit");
            sum += fit.parts["chi_squared_per_freedom"];
        }
    }
    sum / (JOINTS.len() as u64 * SEEDS) as f64
}

/// Chance leaves a fortieth to the noise of 12 seeds, which is the same but for its size in all conditions.
const ALLOWED: std::ops::Range<f64> = 0.94..1.06;

#[test]
fn noise_as_large_as_the_motion_leaves_what_chance_leaves() {
    let [small, large] = [0.003, 0.02]
        .map(|noise| left_by_the_right_joint(&SceneOptions { noise: Some(noise), ..SceneOptions::default() }));
    assert!(ALLOWED.contains(&small), "{small:.3} of what is expected");
    assert!((large / small - 1.0).abs() < 0.05, "{large:.3} of what is expected, and {small:.3} of small noise");
}

#[test]
fn drifting_noise_leaves_what_chance_leaves() {
    for drift in [0.5, 0.9] {
        let left = left_by_the_right_joint(&SceneOptions { drift: Some(drift), ..SceneOptions::default() });
        assert!(ALLOWED.contains(&left), "drift {drift}: {left:.3} of what is expected");
    }
}
