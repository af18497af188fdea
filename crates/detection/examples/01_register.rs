//! Registration: the rigid motion between two sets of points.
//!
//! ```sh
//! cargo run -p jointscope-detection --example 01_register
//! ```

use jointscope_motion::{Pose, nalgebra::Point3, nalgebra::Vector3, register};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A pose is named by its direction: it maps coordinates of the source to those of the target.
    let target_from_source = Pose::new(Vector3::new(0.1, 0.0, -0.2), Vector3::z() * 0.5);
    let source = [[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.1]].map(Point3::from);
    let target = source.map(|point| target_from_source * point);

    let found = register(source.iter().zip(&target))?;
    println!(
        "turned by {:.1} degrees, moved by {:.3} m",
        found.rotation.angle().to_degrees(),
        found.translation.vector.norm()
    );
    assert!((found.rotation.angle() - 0.5).abs() < 1e-12);
    Ok(())
}
