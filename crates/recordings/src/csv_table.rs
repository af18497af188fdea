//! Tables of points or poses with a header.
//!
//! A table of points has the columns `frame,time,body,feature,x,y,z`, a table of poses
//! `frame,time,body,x,y,z,qx,qy,qz,qw`; any quaternion column makes it one of poses.
//!
//! * **Text.** UTF-8 with or without byte order mark; lines end as on any system; cells are separated by commas,
//!   semicolons or tabs (whichever occurs most in the header) and may be quoted; blanks around cells do not count.
//!   Blank lines are skipped; there are no comments.
//! * **Columns.** In any order and case. `time` is optional, the others are needed, and there are no further ones.
//! * **Frames.** The distinct whole numbers that occur, from 0 to 2⁶⁴ − 1, sorted; rows come in any order.
//! * **Times** in seconds. A frame's time is the one its rows give; rows may leave it empty, but rows that give it must
//!   agree, and all frames have a time or none has.
//! * **Names.** Bodies, and features within a body, are in order of first appearance and not empty.
//! * **Samples.** At most one row each. A sample is missing if it has no row, if any of its coordinates is empty or
//!   NaN, or if its quaternion is all zeros.
//! * **Poses** are `recording_from_tracked`. The norm of a quaternion is within 5 % of 1, and is made 1.
//! * **Size.** Frames × features of all bodies are at most 64 per row, or a million.

use std::path::Path;

use csv::{ReaderBuilder, StringRecord};
use jointscope_motion::Recording;
use nalgebra::Point3;

use crate::columns::{Columns, Content, name};
use crate::grid::{Place, Rows};
use crate::pose::pose;
use crate::text::{decode, quoted};
use crate::{RecordingError, Unit};

/// Reads a table of points or poses; `path` is named in errors.
///
/// # Errors
/// [`RecordingError::Line`] and [`RecordingError::File`] for what is said of tables [above](self);
/// [`RecordingError::Motion`], for instance for a body without any sample.
pub fn parse(bytes: &[u8], path: &Path, unit: Unit) -> Result<Recording, RecordingError> {
    let mut table = Table::new(decode(bytes, path)?, path);
    let Some(header_line) = table.next_row()? else {
        return Err(RecordingError::in_file(path, "the file is empty; needed a header line and rows of samples"));
    };
    let columns =
        Columns::of_header(&table.row).map_err(|problem| RecordingError::at_line(path, header_line, problem))?;
    match columns.content {
        Content::Points { feature, position } => {
            let sample = |row: &StringRecord| {
                Ok(Point3::from(columns.numbers(row, position)?.map(|length| unit.to_metres(length))))
            };
            table.rows(&columns, Some(feature), sample)?.of_points(path)
        }
        Content::Poses { values } => {
            let sample = |row: &StringRecord| pose(columns.numbers(row, values)?, unit);
            table.rows(&columns, None, sample)?.of_poses(path)
        }
    }
}

/// A text cut into rows and cells.
struct Table<'a> {
    text: &'a str,
    path: &'a Path,
    reader: csv::Reader<&'a [u8]>,
    row: StringRecord,
}

impl<'a> Table<'a> {
    fn new(text: &'a str, path: &'a Path) -> Self {
        let header = text.trim_start().lines().next().unwrap_or_default();
        let count = |separator: u8| header.matches(char::from(separator)).count();
        // The last of equals wins, so the comma does.
        let separator = [b'\t', b';', b','].into_iter().max_by_key(|separator| count(*separator)).unwrap_or(b',');
        let reader =
            ReaderBuilder::new().has_headers(false).flexible(true).delimiter(separator).from_reader(text.as_bytes());
        Self { text, path, reader, row: StringRecord::new() }
    }

    /// Reads the next row that is not blank into `row`; gives the line where it begins.
    ///
    /// The reader counts blank lines as part of the row below them, so they are counted here.
    fn next_row(&mut self) -> Result<Option<u64>, RecordingError> {
        loop {
            let start = self.reader.position().clone();
            let byte = usize::try_from(start.byte()).unwrap_or(usize::MAX);
            let rest = self.text.get(byte..).unwrap_or_default();
            let blank = rest.len() - rest.trim_start_matches(['\r', '\n']).len();
            let line = start.line() + rest[..blank].matches('\n').count() as u64;
            match self.reader.read_record(&mut self.row) {
                Ok(false) => return Ok(None),
                Ok(true) if self.row.iter().all(|cell| cell.trim().is_empty()) && self.row.len() == 1 => {}
                Ok(true) => return Ok(Some(line)),
                Err(error) => return Err(RecordingError::at_line(self.path, line, error.to_string())),
            }
        }
    }

    /// Reads all rows below the header; `feature` is the column of the features' names, `sample` reads the sample.
    fn rows<T: Copy>(
        mut self,
        columns: &Columns,
        feature: Option<usize>,
        sample: impl Fn(&StringRecord) -> Result<T, String>,
    ) -> Result<Rows<T>, RecordingError> {
        let path = self.path;
        let mut rows = Rows::new(Place::Line);
        while let Some(line) = self.next_row()? {
            let mut read = || {
                check_length(&self.row, columns.names.len())?;
                let frame = frame_number(self.row[columns.frame].trim())?;
                let time = match columns.time {
                    Some(time) => columns.numbers(&self.row, [time])?[0],
                    None => f64::NAN,
                };
                let body = name(&self.row[columns.body], "body")?;
                let feature = feature.map_or(Ok(""), |feature| name(&self.row[feature], "feature"))?;
                rows.push(line, frame, time, (body, feature), sample(&self.row)?);
                Ok(())
            };
            read().map_err(|problem: String| RecordingError::at_line(path, line, problem))?;
        }
        if rows.is_empty() {
            return Err(RecordingError::in_file(
                path,
                "the table has a header but no rows; needed at least one sample",
            ));
        }
        Ok(rows)
    }
}

fn check_length(row: &StringRecord, columns: usize) -> Result<(), String> {
    if row.len() == columns {
        return Ok(());
    }
    let advice = if row.iter().any(|cell| cell.contains('\n')) {
        "a quote seems to be left open"
    } else {
        "leave missing cells empty, but keep their separators"
    };
    Err(format!("needed {columns} cells, one per column of the header, found {}; {advice}", row.len()))
}

pub(crate) fn frame_number(cell: &str) -> Result<u64, String> {
    /// Whole numbers up to here are exact in `f64`.
    const LARGEST_EXACT: f64 = 9_007_199_254_740_992.;

    if let Ok(number) = cell.parse() {
        return Ok(number);
    }
    match cell.parse::<f64>() {
        // Some programs write frame numbers as `3.0`.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole and in range")]
        Ok(number) if number.fract() == 0. && (0. ..=LARGEST_EXACT).contains(&number) => Ok(number as u64),
        _ => Err(format!(
            "column `frame`: needed a whole number from 0, found {}; number the frames 0, 1, 2 …",
            quoted(cell)
        )),
    }
}

#[cfg(test)]
mod tests;
