//! One rigid body as it was observed.

use nalgebra::Point3;

use crate::tracks::unusable;
use crate::{MotionError, Pose, Tracks, scaled_pose};

/// What was observed of a body.
#[derive(Debug, Clone, PartialEq)]
pub enum Observation {
    /// Features tracked on the body.
    Points {
        /// One label per feature, as in the file.
        labels: Vec<String>,
        /// Their positions in metres.
        tracks: Tracks,
    },
    /// A tracker's poses `recording_from_tracked`, one per frame; `None` where it saw nothing.
    Poses(Vec<Option<Pose>>),
    /// The body does not move in the recording's coordinates: the world, for so many frames.
    AtRest(usize),
}

/// A rigid body of a recording: a name and what was observed of it.
///
/// Bodies are checked when they are made: labels fit tracks, seen positions are finite, at least one sample exists.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    name: String,
    observation: Observation,
}

impl Body {
    /// A body seen as tracked features, with one label per feature.
    ///
    /// # Errors
    /// [`MotionError::LabelCount`], [`MotionError::Infinite`], [`MotionError::TooLarge`], [`MotionError::NeverSeen`].
    pub fn from_points(name: impl Into<String>, labels: Vec<String>, tracks: Tracks) -> Result<Self, MotionError> {
        let body = name.into();
        if labels.len() != tracks.features() {
            return Err(MotionError::LabelCount { body, features: tracks.features(), labels: labels.len() });
        }
        if let Some((frame, feature, value)) = tracks.first_unusable() {
            return Err(beyond_measure(body, labels[feature].clone(), frame, value));
        }
        if (0..tracks.frames()).all(|frame| tracks.seen_count(frame) == 0) {
            return Err(MotionError::NeverSeen { body });
        }
        Ok(Self { name: body, observation: Observation::Points { labels, tracks } })
    }

    /// A body of features that is not seen yet.
    pub(crate) fn unseen(name: String, labels: Vec<String>) -> Self {
        let tracks = Tracks::new(labels.len(), Vec::new()).expect("no position fills no frame");
        Self { name, observation: Observation::Points { labels, tracks } }
    }

    /// Refuses positions that cannot be the features' in a frame.
    ///
    /// # Errors
    /// [`MotionError::FeatureCount`], [`MotionError::Infinite`], [`MotionError::TooLarge`].
    pub(crate) fn check_frame(&self, frame: usize, positions: &[Point3<f64>]) -> Result<(), MotionError> {
        let body = self.name.clone();
        let labels = match &self.observation {
            Observation::Points { labels, .. } => labels.as_slice(),
            _ => &[],
        };
        if labels.len() != positions.len() {
            return Err(MotionError::FeatureCount { body, expected: labels.len(), found: positions.len() });
        }
        match unusable(positions) {
            Some((feature, value)) => Err(beyond_measure(body, labels[feature].clone(), frame, value)),
            None => Ok(()),
        }
    }

    /// Adds a frame that was checked.
    pub(crate) fn push(&mut self, positions: &[Point3<f64>]) {
        if let Observation::Points { tracks, .. } = &mut self.observation {
            tracks.push(positions);
        }
    }

    /// A body seen as poses `recording_from_tracked` by a tracker.
    ///
    /// # Errors
    /// [`MotionError::NeverSeen`], [`MotionError::Infinite`], [`MotionError::TooLarge`].
    pub fn from_poses(name: impl Into<String>, poses: Vec<Option<Pose>>) -> Result<Self, MotionError> {
        let body = name.into();
        let origins = poses.iter().map(|pose| match pose {
            Some(pose) => pose.translation.vector.into(),
            None => Point3::from([f64::NAN; 3]),
        });
        // The origins of the poses must be as sound as tracked points.
        Self::from_points(body.as_str(), vec!["origin".into()], Tracks::new(1, origins.collect())?)?;
        Ok(Self { name: body, observation: Observation::Poses(poses) })
    }

    /// A body that rests in the recording's coordinates throughout: the world.
    pub fn at_rest(name: impl Into<String>, frames: usize) -> Self {
        Self { name: name.into(), observation: Observation::AtRest(frames) }
    }

    /// The same body with all its positions multiplied by `factor` about the origin of the recording.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let observation = match &self.observation {
            Observation::Points { labels, tracks } => {
                Observation::Points { labels: labels.clone(), tracks: tracks.scaled(factor) }
            }
            Observation::Poses(poses) => {
                Observation::Poses(poses.iter().map(|pose| pose.map(|pose| scaled_pose(&pose, factor))).collect())
            }
            Observation::AtRest(frames) => Observation::AtRest(*frames),
        };
        Self { name: self.name.clone(), observation }
    }

    /// The body's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What was observed of it.
    pub fn observation(&self) -> &Observation {
        &self.observation
    }

    /// Number of frames it covers.
    pub fn frames(&self) -> usize {
        match &self.observation {
            Observation::Points { tracks, .. } => tracks.frames(),
            Observation::Poses(poses) => poses.len(),
            Observation::AtRest(frames) => *frames,
        }
    }
}

fn beyond_measure(body: String, feature: String, frame: usize, value: f64) -> MotionError {
    if value.is_infinite() {
        MotionError::Infinite { body, feature, frame }
    } else {
        MotionError::TooLarge { body, feature, frame, value }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one_sample(x: f64) -> Tracks {
        Tracks::new(1, vec![Point3::new(x, 0., 0.)]).expect("one sample")
    }

    #[test]
    fn infinite_and_immeasurable_positions_are_refused_by_name() {
        let refuse = |x| Body::from_points("door", vec!["7".into()], one_sample(x)).expect_err("refused").to_string();
        assert!(refuse(f64::INFINITY).starts_with("body `door`, feature `7`, frame 0: a coordinate is infinite"));
        assert!(refuse(1e200).contains("check the unit"));
        assert!(refuse(f64::NAN).starts_with("body `door` has no sample"));
    }

    #[test]
    fn poses_that_are_never_seen_are_refused() {
        assert_eq!(Body::from_poses("tag", vec![None, None]), Err(MotionError::NeverSeen { body: "tag".into() }));
    }
}
