//! `gantry`: a joint with evidence and without a mechanism, written as a user would: nothing of the project is touched.

use jointscope_models::lower_pair::{cost_of_positions, starts};
use jointscope_models::{
    Confidence, Departure, Evidence, FitError, Joint, JointFit, JointModel, Mobility, Positions, joint_model,
};
use jointscope_motion::{Pose, RelativeMotion, twist};
use nalgebra::{Matrix3, Matrix6, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Gantry: the body moves in all directions, as the tool of a plotter does, and never turns.
///
/// `R_t = R`, one rotation for all frames; the places are any. `confidence = exp(-charge / 2)` with what the turns have
/// beyond noise and play.
///
/// Convention: there is no axis; the positions are the shift since the first frame, in the reference's axes, metres.
///
/// References: docs/method.md, "Evidence" and "Play".
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Gantry {
    /// Turn that its guides allow, as a standard deviation, degrees.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub play: f64,
}

impl Default for Gantry {
    fn default() -> Self {
        Self { play: 0.3 }
    }
}

joint_model!(Gantry, "gantry", "moves in all directions, and never turns");

impl JointModel for Gantry {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        let series = motion.pose_series().ok_or_else(|| FitError::Unsuitable {
            needed: "poses of both bodies".into(),
            found: "one of them shows a single feature".into(),
        })?;
        let (poses, noise) = (series.poses(), series.noise());
        if poses.len() < 3 {
            return Err(FitError::TooFewFrames { needed: 3, found: poses.len() });
        }
        // The mean rotation turns with the coordinates, whichever they are; one step weighs the frames by their noise.
        let mean = starts::at_rest(series).home.rotation;
        let inverse = |noise: &Matrix6<f64>| noise.fixed_view::<3, 3>(0, 0).cholesky().map(|factor| factor.inverse());
        let white: Vec<Matrix3<f64>> = noise.iter().map(|noise| inverse(noise).unwrap_or_default()).collect();
        let off = |from| move |pose: &Pose| twist::rotation_log(&(pose.rotation.inverse() * from));
        let pull: Vector3<f64> = poses.iter().map(off(mean)).zip(&white).map(|(turn, white)| white * turn).sum();
        let step = white.iter().sum::<Matrix3<f64>>().cholesky().map_or_else(Vector3::zeros, |sum| sum.solve(&pull));
        let mean = mean * twist::exp(&twist::twist(&-step, &Vector3::zeros())).rotation;
        let turns: Vec<Vector3<f64>> = poses.iter().map(off(mean)).collect();

        // No turn and three slides: a rotation, and mean and covariance of the places.
        let mobility = Mobility { turns: 0, slides: 3, parameters: 3 + 3 + 6, advances: false, roams: false };
        let mut evidence = Evidence::of_poses(mobility, series);
        evidence.chi_squared += turns.iter().zip(&white).map(|(turn, white)| turn.dot(&(white * turn))).sum::<f64>();
        let places: Vec<Vector3<f64>> = poses.iter().map(|pose| pose.translation.vector).collect();
        let in_reference = |(pose, noise): (&Pose, &Matrix6<f64>)| {
            let axes = pose.rotation.to_rotation_matrix();
            axes.matrix() * noise.fixed_view::<3, 3>(3, 3) * axes.matrix().transpose()
        };
        let errors: Vec<Matrix3<f64>> = poses.iter().zip(noise).map(in_reference).collect();
        evidence.configuration_cost = cost_of_positions(&places, &errors);
        let (sigma, play) = (series.turn_noise(), self.play.to_radians());
        let mean_square = turns.iter().map(Vector3::norm_squared).sum::<f64>() / turns.len() as f64;
        let beyond = (mean_square - 1.25 * 3.0 * sigma * sigma).max(0.0);
        // Play is slow: it takes up all frames at once, noise every frame by itself.
        let per_noise = turns.len() as f64 * (play / sigma).powi(2) / evidence.correlation_time;
        evidence.departure = Some(Departure { squared: beyond / (play * play), per_noise, adequate: 25.0 });

        // The series may have exchanged the bodies; what is told is told as it was asked for.
        let asked = |pose: &Pose| if series.reversed() { pose.inverse() } else { *pose };
        let mut positions = vec![f64::NAN; 3 * motion.recording_frames()];
        let start = series.every_pose().first().map(|(_, pose)| asked(pose).translation.vector).unwrap_or_default();
        for (frame, pose) in series.every_pose() {
            positions[3 * frame..3 * frame + 3].copy_from_slice((asked(pose).translation.vector - start).as_slice());
        }
        let joint = Joint { axis: None, positions: Some(Positions::of_freedoms(3, positions)) };
        let confidence = Confidence::new((-0.5 * evidence.own_charge()).exp())?;
        let mut fit = JointFit::new(confidence, joint)
            .with_part("turn_beyond_noise", beyond.sqrt().to_degrees())
            .with_residual(series.radius() * (mean_square * 2.0 / 3.0).sqrt());
        fit.evidence = Some(evidence);
        Ok(fit)
    }

    fn states_evidence(&self) -> bool {
        true
    }

    fn parts(&self) -> &'static [&'static str] {
        &["turn_beyond_noise"]
    }
}
