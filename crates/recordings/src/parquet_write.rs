//! Recordings written as tables in columns.

use std::io::{self, Write};
use std::sync::Arc;

use jointscope_motion::Recording;
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical, ZstdLevel};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};

use crate::RecordingError;
use crate::writable::{Uniform, check_labels, uniform};

/// Rows that are written together, but for the rest of a frame.
const GROUP: usize = 1 << 17;

const OF_POINTS: [&str; 3] = ["x", "y", "z"];
const OF_POSES: [&str; 7] = ["x", "y", "z", "qx", "qy", "qz", "qw"];

/// Writes a [table in columns](crate::parquet_table) in metres and seconds: of points, or of poses if all bodies are
/// poses. `frame` is an `int64`, `time` and what is measured are doubles, names are text; packed by Zstandard.
///
/// Every sample has its row, missing ones with nulls, so that frames, features and their order survive: reading gives
/// the same recording.
///
/// # Errors
/// [`RecordingError::Unwritable`] if points and poses are mixed, a body is at rest, or a name is empty, repeated or
/// surrounded by blanks; [`RecordingError::Write`] if `out` fails.
pub fn write_parquet(recording: &Recording, out: impl Write + Send) -> Result<(), RecordingError> {
    match uniform(recording)? {
        Uniform::Points(bodies) => {
            for body in &bodies {
                check_labels(body)?;
            }
            let names: Vec<(ByteArray, Vec<ByteArray>)> = bodies
                .iter()
                .map(|body| (body.name.into(), body.labels.iter().map(|label| label.as_str().into()).collect()))
                .collect();
            let width = bodies.iter().map(|body| body.tracks.features()).sum();
            write(recording, out, OF_POINTS, Some("feature"), width, |frame, rows| {
                for (body, (name, labels)) in bodies.iter().zip(&names) {
                    for (feature, label) in labels.iter().enumerate() {
                        let sample = body.tracks.get(frame, feature).map(|point| point.coords.into());
                        rows.push(name, Some(label), sample);
                    }
                }
            })
        }
        Uniform::Poses(bodies) => {
            let names: Vec<ByteArray> = bodies.iter().map(|(name, _)| (*name).into()).collect();
            write(recording, out, OF_POSES, None, bodies.len(), |frame, rows| {
                for ((_, poses), name) in bodies.iter().zip(&names) {
                    let sample = poses[frame].map(|pose| {
                        let (t, q) = (pose.translation, pose.rotation.coords);
                        [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
                    });
                    rows.push(name, None, sample);
                }
            })
        }
    }
    .map_err(|error| RecordingError::Write { cause: io::Error::other(error) })
}

/// The columns of some rows.
struct Rows<const N: usize> {
    bodies: Vec<ByteArray>,
    features: Vec<ByteArray>,
    /// 1 where the sample is seen, 0 where it is missing.
    seen: Vec<i16>,
    /// What is measured of the samples that are seen.
    values: [Vec<f64>; N],
}

impl<const N: usize> Rows<N> {
    fn push(&mut self, body: &ByteArray, feature: Option<&ByteArray>, sample: Option<[f64; N]>) {
        self.bodies.push(body.clone());
        self.features.extend(feature.cloned());
        self.seen.push(sample.is_some().into());
        for (column, value) in self.values.iter_mut().zip(sample.into_iter().flatten()) {
            column.push(value);
        }
    }
}

/// Writes all frames, each of which has `width` rows.
fn write<const N: usize>(
    recording: &Recording,
    out: impl Write + Send,
    measured: [&'static str; N],
    feature: Option<&str>,
    width: usize,
    rows_of: impl Fn(usize, &mut Rows<N>),
) -> Result<(), ParquetError> {
    // Signed numbers are what other programs count with.
    let signed = recording.frame_numbers().iter().all(|number| i64::try_from(*number).is_ok());
    let schema = schema(recording.times().is_some(), signed, feature, measured)?;
    let properties = measured.iter().fold(
        WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_created_by("jointscope".into()),
        // No two samples are alike.
        |properties, name| properties.set_column_dictionary_enabled((*name).into(), false),
    );
    let mut file = SerializedFileWriter::new(out, schema, Arc::new(properties.build()))?;
    let frames: Vec<usize> = (0..recording.frames()).collect();
    for frames in frames.chunks((GROUP / width.max(1)).max(1)) {
        let mut rows =
            Rows { bodies: Vec::new(), features: Vec::new(), seen: Vec::new(), values: [const { Vec::new() }; N] };
        for frame in frames {
            rows_of(*frame, &mut rows);
        }
        let mut group = file.next_row_group()?;
        let per_row = |value: &dyn Fn(usize) -> f64| -> Vec<f64> {
            frames.iter().flat_map(|frame| vec![value(*frame); width]).collect()
        };
        let numbers = frames.iter().flat_map(|frame| vec![recording.frame_numbers()[*frame].cast_signed(); width]);
        column::<_, Int64Type>(&mut group, &numbers.collect::<Vec<_>>(), None)?;
        if let Some(times) = recording.times() {
            column::<_, DoubleType>(&mut group, &per_row(&|frame| times[frame]), None)?;
        }
        column::<_, ByteArrayType>(&mut group, &rows.bodies, None)?;
        if feature.is_some() {
            column::<_, ByteArrayType>(&mut group, &rows.features, None)?;
        }
        for values in &rows.values {
            column::<_, DoubleType>(&mut group, values, Some(&rows.seen))?;
        }
        group.close()?;
    }
    file.close()?;
    Ok(())
}

fn column<W: Write + Send, T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: &[T::T],
    seen: Option<&[i16]>,
) -> Result<(), ParquetError> {
    let Some(mut column) = group.next_column()? else { return Ok(()) };
    column.typed::<T>().write_batch(values, seen, None)?;
    column.close()
}

fn schema(
    has_times: bool,
    signed: bool,
    feature: Option<&str>,
    measured: impl IntoIterator<Item = &'static str>,
) -> Result<TypePtr, ParquetError> {
    let column = |name: &str, physical, logical, repetition| {
        let column = Type::primitive_type_builder(name, physical);
        column.with_logical_type(logical).with_repetition(repetition).build().map(Arc::new)
    };
    let number = (!signed).then(|| LogicalType::integer(64, false));
    let mut columns = vec![column("frame", Physical::INT64, number, Repetition::REQUIRED)?];
    if has_times {
        columns.push(column("time", Physical::DOUBLE, None, Repetition::REQUIRED)?);
    }
    for name in ["body"].into_iter().chain(feature) {
        columns.push(column(name, Physical::BYTE_ARRAY, Some(LogicalType::String), Repetition::REQUIRED)?);
    }
    for name in measured {
        columns.push(column(name, Physical::DOUBLE, None, Repetition::OPTIONAL)?);
    }
    Type::group_type_builder("recording").with_fields(columns).build().map(Arc::new)
}
