//! Registration of a body to which frames are added.

use nalgebra::Point3;

use crate::poses::{Shape, follow, pose_of};
use crate::rotation_in_lanes::BLOCK;
use crate::{Pose, Registration, Tracks, register_frames};

/// Poses of a body, registered frame by frame as they come.
///
/// By `first` and `chained` these are the poses that registering all frames at once gives, to the last digit. By `shape`
/// they are those of the mean shape so far, and only a first glance: the shape is known when all frames are.
#[derive(Debug, Clone)]
pub struct FrameByFrame {
    registration: Registration,
    /// Places of the features in the body's coordinates that the next frame is registered to, once a frame could be posed.
    shape: Option<Shape>,
    /// How many samples every place is the mean of.
    counts: Vec<f64>,
    poses: Vec<Option<Pose>>,
    start: usize,
}

impl FrameByFrame {
    /// Before the first frame.
    pub fn new(registration: Registration) -> Self {
        Self { registration, shape: None, counts: Vec::new(), poses: Vec::new(), start: 0 }
    }

    /// `recording_from_body` of all frames so far.
    pub fn poses(&self) -> &[Option<Pose>] {
        &self.poses
    }

    /// How frames are registered.
    pub fn registration(&self) -> Registration {
        self.registration
    }

    /// Registers the frames of `tracks` that are new since the last time.
    pub fn take(&mut self, tracks: &Tracks) {
        for frame in self.poses.len()..tracks.frames() {
            let pose = self.register(tracks, frame);
            self.poses.push(pose);
            if self.shape.is_some() && self.registration == Registration::First {
                self.register_block(tracks, frame);
            }
        }
    }

    fn register(&mut self, tracks: &Tracks, frame: usize) -> Option<Pose> {
        let Some(shape) = &mut self.shape else {
            let shape: Shape = (0..tracks.features()).map(|feature| tracks.get(frame, feature).copied()).collect();
            pose_of(tracks, frame, &shape).ok()?;
            self.counts = vec![0.0; shape.len()];
            self.count(tracks, frame);
            (self.shape, self.start) = (Some(shape), frame);
            return Some(Pose::identity());
        };
        match self.registration {
            // Comes with its block.
            Registration::First => None,
            Registration::Chained => follow(tracks, frame, shape),
            Registration::Shape => {
                let pose = pose_of(tracks, frame, shape).ok()?;
                for (feature, position) in tracks.seen(frame) {
                    let here = pose.inverse_transform_point(position);
                    let place = shape[feature].get_or_insert(here);
                    *place += (here - *place) / (self.counts[feature] + 1.0);
                }
                self.count(tracks, frame);
                Some(pose)
            }
        }
    }

    fn count(&mut self, tracks: &Tracks, frame: usize) {
        tracks.seen(frame).for_each(|(feature, _)| self.counts[feature] += 1.0);
    }

    /// Registers the frames that are solved together with this one, up to it, to the first shape.
    fn register_block(&mut self, tracks: &Tracks, frame: usize) {
        let Some(shape) = &self.shape else { return };
        // Poses are the same to the last digit if those are that are solved together.
        let begin = frame / BLOCK * BLOCK;
        let missing = Point3::from([f64::NAN; 3]);
        let sample = |(frame, feature): (usize, usize)| tracks.get(frame, feature).copied().unwrap_or(missing);
        let samples = (begin..=frame).flat_map(|frame| (0..tracks.features()).map(move |feature| (frame, feature)));
        let block = Tracks::new(tracks.features(), samples.map(sample).collect()).expect("whole frames");
        register_frames(shape, &block, &mut self.poses[begin..=frame]);
        if self.start >= begin {
            self.poses[self.start] = Some(Pose::identity());
        }
    }
}
