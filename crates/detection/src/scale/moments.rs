//! Scales at which trajectories look like those of a joint, by moments that all scales share.

use std::collections::BTreeSet;

use jointscope_motion::nalgebra::{Matrix3, Point3, Vector3};
use jointscope_motion::{RelativeMotion, linear_scales};

use crate::NamedModel;

/// How far the samples of a pair spread about the means of their features, as sums that tell it at every scale.
///
/// Where the moving body is multiplied by `κ` about the camera, a sample seen at `p` is at `κ p + (1 - κ) c`, `c` being the
/// camera as seen from the reference in the same frame. Its second moments are polynomials in `κ`.
struct Spread {
    samples: Matrix3<f64>,
    /// Of samples with the camera, and the transpose of that.
    mixed: Matrix3<f64>,
    camera: Matrix3<f64>,
}

impl Spread {
    fn of(motion: &RelativeMotion<'_>) -> Self {
        let mut spread = Self { samples: Matrix3::zeros(), mixed: Matrix3::zeros(), camera: Matrix3::zeros() };
        let camera = |frame: usize| motion.reference().poses()[frame].unwrap_or_default().inverse() * Point3::origin();
        if let Some(columns) = motion.columns() {
            let cameras: Vec<Point3<f64>> = motion.frames().iter().map(|frame| camera(*frame)).collect();
            columns.map(|_, rows| {
                spread.add((0..rows.frames).map(|index| (rows.point(index), cameras[index])));
            });
        } else {
            let cameras: Vec<Point3<f64>> = (0..motion.recording_frames()).map(camera).collect();
            for trajectory in motion.trajectories().iter() {
                spread.add(
                    trajectory.points.iter().zip(trajectory.frames).map(|(point, frame)| (*point, cameras[*frame])),
                );
            }
        }
        spread.mixed += spread.mixed.transpose();
        spread
    }

    /// Adds a feature's samples, each with the camera.
    fn add(&mut self, samples: impl ExactSizeIterator<Item = (Point3<f64>, Point3<f64>)> + Clone) {
        let count = samples.len().max(1) as f64;
        let zero = (Vector3::zeros(), Vector3::zeros());
        let (sum, of_camera) =
            samples.clone().fold(zero, |(sum, of_camera), (p, c)| (sum + p.coords, of_camera + c.coords));
        let (mean, mean_camera) = (sum / count, of_camera / count);
        for (point, camera) in samples {
            let (p, c) = (point.coords - mean, camera.coords - mean_camera);
            self.samples += p * p.transpose();
            self.mixed += p * c.transpose();
            self.camera += c * c.transpose();
        }
    }

    fn at(&self, scale: f64) -> Matrix3<f64> {
        let rest = 1.0 - scale;
        self.samples * (scale * scale) + self.mixed * (scale * rest) + self.camera * (rest * rest)
    }
}

/// Kinds of models whose joints moments point to.
const KINDS: [&str; 6] = ["thesis-rigid", "thesis-prismatic", "thesis-revolute", "rigid", "prismatic", "revolute"];

/// One of so many scales is tried where moments do not point to all models' scales.
const SPARSELY: usize = 10;

/// The indices of the factors of the moving body with which a search begins: those to which moments point, and poses if
/// models state evidence; one in ten as well unless moments point to the scales of all models.
pub(super) fn begin(motion: &RelativeMotion<'_>, factors: &[f64], models: &[NamedModel]) -> BTreeSet<usize> {
    let mut indices = BTreeSet::from(likely(motion, factors));
    if models.iter().any(|named| named.model.states_evidence()) {
        let scales = linear_scales(motion.reference(), motion.moving());
        indices.extend(scales.into_iter().filter_map(|scale| nearest(factors, scale)));
    }
    if !models.iter().all(|named| KINDS.contains(&named.kind.as_str())) {
        indices.extend((0..factors.len()).step_by(SPARSELY));
    }
    indices
}

/// The index of the factor that is nearest to a scale, unless it lies outside their range.
fn nearest(factors: &[f64], scale: f64) -> Option<usize> {
    let (least, most) = factors.iter().fold((f64::INFINITY, 0.0_f64), |(least, most), f| (least.min(*f), most.max(*f)));
    let apart = |index: usize| (factors[index] - scale).abs();
    let index = (0..factors.len()).min_by(|&a, &b| apart(a).total_cmp(&apart(b)))?;
    (least..=most).contains(&scale).then_some(index)
}

/// The indices of the factors of the moving body at which trajectories spread least for the scale, are the straightest,
/// and the flattest.
fn likely(motion: &RelativeMotion<'_>, factors: &[f64]) -> [usize; 3] {
    let spread = Spread::of(motion);
    let measures: Vec<[f64; 3]> = factors
        .iter()
        .map(|&factor| {
            let spread = spread.at(factor);
            let eigenvalues = spread.symmetric_eigenvalues();
            let size = spread.trace();
            // Samples of bodies whose relation does not change spread by noise of both, that of the one multiplied.
            [size / factor, 1.0 - eigenvalues.max() / size, eigenvalues.min() / size]
        })
        .collect();
    [0, 1, 2].map(|kind| {
        let least = |&a: &usize, &b: &usize| measures[a][kind].total_cmp(&measures[b][kind]);
        (0..factors.len()).min_by(least).unwrap_or(0)
    })
}
