//! Recordings that show next to nothing, or bear strange names, make sound reports all the same.

use jointscope_detection::{Configuration, Detector};
use jointscope_models::Catalog;
use jointscope_motion::{Body, Pose, Recording, Tracks};
use jointscope_report::{Report, pairs_to_svg, to_html, to_mjcf, to_styled_table, to_svg, to_urdf};
use nalgebra::{Point3, Vector3};

/// Features that turn about z, from frame to frame by `step` radians.
fn body(name: &str, features: usize, frames: usize, step: f64, size: f64) -> Body {
    let place = |frame: usize, feature: usize| {
        let corner = [0.3, 0.7, 0.2, 0.9, 0.5].map(|share| (share * (feature + 2) as f64 * 7.3).sin());
        let place = Point3::new(0.4, 0.1, 1.5) + size * Vector3::new(corner[0], corner[1], corner[2]);
        Pose::rotation(Vector3::z() * step * frame as f64) * place
    };
    let places = (0..frames).flat_map(|frame| (0..features).map(move |feature| place(frame, feature)));
    let labels = (0..features).map(|feature| feature.to_string()).collect();
    Body::from_points(name, labels, Tracks::new(features, places.collect()).expect("whole frames")).expect("seen")
}

fn recording(frames: u64, bodies: Vec<Body>) -> Recording {
    Recording::new((0..frames).collect(), None, bodies).expect("valid")
}

/// All that can be said of a recording, as text.
fn reports(recording: &Recording) -> Vec<String> {
    let configuration = Configuration::parse("", &Catalog::linked().expect("unique names")).expect("valid");
    let detection = Detector::new(configuration).detect(recording.clone(), None).expect("bodies");
    let report = Report { detection: &detection, recording, settings: "# settings" };
    assert_eq!(to_html(&report), to_html(&report), "equal reports give equal bytes");
    let table = to_styled_table(&detection, jointscope_report::Style { width: Some(40), colour: true });
    [vec![to_html(&report), to_svg(&report), to_urdf(&report), to_mjcf(&report), table], pairs_to_svg(&report)].concat()
}

#[test]
fn thin_recordings_make_reports_of_numbers() {
    let still = |name, features, frames| body(name, features, frames, 0.0, 0.2);
    let turning = |name, features, frames| body(name, features, frames, 0.05, 0.2);
    for (name, recording) in [
        ("one frame", recording(1, vec![still("a", 5, 1), still("b", 5, 1)])),
        ("at rest", recording(9, vec![still("a", 5, 9), still("b", 5, 9)])),
        ("one feature", recording(40, vec![still("a", 5, 40), turning("b", 1, 40)])),
        ("no orientation", recording(40, vec![turning("a", 1, 40), turning("b", 2, 40)])),
        ("one body", recording(40, vec![turning("a", 5, 40)])),
        ("one point", recording(20, vec![body("a", 5, 20, 0.0, 0.0), body("b", 5, 20, 0.0, 0.0)])),
        ("huge", recording(20, vec![body("a", 5, 20, 0.0, 1e30), body("b", 5, 20, 0.1, 1e30)])),
    ] {
        for text in reports(&recording) {
            // The library in the page has words of its own.
            let drawn = text.split("<script").next().unwrap_or_default();
            let wrong = ["NaN", "inf ", "\"inf", "-inf"].into_iter().find(|word| drawn.contains(word));
            assert_eq!(wrong, None, "{name}: {drawn}");
        }
    }
}

#[test]
fn names_are_text_in_pages_and_pictures() {
    let evil = ["</script><script>alert(1)</script>", "\"/><svg onload='x'> & {{ 7 * 7 }} \u{202e}"];
    let bodies = vec![body(evil[0], 6, 40, 0.0, 0.2), body(evil[1], 6, 40, 0.05, 0.2)];
    // A table is text itself.
    for text in reports(&recording(40, bodies)).into_iter().filter(|text| text.starts_with('<')) {
        assert!(!text.contains("<script>alert") && !text.contains("<svg onload") && !text.contains('\u{202e}'));
        assert!(!text.contains("& {{ 49"));
    }
}
