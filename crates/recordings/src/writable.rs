//! What a recording must be for a format to hold it.

use std::collections::BTreeSet;

use jointscope_motion::{Body, Observation, Pose, Recording, Tracks};

use crate::RecordingError;

/// The content of a recording, if all its bodies are of one kind.
pub(crate) enum Uniform<'a> {
    Points(Vec<Points<'a>>),
    Poses(Vec<(&'a str, &'a [Option<Pose>])>),
}

/// A body of points.
pub(crate) struct Points<'a> {
    pub name: &'a str,
    pub labels: &'a [String],
    pub tracks: &'a Tracks,
}

/// The recording's bodies, all points or all poses, with names that survive being read again.
pub(crate) fn uniform(recording: &Recording) -> Result<Uniform<'_>, RecordingError> {
    for body in recording.bodies() {
        check_name("body", body.name())?;
    }
    let as_points: Vec<_> = recording.bodies().iter().filter_map(points).collect();
    let as_poses: Vec<_> = recording.bodies().iter().filter_map(poses).collect();
    if as_points.len() == recording.bodies().len() {
        Ok(Uniform::Points(as_points))
    } else if as_poses.len() == recording.bodies().len() {
        Ok(Uniform::Poses(as_poses))
    } else if let Some(rest) = recording.bodies().iter().find(|body| points(body).is_none() && poses(body).is_none()) {
        let name = rest.name();
        Err(RecordingError::unwritable(format!("body `{name}` is at rest and has no samples; leave it out")))
    } else {
        let (points, poses) = (as_points[0].name, as_poses[0].0);
        Err(RecordingError::unwritable(format!(
            "needed all bodies as points or all as poses, found `{points}` as points and `{poses}` as poses; write \
             them to two files"
        )))
    }
}

/// Names are trimmed when read, and numpy ends them at a NUL.
pub(crate) fn check_name(what: &str, name: &str) -> Result<(), RecordingError> {
    if name.is_empty() || name.trim() != name || name.contains('\0') {
        return Err(RecordingError::unwritable(format!(
            "needed a {what} name without blanks around it, found {name:?}; rename it"
        )));
    }
    Ok(())
}

/// Labels are told apart by their text alone.
pub(crate) fn check_labels(points: &Points<'_>) -> Result<(), RecordingError> {
    let mut labels = BTreeSet::new();
    for label in points.labels {
        check_name("feature", label)?;
        if !labels.insert(label) {
            let name = points.name;
            return Err(RecordingError::unwritable(format!(
                "body `{name}` has two features labelled `{label}`; rename one of them"
            )));
        }
    }
    Ok(())
}

fn points(body: &Body) -> Option<Points<'_>> {
    match body.observation() {
        Observation::Points { labels, tracks } => Some(Points { name: body.name(), labels, tracks }),
        _ => None,
    }
}

fn poses(body: &Body) -> Option<(&str, &[Option<Pose>])> {
    match body.observation() {
        Observation::Poses(poses) => Some((body.name(), poses)),
        _ => None,
    }
}
