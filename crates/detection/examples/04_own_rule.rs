//! Rules of one's own: as expressions, and as a function over what the models found.
//!
//! ```sh
//! cargo run -p jointscope-detection --example 04_own_rule
//! ```

use jointscope_detection::{Configuration, Detector, PairDetection, RuleKind, ScoringSettings};
use jointscope_models::{
    lower_pair::{Free, Prismatic, Revolute},
    thesis::ThesisRevolute,
};
use jointscope_scenes::{SceneOptions, simulate};

/// The joint whose samples lie nearest to it, whatever it takes; free motion, which explains everything, aside.
fn nearest(pair: &PairDetection) -> Option<&str> {
    let fits = pair.models.iter().filter_map(|(name, found)| Some((name, found.as_ref().ok()?.residual_rms?)));
    let fits = fits.filter(|(name, _)| *name != "disconnected");
    fits.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(name, _)| name.as_str())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The evidence of a hinge counts as far as points are seen on circles; a tenth of it in any case.
    let expressions = [
        ("hinge", "hinge.likelihood * (0.1 + circles.circle_fit)"),
        ("slide", "slide.likelihood * (1.1 - circles)"),
        ("disconnected", "disconnected.likelihood"),
    ];
    let scoring = ScoringSettings {
        rule: RuleKind::Expressions,
        normalise: true,
        expressions: expressions.map(|(joint, text)| (joint.to_owned(), text.to_owned())).into(),
        ..ScoringSettings::default()
    };
    let configuration = Configuration::builder()
        .model("slide", Prismatic::default())
        .model("hinge", Revolute::default())
        .model("disconnected", Free::default())
        .model("circles", ThesisRevolute::default())
        .scoring(scoring)
        .build()?;
    let detector = Detector::new(configuration);
    let simulation = simulate("revolute", &SceneOptions { seed: 3, ..SceneOptions::default() })?;
    let detection = detector.detect(simulation.recording, None)?;

    let pair = &detection.pairs[0];
    println!("by expressions: {} ({:.3})", pair.verdict.joint, pair.verdict.confidence);
    for account in detector.explain(pair).accounts {
        println!("  {}: {}", account.joint, account.arithmetic);
    }
    println!("by the least residual: {}", nearest(pair).unwrap_or("none"));
    assert_eq!(pair.verdict.joint, "hinge");
    Ok(())
}
