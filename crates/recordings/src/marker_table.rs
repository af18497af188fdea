//! What the text tables of markers have in common: rows of cells, and samples that fill up frame by frame.

use std::path::Path;

use nalgebra::Point3;

use crate::markers::distinct;
use crate::text::{number, quoted};
use crate::{Format, Markers, RecordingError, Unit};

/// The lines of a table cut into cells, with their numbers from 1; cells may be quoted.
pub(crate) fn lines(text: &str, separator: char) -> impl Iterator<Item = (u64, Vec<&str>)> {
    (1..).zip(text.lines().map(move |line| cells(line, separator)))
}

/// The cells of a line, without the quotes and blanks around them.
pub(crate) fn cells(line: &str, separator: char) -> Vec<&str> {
    let mut inside = false;
    let split = line.split(move |letter| {
        inside ^= letter == '"';
        letter == separator && !inside
    });
    split.map(|cell| cell.trim().trim_matches('"').trim()).collect()
}

/// Frames of markers as they are read.
#[derive(Default)]
pub(crate) struct Samples {
    pub frame_numbers: Vec<u64>,
    pub times: Vec<f64>,
    pub positions: Vec<Point3<f64>>,
    line: u64,
}

impl Samples {
    /// Begins the frame of a line.
    pub(crate) fn begin(&mut self, line: u64, frame: u64, time: f64) -> Result<(), String> {
        if let (Some(&last), Some(&before)) = (self.frame_numbers.last(), self.times.last()) {
            if frame <= last {
                return Err(format!(
                    "needed a frame after {last} of line {}, found {frame}; put the rows in order, one per frame",
                    self.line
                ));
            }
            if time < before {
                return Err(format!(
                    "needed a time from {before} s of line {} on, found {time} s; put the rows in order",
                    self.line
                ));
            }
        }
        if self.times.first().is_some_and(|first| first.is_nan() != time.is_nan()) {
            return Err("needed a time in every row or in none; give every row its time".into());
        }
        self.line = line;
        self.frame_numbers.push(frame);
        self.times.push(time);
        Ok(())
    }

    /// Adds the markers of the frame, three cells each.
    pub(crate) fn markers(
        &mut self,
        cells: &[&str],
        names: &[String],
        unit: Unit,
        zero_is_missing: bool,
    ) -> Result<(), String> {
        for (name, cells) in names.iter().zip(cells.chunks_exact(3)) {
            let value = |cell: &str| number(cell).map_err(|problem| format!("marker {}: {problem}", quoted(name)));
            let position = [value(cells[0])?, value(cells[1])?, value(cells[2])?];
            let missing = zero_is_missing && position == [0.; 3];
            self.positions.push(Point3::from(position.map(|x| if missing { f64::NAN } else { unit.to_metres(x) })));
        }
        Ok(())
    }

    /// All that was read, unless there are no rows.
    pub(crate) fn into_markers(
        self,
        path: &Path,
        Source { format, unit, unit_stated, rate }: Source,
        names: Vec<String>,
        mut notes: Vec<String>,
    ) -> Result<Markers, RecordingError> {
        let Self { frame_numbers, times, positions, .. } = self;
        if frame_numbers.is_empty() {
            return Err(RecordingError::in_file(
                path,
                "the table has names of markers but no rows; needed at least one frame",
            ));
        }
        let markers = distinct(names, &mut notes);
        // Rows have a time all, or none.
        let times = (!times[0].is_nan()).then_some(times);
        Ok(Markers {
            format,
            unit,
            unit_stated,
            rate,
            frame_numbers,
            times,
            markers,
            positions,
            poses: Vec::new(),
            notes,
        })
    }
}

/// What a table says of itself.
pub(crate) struct Source {
    pub format: Format,
    pub unit: Unit,
    /// Whether the unit is the file's, not the caller's or the format's.
    pub unit_stated: bool,
    /// Frames per second.
    pub rate: Option<f64>,
}

/// A row that should have so many cells at least.
pub(crate) fn check_length(cells: &[&str], needed: usize, markers: usize) -> Result<(), String> {
    if cells.len() >= needed {
        return Ok(());
    }
    Err(format!(
        "needed {needed} cells for {markers} markers, found {}; the file may be cut off, write it again",
        cells.len()
    ))
}

/// A row that should have just so many cells, and blank ones behind.
pub(crate) fn check_width(cells: &[&str], needed: usize, markers: usize) -> Result<(), String> {
    check_length(cells, needed, markers)?;
    if is_blank(&cells[needed..]) {
        return Ok(());
    }
    Err(format!("needed {needed} cells for {markers} markers, found more; name every marker"))
}

/// A frame number.
pub(crate) fn frame(cell: &str) -> Result<u64, String> {
    crate::csv_table::frame_number(cell)
}

/// A row that is no more than separators.
pub(crate) fn is_blank(cells: &[&str]) -> bool {
    cells.iter().all(|cell| cell.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quoted_cells_keep_their_separators() {
        assert_eq!(cells("a, \"b,c\" ,\"\",d", ','), ["a", "b,c", "", "d"]);
        assert_eq!(cells("", ','), [""]);
    }

    #[test]
    fn frames_and_times_that_go_back_are_refused_with_the_line_before() {
        let mut samples = Samples::default();
        samples.begin(5, 1, 0.).expect("the first");
        assert!(samples.begin(6, 1, 0.1).expect_err("again").starts_with("needed a frame after 1 of line 5"));
        assert!(samples.begin(6, 2, -1.).expect_err("back").starts_with("needed a time from 0 s of line 5"));
        assert!(samples.begin(6, 2, f64::NAN).expect_err("none").starts_with("needed a time in every row"));
    }
}
