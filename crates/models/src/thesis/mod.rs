//! The joint models of the thesis *Three dimensional Joint Detection*: expert-designed scores on trajectories.
//!
//! Equations are cited by their number there. Where the print is wrong the intended formula is used, and where it
//! leaves a choice the choice is a named setting; the defaults reproduce the thesis's figures.
//!
//! *Missing samples*, which the thesis does not treat: every score is taken over the samples that exist, trajectories
//! that begin late are aligned at the first frame they share with the reference trajectory, and lengths are compared
//! over common frames. With all features visible these are the thesis's own definitions.

mod arcs;
mod centre_line;
mod circle;
mod ellipse;
mod elliptical;
mod lanes;
mod occupied;
mod positions;
mod prismatic;
mod q_function;
mod revolute;
mod rigid;

pub use centre_line::AxisRadius;
pub use circle::{Circle, CircleMethod};
pub use ellipse::Ellipses;
pub use elliptical::Elliptical;
pub use prismatic::{EmptySections, Longest, Overshoot, ThesisPrismatic};
pub use q_function::q_function;
pub use revolute::{CombineTrajectories, LoneTrajectory, ThesisRevolute};
pub use rigid::{Distance, OverFeatures, ThesisRigid};

use jointscope_motion::{Columns, RelativeMotion, Trajectory};
use nalgebra::{Matrix3, SymmetricEigen, Unit, Vector3};

use crate::FitError;
use occupied::occupied;

/// The trajectories of at least `needed` samples.
fn trajectories<'m>(motion: &'m RelativeMotion<'_>, needed: usize) -> Result<Vec<Trajectory<'m>>, FitError> {
    Ok(trajectories_by_feature(motion, needed)?.into_iter().map(|(_, trajectory)| trajectory).collect())
}

/// The same, each with its feature.
fn trajectories_by_feature<'m>(
    motion: &'m RelativeMotion<'_>,
    needed: usize,
) -> Result<Vec<(usize, Trajectory<'m>)>, FitError> {
    let found = motion.trajectories().iter().map(|t| t.points.len()).max().unwrap_or(0);
    if found < needed {
        return Err(FitError::TooFewFrames { needed, found });
    }
    Ok(motion.trajectories().iter().enumerate().filter(|(_, t)| t.points.len() >= needed).collect())
}

/// Rounding as a share of the coordinates' magnitude, after a change of coordinates.
const ROUNDING: f64 = 1e-13;

/// Whether a trajectory stays in one place, up to the rounding of its coordinates.
fn is_still(track: &Trajectory<'_>) -> bool {
    let start = track.points[0].coords;
    let (moved, magnitude) = track.points.iter().fold((0.0_f64, 0.0_f64), |(moved, magnitude), p| {
        (moved.max((p.coords - start).amax()), magnitude.max(p.coords.amax()))
    });
    moved <= ROUNDING * magnitude
}

/// A distance, or 0 where the rounding of coordinates explains it: metres.
fn above_rounding(distance: f64, columns: Columns<'_>) -> f64 {
    let magnitude = columns.summaries().iter().map(|known| known.magnitude).fold(0.0, f64::max);
    if distance <= ROUNDING * magnitude { 0.0 } else { distance }
}

/// Eigenvalues and unit eigenvectors of a symmetric matrix, the largest first.
fn principal_axes(matrix: Matrix3<f64>) -> [(f64, Unit<Vector3<f64>>); 3] {
    let eigen = SymmetricEigen::new(matrix);
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    order.map(|k| (eigen.eigenvalues[k], Unit::new_normalize(eigen.eigenvectors.column(k).into_owned())))
}
