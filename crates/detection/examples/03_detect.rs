//! Detection without files or TOML: models and settings in code, a recording made of numbers.
//!
//! ```sh
//! cargo run -p jointscope-detection --example 03_detect
//! ```

use jointscope_detection::{Configuration, Detector, ScoringSettings};
use jointscope_models::lower_pair::{Free, Prismatic, Revolute, Rigid};
use jointscope_motion::{Body, Recording, Tracks, nalgebra::Point3};

/// A lid of five features that opens about the x axis, seen without noise; the world rests.
fn lid() -> Result<Recording, Box<dyn std::error::Error>> {
    const FRAMES: u32 = 40;
    let features = [[0.0, 0.1, 0.0], [0.3, 0.1, 0.0], [0.0, 0.3, 0.0], [0.3, 0.3, 0.0], [0.15, 0.2, 0.02]];
    let turned = |[x, y, z]: [f64; 3], angle: f64| {
        let (sin, cos) = angle.sin_cos();
        Point3::new(x, cos * y - sin * z, sin * y + cos * z)
    };
    let samples = (0..FRAMES).flat_map(|frame| features.map(|feature| turned(feature, 0.03 * f64::from(frame))));
    let labels = (1..=features.len()).map(|feature| feature.to_string()).collect();
    let tracks = Tracks::new(features.len(), samples.collect())?;
    let lid = Body::from_points("lid", labels, tracks)?;
    Ok(Recording::new((0..u64::from(FRAMES)).collect(), None, vec![lid])?)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let configuration = Configuration::builder()
        .model("fixed", Rigid::default())
        .model("slide", Prismatic::default())
        .model("hinge", Revolute::default())
        .model("disconnected", Free::default())
        .scoring(ScoringSettings { lead: 8.0, ..ScoringSettings::default() })
        .build()?;
    let detector = Detector::new(configuration);
    let detection = detector.detect(lid()?, None)?;
    for pair in &detection.pairs {
        println!("{} - {}: {} ({:.3})", pair.reference, pair.moving, pair.verdict.joint, pair.verdict.confidence);
        for reason in detector.explain(pair).reasons {
            println!("  {reason}");
        }
    }
    assert_eq!(detection.pairs[0].verdict.joint, "hinge");
    Ok(())
}
