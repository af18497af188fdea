//! The thesis's protocol of section 6.2, whose results are its Table 2.

use jointscope_motion::Pose;
use nalgebra::{Point3, UnitVector3, Vector3};
use rand_distr::{Distribution as _, UnitSphere};

use crate::sensor::{Purpose, stream};
use crate::{Attachment, Joint, JointKind, Scene, SceneBody, SceneError, SceneOptions, Shape, law};

/// Travel of the slider where the options ask for none, metres.
const TRAVEL: f64 = 0.5;
/// Noise as a share of the travel: the first row of Table 2.
const NOISE: f64 = 0.0038;

/// Body `slider` runs straight at uniform speed past body `base`, which rests and is seen exactly. Every sample of the
/// slider has Gaussian noise.
pub(crate) fn table2(options: &SceneOptions) -> Result<Scene, SceneError> {
    options.refuse("table2", &["sweep_deg", "axis_distance", "base_distance", "monocular", "poses", "body_shape"])?;
    let frames = options.frames.unwrap_or(20);
    let features = options.features.unwrap_or(20);
    let travel = options.travel.unwrap_or(TRAVEL);
    let edge = options.body_size.unwrap_or(0.15);
    let direction = UnitSphere.sample(&mut stream(options.seed, Purpose::Layout, 0));
    let direction = UnitVector3::new_normalize(Vector3::from(direction));
    // Half-way the slider passes the point that the camera looks at.
    let start = Point3::new(0.0, 0.0, 1.5) - direction.into_inner() * (travel / 2.0);
    let joint = Joint::about(JointKind::Prismatic, start, direction.into_inner());
    let body = |name: &str, centre: Point3<f64>, attachment, noise_factor| SceneBody {
        name: name.into(),
        features,
        shape: Shape::Box { size: [edge; 3] },
        placement: Pose::translation(centre.x, centre.y, centre.z),
        attachment,
        noise_factor,
        scale: 1.0,
        depth_gain: 1.0,
    };
    let base = body("base", Point3::new(0.0, 0.3, 1.5), Attachment::at_rest(), 0.0);
    let mut slider = body("slider", start, Attachment::new(Some(0), joint, vec![law::ramp(frames, travel)]), 1.0);
    slider.scale = options.scale.unwrap_or(1.0);
    slider.depth_gain = options.depth_gain.unwrap_or(1.0);
    slider.attachment.play = options.play.unwrap_or(0.0);
    slider.attachment.bend = options.bend.unwrap_or(0.0);
    let sensor = options.sensor(NOISE * travel);
    Ok(Scene { name: "table2".into(), frames, rate: 30.0, bodies: vec![base, slider], sensor })
}

#[cfg(test)]
mod tests {
    use jointscope_motion::Observation;

    use crate::{Positions, SceneOptions, simulate};

    #[test]
    fn the_slider_runs_at_uniform_speed_past_a_base_seen_exactly() {
        let simulation = simulate("table2", &SceneOptions { seed: 4, ..Default::default() }).expect("table2");
        let pair = &simulation.truth.pairs[0];
        assert_eq!(
            (pair.reference.as_str(), pair.moving.as_str(), pair.joint.as_str()),
            ("base", "slider", "prismatic")
        );
        let Some(Positions::Single(q)) = &pair.positions else { panic!("one number per frame") };
        assert_eq!(q.len(), 20);
        assert!(q.iter().enumerate().all(|(frame, q)| (q - 0.5 * frame as f64 / 19.0).abs() < 1e-12));
        let [base, slider] = [0, 1].map(|body| match simulation.recording.bodies()[body].observation() {
            Observation::Points { tracks, .. } => tracks,
            _ => panic!("points"),
        });
        assert!((1..20).all(|frame| base.repeats_previous(frame) && !slider.repeats_previous(frame)));
        assert_eq!(slider.features(), 20);
        assert!((simulation.truth.bodies[1].noise - 0.0019).abs() < 1e-15);
        assert!(simulation.truth.bodies[0].noise == 0.0);
    }

    #[test]
    fn noise_left_out_follows_the_travel() {
        let simulation = simulate("table2", &SceneOptions { travel: Some(1.0), ..Default::default() }).expect("table2");
        assert!((simulation.truth.bodies[1].noise - 0.0038).abs() < 1e-15);
    }
}
