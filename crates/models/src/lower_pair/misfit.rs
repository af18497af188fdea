//! How far poses are from a fitted joint, beyond their noise, whatever single frames do.

use jointscope_motion::quantile;
use nalgebra::Vector3;

/// Half width of a frame's neighbourhood in time.
const NEIGHBOURS: usize = 7;
/// Factor by which a wrong frame sticks out of its neighbourhood, and of the noise.
const STICKS_OUT: f64 = 4.0;
/// Largest share of the frames that can be wrong.
const MOST: f64 = 0.25;
/// Frames below which a neighbourhood says nothing.
const FEW: usize = 12;
/// Share of the frames, those with the largest misfit, that does not count in any case.
const TRIMMED: f64 = 0.03;

/// Mean square of residual lengths without frames that stick out of their neighbourhood, and without the largest 3 %.
pub(crate) fn mean_square(lengths: &[f64], noise: f64) -> f64 {
    let wrong = isolated(lengths, noise);
    let mut kept: Vec<f64> = lengths.iter().zip(wrong).filter(|(_, wrong)| !wrong).map(|(length, _)| *length).collect();
    if kept.is_empty() {
        return 0.0;
    }
    kept.sort_by(f64::total_cmp);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of the length")]
    let count = (((1.0 - TRIMMED) * kept.len() as f64).ceil() as usize).max(1);
    kept[..count].iter().map(|length| length * length).sum::<f64>() / count as f64
}

/// The frames that stick out of their neighbourhood in time: single wrong ones, short flips.
pub(crate) fn isolated(lengths: &[f64], noise: f64) -> Vec<bool> {
    let count = lengths.len();
    if count < FEW {
        return vec![false; count];
    }
    let mut window = Vec::with_capacity(2 * NEIGHBOURS + 1);
    let overall = quantile(&mut lengths.to_vec(), 0.5);
    let mut wrong: Vec<bool> = (0..count)
        .map(|frame| {
            window.clear();
            window.extend((0..=2 * NEIGHBOURS).map(|k| lengths[(frame + k).saturating_sub(NEIGHBOURS).min(count - 1)]));
            let local = quantile(&mut window, 0.5);
            lengths[frame] > STICKS_OUT * (local.max(0.5 * overall) + noise)
        })
        .collect();
    if wrong.iter().filter(|wrong| **wrong).count() as f64 > MOST * count as f64 {
        let limit = quantile(&mut lengths.to_vec(), 1.0 - MOST);
        wrong = lengths.iter().map(|length| *length > limit.max(f64::MIN_POSITIVE)).collect();
    }
    wrong
}

/// Range from 2 to 98 %, of few values their whole range.
pub(crate) fn range(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let beyond = if values.len() < 2 * FEW { 0.0 } else { 0.02 };
    if values.is_empty() { 0.0 } else { quantile(&mut values, 1.0 - beyond) - quantile(&mut values, beyond) }
}

/// Length of the 2 to 98 % range of vectors along their main direction.
pub(crate) fn vector_range(vectors: &[Vector3<f64>]) -> f64 {
    let count = vectors.len().max(1) as f64;
    let mean = vectors.iter().sum::<Vector3<f64>>() / count;
    let scatter = vectors.iter().map(|v| (v - mean) * (v - mean).transpose()).sum::<nalgebra::Matrix3<f64>>();
    let eigen = scatter.symmetric_eigen();
    let main = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    range(vectors.iter().map(|v| main.dot(v)))
}
