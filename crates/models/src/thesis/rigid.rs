//! `thesis-rigid`: little relative motion compared with the bodies' own.

use std::f64::consts::PI;

use jointscope_motion::{Columns, Lengths, RelativeMotion, Trajectory};
use nalgebra::{Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::trajectories;
use crate::{Confidence, FitError, Joint, JointFit, JointModel, joint_model};

/// Rigid connection: the bodies move far more than they move relative to each other.
///
/// `confidence = exp(-π λ f²)` with `f = dist_relative / min(dist_reference, dist_moving)`.
///
/// Degenerate cases: where neither body moves nor their relation changes, beyond the rounding of coordinates, they
/// are rigidly connected (f = 0). Where one body rests exactly and the other moves, f is infinite. Noise adds to path
/// lengths in every frame, so that two bodies at rest seen with noise have f near 1 and are not called rigid; net
/// lengths are less sensitive.
///
/// References: thesis section 5.4, equations (45)-(47).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ThesisRigid {
    /// λ of equation (47): how sharply the confidence falls with relative motion.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub sharpness: f64,
    /// What counts as travelled distance in equation (45).
    pub distance: Distance,
    /// How the distances of a body's features are put together.
    pub features: OverFeatures,
}

/// What counts as the distance that a feature travelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Distance {
    /// The sum of its steps, as printed.
    Path,
    /// The largest distance between any two of its positions.
    Net,
}

/// How the distances of a body's features are put together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OverFeatures {
    /// Their mean.
    Mean,
    /// Their sum: bodies with more features count as moving more.
    Sum,
}

impl Default for ThesisRigid {
    fn default() -> Self {
        Self { sharpness: 3.0, distance: Distance::Path, features: OverFeatures::Mean }
    }
}

joint_model!(ThesisRigid, "thesis-rigid", "little relative motion compared with the bodies' own (thesis 5.4)");

impl JointModel for ThesisRigid {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        let residual = match motion.columns() {
            Some(columns) => of_rows(columns),
            None => of_trajectories(&trajectories(motion, 1)?),
        };
        let lengths = self.lengths(motion);
        let ratio = motion_ratio(lengths);
        let confidence = Confidence::new((-PI * ratio * ratio * self.sharpness).exp())?;
        Ok(JointFit::new(confidence, Joint::default())
            .with_part("motion_ratio", ratio)
            .with_part("distance_reference", lengths.reference)
            .with_part("distance_moving", lengths.moving)
            .with_part("distance_relative", lengths.relative)
            .with_residual(residual))
    }

    fn parts(&self) -> &'static [&'static str] {
        &["motion_ratio", "distance_reference", "distance_moving", "distance_relative"]
    }
}

impl ThesisRigid {
    fn lengths(&self, motion: &RelativeMotion<'_>) -> Lengths {
        let mean = match self.distance {
            Distance::Path => motion.path_lengths(),
            Distance::Net => motion.net_lengths(),
        };
        match self.features {
            OverFeatures::Mean => mean,
            OverFeatures::Sum => {
                let reference = motion.reference().features() as f64;
                let moving = motion.moving().features() as f64;
                Lengths {
                    reference: mean.reference * reference,
                    moving: mean.moving * moving,
                    relative: mean.relative * moving,
                }
            }
        }
    }
}

/// Root mean square distance of the samples from the means of their features, metres.
fn of_trajectories(tracks: &[Trajectory<'_>]) -> f64 {
    let off_mean = |points: &[Point3<f64>]| {
        let mean = points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len() as f64;
        points.iter().map(|p| (p.coords - mean).norm_squared()).sum::<f64>()
    };
    let samples: usize = tracks.iter().map(|t| t.points.len()).sum();
    (tracks.iter().map(|t| off_mean(t.points)).sum::<f64>() / samples as f64).sqrt()
}

/// The same of features that are always seen.
fn of_rows(columns: Columns<'_>) -> f64 {
    let sum: f64 = columns.summaries().iter().map(|one| one.covariance.trace()).sum();
    (sum / columns.features() as f64).sqrt()
}

/// Equation (45).
fn motion_ratio(lengths: Lengths) -> f64 {
    if lengths.relative == 0.0 { 0.0 } else { lengths.relative / lengths.reference.min(lengths.moving) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equation_47_is_half_at_a_ratio_of_0_27() {
        // 3 π 0.27² = 9.424778 · 0.0729 = 0.687066; exp(-0.687066) = 0.503050.
        let confidence = (-PI * 3.0 * 0.27_f64 * 0.27).exp();
        assert!((confidence - 0.503_050).abs() < 1e-6, "{confidence}");
    }

    #[test]
    fn bodies_at_rest_are_rigid_and_one_that_leaves_the_other_is_not() {
        assert_eq!(motion_ratio(Lengths { reference: 0.0, moving: 0.0, relative: 0.0 }), 0.0);
        assert_eq!(motion_ratio(Lengths { reference: 0.0, moving: 0.2, relative: 0.2 }), f64::INFINITY);
        assert_eq!(motion_ratio(Lengths { reference: 0.5, moving: 0.2, relative: 0.1 }), 0.5);
    }
}
