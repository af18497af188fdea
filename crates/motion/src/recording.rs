//! A recording: bodies observed over common frames.

use std::collections::BTreeSet;

use nalgebra::Point3;

use crate::{Body, MotionError};

/// Bodies observed over the same frames.
///
/// # Convention
/// Frame numbers increase and may have gaps: only frames that occur are stored, and a gap is a gap, not stillness.
/// Positions are in metres, times in seconds.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    frame_numbers: Vec<u64>,
    times: Option<Vec<f64>>,
    bodies: Vec<Body>,
}

impl Recording {
    /// Puts bodies together over common frames.
    ///
    /// # Errors
    /// [`MotionError::Empty`], [`MotionError::FrameOrder`], [`MotionError::Times`], [`MotionError::FrameCount`],
    /// [`MotionError::DuplicateName`].
    pub fn new(frame_numbers: Vec<u64>, times: Option<Vec<f64>>, bodies: Vec<Body>) -> Result<Self, MotionError> {
        if bodies.is_empty() || frame_numbers.is_empty() {
            return Err(MotionError::Empty);
        }
        if let Some(pair) = frame_numbers.windows(2).find(|pair| pair[0] >= pair[1]) {
            return Err(MotionError::FrameOrder { first: pair[0], second: pair[1] });
        }
        if let Some(times) = &times {
            let detail = if times.len() == frame_numbers.len() {
                let unknown = times.iter().find(|time| !time.is_finite()).map(|time| format!("found {time}"));
                let fall = times.windows(2).position(|pair| pair[0] > pair[1]);
                let falling = fall
                    .map(|i| format!("{} s in frame {} follows {} s", times[i + 1], frame_numbers[i + 1], times[i]));
                unknown.or(falling)
            } else {
                Some(format!("found {} times for {} frames", times.len(), frame_numbers.len()))
            };
            if let Some(detail) = detail {
                return Err(MotionError::Times { detail });
            }
        }
        let mut names = BTreeSet::new();
        for body in &bodies {
            if body.frames() != frame_numbers.len() {
                let (found, expected) = (body.frames(), frame_numbers.len());
                return Err(MotionError::FrameCount { body: body.name().into(), found, expected });
            }
            if !names.insert(body.name()) {
                return Err(MotionError::DuplicateName { body: body.name().into() });
            }
        }
        Ok(Self { frame_numbers, times, bodies })
    }

    /// The same recording with a body at rest, the world, as its first body.
    ///
    /// # Errors
    /// [`MotionError::DuplicateName`] if a body has that name already.
    pub fn with_world(self, name: &str) -> Result<Self, MotionError> {
        let mut bodies = vec![Body::at_rest(name, self.frames())];
        bodies.extend(self.bodies);
        Self::new(self.frame_numbers, self.times, bodies)
    }

    /// Bodies of which no frame is known yet.
    pub(crate) fn without_frames(bodies: Vec<Body>) -> Result<Self, MotionError> {
        if bodies.is_empty() {
            return Err(MotionError::Empty);
        }
        let recording = Self { frame_numbers: Vec::new(), times: Some(Vec::new()), bodies };
        let mut names = BTreeSet::new();
        match recording.bodies.iter().find(|body| !names.insert(body.name())) {
            Some(twice) => Err(MotionError::DuplicateName { body: twice.name().into() }),
            None => Ok(recording),
        }
    }

    /// Adds a frame to bodies of points whose times are known, or changes nothing.
    pub(crate) fn push(&mut self, time: f64, positions: &[impl AsRef<[Point3<f64>]>]) -> Result<(), MotionError> {
        let frame = self.frames();
        if positions.len() != self.bodies.len() {
            return Err(MotionError::BodyCount { expected: self.bodies.len(), found: positions.len() });
        }
        let last = self.times().and_then(|times| times.last().copied());
        if !time.is_finite() {
            return Err(MotionError::Times { detail: format!("found {time}") });
        }
        if let Some(last) = last.filter(|last| time < *last) {
            return Err(MotionError::Times { detail: format!("{time} s in frame {frame} follows {last} s") });
        }
        for (body, positions) in self.bodies.iter().zip(positions) {
            body.check_frame(frame, positions.as_ref())?;
        }
        self.frame_numbers.push(frame as u64);
        self.times.get_or_insert_default().push(time);
        for (body, positions) in self.bodies.iter_mut().zip(positions) {
            body.push(positions.as_ref());
        }
        Ok(())
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.frame_numbers.len()
    }

    /// The number of each frame as its source counts them, increasing.
    pub fn frame_numbers(&self) -> &[u64] {
        &self.frame_numbers
    }

    /// Times of the frames in seconds, where the source gives them.
    pub fn times(&self) -> Option<&[f64]> {
        self.times.as_deref()
    }

    /// Seconds from first to last frame, where times are known.
    pub fn duration(&self) -> Option<f64> {
        self.times().and_then(|times| Some(times.last()? - times.first()?))
    }

    /// The bodies, in order of first appearance.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The bodies and frames taken apart, to be changed and put together again.
    pub fn into_parts(self) -> (Vec<u64>, Option<Vec<f64>>, Vec<Body>) {
        (self.frame_numbers, self.times, self.bodies)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_of_one_name_and_of_other_lengths_are_refused() {
        let bodies = || vec![Body::at_rest("a", 2), Body::at_rest("a", 2)];
        assert_eq!(Recording::new(vec![0, 1], None, bodies()), Err(MotionError::DuplicateName { body: "a".into() }));
        assert_eq!(
            Recording::new(vec![0], None, bodies()),
            Err(MotionError::FrameCount { body: "a".into(), found: 2, expected: 1 })
        );
        assert_eq!(Recording::new(vec![3, 3], None, bodies()), Err(MotionError::FrameOrder { first: 3, second: 3 }));
        assert_eq!(Recording::new(vec![], None, bodies()), Err(MotionError::Empty));
        let falling = Recording::new(vec![5, 7], Some(vec![1.0, 0.5]), bodies()).expect_err("refused").to_string();
        assert!(falling.ends_with("0.5 s in frame 7 follows 1 s"), "{falling}");
    }

    #[test]
    fn the_world_comes_first_and_needs_a_free_name() {
        let recording = Recording::new(vec![4, 9], Some(vec![0., 0.5]), vec![Body::at_rest("door", 2)]).expect("valid");
        let with_world = recording.clone().with_world("world").expect("free name");
        assert_eq!(with_world.bodies()[0].name(), "world");
        assert_eq!(with_world.duration(), Some(0.5));
        assert!(recording.with_world("door").is_err());
    }
}
