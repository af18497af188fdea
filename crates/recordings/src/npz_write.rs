//! Recordings written as archives of numpy's arrays.

use std::io::{Seek, Write};

use jointscope_motion::{Observation, Recording};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::RecordingError;
use crate::writable::{Points, Uniform, uniform};

/// Writes an [archive](crate::npz) in metres and seconds that numpy opens: `points` in float64 with NaN for missing
/// samples, `visibility`, `body_ids`, `body_names`, and `times` if they are known.
///
/// The format has neither frame numbers nor labels: frames count from 0, gaps close, and features are labelled by
/// their column when read again.
///
/// # Errors
/// [`RecordingError::Unwritable`] if a body is not made of points, or its name is empty or surrounded by blanks;
/// [`RecordingError::Write`] if `out` fails.
pub fn write_npz(recording: &Recording, out: impl Write + Seek) -> Result<(), RecordingError> {
    let bodies = match uniform(recording)? {
        Uniform::Points(bodies) => bodies,
        Uniform::Poses(bodies) => {
            let name = bodies[0].0;
            return Err(RecordingError::unwritable(format!(
                "needed points, found poses of body `{name}`; write poses as csv or parquet"
            )));
        }
    };
    let frames = recording.frames();
    let features = bodies.iter().map(|body| body.tracks.features()).sum();
    let mut archive = Archive(ZipWriter::new(out));

    archive.array("points", "<f8", &[frames, features, 3])?;
    for frame in 0..frames {
        for (body, feature) in columns(&bodies) {
            let position = body.tracks.get(frame, feature).map_or([f64::NAN; 3], |point| point.coords.into());
            archive.0.write_all(position.map(f64::to_le_bytes).as_flattened())?;
        }
    }
    archive.array("visibility", "|b1", &[frames, features])?;
    for frame in 0..frames {
        let visible: Vec<u8> =
            columns(&bodies).map(|(body, feature)| body.tracks.is_visible(frame, feature).into()).collect();
        archive.0.write_all(&visible)?;
    }
    archive.array("body_ids", "<i8", &[features])?;
    for (id, body) in (0_i64..).zip(&bodies) {
        archive.0.write_all(&id.to_le_bytes().repeat(body.tracks.features()))?;
    }
    let longest = bodies.iter().map(|body| body.name.chars().count()).max().unwrap_or(1);
    archive.array("body_names", &format!("<U{longest}"), &[bodies.len()])?;
    for body in &bodies {
        let padded = body.name.chars().chain(std::iter::repeat('\0')).take(longest);
        let code_points: Vec<u8> = padded.flat_map(|letter| u32::from(letter).to_le_bytes()).collect();
        archive.0.write_all(&code_points)?;
    }
    if let Some(times) = recording.times() {
        archive.array("times", "<f8", &[frames])?;
        for time in times {
            archive.0.write_all(&time.to_le_bytes())?;
        }
    }
    archive.0.finish().map_err(failed)?.flush()?;
    Ok(())
}

/// What an archive does not hold of a recording, in one sentence; `None` if nothing is lost.
pub fn lost_in_npz(recording: &Recording) -> Option<String> {
    let numbers = recording.frame_numbers();
    let counted = numbers.iter().zip(0..).all(|(number, frame)| *number == frame);
    let mut column = 0..;
    let mut labelled_by_column = |labels: &[String]| {
        labels.iter().all(|label| column.next().is_some_and(|column: usize| *label == column.to_string()))
    };
    let labelled = recording.bodies().iter().all(|body| match body.observation() {
        Observation::Points { labels, .. } => labelled_by_column(labels),
        _ => true,
    });
    let of_frames = (!counted).then(|| {
        let (first, last) = (numbers.first().unwrap_or(&0), numbers.last().unwrap_or(&0));
        format!("the numbers of the frames ({first} to {last} became 0 to {})", numbers.len() - 1)
    });
    let of_features = (!labelled).then(|| "the names of the features (now counted from 0)".to_owned());
    let lost: Vec<String> = of_frames.into_iter().chain(of_features).collect();
    (!lost.is_empty()).then(|| format!("the format does not hold {}; .csv and .parquet do", lost.join(" and ")))
}

/// The body and the feature in each column of the arrays.
fn columns<'a>(bodies: &'a [Points<'a>]) -> impl Iterator<Item = (&'a Points<'a>, usize)> {
    bodies.iter().flat_map(|body| (0..body.tracks.features()).map(move |feature| (body, feature)))
}

struct Archive<W: Write + Seek>(ZipWriter<W>);

impl<W: Write + Seek> Archive<W> {
    /// Begins an array: what is written to the archive next are its elements.
    fn array(&mut self, name: &str, dtype: &str, shape: &[usize]) -> Result<(), RecordingError> {
        // Positions with noise hardly become smaller, and unpacking takes many times as long as reading. No time stamp:
        // the same recording gives the same bytes. Large: the sizes are not known beforehand.
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default())
            .large_file(true);
        self.0.start_file(format!("{name}.npy"), options).map_err(failed)?;
        self.0.write_all(&header(dtype, shape))?;
        Ok(())
    }
}

/// The header of an array in C order, padded so that the elements begin at a multiple of 64 bytes.
fn header(dtype: &str, shape: &[usize]) -> Vec<u8> {
    const BEFORE_TEXT: usize = 10;

    let shape = shape.iter().fold(String::new(), |shape, length| shape + &format!("{length}, "));
    let text = format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': ({shape}), }}");
    let length = (BEFORE_TEXT + text.len() + 1).next_multiple_of(64) - BEFORE_TEXT;
    let stated = u16::try_from(length).expect("three lengths of at most 20 digits each are short");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(stated.to_le_bytes());
    bytes.extend(format!("{text:<width$}\n", width = length - 1).bytes());
    bytes
}

fn failed(error: zip::result::ZipError) -> RecordingError {
    RecordingError::Write { cause: error.into() }
}
