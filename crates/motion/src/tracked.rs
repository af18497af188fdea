//! Poses given by a tracker, without its short wrong stretches.

use nalgebra::{Quaternion, SVector, UnitQuaternion, Vector3, Vector4};

use crate::noise::is_smooth;
use crate::{Pose, quantile};

/// Half width of the neighbourhood in time, frames.
const NEIGHBOURS: usize = 7;
/// Frames below which a neighbourhood says nothing.
const FEW: usize = 30;
/// Departure from the neighbourhood, in medians of all departures and in standard deviations of the
/// noise, from which a frame is wrong.
const IN_MEDIANS: f64 = 9.0;
const IN_NOISE: f64 = 8.0;
/// The same for rotations, in upper quartiles: flips last for some frames.
const IN_QUARTILES: f64 = 6.0;
/// Least departure of a rotation that counts as a flip, radians.
const LEAST_FLIP: f64 = 0.052;
/// Share of the changes of turning that is quiet however many frames are flipped, and how many of these a change must be to
/// be abrupt.
const QUIET_SHARE: f64 = 0.1;
const IN_QUIET: f64 = 30.0;
/// Share of the frames in which the turning changes abruptly from which flips are suspected that were not told.
const RESTLESS: f64 = 0.06;
/// Frames of a recording in which a single stretch of wrong orientations spoils a joint, changes at its ends, and how many
/// medians are no noise.
const SHORT: usize = 100;
const BURST: usize = 2;
const BEYOND_NOISE: f64 = 4.0;
/// Largest share of the frames that can be wrong; with more, nobody knows which.
const MOST_POSITIONS: f64 = 0.4;
const MOST_ROTATIONS: f64 = 0.4;

/// Poses given by a tracker after their jumps were mended.
#[derive(Debug, Clone)]
pub(crate) struct Mended {
    /// Without those whose position jumps away; rotations that do are those of their surroundings.
    pub(crate) poses: Vec<Option<Pose>>,
    /// Whose rotation was replaced.
    pub(crate) replaced: Vec<bool>,
    /// Share of the frames in which the turning changes abruptly, where it is so large that nobody knows which are wrong.
    pub(crate) restless: Option<f64>,
    /// Whether successive errors are alike, which hides how large they are.
    pub(crate) smooth: bool,
}

/// Drops frames whose position jumps away, and replaces rotations that do. The flips of a flat marker seen by one camera
/// are of this kind: the position stays right.
pub(crate) fn without_jumps(poses: &[Option<Pose>], position_noise: f64, rotation_noise: f64) -> Mended {
    let mut cleaned = poses.to_vec();
    let mut replaced = vec![false; poses.len()];
    let frames: Vec<usize> = (0..poses.len()).filter(|&frame| poses[frame].is_some()).collect();
    if frames.len() < FEW {
        return Mended { poses: cleaned, replaced, restless: None, smooth: false };
    }
    let positions: Vec<Vector3<f64>> = poses.iter().flatten().map(|pose| pose.translation.vector).collect();
    let around = expected(&positions);
    let departures: Vec<f64> = positions.iter().zip(&around).map(|(x, m)| (x - m).norm()).collect();
    let limit = (IN_MEDIANS * quantile(&mut departures.clone(), 0.5)).max(IN_NOISE * position_noise);
    let wrong: Vec<bool> = departures.iter().map(|departure| *departure > limit).collect();
    let mut kept = frames.clone();
    if share(&wrong) < MOST_POSITIONS {
        frames.iter().zip(&wrong).filter(|(_, wrong)| **wrong).for_each(|(frame, _)| cleaned[*frame] = None);
        kept.retain(|frame| cleaned[*frame].is_some());
    }
    let mut previous: Option<Vector4<f64>> = None;
    let rotations: Vec<Vector4<f64>> = kept
        .iter()
        .filter_map(|&frame| {
            let q = poses[frame]?.rotation.coords;
            let q = if previous.is_some_and(|before| before.dot(&q) < 0.0) { -q } else { q };
            previous = Some(q);
            Some(q)
        })
        .collect();
    let around = medians(&rotations);
    let around: Vec<UnitQuaternion<f64>> =
        around.into_iter().map(|m| UnitQuaternion::from_quaternion(Quaternion::from(m))).collect();
    let departures: Vec<f64> =
        kept.iter().zip(&around).map(|(&frame, m)| poses[frame].map_or(0.0, |p| p.rotation.angle_to(m))).collect();
    let limit = (IN_QUARTILES * quantile(&mut departures.clone(), 0.75)).max(IN_NOISE * rotation_noise).max(LEAST_FLIP);
    let wrong: Vec<bool> = departures.iter().map(|departure| *departure > limit).collect();
    if share(&wrong) <= MOST_ROTATIONS {
        for ((frame, wrong), rotation) in kept.iter().zip(wrong).zip(around) {
            if wrong && let Some(pose) = &mut cleaned[*frame] {
                pose.rotation = rotation;
                replaced[*frame] = true;
            }
        }
    }
    let changes =
        changes_of_turning(&kept.iter().filter_map(|&frame| Some(cleaned[frame]?.rotation)).collect::<Vec<_>>());
    // Flips spoil three changes each, and may be more than the sound frames: the quiet ones tell what is usual.
    let usual = quantile(&mut changes.clone(), QUIET_SHARE);
    let abrupt = (IN_QUIET * usual).max(IN_NOISE * rotation_noise).max(LEAST_FLIP);
    // In a short recording a single stretch of wrong orientations spoils a joint.
    let short = frames.len() < SHORT;
    let beyond_noise = (BEYOND_NOISE * quantile(&mut changes.clone(), 0.5)).max(LEAST_FLIP);
    let limit = if short { abrupt.min(beyond_noise) } else { abrupt };
    let jumps: Vec<bool> = changes.iter().map(|change| *change > limit).collect();
    let many = if short { jumps.iter().filter(|jump| **jump).count() >= BURST } else { share(&jumps) > RESTLESS };
    let restless = many.then_some(share(&jumps));
    let smooth = is_smooth(&cleaned);
    Mended { poses: cleaned, replaced, restless, smooth }
}

/// By how much every turn from a frame to the next differs from the one before, radians: steady turning has none, and a
/// flip three large ones.
fn changes_of_turning(rotations: &[UnitQuaternion<f64>]) -> Vec<f64> {
    let steps: Vec<_> = rotations.windows(2).map(|pair| pair[0].inverse() * pair[1]).collect();
    steps.windows(2).map(|pair| pair[0].angle_to(&pair[1])).collect()
}

fn share(flags: &[bool]) -> f64 {
    flags.iter().filter(|flag| **flag).count() as f64 / flags.len().max(1) as f64
}

/// The middle one of the neighbours in time of every sample, which the flips of a few successive frames do not move.
fn medians<const D: usize>(series: &[SVector<f64, D>]) -> Vec<SVector<f64, D>> {
    let half = NEIGHBOURS.min((series.len() - 1) / 4);
    let last = series.len() - 1;
    let mut window = Vec::with_capacity(2 * half + 1);
    (0..series.len())
        .map(|at| {
            window.clear();
            // At the ends the last sample stands for those beyond.
            window.extend((0..=2 * half).map(|k| series[(at + k).saturating_sub(half).min(last)]));
            middle_one(&window)
        })
        .collect()
}

/// The one whose distances to all others are least in sum: a median that turns with the coordinates.
fn middle_one<const D: usize>(among: &[SVector<f64, D>]) -> SVector<f64, D> {
    let sum = |one: &SVector<f64, D>| among.iter().map(|other| (other - one).norm()).sum::<f64>();
    let least = among.iter().map(|one| (sum(one), one)).min_by(|a, b| a.0.total_cmp(&b.0));
    least.map_or_else(SVector::zeros, |(_, one)| *one)
}

/// Where the neighbours in time say that every sample is: the middle one of the midpoints of pairs at equal distance
/// before and after, which steady motion leaves unchanged; near the ends, of what pairs on one side lead to.
fn expected<const D: usize>(series: &[SVector<f64, D>]) -> Vec<SVector<f64, D>> {
    let reach = NEIGHBOURS.min((series.len() - 1) / 4).max(1);
    let mut guesses: Vec<SVector<f64, D>> = Vec::with_capacity(3 * reach);
    (0..series.len())
        .map(|at| {
            guesses.clear();
            for k in 1..=reach {
                let (before, after) = (at.checked_sub(k).map(|b| series[b]), series.get(at + k));
                guesses.extend(before.zip(after).map(|(before, after)| (before + after) / 2.0));
            }
            for k in 1..=reach {
                if guesses.len() >= reach {
                    break;
                }
                let onwards = series.get(at + k).zip(series.get(at + 2 * k)).map(|(near, far)| near * 2.0 - far);
                let back = at.checked_sub(2 * k).map(|far| series[at - k] * 2.0 - series[far]);
                guesses.extend(onwards.into_iter().chain(back));
            }
            middle_one(&guesses)
        })
        .collect()
}
