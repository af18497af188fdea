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
    let overall = quantile(&mut lengths.to_vec(), 0.5);
    let mut wrong: Vec<bool> = local_medians(lengths)
        .zip(lengths)
        .map(|(local, length)| *length > STICKS_OUT * (local.max(0.5 * overall) + noise))
        .collect();
    if wrong.iter().filter(|wrong| **wrong).count() as f64 > MOST * count as f64 {
        let limit = quantile(&mut lengths.to_vec(), 1.0 - MOST);
        wrong = lengths.iter().map(|length| *length > limit.max(f64::MIN_POSITIVE)).collect();
    }
    wrong
}

/// The median of every frame's neighbourhood; beyond first and last frame are more of these.
fn local_medians(lengths: &[f64]) -> impl Iterator<Item = f64> {
    let at = move |index: usize| lengths[index.saturating_sub(NEIGHBOURS).min(lengths.len() - 1)];
    let mut window: [f64; 2 * NEIGHBOURS + 1] = std::array::from_fn(at);
    window.sort_unstable_by(f64::total_cmp);
    (0..lengths.len()).map(move |frame| {
        if frame > 0 {
            // One leaves, one comes, the others move up or down into the gap.
            let (leaving, coming) = (at(frame - 1), at(frame + 2 * NEIGHBOURS));
            let mut gap = window.partition_point(|value| value.total_cmp(&leaving).is_lt());
            while gap + 1 < window.len() && window[gap + 1] < coming {
                window[gap] = window[gap + 1];
                gap += 1;
            }
            while gap > 0 && window[gap - 1] > coming {
                window[gap] = window[gap - 1];
                gap -= 1;
            }
            window[gap] = coming;
        }
        window[NEIGHBOURS]
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbourhoods_have_the_median_of_their_frames() {
        for count in [12, 15, 16, 40, 200_usize] {
            // Values that repeat, too.
            let lengths: Vec<f64> = (0..count).map(|t| ((t * 37) % 23 / (1 + t % 2)) as f64).collect();
            for (frame, found) in local_medians(&lengths).enumerate() {
                let near = (0..=2 * NEIGHBOURS).map(|k| lengths[(frame + k).saturating_sub(NEIGHBOURS).min(count - 1)]);
                let mut near: Vec<f64> = near.collect();
                assert_eq!(found, quantile(&mut near, 0.5), "frame {frame} of {count}");
            }
        }
    }
}
