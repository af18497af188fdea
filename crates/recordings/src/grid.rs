//! Rows in any order become one grid of frames × features per body.

use std::collections::HashMap;
use std::path::Path;

use jointscope_motion::{Body, MotionError, Pose, Recording, Tracks};
use nalgebra::Point3;

use crate::RecordingError;
use crate::text::quoted;

/// Samples that a recording may hold, however few rows the file has.
const ALWAYS_ALLOWED: usize = 1_000_000;

/// Samples allowed per row of the file: beyond that nearly all would be missing, and memory would not be bounded by
/// the size of the file.
const ALLOWED_PER_ROW: usize = 64;

/// The rows of a table, with names of bodies and features in order of first appearance.
pub(crate) struct Rows<T> {
    place: Place,
    bodies: Names,
    features: Vec<Names>,
    list: Vec<Row<T>>,
}

/// Where a row is, as people look for it: in its text file, or in a table without text.
#[derive(Clone, Copy)]
pub(crate) enum Place {
    Line,
    #[cfg(feature = "parquet")]
    Row,
}

impl Place {
    fn error(self, path: &Path, number: u64, problem: String) -> RecordingError {
        match self {
            Self::Line => RecordingError::at_line(path, number, problem),
            #[cfg(feature = "parquet")]
            Self::Row => RecordingError::at_row(path, number, problem),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Line => "line",
            #[cfg(feature = "parquet")]
            Self::Row => "row",
        }
    }
}

/// A body's samples, frame-major.
struct Grid<T> {
    name: String,
    features: Vec<String>,
    samples: Vec<T>,
}

struct Row<T> {
    number: u64,
    frame: u64,
    /// NaN if not given.
    time: f64,
    body: usize,
    feature: usize,
    sample: T,
}

impl Rows<Point3<f64>> {
    /// A recording of points, NaN where missing.
    pub(crate) fn of_points(self, path: &Path) -> Result<Recording, RecordingError> {
        let body = |grid: Grid<Point3<f64>>| {
            let tracks = Tracks::new(grid.features.len(), grid.samples)?;
            Body::from_points(grid.name, grid.features, tracks)
        };
        self.recording(Point3::from([f64::NAN; 3]), body, path)
    }
}

impl Rows<Option<Pose>> {
    /// A recording of poses; each body has one unnamed feature.
    pub(crate) fn of_poses(self, path: &Path) -> Result<Recording, RecordingError> {
        self.recording(None, |grid| Body::from_poses(grid.name, grid.samples), path)
    }
}

impl<T: Copy> Rows<T> {
    pub(crate) fn new(place: Place) -> Self {
        Self { place, bodies: Names::default(), features: Vec::new(), list: Vec::new() }
    }

    /// Adds the sample of a row, which is found by its number; `time` is NaN if the row does not give it.
    pub(crate) fn push(&mut self, number: u64, frame: u64, time: f64, (body, feature): (&str, &str), sample: T) {
        let body = self.bodies.index(body);
        if body == self.features.len() {
            self.features.push(Names::default());
        }
        let feature = self.features[body].index(feature);
        self.list.push(Row { number, frame, time, body, feature, sample });
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Sorts the samples into grids, with `missing` where no row gives one, and makes bodies of them.
    fn recording(
        self,
        missing: T,
        body: impl Fn(Grid<T>) -> Result<Body, MotionError>,
        path: &Path,
    ) -> Result<Recording, RecordingError> {
        let mut frame_numbers: Vec<u64> = self.list.iter().map(|row| row.frame).collect();
        frame_numbers.sort_unstable();
        frame_numbers.dedup();
        self.check_size(frame_numbers.len(), path)?;
        let frame_of_row: Vec<usize> =
            self.list.iter().map(|row| frame_numbers.partition_point(|number| *number < row.frame)).collect();
        let times = self.times(&frame_of_row, frame_numbers.len(), path)?;
        let grids = self.grids(missing, &frame_of_row, frame_numbers.len(), path)?;
        let bodies =
            grids.into_iter().map(body).collect::<Result<_, _>>().map_err(|error| numbered(error, &frame_numbers));
        bodies.and_then(|bodies| Recording::new(frame_numbers, times, bodies)).map_err(RecordingError::motion(path))
    }

    fn check_size(&self, frames: usize, path: &Path) -> Result<(), RecordingError> {
        let (rows, features) = (self.list.len(), self.features.iter().map(Names::len).sum());
        if frames.saturating_mul(features) <= ALWAYS_ALLOWED.max(rows.saturating_mul(ALLOWED_PER_ROW)) {
            return Ok(());
        }
        let problem = format!(
            "{frames} frames of {features} features need at least one row per {ALLOWED_PER_ROW} samples, found {rows} \
             rows; check the columns frame, body and feature, or split the recording"
        );
        Err(RecordingError::in_file(path, problem))
    }

    fn grids(
        self,
        missing: T,
        frame_of_row: &[usize],
        frames: usize,
        path: &Path,
    ) -> Result<Vec<Grid<T>>, RecordingError> {
        let widths: Vec<usize> = self.features.iter().map(Names::len).collect();
        let mut samples: Vec<Vec<T>> = widths.iter().map(|width| vec![missing; frames * width]).collect();
        let mut filled: Vec<Vec<bool>> = widths.iter().map(|width| vec![false; frames * width]).collect();
        for (row, frame) in self.list.iter().zip(frame_of_row) {
            let cell = frame * widths[row.body] + row.feature;
            if std::mem::replace(&mut filled[row.body][cell], true) {
                return Err(self.repeated(row, path));
            }
            samples[row.body][cell] = row.sample;
        }
        let bodies = self.bodies.into_vec().into_iter().zip(self.features).zip(samples);
        Ok(bodies.map(|((name, features), samples)| Grid { name, features: features.into_vec(), samples }).collect())
    }

    /// One time per frame, from whichever of its rows give it.
    fn times(&self, frame_of_row: &[usize], frames: usize, path: &Path) -> Result<Option<Vec<f64>>, RecordingError> {
        let mut times = vec![f64::NAN; frames];
        for (row, frame) in self.list.iter().zip(frame_of_row).filter(|(row, _)| !row.time.is_nan()) {
            let time = &mut times[*frame];
            if time.is_nan() {
                *time = row.time;
            }
            #[expect(clippy::float_cmp, reason = "rows of one frame repeat the same text")]
            if *time != row.time {
                let first = self.list.iter().find(|other| other.frame == row.frame && !other.time.is_nan());
                let first = first.map_or(row.number, |other| other.number);
                let (found, frame, place) = (row.time, row.frame, self.place.name());
                let problem = format!(
                    "needed one time per frame, found {found} for frame {frame} after {time} in {place} {first}; \
                     correct one of them"
                );
                return Err(self.place.error(path, row.number, problem));
            }
        }
        if times.iter().all(|time| time.is_nan()) {
            return Ok(None);
        }
        match self.list.iter().zip(frame_of_row).find(|(_, frame)| times[**frame].is_nan()) {
            Some((row, _)) => {
                let problem = format!(
                    "frame {} has no time in any row, other frames have; give all frames a time or none",
                    row.frame
                );
                Err(self.place.error(path, row.number, problem))
            }
            None => Ok(Some(times)),
        }
    }

    fn repeated(&self, row: &Row<T>, path: &Path) -> RecordingError {
        let same = |other: &&Row<T>| (other.frame, other.body, other.feature) == (row.frame, row.body, row.feature);
        let first = self.list.iter().find(same).map_or(row.number, |other| other.number);
        let (body, place) = (self.bodies.name(row.body), self.place.name());
        let feature = match self.features[row.body].name(row.feature) {
            "" => String::new(),
            feature => format!(", feature {}", quoted(feature)),
        };
        let problem = format!(
            "needed one row per sample, found a second one for frame {}, body {}{feature}, after {place} {first}; \
             remove one of them",
            row.frame,
            quoted(body)
        );
        self.place.error(path, row.number, problem)
    }
}

/// The error with the frame's number in the file in place of its index.
fn numbered(mut error: MotionError, frame_numbers: &[u64]) -> MotionError {
    if let MotionError::Infinite { frame, .. } | MotionError::TooLarge { frame, .. } = &mut error {
        let number = frame_numbers.get(*frame).and_then(|number| usize::try_from(*number).ok());
        *frame = number.unwrap_or(*frame);
    }
    error
}

/// Names numbered in order of first appearance.
#[derive(Default)]
struct Names(HashMap<String, usize>);

impl Names {
    fn index(&mut self, name: &str) -> usize {
        if let Some(index) = self.0.get(name) {
            return *index;
        }
        let index = self.0.len();
        self.0.insert(name.to_owned(), index);
        index
    }

    fn len(&self) -> usize {
        self.0.len()
    }

    fn name(&self, index: usize) -> &str {
        self.0.iter().find(|(_, other)| **other == index).map_or("", |(name, _)| name)
    }

    fn into_vec(self) -> Vec<String> {
        let mut names: Vec<_> = self.0.into_iter().collect();
        names.sort_unstable_by_key(|(_, index)| *index);
        names.into_iter().map(|(name, _)| name).collect()
    }
}

#[cfg(test)]
mod tests {
    use jointscope_motion::Observation;

    use super::*;

    const MISSING: f64 = f64::NAN;

    fn recording(rows: Rows<f64>) -> Result<Recording, RecordingError> {
        let body = |grid: Grid<f64>| {
            let points = grid.samples.iter().map(|x| Point3::new(*x, 0., 0.)).collect();
            let tracks = Tracks::new(grid.features.len(), points)?;
            Body::from_points(grid.name, grid.features, tracks)
        };
        rows.recording(MISSING, body, Path::new("a.csv"))
    }

    #[test]
    fn rows_in_any_order_fill_grids_in_order_of_first_appearance() {
        let mut rows = Rows::new(Place::Line);
        rows.push(2, 1_000_000_000_000_000, f64::NAN, ("door", "b"), 1.);
        rows.push(3, 0, f64::NAN, ("door", "a"), 2.);
        rows.push(4, 0, f64::NAN, ("wall", "a"), 3.);
        let recording = recording(rows).expect("two frames");
        assert_eq!(recording.frame_numbers(), [0, 1_000_000_000_000_000]);
        assert_eq!(recording.times(), None);
        let names: Vec<_> = recording.bodies().iter().map(Body::name).collect();
        assert_eq!(names, ["door", "wall"]);
        let Observation::Points { labels, tracks } = recording.bodies()[0].observation() else { panic!("points") };
        assert_eq!(labels, &["b", "a"]);
        let seen = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(t, f)| tracks.get(t, f).map(|point| point.x));
        assert_eq!(seen, [None, Some(2.), Some(1.), None]);
    }

    #[test]
    fn a_coordinate_beyond_measure_is_named_by_the_number_of_its_frame() {
        let mut rows = Rows::new(Place::Line);
        rows.push(2, 500, f64::NAN, ("door", "a"), 0.);
        rows.push(3, 700, f64::NAN, ("door", "a"), 1e70);
        let error = recording(rows).expect_err("too large").to_string();
        assert!(error.starts_with("a.csv: body `door`, feature `a`, frame 700: "), "{error}");
    }

    #[test]
    fn a_few_rows_cannot_ask_for_all_memory() {
        let mut rows = Rows::new(Place::Line);
        for index in 0..100_000_u64 {
            rows.push(index + 2, index, f64::NAN, (&format!("body {index}"), ""), 0.);
        }
        let error = recording(rows).expect_err("10^10 samples").to_string();
        assert!(error.contains("100000 frames of 100000 features"), "{error}");
    }
}
