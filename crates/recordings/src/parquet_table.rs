//! Tables of points or poses in columns, as files of Apache Parquet; in programs built with the feature `parquet`.
//!
//! Columns, frames, times, names and samples are those of [tables as text](crate::csv_table); in addition:
//!
//! * **Columns** are plain, not nested. `__index_level_0__`, the row numbers that pandas writes, is not looked at.
//! * **Numbers** are integers or floating-point numbers of any width; frames are whole. Null and NaN are missing.
//! * **Names** are text, plain or from a dictionary (categories), or integers; at most 1000 bytes.
//! * **Packing**: none, Snappy or Zstandard. Text written as differences (`DELTA_…_BYTE_ARRAY`) is not read.
//! * **Size**. At most one row per byte of the file, or a million; pages unpack to at most 64 times their size, or
//!   16 MiB. What a file says about its size is checked before it is believed.
//!
//! Errors name rows, counted from 1.

mod cells;
mod claims;
mod thrift;

use std::path::Path;

use bytes::Bytes;
use jointscope_motion::Recording;
use nalgebra::Point3;
use parquet::file::metadata::ParquetStatisticsPolicy;
use parquet::file::reader::FileReader;
use parquet::file::serialized_reader::{ReadOptionsBuilder, SerializedFileReader};

use self::cells::{Cell, Column, Kind, caught};
use crate::columns::{Columns, Content, name};
use crate::grid::{Part, Place, Rows};
use crate::pose::pose;
use crate::{RecordingError, Unit};

/// Rows that a file may have, however few bytes.
const ALWAYS_ALLOWED: usize = 1_000_000;

/// Rows that are decoded together.
const BATCH: usize = 4096;

/// Reads a table of points or poses; `path` is named in errors.
///
/// # Errors
/// [`RecordingError::Row`] and [`RecordingError::File`] for what is said of tables [above](self);
/// [`RecordingError::Motion`], for instance for a body without any sample.
pub fn parse(bytes: &[u8], path: &Path, unit: Unit) -> Result<Recording, RecordingError> {
    let table = Table::open(bytes).map_err(|problem| RecordingError::in_file(path, problem))?;
    match table.columns.content {
        Content::Points { feature, position } => {
            let sample = |row: &Row<'_>| Ok(Point3::from(row.numbers(position)?.map(|length| unit.to_metres(length))));
            table.rows(Some(feature), sample, path)?.of_points(path, Place::Row)
        }
        Content::Poses { values } => {
            table.rows(None, |row| pose(row.numbers(values)?, unit), path)?.of_poses(path, Place::Row)
        }
    }
}

/// A file with what is known of it.
struct Table<'a> {
    bytes: &'a [u8],
    reader: SerializedFileReader<Bytes>,
    columns: Columns,
    /// For each of the columns, its place in the file and what its cells are.
    places: Vec<(usize, Kind)>,
}

impl<'a> Table<'a> {
    fn open(bytes: &'a [u8]) -> Result<Self, String> {
        claims::check_file(bytes)?;
        let options = ReadOptionsBuilder::new()
            .with_column_stats_policy(ParquetStatisticsPolicy::SkipAll)
            .with_size_stats_policy(ParquetStatisticsPolicy::SkipAll)
            .build();
        let whole = Bytes::copy_from_slice(bytes);
        let reader = caught(|| SerializedFileReader::new_with_options(whole, options))?;
        let schema = reader.metadata().file_metadata().schema_descr();
        let places: Vec<usize> =
            (0..schema.num_columns()).filter(|place| !is_index(schema.column(*place).name())).collect();
        let columns = Columns::of_header(places.iter().map(|place| schema.columns()[*place].name()))?;
        let feature = match columns.content {
            Content::Points { feature, .. } => Some(feature),
            Content::Poses { .. } => None,
        };
        let kind = |(column, place): (usize, usize)| {
            let descriptor = &schema.columns()[place];
            let kind = match descriptor.max_rep_level() {
                0 if column == columns.body || Some(column) == feature => Kind::of_names(descriptor),
                0 => Kind::of_numbers(descriptor),
                _ => Err("needed one value per row, found lists; leave one".into()),
            };
            kind.map(|kind| (place, kind)).map_err(|problem| columns.at(column, &problem))
        };
        let places = places.into_iter().enumerate().map(kind).collect::<Result<_, _>>()?;
        Ok(Self { bytes, reader, columns, places })
    }

    /// Reads all rows; `feature` is the column of the features' names, `sample` reads the sample.
    fn rows<T: Copy + Send>(
        self,
        feature: Option<usize>,
        sample: impl Fn(&Row<'_>) -> Result<T, String>,
        path: &Path,
    ) -> Result<Rows<T>, RecordingError> {
        let in_file = |problem: String| RecordingError::in_file(path, problem);
        let counts = self.counts().map_err(in_file)?;
        let (mut rows, mut number) = (Part::default(), 0);
        for (group, count) in counts.into_iter().enumerate() {
            let mut columns = self.group(group, count).map_err(in_file)?;
            for start in (0..count).step_by(BATCH) {
                let read = |(index, column): (usize, &mut Column)| {
                    column.next(BATCH.min(count - start)).map_err(|problem| in_file(self.columns.at(index, &problem)))
                };
                let cells = columns.iter_mut().enumerate().map(read).collect::<Result<Vec<_>, _>>()?;
                for index in 0..BATCH.min(count - start) {
                    number += 1;
                    let row = Row { columns: &self.columns, cells: &cells, index };
                    let push = row.push(&mut rows, feature, &sample);
                    push.map_err(|problem| RecordingError::at_row(path, number, problem))?;
                }
            }
        }
        let rows = Rows::of(vec![rows]);
        if rows.is_empty() {
            return Err(in_file("the table has columns but no rows; needed at least one sample".into()));
        }
        Ok(rows)
    }

    /// The number of rows in each group, checked against the file's size.
    fn counts(&self) -> Result<Vec<usize>, String> {
        let groups = self.reader.metadata().row_groups();
        let counts: Option<Vec<usize>> = groups.iter().map(|group| usize::try_from(group.num_rows()).ok()).collect();
        let counts = counts.ok_or("a negative number of rows; the file is damaged, write it anew")?;
        let total = counts.iter().fold(0_usize, |total, count| total.saturating_add(*count));
        if total > ALWAYS_ALLOWED.max(self.bytes.len()) {
            return Err(format!(
                "needed at least one byte per row, found {total} rows in {} bytes; leave out rows without a sample, or \
                 write the table as csv",
                self.bytes.len()
            ));
        }
        Ok(counts)
    }

    /// The columns of a group of rows, in the order of `columns`.
    fn group(&self, index: usize, rows: usize) -> Result<Vec<Column>, String> {
        let group = caught(|| self.reader.get_row_group(index))?;
        let schema = self.reader.metadata().file_metadata().schema_descr();
        if group.num_columns() != schema.num_columns() {
            let (found, needed) = (group.num_columns(), schema.num_columns());
            return Err(format!("needed {needed} columns in every group of rows, found {found}; write the file anew"));
        }
        let column = |(index, (place, kind)): (usize, &(usize, Kind))| {
            let pages = claims::check_pages(self.bytes, group.metadata().column(*place), rows);
            pages
                .and_then(|()| caught(|| group.get_column_reader(*place)))
                .map(|reader| Column::new(reader, *kind))
                .map_err(|problem| self.columns.at(index, &problem))
        };
        self.places.iter().enumerate().map(column).collect()
    }
}

/// Whether pandas numbers its rows by this column.
fn is_index(name: &str) -> bool {
    name.strip_prefix("__index_level_").and_then(|rest| rest.strip_suffix("__")).is_some()
}

/// A row among decoded columns.
struct Row<'a> {
    columns: &'a Columns,
    cells: &'a [Vec<Cell>],
    index: usize,
}

impl Row<'_> {
    fn push<T: Copy>(
        &self,
        rows: &mut Part<T>,
        feature: Option<usize>,
        sample: &impl Fn(&Self) -> Result<T, String>,
    ) -> Result<(), String> {
        let frame = self.cell(self.columns.frame).frame()?;
        let time = self.columns.time.map_or(Ok([f64::NAN]), |time| self.numbers([time]))?[0];
        let [mut of_body, mut of_feature] = [const { String::new() }; 2];
        let body = self.name(self.columns.body, "body", &mut of_body)?;
        let feature = feature.map_or(Ok(""), |feature| self.name(feature, "feature", &mut of_feature))?;
        rows.push(frame, time, (body, feature), sample(self)?);
        Ok(())
    }

    fn cell(&self, column: usize) -> &Cell {
        &self.cells[column][self.index]
    }

    fn name<'a>(&'a self, column: usize, what: &str, buffer: &'a mut String) -> Result<&'a str, String> {
        name(self.cell(column).text(buffer).map_err(|problem| self.columns.at(column, &problem))?, what)
    }

    /// The numbers in some cells; NaN where a cell is missing.
    fn numbers<const N: usize>(&self, columns: [usize; N]) -> Result<[f64; N], String> {
        let mut values = [f64::NAN; N];
        for (value, column) in values.iter_mut().zip(columns) {
            *value = self.cell(column).number().map_err(|problem| self.columns.at(column, &problem))?;
        }
        Ok(values)
    }
}

#[cfg(test)]
mod tests;
