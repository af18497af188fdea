//! Detection while it is being recorded.

use std::borrow::Cow;

use jointscope_motion::{FrameByFrame, GrowingRecording, Observation, Pose, Recording, nalgebra::Point3};

use crate::{Configuration, Detection, DetectionError, Detector};

/// Detects joints while they are being recorded: takes one frame after another, and tells the joints of all frames so far
/// whenever it is asked.
///
/// A frame costs its own registrations, however many were there before: its body's poses by `registration = "first"` and
/// `"chained"` are found when it comes and stay. [`LiveDetector::detect`] judges all pairs by all frames, as
/// [`Detector::detect`] does, with the same result to the last digit, but does not register again. By the default,
/// `registration = "shape"`, bodies are registered to a shape that all frames tell; then asking registers them all, and
/// [`LiveDetector::pose`] is by the mean shape so far.
///
/// ```
/// use jointscope_detection::{Configuration, LiveDetector};
/// use jointscope_models::Catalog;
/// use jointscope_motion::{Pose, nalgebra::{Point3, Vector3}};
///
/// let configuration = Configuration::parse("", &Catalog::linked()?)?;
/// let labels: Vec<String> = ["1", "2", "3", "4"].map(String::from).into();
/// let mut live = LiveDetector::new(configuration, vec![("frame".into(), labels.clone()), ("door".into(), labels)])?;
///
/// // The door opens by 1.2 rad about the z axis.
/// let corners = [[0.1, 0.0, 0.0], [0.8, 0.0, 0.0], [0.1, 0.0, 1.9], [0.8, 0.1, 1.9]].map(Point3::from);
/// for frame in 0..40 {
///     let turn = Pose::rotation(Vector3::z() * 0.03 * f64::from(frame));
///     live.push(f64::from(frame) / 30.0, &[corners, corners.map(|corner| turn * corner)])?;
/// }
/// assert_eq!(live.detect()?.pairs[0].verdict.joint, "revolute");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct LiveDetector {
    detector: Detector,
    recording: GrowingRecording,
    poses: Vec<FrameByFrame>,
}

impl LiveDetector {
    /// A detector by a configuration, for bodies that are each given by a name and the labels of its features.
    ///
    /// # Errors
    /// [`DetectionError::Recording`] without bodies, or for two of one name.
    pub fn new(configuration: Configuration, bodies: Vec<(String, Vec<String>)>) -> Result<Self, DetectionError> {
        let poses = bodies.iter().map(|_| FrameByFrame::new(configuration.motion.registration)).collect();
        let recording = GrowingRecording::new(bodies)?;
        Ok(Self { detector: Detector::new(configuration), recording, poses })
    }

    /// Takes a frame: its time in seconds, and the positions of every body's features in metres, in the order in which they
    /// were given; NaN where missing.
    ///
    /// # Errors
    /// [`DetectionError::Recording`] for a wrong number of bodies or features, coordinates that are infinite, or a time
    /// earlier than the last one. Then the frame is not taken.
    pub fn push(&mut self, time: f64, positions: &[impl AsRef<[Point3<f64>]>]) -> Result<(), DetectionError> {
        self.recording.push(time, positions)?;
        for (poses, body) in self.poses.iter_mut().zip(self.recording.bodies()) {
            if let Observation::Points { tracks, .. } = body.observation() {
                poses.take(tracks);
            }
        }
        Ok(())
    }

    /// Number of frames so far.
    pub fn frames(&self) -> usize {
        self.recording.frames()
    }

    /// `recording_from_body` of a body, by its place among the bodies, in the latest frame; `None` where it could not be
    /// posed.
    ///
    /// # Panics
    /// If there are not so many bodies.
    pub fn pose(&self, body: usize) -> Option<Pose> {
        *self.poses[body].poses().last()?
    }

    /// What was recorded so far.
    ///
    /// # Errors
    /// [`DetectionError::Recording`] before the first frame, and while a body has not been seen at all.
    pub fn recording(&self) -> Result<&Recording, DetectionError> {
        Ok(self.recording.recording()?)
    }

    /// The joints between all pairs of bodies, by all frames so far.
    ///
    /// # Errors
    /// As [`LiveDetector::recording`] and [`Detector::detect`].
    pub fn detect(&self) -> Result<Detection, DetectionError> {
        self.detector.detect_registered(Cow::Borrowed(self.recording()?), &self.poses, None, &|_, _| ())
    }

    /// The detector that judges, which can explain its verdicts.
    pub fn detector(&self) -> &Detector {
        &self.detector
    }
}
