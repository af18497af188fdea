//! The thesis's Table 2, by the protocol of its section 6.2.

use jointscope_scenes::{SceneOptions, simulate};
use jointscope_tests::{THESIS, detector};
use rayon::prelude::*;

/// Noise as a share of the travel, and the mean confidence that the thesis's method must give.
const LEVELS: [(f64, f64); 4] = [(0.0038, 0.99), (0.0095, 0.96), (0.019, 0.77), (0.038, 0.23)];
/// Runs per level: the standard error of the worst level is then below 0.014.
const RUNS: u64 = 200;
/// How far the mean of the runs may be off.
const TOLERANCE: f64 = 0.03;
/// Travel of the slide, metres.
const TRAVEL: f64 = 0.5;

#[test]
fn table_2_comes_out_within_three_hundredths() {
    let detector = detector(THESIS);
    for (noise, expected) in LEVELS {
        let confidence = |seed: u64| {
            let options =
                SceneOptions { seed, noise: Some(noise * TRAVEL), travel: Some(TRAVEL), ..SceneOptions::default() };
            let simulation = simulate("table2", &options).expect("a scene");
            let detection = detector.detect(simulation.recording, None).expect("two bodies");
            let prismatic = detection.pairs[0].verdict.confidences.iter().find(|(joint, _)| joint == "prismatic");
            prismatic.expect("asked for").1
        };
        let mean = (1000..1000 + RUNS).into_par_iter().map(confidence).sum::<f64>() / RUNS as f64;
        assert!((mean - expected).abs() < TOLERANCE, "noise of {noise} of the travel: {mean:.3}, expected {expected}");
    }
}
