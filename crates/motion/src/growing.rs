//! A recording that grows frame by frame.

use nalgebra::Point3;

use crate::{Body, MotionError, Recording};

/// Bodies of named features that are being recorded.
///
/// Frames are numbered from 0. Adding one copies its positions and looks at no earlier one.
#[derive(Debug, Clone)]
pub struct GrowingRecording {
    recording: Recording,
    /// Whether each body has been seen at all.
    seen: Vec<bool>,
}

impl GrowingRecording {
    /// A recording without frames of bodies, each given by its name and the labels of its features.
    ///
    /// # Errors
    /// [`MotionError::Empty`] without bodies, [`MotionError::DuplicateName`].
    pub fn new(bodies: Vec<(String, Vec<String>)>) -> Result<Self, MotionError> {
        let seen = vec![false; bodies.len()];
        let bodies = bodies.into_iter().map(|(name, labels)| Body::unseen(name, labels)).collect();
        Ok(Self { recording: Recording::without_frames(bodies)?, seen })
    }

    /// Adds a frame: its time in seconds, and the positions of every body's features in metres, in the order in which bodies
    /// and labels were given; NaN where missing.
    ///
    /// # Errors
    /// [`MotionError::BodyCount`], [`MotionError::FeatureCount`], [`MotionError::Infinite`], [`MotionError::TooLarge`], or
    /// [`MotionError::Times`] for a time that is not a number or earlier than the last one; the recording is as it was then.
    pub fn push(&mut self, time: f64, positions: &[impl AsRef<[Point3<f64>]>]) -> Result<(), MotionError> {
        self.recording.push(time, positions)?;
        for (seen, positions) in self.seen.iter_mut().zip(positions) {
            *seen = *seen || positions.as_ref().iter().any(|point| !point.iter().any(|c| c.is_nan()));
        }
        Ok(())
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.recording.frames()
    }

    /// The bodies.
    pub fn bodies(&self) -> &[Body] {
        self.recording.bodies()
    }

    /// What was recorded so far.
    ///
    /// # Errors
    /// [`MotionError::Empty`] without frames, [`MotionError::NeverSeen`] while a body has no sample.
    pub fn recording(&self) -> Result<&Recording, MotionError> {
        if self.frames() == 0 {
            return Err(MotionError::Empty);
        }
        match self.seen.iter().position(|seen| !seen) {
            Some(body) => Err(MotionError::NeverSeen { body: self.bodies()[body].name().into() }),
            None => Ok(&self.recording),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Tracks;

    fn frame(k: u32) -> [Vec<Point3<f64>>; 2] {
        let k = f64::from(k);
        [vec![Point3::new(k, 1.0, 2.0), Point3::new(0.0, k, f64::NAN)], vec![Point3::new(3.0, -k, k)]]
    }

    fn growing() -> GrowingRecording {
        let labels = |labels: &[&str]| labels.iter().map(ToString::to_string).collect::<Vec<_>>();
        GrowingRecording::new(vec![("a".into(), labels(&["1", "2"])), ("b".into(), labels(&["3"]))]).expect("two names")
    }

    #[test]
    fn frame_by_frame_it_is_the_recording_of_all_frames() {
        let mut growing = growing();
        assert_eq!(growing.recording(), Err(MotionError::Empty));
        (0..70).try_for_each(|k| growing.push(0.1 * f64::from(k), &frame(k))).expect("frames fit");
        let tracks = |body: usize, features| {
            Tracks::new(features, (0..70).flat_map(|k| frame(k)[body].clone()).collect()).expect("whole frames")
        };
        let bodies = vec![
            Body::from_points("a", vec!["1".into(), "2".into()], tracks(0, 2)).expect("seen"),
            Body::from_points("b", vec!["3".into()], tracks(1, 1)).expect("seen"),
        ];
        let times = (0..70).map(|k| 0.1 * f64::from(k)).collect();
        assert_eq!(growing.recording(), Ok(&Recording::new((0..70).collect(), Some(times), bodies).expect("fits")));
    }

    #[test]
    fn frames_that_do_not_fit_are_refused_and_change_nothing() {
        let mut growing = growing();
        growing.push(1.0, &frame(0)).expect("fits");
        let [a, b] = frame(1);
        let refused = |growing: &mut GrowingRecording, time: f64, frame: &[Vec<Point3<f64>>]| {
            growing.push(time, frame).expect_err("refused").to_string()
        };
        assert_eq!(
            refused(&mut growing, 2.0, std::slice::from_ref(&a)),
            "a frame has positions of 1 bodies, where there are 2; give those of all bodies, NaN where missing"
        );
        assert_eq!(
            refused(&mut growing, 2.0, &[a.clone(), a.clone()]),
            "a frame has 2 positions of body `b`, which has 1 features; give one of each, NaN where missing"
        );
        assert!(refused(&mut growing, 0.5, &[a.clone(), b.clone()]).contains("0.5 s in frame 1 follows 1 s"));
        let far = vec![Point3::new(f64::INFINITY, 0.0, 0.0)];
        assert!(
            refused(&mut growing, 2.0, &[a, far]).starts_with("body `b`, feature `3`, frame 1: a coordinate is inf")
        );
        assert_eq!(growing.frames(), 1);
        let unseen = [vec![Point3::from([f64::NAN; 3]); 2], b];
        let mut other = self::growing();
        other.push(0.0, &unseen).expect("fits");
        assert_eq!(other.recording(), Err(MotionError::NeverSeen { body: "a".into() }));
    }
}
