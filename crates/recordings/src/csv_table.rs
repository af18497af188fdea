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

use std::borrow::Cow;
use std::path::Path;

use jointscope_motion::Recording;
use memchr::{memchr, memchr_iter};
use nalgebra::Point3;
use rayon::prelude::*;

use crate::cells::Cutter;
use crate::columns::{Columns, Content, name};
use crate::grid::{Part, Place, Rows};
use crate::pose::pose;
use crate::text::{decode, quoted, trimmed};
use crate::{RecordingError, Unit};

/// Bytes of the text, up to the next line end, that one thread reads at a time.
const PIECE: usize = 1 << 22;

/// Reads a table of points or poses; `path` is named in errors.
///
/// # Errors
/// [`RecordingError::Line`] and [`RecordingError::File`] for what is said of tables [above](self);
/// [`RecordingError::Motion`], for instance for a body without any sample.
pub fn parse(bytes: &[u8], path: &Path, unit: Unit) -> Result<Recording, RecordingError> {
    in_pieces(PIECE, bytes, path, unit)
}

fn in_pieces(size: usize, bytes: &[u8], path: &Path, unit: Unit) -> Result<Recording, RecordingError> {
    let table = Table::of(decode(bytes, path)?, path)?;
    let columns = &table.columns;
    match columns.content {
        Content::Points { feature, position } => {
            let sample =
                |row: &Row<'_>| Ok(Point3::from(columns.numbers(row, position)?.map(|length| unit.to_metres(length))));
            let (rows, places) = table.rows(Some(feature), sample, size)?;
            rows.of_points(path, Place::Line(&|row| table.line_of(row, &places)))
        }
        Content::Poses { values } => {
            let sample = |row: &Row<'_>| pose(columns.numbers(row, values)?, unit);
            let (rows, places) = table.rows(None, sample, size)?;
            rows.of_poses(path, Place::Line(&|row| table.line_of(row, &places)))
        }
    }
}

/// The cells of a row.
type Row<'a> = [Cow<'a, str>];

/// A text whose header was read.
struct Table<'a> {
    text: &'a str,
    path: &'a Path,
    separator: u8,
    columns: Columns,
    /// Where the rows below the header begin.
    start: usize,
}

/// What was read of a piece of the text.
struct Piece<T> {
    start: usize,
    /// Where the row begins that was not read any more.
    end: usize,
    part: Part<T>,
    /// What is wrong with a row, and where it begins.
    problem: Option<(usize, String)>,
}

/// Where the rows of a part are: its first byte, and their number.
type PartPlace = (usize, usize);

impl<'a> Table<'a> {
    fn of(text: &'a str, path: &'a Path) -> Result<Self, RecordingError> {
        let header = text.trim_start().lines().next().unwrap_or_default();
        let count = |separator: u8| header.matches(char::from(separator)).count();
        // The last of equals wins, so the comma does.
        let separator = [b'\t', b';', b','].into_iter().max_by_key(|separator| count(*separator)).unwrap_or(b',');
        let (mut cutter, mut header) = (Cutter::new(text, separator, 0), Vec::new());
        let begin = loop {
            match cutter.row(&mut header) {
                None => {
                    let problem = "the file is empty; needed a header line and rows of samples";
                    return Err(RecordingError::in_file(path, problem));
                }
                Some(_) if is_blank(&header) => {}
                Some(begin) => break begin,
            }
        };
        let columns = Columns::of_header(header.iter().map(AsRef::as_ref))
            .map_err(|problem| RecordingError::at_line(path, line(text, begin), problem))?;
        Ok(Self { text, path, separator, columns, start: cutter.position })
    }

    /// Reads all rows, pieces of about so many bytes in parallel; `feature` is the column of the features' names, `sample`
    /// reads the sample.
    ///
    /// Pieces begin behind line ends. Where a quote is open there, which the piece before knows, the row goes on, and the
    /// piece is read again from its end.
    fn rows<T: Copy + Send>(
        &self,
        feature: Option<usize>,
        sample: impl Fn(&Row<'_>) -> Result<T, String> + Sync,
        size: usize,
    ) -> Result<(Rows<T>, Vec<PartPlace>), RecordingError> {
        let (bytes, all) = (self.text.as_bytes(), self.text.len());
        let mut limits = Vec::new();
        let mut start = self.start;
        while start < all {
            let least = (start + size).min(all);
            start = memchr(b'\n', &bytes[least..]).map_or(all, |rest| least + rest + 1);
            limits.push(start);
        }
        let starts = [self.start].into_iter().chain(limits.iter().copied());
        let pieces: Vec<(usize, usize)> = starts.zip(limits.iter().copied()).collect();
        let read = |start, limit, end| self.piece(start, limit, end, feature, &sample);
        let pieces: Vec<Piece<T>> = pieces.into_par_iter().map(|(start, limit)| read(start, limit, limit)).collect();
        let (mut parts, mut places, mut at) = (Vec::new(), Vec::new(), self.start);
        let mut accept = |piece: Piece<T>| {
            if let Some((begin, problem)) = piece.problem {
                return Err(RecordingError::at_line(self.path, line(self.text, begin), problem));
            }
            places.push((piece.start, piece.part.len()));
            parts.push(piece.part);
            Ok(piece.end)
        };
        for (piece, limit) in pieces.into_iter().zip(limits) {
            if piece.start == at {
                at = accept(piece)?;
            }
            if at < limit {
                at = accept(read(at, limit, all))?;
            }
        }
        let rows = Rows::of(parts);
        if rows.is_empty() {
            let problem = "the table has a header but no rows; needed at least one sample";
            return Err(RecordingError::in_file(self.path, problem));
        }
        Ok((rows, places))
    }

    /// Reads the rows that begin between two places, as if the text had an end; but a row with an open quote there only
    /// if it is the end of the whole text.
    fn piece<T: Copy>(
        &self,
        start: usize,
        limit: usize,
        end: usize,
        feature: Option<usize>,
        sample: &impl Fn(&Row<'_>) -> Result<T, String>,
    ) -> Piece<T> {
        let mut cutter = Cutter::new(&self.text[..end], self.separator, start);
        let (mut row, mut times) = (Vec::new(), Times::default());
        let mut piece = Piece { start, end: start, part: Part::default(), problem: None };
        while cutter.position < limit {
            let Some(begin) = cutter.row(&mut row) else { break };
            if cutter.open && end < self.text.len() {
                cutter.position = begin;
                break;
            }
            if is_blank(&row) {
                continue;
            }
            if let Err(problem) = self.push(&row, feature, sample, &mut times, &mut piece.part) {
                piece.problem = Some((begin, problem));
                break;
            }
        }
        piece.end = cutter.position;
        piece
    }

    fn push<T: Copy>(
        &self,
        row: &Row<'_>,
        feature: Option<usize>,
        sample: &impl Fn(&Row<'_>) -> Result<T, String>,
        times: &mut Times,
        part: &mut Part<T>,
    ) -> Result<(), String> {
        let columns = &self.columns;
        check_length(row, columns.names.len())?;
        let frame = frame_number(trimmed(&row[columns.frame]))?;
        let time = match columns.time {
            Some(column) => times.read(&row[column], || Ok(columns.numbers(row, [column])?[0]))?,
            None => f64::NAN,
        };
        let body = name(&row[columns.body], "body")?;
        let feature = feature.map_or(Ok(""), |feature| name(&row[feature], "feature"))?;
        part.push(frame, time, (body, feature), sample(row)?);
        Ok(())
    }

    /// The line where a row begins, counted from 1; rows are counted from 0.
    fn line_of(&self, row: usize, places: &[PartPlace]) -> u64 {
        let mut left = row;
        let of_part = places.iter().find(|(_, rows)| {
            let inside = left < *rows;
            left -= if inside { 0 } else { *rows };
            inside
        });
        let mut cutter = Cutter::new(self.text, self.separator, of_part.map_or(self.start, |(start, _)| *start));
        let mut cells = Vec::new();
        while let Some(begin) = cutter.row(&mut cells) {
            if !is_blank(&cells) {
                if left == 0 {
                    return line(self.text, begin);
                }
                left -= 1;
            }
        }
        line(self.text, self.text.len())
    }
}

/// The time of the row before, which most rows repeat.
#[derive(Default)]
struct Times {
    cell: String,
    time: Option<f64>,
}

impl Times {
    fn read(&mut self, cell: &str, read: impl Fn() -> Result<f64, String>) -> Result<f64, String> {
        if let Some(time) = self.time.filter(|_| self.cell == cell) {
            return Ok(time);
        }
        let time = read()?;
        self.cell.clear();
        self.cell.push_str(cell);
        self.time = Some(time);
        Ok(time)
    }
}

/// The line of a place in a text, from 1.
fn line(text: &str, place: usize) -> u64 {
    1 + memchr_iter(b'\n', &text.as_bytes()[..place]).count() as u64
}

/// A line of blanks.
fn is_blank(row: &Row<'_>) -> bool {
    matches!(row, [cell] if cell.trim().is_empty())
}

fn check_length(row: &Row<'_>, columns: usize) -> Result<(), String> {
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
