//! Bodies whose features lie on one line: five of six coordinates of their pose are seen.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use crate::poses::{Shape, rebase, spread};
use crate::{Pose, Tracks};

/// Thickness over length below which features count as lying on a line: the turn about it would be read off their
/// errors.
const THIN: f64 = 0.03;
/// The same in standard deviations of a coordinate, for bodies no thicker than a tenth of their length.
const THICKNESS_IN_NOISE: f64 = 2.0;
const THICK: f64 = 0.1;
/// Rounds of alternating between poses and places on the line.
const ROUNDS: usize = 10;

/// Poses of a body on a line. The turn about the line is not seen, and is whatever turns least from the first pose.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    /// `recording_from_body`; the first one is the identity.
    pub(crate) poses: Vec<Option<Pose>>,
    /// Places of the features, in the body's coordinates.
    pub(crate) shape: Shape,
    /// Unit direction in the body's coordinates.
    pub(crate) direction: Vector3<f64>,
    /// Standard deviation of a coordinate, metres.
    pub(crate) noise: Option<f64>,
}

/// Whether features with noise `sigma` metres lie on a line.
pub(crate) fn is_line(shape: &Shape, sigma: f64) -> bool {
    let mut values: Vec<f64> = spread(shape).symmetric_eigenvalues().iter().map(|v| v.max(0.0).sqrt()).collect();
    values.sort_by(|a, b| b.total_cmp(a));
    values[1] < (THIN * values[0]).max(THICKNESS_IN_NOISE * sigma) && values[1] < THICK * values[0]
}

impl Line {
    /// The poses of features on a line, from two of them in a frame on; `None` if no frame shows two, or all features
    /// are in one place.
    pub(crate) fn of(tracks: &Tracks, counts: impl Fn(usize, usize) -> bool) -> Option<Self> {
        let seen = |frame: usize| tracks.seen(frame).filter(|&(feature, _)| counts(frame, feature)).count();
        let start = (0..tracks.frames()).max_by_key(|&frame| (seen(frame), std::cmp::Reverse(frame)))?;
        if seen(start) < 2 {
            return None;
        }
        let mut places: Vec<Option<f64>> = vec![None; tracks.features()];
        let first: Vec<&Point3<f64>> =
            tracks.seen(start).filter(|&(f, _)| counts(start, f)).map(|(_, position)| position).collect();
        let centre = first.iter().map(|p| p.coords).sum::<Vector3<f64>>() / first.len() as f64;
        let scatter =
            first.iter().map(|p| (p.coords - centre) * (p.coords - centre).transpose()).sum::<nalgebra::Matrix3<f64>>();
        let eigen = scatter.symmetric_eigen();
        let direction: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
        if eigen.eigenvalues.max() <= 0.0 {
            return None;
        }
        for (feature, position) in tracks.seen(start).filter(|&(f, _)| counts(start, f)) {
            places[feature] = Some(direction.dot(&(position.coords - centre)));
        }
        let mut poses = vec![None; tracks.frames()];
        for _ in 0..ROUNDS {
            for (frame, pose) in poses.iter_mut().enumerate() {
                *pose = line_pose(tracks, frame, &places, direction, &counts);
            }
            let mut sums = vec![(0.0, 0.0); places.len()];
            for (frame, pose) in poses.iter().enumerate() {
                let Some(pose) = pose else { continue };
                for (feature, position) in tracks.seen(frame).filter(|&(f, _)| counts(frame, f)) {
                    sums[feature].0 += 1.0;
                    sums[feature].1 += direction.dot(&pose.inverse_transform_point(position).coords);
                }
            }
            for (place, (count, sum)) in places.iter_mut().zip(sums) {
                *place = if count > 0.0 { Some(sum / count) } else { *place };
            }
        }
        let mut shape: Shape = places.iter().map(|place| place.map(|along| Point3::from(direction * along))).collect();
        let noise = noise(tracks, &poses, &shape, &counts);
        let turn = poses.iter().flatten().next()?.rotation;
        rebase(&mut poses, &mut shape);
        Some(Self { poses, shape, direction: turn * direction, noise })
    }
}

/// The pose that takes the line's places nearest to the positions of a frame, with the least turn.
fn line_pose(
    tracks: &Tracks,
    frame: usize,
    places: &[Option<f64>],
    direction: Vector3<f64>,
    counts: &impl Fn(usize, usize) -> bool,
) -> Option<Pose> {
    let pairs = || {
        tracks.seen(frame).filter(|&(f, _)| counts(frame, f)).filter_map(|(f, position)| Some((places[f]?, position)))
    };
    let count = pairs().count() as f64;
    let place = pairs().map(|(place, _)| place).sum::<f64>() / count;
    let centre = pairs().map(|(_, position)| position.coords).sum::<Vector3<f64>>() / count;
    let along = pairs().map(|(at, position)| (position.coords - centre) * (at - place)).sum::<Vector3<f64>>();
    let turn = UnitQuaternion::rotation_between(&direction, &along.try_normalize(0.0)?)
        // Opposite directions leave the turn open; any half turn across the line will do.
        .unwrap_or_else(|| {
            let across = direction.cross(&Vector3::ith(direction.iamin(), 1.0)).normalize();
            UnitQuaternion::from_scaled_axis(across * std::f64::consts::PI)
        });
    Some(Pose::from_parts((centre - turn * direction * place).into(), turn))
}

fn noise(
    tracks: &Tracks,
    poses: &[Option<Pose>],
    shape: &Shape,
    counts: &impl Fn(usize, usize) -> bool,
) -> Option<f64> {
    let (mut samples, mut frames, mut sum) = (0_usize, 0_usize, 0.0);
    for (frame, pose) in poses.iter().enumerate() {
        let Some(pose) = pose else { continue };
        frames += 1;
        for (feature, position) in tracks.seen(frame).filter(|&(f, _)| counts(frame, f)) {
            let Some(place) = shape[feature] else { continue };
            samples += 1;
            sum += (position - pose * place).norm_squared();
        }
    }
    // Five parameters per pose, one per place, less the origin on the line.
    let freedom = (3 * samples + 1).saturating_sub(5 * frames + shape.iter().flatten().count());
    (freedom > 0).then(|| (sum / freedom as f64).sqrt())
}
