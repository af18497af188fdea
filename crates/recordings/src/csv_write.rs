//! Recordings written as tables.

use std::io::Write;

use jointscope_motion::{Pose, Recording};

use crate::RecordingError;
use crate::writable::{Points, Uniform, check_labels, uniform};

/// Writes a [table](crate::csv_table) in metres and seconds: of points, or of poses if all bodies are poses.
///
/// Every sample has its row, missing ones with empty cells, so that frames, features and their order survive. Numbers
/// are written as short as they can be and still be read as the same `f64`: reading gives the same recording.
///
/// # Errors
/// [`RecordingError::Unwritable`] if points and poses are mixed, a body is at rest, or a name is empty, repeated or
/// surrounded by blanks; [`RecordingError::Write`] if `out` fails.
pub fn write_csv(recording: &Recording, out: &mut impl Write) -> Result<(), RecordingError> {
    let content = uniform(recording)?;
    let table = Table { writer: csv::Writer::from_writer(out), buffer: Vec::new() };
    match content {
        Uniform::Points(bodies) => table.points(recording, &bodies),
        Uniform::Poses(bodies) => table.poses(recording, &bodies),
    }
}

struct Table<W: Write> {
    writer: csv::Writer<W>,
    buffer: Vec<u8>,
}

impl<W: Write> Table<W> {
    fn points(mut self, recording: &Recording, bodies: &[Points<'_>]) -> Result<(), RecordingError> {
        for body in bodies {
            check_labels(body)?;
        }
        self.header(recording, &["feature", "x", "y", "z"])?;
        for frame in 0..recording.frames() {
            for body in bodies {
                for (feature, label) in body.labels.iter().enumerate() {
                    self.key(recording, frame, body.name)?;
                    self.text(label)?;
                    self.numbers(body.tracks.get(frame, feature).map(|point| [point.x, point.y, point.z]))?;
                }
            }
        }
        Ok(self.writer.flush()?)
    }

    fn poses(mut self, recording: &Recording, bodies: &[(&str, &[Option<Pose>])]) -> Result<(), RecordingError> {
        self.header(recording, &["x", "y", "z", "qx", "qy", "qz", "qw"])?;
        for frame in 0..recording.frames() {
            for (name, poses) in bodies {
                self.key(recording, frame, name)?;
                self.numbers(poses[frame].map(|pose| {
                    let (t, q) = (pose.translation, pose.rotation.coords);
                    [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
                }))?;
            }
        }
        Ok(self.writer.flush()?)
    }

    fn header(&mut self, recording: &Recording, content: &[&str]) -> Result<(), RecordingError> {
        let key: &[&str] = if recording.times().is_some() { &["frame", "time", "body"] } else { &["frame", "body"] };
        self.writer.write_record(key.iter().chain(content)).map_err(failed)
    }

    /// The cells that say which frame and body a row is about.
    fn key(&mut self, recording: &Recording, frame: usize, body: &str) -> Result<(), RecordingError> {
        self.number(recording.frame_numbers()[frame])?;
        if let Some(times) = recording.times() {
            self.number(times[frame])?;
        }
        self.text(body)
    }

    /// The last cells of a row; empty if the sample is missing.
    fn numbers<const N: usize>(&mut self, values: Option<[f64; N]>) -> Result<(), RecordingError> {
        match values {
            Some(values) => values.into_iter().try_for_each(|value| self.number(value))?,
            None => (0..N).try_for_each(|_| self.text(""))?,
        }
        self.writer.write_record(None::<&[u8]>).map_err(failed)
    }

    fn number(&mut self, number: impl std::fmt::Display) -> Result<(), RecordingError> {
        self.buffer.clear();
        write!(self.buffer, "{number}")?;
        self.writer.write_field(&self.buffer).map_err(failed)
    }

    fn text(&mut self, text: &str) -> Result<(), RecordingError> {
        self.writer.write_field(text).map_err(failed)
    }
}

fn failed(error: csv::Error) -> RecordingError {
    RecordingError::Write { cause: error.into() }
}
