//! Relative motion: how one body moves, seen from another that moves itself.
//!
//! ```sh
//! cargo run -p jointscope-detection --example 02_relative_motion
//! ```

use jointscope_motion::{BodyMotion, MotionSettings, RelativeMotion};
use jointscope_scenes::{SceneOptions, simulate};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let simulation = simulate("revolute", &SceneOptions { seed: 7, ..SceneOptions::default() })?;
    let bodies = simulation.recording.bodies();

    // Every body once: its shape, its poses, its noise.
    let settings = MotionSettings::default();
    let [base, part] = [0, 1].map(|index| BodyMotion::of(&bodies[index], &settings));
    println!("noise of {}: {:.4} m", part.name(), part.noise().position.unwrap_or(f64::NAN));

    let motion = RelativeMotion::between(&base, &part)?;
    let lengths = motion.path_lengths();
    println!("paths: {:.2} m, {:.2} m, relative {:.2} m", lengths.reference, lengths.moving, lengths.relative);

    let poses = motion.frames().iter().filter_map(|&frame| motion.pose(frame));
    let first = motion.pose(motion.frames()[0]).ok_or("the first frame shows both")?;
    let most = poses.map(|pose| (pose.rotation * first.rotation.inverse()).angle()).fold(0.0, f64::max);
    println!("turns by up to {:.0} degrees", most.to_degrees());
    assert!(most > 0.2);
    Ok(())
}
