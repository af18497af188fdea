//! The motion of one body as seen from another.

use std::sync::{Arc, OnceLock};

use nalgebra::{Point3, Vector3, distance};

use crate::answers::Answers;
use crate::columns::{Maps, Placed};
use crate::flat_rows::way;
use crate::tracks::SeenAtScale;
use crate::{BodyMotion, Columns, Pose, PoseSeries, Summary, Tracks, extent, path_length};

/// Why one body's motion cannot be seen from another.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RelativeMotionError {
    /// The reference has no poses.
    #[error("`{body}` cannot be a reference: {reason}")]
    Unposed {
        /// The reference body.
        body: String,
        /// Why it has no poses.
        reason: String,
    },
    /// No frame shows both.
    #[error("`{reference}` and `{moving}` are never seen in the same frame")]
    NeverTogether {
        /// The reference body.
        reference: String,
        /// The moving body.
        moving: String,
    },
}

/// Positions of every feature of the moving body over the frames in which it is seen, feature by feature.
///
/// # Convention
/// Metres, in the reference body's coordinates. Missing samples are simply absent.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectories {
    starts: Vec<usize>,
    frames: Vec<usize>,
    points: Vec<Point3<f64>>,
}

/// One feature's positions in the order of frames: `points[i]` is where it is in frame `frames[i]`, so that both have
/// one entry per sample.
#[derive(Debug, Clone, Copy)]
pub struct Trajectory<'a> {
    /// Frames in which the feature is seen, increasing: indices into the recording, not its frame numbers.
    pub frames: &'a [usize],
    /// Its positions there, metres, in the reference body's coordinates.
    pub points: &'a [Point3<f64>],
}

impl Trajectories {
    /// Number of features, seen or not.
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Whether there is no feature at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The trajectory of one feature; empty if it is never seen.
    pub fn get(&self, feature: usize) -> Trajectory<'_> {
        let range = self.starts[feature]..self.starts[feature + 1];
        Trajectory { frames: &self.frames[range.clone()], points: &self.points[range] }
    }

    /// All trajectories, in the order of features.
    pub fn iter(&self) -> impl Iterator<Item = Trajectory<'_>> {
        (0..self.len()).map(|feature| self.get(feature))
    }
}

/// How far two bodies, and one relative to the other, travelled: the inputs of thesis equation (45), metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lengths {
    /// Of the reference body in the recording.
    pub reference: f64,
    /// Of the moving body in the recording.
    pub moving: f64,
    /// Of the moving body as seen from the reference.
    pub relative: f64,
}

/// The motion of a moving body in the coordinates of a reference body.
///
/// # Convention
/// The reference's coordinates coincide with the recording's at the reference's first posed frame. Frames are indices
/// into the recording; those that count are the ones in which the reference is posed and the moving body is seen.
#[derive(Debug, Clone)]
pub struct RelativeMotion<'m> {
    reference: &'m BodyMotion<'m>,
    moving: &'m BodyMotion<'m>,
    frames: Arc<[usize]>,
    trajectories: OnceLock<Trajectories>,
    columns: OnceLock<Option<Placed>>,
    paths: OnceLock<Lengths>,
    pose_series: OnceLock<Option<PoseSeries>>,
    answers: Answers,
}

impl<'m> RelativeMotion<'m> {
    /// The motion of `moving` as seen from `reference`.
    ///
    /// The moving body needs no poses; the reference does.
    ///
    /// # Errors
    /// [`RelativeMotionError`].
    ///
    /// # References
    /// Thesis section 4.4, Algorithm 3: the motion of the reference is removed from the moving body.
    pub fn between(reference: &'m BodyMotion<'m>, moving: &'m BodyMotion<'m>) -> Result<Self, RelativeMotionError> {
        if let Some(reason) = reference.unposed() {
            return Err(RelativeMotionError::Unposed { body: reference.name().into(), reason: reason.into() });
        }
        let posed = reference.posed_frames();
        let frames = if moving.is_always_seen() {
            posed.clone()
        } else {
            let tracks = moving.seen().tracks;
            posed.iter().copied().filter(|&frame| tracks.seen_count(frame) > 0).collect()
        };
        if frames.is_empty() {
            let (reference, moving) = (reference.name().into(), moving.name().into());
            return Err(RelativeMotionError::NeverTogether { reference, moving });
        }
        Ok(Self {
            reference,
            moving,
            frames,
            trajectories: OnceLock::new(),
            columns: OnceLock::new(),
            paths: OnceLock::new(),
            pose_series: OnceLock::new(),
            answers: Answers::default(),
        })
    }

    /// The body from which motion is seen.
    pub fn reference(&self) -> &BodyMotion<'m> {
        self.reference
    }

    /// The body that is seen moving.
    pub fn moving(&self) -> &BodyMotion<'m> {
        self.moving
    }

    /// The frames that count, increasing.
    pub fn frames(&self) -> &[usize] {
        &self.frames
    }

    /// Number of frames of the recording.
    pub fn recording_frames(&self) -> usize {
        self.moving.seen().tracks.frames()
    }

    /// The moving body's features as seen from the reference.
    pub fn trajectories(&self) -> &Trajectories {
        self.trajectories.get_or_init(|| seen_from(self.moving, &self.frames, |frame| self.recording_pose(frame)))
    }

    /// The same, coordinate by coordinate; `None` unless every feature is seen in every frame that counts.
    pub fn columns(&self) -> Option<Columns<'_>> {
        let seen = self.moving.seen();
        let placed = self.columns.get_or_init(|| {
            // What is the same for all pairs of a body is found once.
            if self.frames.len() == self.recording_frames() {
                let rows = self.moving.rows_as_seen();
                return Placed::of(seen, &self.frames, self.reference.maps_from_recording().clone(), rows);
            }
            Placed::of(seen, &self.frames, Maps::of(&self.frames, |frame| self.recording_pose(frame)), None)
        });
        Some(Columns::new(seen, &self.frames, placed.as_ref()?))
    }

    /// `reference_from_recording` in a frame that counts.
    fn recording_pose(&self, frame: usize) -> Pose {
        self.reference.poses()[frame].unwrap_or_default().inverse()
    }

    /// `reference_from_moving` at a frame, where both bodies are posed.
    pub fn pose(&self, frame: usize) -> Option<Pose> {
        Some(self.reference.poses()[frame]?.inverse() * self.moving.poses()[frame]?)
    }

    /// The poses of the pair with their uncertainty; `None` if one of the bodies shows no orientation at all.
    pub fn pose_series(&self) -> Option<&PoseSeries> {
        self.pose_series.get_or_init(|| PoseSeries::between(self.reference, self.moving, None)).as_ref()
    }

    /// What several models ask of this motion, computed once: by the type of the answer, which should belong to who asks.
    pub fn once<T: Clone + Send + Sync + 'static>(&self, ask: impl FnOnce() -> T) -> T {
        self.answers.get_or_ask(ask)
    }

    /// The same motion with successive frames merged, about so many being left; `None` where that leaves too few
    /// frames in each.
    ///
    /// Where the motion of a frame drowns in its noise, that of many frames together does not.
    #[must_use]
    pub fn merged(&self, frames: usize) -> Option<Self> {
        let merged = self.pose_series()?.merged(frames)?;
        Some(Self { pose_series: OnceLock::from(Some(merged)), ..self.clone() })
    }

    /// The same motion with a noise `factor` times as large.
    #[must_use]
    pub fn with_noise(&self, factor: f64) -> Option<Self> {
        let series = self.pose_series()?.with_noise(factor);
        Some(Self { pose_series: OnceLock::from(Some(series)), ..self.clone() })
    }

    /// The same motion with one of its bodies, or both, seen at another scale: of the same frames, so that what models find
    /// at different scales can be compared.
    ///
    /// # Errors
    /// As [`RelativeMotion::between`].
    pub fn rescaled<'s>(
        &self,
        reference: &'s BodyMotion<'s>,
        moving: &'s BodyMotion<'s>,
    ) -> Result<RelativeMotion<'s>, RelativeMotionError> {
        let motion = RelativeMotion::between(reference, moving)?;
        let series = self.pose_series().and_then(|series| PoseSeries::between(reference, moving, Some(series)));
        Ok(RelativeMotion { pose_series: OnceLock::from(series), ..motion })
    }

    /// `moving_from_reference` at one moment: takes an axis from the reference's coordinates to the moving body's.
    ///
    /// The moment is the moving body's first posed frame, where its coordinates are the recording's, if the reference
    /// is posed there too; else the first frame that poses both. A body without poses has the recording's coordinates
    /// at the first frame that shows it.
    pub fn moving_from_reference(&self) -> Option<Pose> {
        let start = self.moving.first_posed_frame().or_else(|| self.moving.first_seen_frame())?;
        if let Some(recording_from_reference) = self.reference.poses()[start] {
            return Some(recording_from_reference);
        }
        self.frames.iter().find_map(|&frame| self.pose(frame)).map(|pose| pose.inverse())
    }

    /// Centroid of the moving body's seen features at the first frame that counts, metres.
    pub fn first_centroid(&self) -> Point3<f64> {
        let first = self.frames[0];
        let pose = self.reference.poses()[first].unwrap_or_default().inverse();
        let (rotation, shift) = (pose.rotation.to_rotation_matrix(), pose.translation.vector);
        let seen = self.moving.seen();
        let here = || seen.tracks.seen(first).map(|(_, point)| rotation * (seen.factor * point.coords) + shift);
        Point3::from(here().sum::<Vector3<f64>>() / here().count() as f64)
    }

    /// Path lengths: the distances between successive samples summed up, mean over features.
    ///
    /// *Missing samples.* A feature's path runs through the samples that exist; steps are counted in frames, so that
    /// features seen for part of the time weigh by that part. *Rest.* A length that coordinates' rounding explains is
    /// exactly 0.
    ///
    /// # References
    /// Thesis equation (45), as printed: "the sum about the euclidean distances between all time frames".
    pub fn path_lengths(&self) -> Lengths {
        *self.paths.get_or_init(|| {
            let relative = match self.columns() {
                Some(columns) => Path::summed_up(columns.summaries(), &self.frames),
                None => self.trajectories().iter().map(Path::along).fold(Path::default(), Path::and),
            };
            let [reference, moving] = self.observed_paths();
            self.above_rounding([reference, moving, self.mean_path(relative)])
        })
    }

    /// Whether neither body moves in the recording, but for the rounding of coordinates.
    pub fn is_at_rest(&self) -> bool {
        let [reference, moving] = self.observed_paths();
        let lengths = self.above_rounding([reference, moving, (0.0, 0.0)]);
        lengths.reference == 0.0 && lengths.moving == 0.0
    }

    /// The way of a typical feature of the reference and of the moving body through the frames that count, and the largest
    /// coordinate on it, metres.
    fn observed_paths(&self) -> [(f64, f64); 2] {
        let all = self.frames.len() == self.recording_frames();
        [self.reference, self.moving]
            .map(|body| self.mean_path(if all { body.path() } else { Path::observed(body.tracks(), &self.frames) }))
    }

    fn mean_path(&self, path: Path) -> (f64, f64) {
        let steps = (self.frames[self.frames.len() - 1] - self.frames[0]) as f64;
        (path.length / path.steps.max(1) as f64 * steps, path.magnitude)
    }

    /// Net lengths: the largest distance between any two samples of a trajectory, mean over features.
    ///
    /// Unlike a path it does not grow with noise and frames.
    pub fn net_lengths(&self) -> Lengths {
        let mean = |trajectories: &Trajectories| {
            let seen = || trajectories.iter().filter(|t| !t.points.is_empty());
            let length = seen().map(|t| extent(t.points)).sum::<f64>() / seen().count().max(1) as f64;
            let magnitude = seen().flat_map(|t| t.points).fold(0.0_f64, |m, p| m.max(p.coords.amax()));
            (length, magnitude)
        };
        let observed = |body: &BodyMotion<'_>| mean(&as_observed(body, &self.frames));
        self.above_rounding([observed(self.reference), observed(self.moving), mean(self.trajectories())])
    }

    /// Lengths of reference, moving and relative motion, each with the largest coordinate of what it was measured on;
    /// those that the rounding of coordinates explains become 0.
    fn above_rounding(&self, lengths: [(f64, f64); 3]) -> Lengths {
        /// A step that rounding explains, as a share of the coordinates' magnitude.
        const ROUNDING: f64 = 1e-13;
        let steps = (self.frames[self.frames.len() - 1] - self.frames[0] + 1) as f64;
        let magnitude = lengths.iter().map(|(_, magnitude)| *magnitude).fold(0.0, f64::max);
        let above = |(length, _): (f64, f64)| if length <= ROUNDING * steps * magnitude { 0.0 } else { length };
        let [reference, moving, relative] = lengths.map(above);
        Lengths { reference, moving, relative }
    }
}

/// A way along which features travelled.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Path {
    /// Sum of the distances between successive samples, metres.
    length: f64,
    /// Frames that these steps take.
    steps: usize,
    /// Largest coordinate on the way, metres.
    magnitude: f64,
}

impl Path {
    /// Of all of a body's features through the frames given.
    pub(crate) fn observed(tracks: &Tracks, frames: &[usize]) -> Self {
        let complete = |&frame: &usize| tracks.seen_count(frame) == tracks.features();
        if frames.iter().all(complete) {
            let steps = frames.last().zip(frames.first()).map_or(0, |(last, first)| last - first);
            return Self::of_all(tracks, way(tracks, frames), steps);
        }
        let mut path = Self::default();
        let mut latest: Vec<Option<(usize, &Point3<f64>)>> = vec![None; tracks.features()];
        for &frame in frames {
            for (feature, point) in tracks.seen(frame) {
                if let Some((before, from)) = latest[feature].replace((frame, point)) {
                    path.length += distance(from, point);
                    path.steps += frame - before;
                }
                path.magnitude = path.magnitude.max(point.coords.amax());
            }
        }
        path
    }

    /// Of so many steps of features that are always seen.
    pub(crate) fn of_all(tracks: &Tracks, length: f64, steps: usize) -> Self {
        // The largest coordinate of all frames says as well what rounding explains.
        Self { length, steps: steps * tracks.features(), magnitude: tracks.magnitude() }
    }

    /// Of one feature.
    fn along(trajectory: Trajectory<'_>) -> Self {
        let steps = trajectory.frames.last().zip(trajectory.frames.first()).map_or(0, |(last, first)| last - first);
        let magnitude = trajectory.points.iter().fold(0.0_f64, |m, p| m.max(p.coords.amax()));
        Self { length: path_length(trajectory.points), steps, magnitude }
    }

    /// Of features that are always seen.
    fn summed_up(all: &[Summary], frames: &[usize]) -> Self {
        Self {
            length: all.iter().map(|one| one.path).sum(),
            steps: all.len() * (frames[frames.len() - 1] - frames[0]),
            magnitude: all.iter().map(|one| one.magnitude).fold(0.0, f64::max),
        }
    }

    /// With all positions multiplied.
    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self { length: factor * self.length, steps: self.steps, magnitude: factor * self.magnitude }
    }

    fn and(self, Self { length, steps, magnitude }: Self) -> Self {
        Self { length: self.length + length, steps: self.steps + steps, magnitude: self.magnitude.max(magnitude) }
    }
}

/// A body's features after the pose `target_from_recording` of each of some frames.
fn seen_from(moving: &BodyMotion<'_>, frames: &[usize], pose: impl Fn(usize) -> Pose) -> Trajectories {
    let poses = frames.iter().map(|&frame| pose(frame));
    let maps: Vec<_> = poses.map(|pose| (pose.rotation.to_rotation_matrix(), pose.translation.vector)).collect();
    collect(moving, frames, |index, point| {
        let (rotation, translation) = &maps[index];
        rotation * point + translation
    })
}

/// A body's features in the recording's coordinates.
fn as_observed(body: &BodyMotion<'_>, frames: &[usize]) -> Trajectories {
    collect(body, frames, |_, point| point)
}

fn collect(body: &BodyMotion<'_>, frames: &[usize], place: impl Fn(usize, Point3<f64>) -> Point3<f64>) -> Trajectories {
    let SeenAtScale { tracks, factor } = body.seen();
    let mut trajectories = Trajectories { starts: vec![0], frames: Vec::new(), points: Vec::new() };
    let samples = frames.iter().map(|&frame| tracks.seen_count(frame)).sum();
    trajectories.frames.reserve_exact(samples);
    trajectories.points.reserve_exact(samples);
    for feature in 0..tracks.features() {
        for (index, &frame) in frames.iter().enumerate() {
            if let Some(point) = tracks.get(frame, feature) {
                trajectories.frames.push(frame);
                trajectories.points.push(place(index, *point * factor));
            }
        }
        trajectories.starts.push(trajectories.points.len());
    }
    trajectories
}
