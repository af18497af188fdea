//! Rows in any order become one grid of frames × features per body.

use std::collections::HashMap;
use std::path::Path;

use jointscope_motion::{Body, MotionError, Pose, Recording, Tracks};
use nalgebra::Point3;
use rayon::prelude::*;

use crate::RecordingError;
use crate::text::quoted;

/// Samples that a recording may hold, however few rows the file has.
const ALWAYS_ALLOWED: usize = 1_000_000;

/// Samples allowed per row of the file: beyond that nearly all would be missing, and memory would not be bounded by
/// the size of the file.
const ALLOWED_PER_ROW: usize = 64;

/// The rows of a table, or a part of them that were read in a row, with names of bodies and features in order of first
/// appearance.
pub(crate) struct Part<T> {
    features: Features,
    runs: Vec<Run>,
    /// For each row, which of the features it is about, and the sample.
    feature_of: Vec<usize>,
    samples: Vec<T>,
}

/// Rows in a row that are about one frame and give one time.
struct Run {
    frame: u64,
    /// NaN if not given.
    time: f64,
    rows: usize,
}

/// All rows of a table.
pub(crate) struct Rows<T>(Vec<Part<T>>);

/// Where a row is, as people look for it: the line of its text file, of rows counted from 0, or its number in a table
/// without text.
#[derive(Clone, Copy)]
pub(crate) enum Place<'a> {
    Line(&'a dyn Fn(usize) -> u64),
    #[cfg(feature = "parquet")]
    Row,
}

impl Place<'_> {
    fn error(self, path: &Path, row: usize, problem: String) -> RecordingError {
        match self {
            Self::Line(_) => RecordingError::at_line(path, self.number(row), problem),
            #[cfg(feature = "parquet")]
            Self::Row => RecordingError::at_row(path, self.number(row), problem),
        }
    }

    fn number(self, row: usize) -> u64 {
        match self {
            Self::Line(line_of) => line_of(row),
            #[cfg(feature = "parquet")]
            Self::Row => row as u64 + 1,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Line(_) => "line",
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

impl Rows<Point3<f64>> {
    /// A recording of points, NaN where missing.
    pub(crate) fn of_points(self, path: &Path, place: Place<'_>) -> Result<Recording, RecordingError> {
        let body = |grid: Grid<Point3<f64>>| {
            let tracks = Tracks::new(grid.features.len(), grid.samples)?;
            Body::from_points(grid.name, grid.features, tracks)
        };
        self.recording(Point3::from([f64::NAN; 3]), body, path, place)
    }
}

impl Rows<Option<Pose>> {
    /// A recording of poses; each body has one unnamed feature.
    pub(crate) fn of_poses(self, path: &Path, place: Place<'_>) -> Result<Recording, RecordingError> {
        self.recording(None, |grid| Body::from_poses(grid.name, grid.samples), path, place)
    }
}

impl<T> Default for Part<T> {
    fn default() -> Self {
        Self { features: Features::default(), runs: Vec::new(), feature_of: Vec::new(), samples: Vec::new() }
    }
}

impl<T> Part<T> {
    /// Adds the sample of the next row; `time` is NaN if the row does not give it.
    pub(crate) fn push(&mut self, frame: u64, time: f64, (body, feature): (&str, &str), sample: T) {
        match self.runs.last_mut() {
            Some(run) if run.frame == frame && run.time.to_bits() == time.to_bits() => run.rows += 1,
            _ => self.runs.push(Run { frame, time, rows: 1 }),
        }
        self.feature_of.push(self.features.index(body, feature));
        self.samples.push(sample);
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.samples.len()
    }
}

impl<T: Copy + Send> Rows<T> {
    /// The rows of all parts, in this order.
    pub(crate) fn of(parts: Vec<Part<T>>) -> Self {
        Self(parts)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn len(&self) -> usize {
        self.0.iter().map(Part::len).sum()
    }

    /// Runs with the number of their first row.
    fn runs(&self) -> impl Iterator<Item = (usize, &Run)> {
        self.0.iter().flat_map(|part| &part.runs).scan(0, |next, run| {
            let first = *next;
            *next += run.rows;
            Some((first, run))
        })
    }

    /// Sorts the samples into grids, with `missing` where no row gives one, and makes bodies of them.
    fn recording(
        self,
        missing: T,
        body: impl Fn(Grid<T>) -> Result<Body, MotionError> + Send + Sync,
        path: &Path,
        place: Place<'_>,
    ) -> Result<Recording, RecordingError> {
        let mut frame_numbers: Vec<u64> = self.runs().map(|(_, run)| run.frame).collect();
        frame_numbers.sort_unstable();
        frame_numbers.dedup();
        let mut features = Features::default();
        let known: Vec<Vec<usize>> = self.0.iter().map(|part| features.adopt(&part.features)).collect();
        self.check_size(frame_numbers.len(), features.all.len(), path)?;
        let times = self.times(&frame_numbers, path, place)?;
        let grids = self.grids(missing, &frame_numbers, features, &known, path, place)?;
        // All of them before the first error is looked for, which is then the same one every time.
        let bodies: Vec<_> = grids.into_par_iter().map(body).collect();
        let bodies = bodies.into_iter().collect::<Result<_, _>>().map_err(|error| numbered(error, &frame_numbers));
        bodies.and_then(|bodies| Recording::new(frame_numbers, times, bodies)).map_err(RecordingError::motion(path))
    }

    fn check_size(&self, frames: usize, features: usize, path: &Path) -> Result<(), RecordingError> {
        let rows = self.len();
        if frames.saturating_mul(features) <= ALWAYS_ALLOWED.max(rows.saturating_mul(ALLOWED_PER_ROW)) {
            return Ok(());
        }
        let problem = format!(
            "{frames} frames of {features} features need at least one row per {ALLOWED_PER_ROW} samples, found {rows} \
             rows; check the columns frame, body and feature, or split the recording"
        );
        Err(RecordingError::in_file(path, problem))
    }

    /// Places the samples; `known` gives for the features of each part their places among all features.
    fn grids(
        self,
        missing: T,
        frame_numbers: &[u64],
        features: Features,
        known: &[Vec<usize>],
        path: &Path,
        place: Place<'_>,
    ) -> Result<Vec<Grid<T>>, RecordingError> {
        let frames = frame_numbers.len();
        let widths: Vec<usize> = features.bodies.iter().map(|body| body.order.len()).collect();
        let mut samples: Vec<Vec<T>> = widths.iter().map(|width| vec![missing; frames * width]).collect();
        let mut filled: Vec<Vec<bool>> = widths.iter().map(|width| vec![false; frames * width]).collect();
        let mut row = 0;
        for (part, known) in self.0.iter().zip(known) {
            let mut rows = part.feature_of.iter().zip(&part.samples);
            for run in &part.runs {
                let frame = index_of(run.frame, frame_numbers);
                for (feature, sample) in rows.by_ref().take(run.rows) {
                    let Feature { body, column } = features.all[known[*feature]];
                    let cell = frame * widths[body] + column;
                    if std::mem::replace(&mut filled[body][cell], true) {
                        return Err(self.repeated(row, (run.frame, body, column), &features, path, place));
                    }
                    samples[body][cell] = *sample;
                    row += 1;
                }
            }
        }
        Ok(features.into_grids(samples))
    }

    /// One time per frame, from whichever of its rows give it.
    fn times(&self, frame_numbers: &[u64], path: &Path, place: Place<'_>) -> Result<Option<Vec<f64>>, RecordingError> {
        let mut times = vec![f64::NAN; frame_numbers.len()];
        for (row, run) in self.runs().filter(|(_, run)| !run.time.is_nan()) {
            let time = &mut times[index_of(run.frame, frame_numbers)];
            if time.is_nan() {
                *time = run.time;
            }
            #[expect(clippy::float_cmp, reason = "rows of one frame repeat the same text")]
            if *time != run.time {
                let first = self.runs().find(|(_, other)| other.frame == run.frame && !other.time.is_nan());
                let first = place.number(first.map_or(row, |(first, _)| first));
                let (found, frame, name) = (run.time, run.frame, place.name());
                let problem = format!(
                    "needed one time per frame, found {found} for frame {frame} after {time} in {name} {first}; \
                     correct one of them"
                );
                return Err(place.error(path, row, problem));
            }
        }
        if times.iter().all(|time| time.is_nan()) {
            return Ok(None);
        }
        match self.runs().find(|(_, run)| times[index_of(run.frame, frame_numbers)].is_nan()) {
            Some((row, run)) => {
                let problem = format!(
                    "frame {} has no time in any row, other frames have; give all frames a time or none",
                    run.frame
                );
                Err(place.error(path, row, problem))
            }
            None => Ok(Some(times)),
        }
    }

    /// Refuses a second row for a frame, a body and one of its columns.
    fn repeated(
        &self,
        row: usize,
        (frame, body, column): (u64, usize, usize),
        features: &Features,
        path: &Path,
        place: Place<'_>,
    ) -> RecordingError {
        let (feature, body) = (&features.bodies[body].order[column], &features.bodies[body].name);
        let frames = self.runs().flat_map(|(_, run)| std::iter::repeat_n(run.frame, run.rows));
        let names = self.0.iter().flat_map(|part| part.feature_of.iter().map(|feature| part.features.names(*feature)));
        let first = frames.zip(names).position(|found| found == (frame, (body, feature)));
        let (first, name) = (place.number(first.unwrap_or(row)), place.name());
        let feature = match feature.as_str() {
            "" => String::new(),
            feature => format!(", feature {}", quoted(feature)),
        };
        let problem = format!(
            "needed one row per sample, found a second one for frame {frame}, body {}{feature}, after {name} {first}; \
             remove one of them",
            quoted(body)
        );
        place.error(path, row, problem)
    }
}

fn index_of(frame: u64, frame_numbers: &[u64]) -> usize {
    frame_numbers.partition_point(|number| *number < frame)
}

/// The error with the frame's number in the file in place of its index.
fn numbered(mut error: MotionError, frame_numbers: &[u64]) -> MotionError {
    if let MotionError::Infinite { frame, .. } | MotionError::TooLarge { frame, .. } = &mut error {
        let number = frame_numbers.get(*frame).and_then(|number| usize::try_from(*number).ok());
        *frame = number.unwrap_or(*frame);
    }
    error
}

/// Features of all bodies, both numbered in order of first appearance.
#[derive(Default)]
struct Features {
    all: Vec<Feature>,
    bodies: Vec<Names>,
    numbers: HashMap<String, usize>,
    /// Which feature came after each of them, and which one last: most tables repeat the order of their rows.
    next: Vec<usize>,
    last: usize,
}

/// A feature's body, and its place among the features of that.
struct Feature {
    body: usize,
    column: usize,
}

/// The name of a body, and those of its features.
struct Names {
    name: String,
    order: Vec<String>,
    /// By name, their numbers among the features of all bodies.
    features: HashMap<String, usize>,
}

impl Features {
    /// The number of a feature in a row; rows come one after another.
    fn index(&mut self, body: &str, feature: &str) -> usize {
        let expected = self.next.get(self.last).copied();
        let index = match expected.filter(|index| self.names(*index) == (body, feature)) {
            Some(index) => index,
            None => self.find_or_add(body, feature),
        };
        if let Some(next) = self.next.get_mut(self.last) {
            *next = index;
        }
        self.last = index;
        index
    }

    /// The numbers here of all features of a part.
    fn adopt(&mut self, part: &Self) -> Vec<usize> {
        let names = (0..part.all.len()).map(|index| part.names(index));
        names.map(|(body, feature)| self.find_or_add(body, feature)).collect()
    }

    fn find_or_add(&mut self, body: &str, feature: &str) -> usize {
        let body = self.numbers.get(body).copied().unwrap_or_else(|| {
            self.numbers.insert(body.to_owned(), self.bodies.len());
            self.bodies.push(Names { name: body.to_owned(), order: Vec::new(), features: HashMap::new() });
            self.bodies.len() - 1
        });
        let names = &mut self.bodies[body];
        names.features.get(feature).copied().unwrap_or_else(|| {
            let index = self.all.len();
            self.all.push(Feature { body, column: names.order.len() });
            self.next.push(index);
            names.features.insert(feature.to_owned(), index);
            names.order.push(feature.to_owned());
            index
        })
    }

    /// The names of a feature's body and of the feature.
    fn names(&self, index: usize) -> (&str, &str) {
        let Feature { body, column } = self.all[index];
        (&self.bodies[body].name, &self.bodies[body].order[column])
    }

    fn into_grids<T>(self, samples: Vec<Vec<T>>) -> Vec<Grid<T>> {
        let bodies = self.bodies.into_iter().zip(samples);
        bodies.map(|(names, samples)| Grid { name: names.name, features: names.order, samples }).collect()
    }
}

#[cfg(test)]
mod tests {
    use jointscope_motion::Observation;

    use super::*;

    const MISSING: f64 = f64::NAN;

    fn recording(rows: Part<f64>) -> Result<Recording, RecordingError> {
        let body = |grid: Grid<f64>| {
            let points = grid.samples.iter().map(|x| Point3::new(*x, 0., 0.)).collect();
            let tracks = Tracks::new(grid.features.len(), points)?;
            Body::from_points(grid.name, grid.features, tracks)
        };
        Rows::of(vec![rows]).recording(MISSING, body, Path::new("a.csv"), Place::Line(&|row| row as u64 + 2))
    }

    #[test]
    fn rows_in_any_order_fill_grids_in_order_of_first_appearance() {
        let mut rows = Part::default();
        rows.push(1_000_000_000_000_000, f64::NAN, ("door", "b"), 1.);
        rows.push(0, f64::NAN, ("door", "a"), 2.);
        rows.push(0, f64::NAN, ("wall", "a"), 3.);
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
        let mut rows = Part::default();
        rows.push(500, f64::NAN, ("door", "a"), 0.);
        rows.push(700, f64::NAN, ("door", "a"), 1e70);
        let error = recording(rows).expect_err("too large").to_string();
        assert!(error.starts_with("a.csv: body `door`, feature `a`, frame 700: "), "{error}");
    }

    #[test]
    fn a_few_rows_cannot_ask_for_all_memory() {
        let mut rows = Part::default();
        for index in 0..100_000_u64 {
            rows.push(index, f64::NAN, (&format!("body {index}"), ""), 0.);
        }
        let error = recording(rows).expect_err("10^10 samples").to_string();
        assert!(error.contains("100000 frames of 100000 features"), "{error}");
    }
}
