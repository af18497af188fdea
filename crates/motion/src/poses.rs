//! The poses of a body over all frames, from its features.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::flat_rows::sums_of_places;
use crate::{Pose, RegistrationError, Tracks, noise, register, register_frames};

/// Change of the shape, as a share of its size, at which the alternation has converged.
pub(crate) const SHAPE_CONVERGED: f64 = 1e-11;

/// Positions of the features in the body's coordinates, metres, where known.
pub(crate) type Shape = Vec<Option<Point3<f64>>>;

/// The frames that have a pose.
pub(crate) fn posed(poses: &[Option<Pose>]) -> impl Iterator<Item = (usize, &Pose)> {
    poses.iter().enumerate().filter_map(|(frame, pose)| Some((frame, pose.as_ref()?)))
}

/// Registers a frame to the known positions of features in the body's coordinates.
pub(crate) fn pose_of(tracks: &Tracks, frame: usize, shape: &Shape) -> Result<Pose, RegistrationError> {
    register(tracks.seen(frame).filter_map(|(feature, target)| Some((shape[feature].as_ref()?, target))))
}

/// The first of `frames` that can be posed, and its features' positions, which define the body's coordinates.
pub(crate) fn start(tracks: &Tracks, frames: impl Iterator<Item = usize>) -> Result<(usize, Shape), RegistrationError> {
    let mut refusal = RegistrationError::TooFewPoints { found: 0 };
    for frame in frames {
        let shape: Shape = (0..tracks.features()).map(|feature| tracks.get(frame, feature).copied()).collect();
        match pose_of(tracks, frame, &shape) {
            Ok(_) => return Ok((frame, shape)),
            Err(collinear @ RegistrationError::Collinear { .. }) => refusal = collinear,
            Err(RegistrationError::TooFewPoints { found }) => {
                if let RegistrationError::TooFewPoints { found: most } = &mut refusal {
                    *most = found.max(*most);
                }
            }
        }
    }
    Err(refusal)
}

/// Thesis Algorithm 3: every frame to the one before, from the first one.
pub(crate) fn chained(tracks: &Tracks) -> Result<Vec<Option<Pose>>, RegistrationError> {
    Ok(linked(tracks, start(tracks, 0..tracks.frames())?))
}

/// As [`chained`], both ways from the frame that shows most features, so that a poor first frame does not cut it off.
pub(crate) fn chained_from_the_best(tracks: &Tracks) -> Result<Vec<Option<Pose>>, RegistrationError> {
    let mut frames: Vec<usize> = (0..tracks.frames()).collect();
    frames.sort_by_key(|&frame| std::cmp::Reverse(tracks.seen_count(frame)));
    Ok(linked(tracks, start(tracks, frames.into_iter())?))
}

/// Registers frame after frame to the features' latest positions, forwards and then backwards from the start.
///
/// Registering to latest positions carried back into the body's coordinates is the same least squares problem as
/// registering to the previous frame and composing; and a feature or a whole body that was lost for some frames is
/// taken up where it was last seen.
fn linked(tracks: &Tracks, (start, mut latest): (usize, Shape)) -> Vec<Option<Pose>> {
    let mut poses = vec![None; tracks.frames()];
    poses[start] = Some(Pose::identity());
    for frame in (start + 1..tracks.frames()).chain((0..start).rev()) {
        poses[frame] = follow(tracks, frame, &mut latest);
    }
    poses
}

/// Registers a frame to the features' latest positions, which then are those of this frame.
pub(crate) fn follow(tracks: &Tracks, frame: usize, latest: &mut Shape) -> Option<Pose> {
    let pose = pose_of(tracks, frame, latest).ok()?;
    for (feature, position) in tracks.seen(frame) {
        latest[feature] = Some(pose.inverse_transform_point(position));
    }
    Some(pose)
}

/// Alternates between the mean shape and the poses that fit it (generalised Procrustes analysis), until the shape
/// rests; then moves the coordinates so that the first pose is the identity.
pub(crate) fn settle(tracks: &Tracks, mut poses: Vec<Option<Pose>>, rounds: usize) -> (Vec<Option<Pose>>, Shape) {
    let mut shape = mean_shape(tracks, &poses);
    for _ in 0..rounds {
        register_frames(&shape, tracks, &mut poses);
        let next = mean_shape(tracks, &poses);
        let (change, size) = (change(&shape, &next), spread(&next).trace().sqrt());
        shape = next;
        if change <= SHAPE_CONVERGED * size {
            break;
        }
    }
    rebase(&mut poses, &mut shape);
    (poses, shape)
}

/// Moves the body's coordinates so that the first pose is the identity.
pub(crate) fn rebase(poses: &mut [Option<Pose>], shape: &mut Shape) {
    let Some(start) = poses.iter().flatten().next().copied() else { return };
    rebase_to(&start, poses, shape);
}

/// Makes the body's coordinates coincide with the recording's where the body has this pose.
pub(crate) fn rebase_to(start: &Pose, poses: &mut [Option<Pose>], shape: &mut Shape) {
    for pose in poses.iter_mut().flatten() {
        *pose *= start.inverse();
    }
    for position in shape.iter_mut().flatten() {
        *position = start * *position;
    }
}

/// Mean of every feature's positions in the body's coordinates; exact repetitions of a frame count once.
pub(crate) fn mean_shape(tracks: &Tracks, poses: &[Option<Pose>]) -> Shape {
    let sums = sums_of_places(tracks, noise::fresh(tracks, poses), None);
    sums.into_iter().map(|(count, sum)| (count > 0.0).then(|| Point3::from(sum / count))).collect()
}

/// Largest distance that a feature's position moved, metres.
pub(crate) fn change(before: &Shape, after: &Shape) -> f64 {
    let moved = |(a, b): (&Option<Point3<f64>>, &Option<Point3<f64>>)| match (a, b) {
        (Some(a), Some(b)) => nalgebra::distance(a, b),
        (None, None) => 0.0,
        _ => f64::INFINITY,
    };
    before.iter().zip(after).map(moved).fold(0.0, f64::max)
}

/// Scatter matrix of the shape about its centroid, m².
pub(crate) fn spread(shape: &Shape) -> Matrix3<f64> {
    let known = || shape.iter().flatten().map(|p| p.coords);
    let centroid = known().sum::<Vector3<f64>>() / known().count().max(1) as f64;
    known().map(|x| x - centroid).map(|x| x * x.transpose()).sum()
}
