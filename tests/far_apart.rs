//! Small bodies that are far apart: what is known of their turns is little, times the distance.

use jointscope_detection::PairDetection;
use jointscope_scenes::{SceneOptions, simulate};
use jointscope_tests::detector;

/// Six features of 15 cm bodies, 5 mm of noise.
fn far(kind: &str, seed: u64, axis_distance: f64, still_base: bool) -> PairDetection {
    let options = SceneOptions {
        seed,
        features: Some(6),
        noise: Some(0.005),
        axis_distance: Some(axis_distance),
        still_base,
        ..SceneOptions::default()
    };
    let recording = simulate(kind, &options).expect("a scene").recording;
    detector("").detect(recording, None).expect("detected").pairs.remove(0)
}

const SEEDS: std::ops::Range<u64> = 0..10;

#[test]
fn joints_metres_away_from_a_resting_base_are_told() {
    for kind in ["prismatic", "revolute", "spherical"] {
        let told = SEEDS.filter(|seed| far(kind, *seed, 3.0, true).verdict.joint == kind).count();
        assert!(told >= 8, "{told} of 10 {kind}");
    }
}

#[test]
fn slides_that_drown_between_moving_bodies_are_not_determined() {
    let drowned = |pair: &PairDetection| pair.notes.iter().any(|note| note.contains("slides drown in it"));
    let mut noted = 0;
    for pair in SEEDS.map(|seed| far("prismatic", seed, 5.0, false)) {
        let joint = &pair.verdict.joint;
        assert!(joint == "prismatic" || !pair.determined, "{joint}: {:?}", pair.notes);
        assert!(!(drowned(&pair) && pair.determined));
        noted += usize::from(drowned(&pair));
    }
    assert!(noted >= 5, "{noted} of 10");
    assert!(!drowned(&far("prismatic", 0, 0.5, false)), "near enough");
}
