//! Detection while it is being recorded: one frame after another, verdicts whenever they are asked for.
//!
//! ```sh
//! cargo run -p jointscope-detection --example 05_live
//! ```

use jointscope_detection::{Configuration, LiveDetector};
use jointscope_models::lower_pair::{Free, Prismatic, Revolute, Rigid};
use jointscope_motion::{MotionSettings, Pose, Registration, nalgebra::Point3};

/// Places of features on a drawer and on its cabinet, metres.
const FEATURES: [[f64; 3]; 5] = [[0.0, 0.0, 1.0], [0.4, 0.0, 1.0], [0.0, 0.2, 1.0], [0.4, 0.2, 1.0], [0.2, 0.1, 1.05]];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let configuration = Configuration::builder()
        // Poses are found when a frame comes; by the default they would be found anew whenever verdicts are asked for.
        .motion(MotionSettings { registration: Registration::First, ..MotionSettings::default() })
        .model("fixed", Rigid::default())
        .model("slide", Prismatic::default())
        .model("hinge", Revolute::default())
        .model("disconnected", Free::default())
        .build()?;
    let labels: Vec<String> = (1..=FEATURES.len()).map(|number| number.to_string()).collect();
    let mut live =
        LiveDetector::new(configuration, vec![("cabinet".into(), labels.clone()), ("drawer".into(), labels)])?;
    let mut told = Vec::new();
    for frame in 0..90 {
        // At rest for a second, then pulled out by 40 cm, all carried about by a camera that moves.
        let time = f64::from(frame) / 30.0;
        let out = Pose::translation(0.0, 0.0, -0.2 * (time - 1.0).max(0.0));
        let seen = Pose::translation(0.05 * time, 0.02 * time, 0.0);
        let body = |pose: Pose| FEATURES.map(|place| pose * Point3::from(place));
        live.push(time, &[body(seen), body(seen * out)])?;
        if live.frames() % 30 == 0 {
            let detection = live.detect()?;
            let verdict = &detection.pairs[0].verdict;
            println!("after {time:.1} s: {} ({:.2})", verdict.joint, verdict.confidence);
            told.push(verdict.joint.clone());
        }
    }
    assert_eq!(told, ["fixed", "slide", "slide"]);
    Ok(())
}
