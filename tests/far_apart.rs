//! Small bodies that are far apart: what is known of their turns is little, times the distance.

use jointscope_detection::PairDetection;
use jointscope_scenes::{SceneOptions, simulate};
use jointscope_tests::detector;

/// Six features of 15 cm bodies, 5 mm of noise.
fn far(seed: u64, axis_distance: f64, still_base: bool) -> PairDetection {
    let options = SceneOptions {
        seed,
        features: Some(6),
        noise: Some(0.005),
        axis_distance: Some(axis_distance),
        still_base,
        ..SceneOptions::default()
    };
    let recording = simulate("prismatic", &options).expect("a scene").recording;
    detector("").detect(recording, None).expect("detected").pairs.remove(0)
}

#[test]
fn slides_that_drown_are_not_determined() {
    let drowned = |pair: &PairDetection| pair.notes.iter().any(|note| note.contains("slides drown in it"));
    let mut noted = 0;
    for (seed, still_base) in (0..20).map(|number| (number / 2, number % 2 == 0)) {
        let pair = far(seed, 5.0, still_base);
        let joint = &pair.verdict.joint;
        assert!(joint == "prismatic" || !pair.determined, "{joint}: {:?}", pair.notes);
        assert!(!(drowned(&pair) && pair.determined));
        noted += usize::from(drowned(&pair));
    }
    assert!(noted >= 10, "{noted} of 20");
    assert!(!drowned(&far(0, 0.5, false)), "near enough");
}
