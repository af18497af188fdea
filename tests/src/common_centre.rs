//! `common-centre`: a spherical joint by its definition, written as a user would: nothing of the project is touched.

use jointscope_models::{Axis, Confidence, FitError, Joint, JointFit, JointModel, joint_model};
use jointscope_motion::RelativeMotion;
use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Spherical joint: all features keep their distances from one common point.
///
/// `confidence = exp(-(rms / (tolerance · mean distance))²)`, with the point by least squares over all trajectories.
///
/// Convention: the axis's point is the centre, and there is no direction.
///
/// References: the linear equations of a sphere, `|x|² - 2 x·c + (|c|² - r²) = 0`.
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CommonCentre {
    /// Change of the distances, as a share of them, that is one third convincing.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub tolerance: f64,
}

impl Default for CommonCentre {
    fn default() -> Self {
        Self { tolerance: 0.02 }
    }
}

joint_model!(CommonCentre, "common-centre", "features keep their distances from one point");

impl JointModel for CommonCentre {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        // |x|² - 2 x·c + (|c|² - r²) = 0: linear in the centre and in one number per feature.
        let trajectories: Vec<_> = motion.trajectories().iter().filter(|t| t.points.len() >= 4).collect();
        let samples: usize = trajectories.iter().map(|t| t.points.len()).sum();
        if samples == 0 {
            return Err(FitError::TooFewFrames { needed: 4, found: motion.frames().len() });
        }
        // About the middle of it all, where squares lose fewest digits.
        let middle = motion.first_centroid();
        let unknowns = 3 + trajectories.len();
        let (mut normal, mut right) = (DMatrix::zeros(unknowns, unknowns), DVector::zeros(unknowns));
        for (feature, trajectory) in trajectories.iter().enumerate() {
            for p in trajectory.points.iter().map(|p| p - middle) {
                let mut row = DVector::zeros(unknowns);
                row.fixed_rows_mut::<3>(0).copy_from(&(2.0 * p));
                row[3 + feature] = 1.0;
                normal += &row * row.transpose();
                right += row * p.norm_squared();
            }
        }
        let Some(solution) = normal.cholesky().map(|cholesky| cholesky.solve(&right)) else {
            return Ok(JointFit::new(Confidence::ZERO, Joint::default()));
        };
        let centre = middle + solution.fixed_rows::<3>(0);
        let (mut off, mut reach) = (0.0, 0.0);
        for trajectory in &trajectories {
            let distances: Vec<f64> = trajectory.points.iter().map(|p| (p - centre).norm()).collect();
            let mean = distances.iter().sum::<f64>() / distances.len() as f64;
            off += distances.iter().map(|d| (d - mean).powi(2)).sum::<f64>();
            reach += mean * distances.len() as f64;
        }
        let (rms, reach) = ((off / samples as f64).sqrt(), reach / samples as f64);
        let confidence = Confidence::new((-(rms / (self.tolerance * reach)).powi(2)).exp())?;
        let axis = Axis { point: centre, direction: None, pitch: None };
        Ok(JointFit::new(confidence, Joint { axis: Some(axis), positions: None })
            .with_part("mean_distance", reach)
            .with_residual(rms))
    }

    fn parts(&self) -> &'static [&'static str] {
        &["mean_distance"]
    }
}
