//! The joint models of the thesis *Three dimensional Joint Detection*: expert-designed scores on trajectories.
//!
//! Equations are cited by their number there. Where the print is wrong the intended formula is used, and where it
//! leaves a choice the choice is a named setting; the defaults reproduce the thesis's figures.
//!
//! *Missing samples*, which the thesis does not treat: every score is taken over the samples that exist, trajectories
//! that begin late are aligned at the first frame they share with the reference trajectory, and lengths are compared
//! over common frames. With all features visible these are the thesis's own definitions.

mod circle;
mod positions;
mod prismatic;
mod q_function;
mod revolute;
mod rigid;

pub use circle::{Circle, CircleMethod};
pub use prismatic::{EmptySections, Longest, Overshoot, ThesisPrismatic};
pub use q_function::q_function;
pub use revolute::{AxisRadius, CombineTrajectories, LoneTrajectory, ThesisRevolute};
pub use rigid::{Distance, OverFeatures, ThesisRigid};

use jointscope_motion::{RelativeMotion, Trajectory};
use nalgebra::{Matrix3, SymmetricEigen, Unit, Vector3};

use crate::FitError;

/// The trajectories of at least `needed` samples.
fn trajectories<'m>(motion: &'m RelativeMotion<'_>, needed: usize) -> Result<Vec<Trajectory<'m>>, FitError> {
    let found = motion.trajectories().iter().map(|t| t.points.len()).max().unwrap_or(0);
    if found < needed {
        return Err(FitError::TooFewFrames { needed, found });
    }
    Ok(motion.trajectories().iter().filter(|t| t.points.len() >= needed).collect())
}

/// Eigenvalues and unit eigenvectors of a symmetric matrix, the largest first.
fn principal_axes(matrix: Matrix3<f64>) -> [(f64, Unit<Vector3<f64>>); 3] {
    let eigen = SymmetricEigen::new(matrix);
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    order.map(|k| (eigen.eigenvalues[k], Unit::new_normalize(eigen.eigenvectors.column(k).into_owned())))
}
