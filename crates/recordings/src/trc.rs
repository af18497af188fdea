//! TRC: markers as a text table, as many programs of motion analysis exchange them.
//!
//! ```text
//! PathFileType  4  (X/Y/Z)  FILE
//! DataRate  CameraRate  NumFrames  NumMarkers  Units  OrigDataRate  OrigDataStartFrame  OrigNumFrames
//! 100  100  652  51  mm  100  1  652
//! Frame#  Time  heel      toe
//!               X1 Y1 Z1  X2 Y2 Z2
//! 1  0.00  …
//! ```
//!
//! * **Text.** UTF-8; cells are separated by tabs, or by commas if the line of names has no tab. Blank lines are skipped.
//! * **Names** are the cells of the fourth line that are not empty, after `Frame#` and `Time`; their coordinates follow
//!   one another from the third cell of a row on, however many empty cells separate the names.
//! * **Samples.** Missing where a cell is empty or NaN. Rows count; `NumFrames` is only compared with them.
//! * **Unit** is `Units` of the third line.

use std::path::Path;

use crate::marker_table::{Samples, Source, cells, check_width, frame, is_blank, lines};
use crate::text::{decode, number, quoted};
use crate::{Format, Markers, RecordingError, Unit};

/// Reads the markers of a table; `path` is named in errors, and `unit` takes the place of the unit that the file states.
///
/// # Errors
/// [`RecordingError::Line`] and [`RecordingError::File`] for what is said of tables [above](self).
pub fn parse(bytes: &[u8], path: &Path, unit: Option<Unit>) -> Result<Markers, RecordingError> {
    let text = decode(bytes, path)?;
    let at = |line: u64| move |problem: String| RecordingError::at_line(path, line, problem);
    let line = |index: usize| text.lines().nth(index).unwrap_or_default();
    let separator = if line(3).contains('\t') { '\t' } else { ',' };
    let header = |name: &str| {
        let column = cells(line(1), separator).iter().position(|cell| cell.eq_ignore_ascii_case(name))?;
        cells(line(2), separator).get(column).copied().filter(|cell| !cell.is_empty())
    };
    let first = cells(line(3), separator);
    if !first.first().is_some_and(|cell| cell.to_ascii_lowercase().starts_with("frame")) || first.len() < 3 {
        let found = quoted(first.first().copied().unwrap_or_default());
        return Err(at(4)(format!(
            "needed the names of the markers after `Frame#` and `Time`, found {found}; a TRC file has them in its fourth \
             line"
        )));
    }
    let names: Vec<String> = first[2..].iter().filter(|cell| !cell.is_empty()).map(ToString::to_string).collect();
    let coordinates = cells(line(4), separator).iter().filter(|cell| !cell.is_empty()).count();
    if coordinates != 3 * names.len() || names.is_empty() {
        return Err(at(5)(format!(
            "needed X, Y and Z of each of {} markers of the line before, found {coordinates} columns; name every marker \
             once",
            names.len()
        )));
    }
    let (unit, unit_stated) = match (unit, header("Units")) {
        (Some(unit), _) => (unit, false),
        (None, Some(name)) => (Unit::of_name(name).map_err(at(3))?, true),
        (None, None) => {
            return Err(at(3)("needed the unit of the positions under `Units`, found none; name the unit".into()));
        }
    };
    let mut samples = Samples::default();
    let needed = 2 + 3 * names.len();
    for (number_of_line, cells) in lines(text, separator).skip(5) {
        if is_blank(&cells) {
            continue;
        }
        let mut read = || {
            check_width(&cells, needed, names.len())?;
            samples.begin(number_of_line, frame(cells[0])?, number(cells[1])?)?;
            samples.markers(&cells[2..needed], &names, unit, false)
        };
        read().map_err(at(number_of_line))?;
    }
    let mut notes = Vec::new();
    let promised = header("NumFrames").and_then(|cell| cell.parse::<f64>().ok());
    if let Some(promised) = promised.filter(|promised| *promised != samples.frame_numbers.len() as f64) {
        notes.push(format!("the header promises {promised} frames, the table has {}", samples.frame_numbers.len()));
    }
    let rate =
        header("DataRate").and_then(|cell| cell.parse().ok()).filter(|rate: &f64| *rate > 0. && rate.is_finite());
    samples.into_markers(path, Source { format: Format::Trc, unit, unit_stated, rate }, names, notes)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n\
                        100\t100\t9\t2\tmm\nFrame#\tTime\ta:x\t\t\tb\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n";

    fn parse(text: &str) -> Result<Markers, String> {
        super::parse(text.as_bytes(), Path::new("a.trc"), None).map_err(|error| error.to_string())
    }

    #[test]
    fn empty_and_nan_cells_are_missing_and_the_unit_is_the_file_s() {
        let found =
            parse(&format!("{HEAD}\n1\t0.0\t1000\t-2e3\t0\t\t\t \n4\t0.1\tNaN\tnan\tNAN\t1\t2\t3\n")).expect("sound");
        assert_eq!((found.frame_numbers, found.times), (vec![1, 4], Some(vec![0., 0.1])));
        assert_eq!((found.unit, found.unit_stated, found.rate), (Unit::Millimetre, true, Some(100.)));
        assert_eq!(found.markers[0].body.as_deref(), Some("a"));
        let x: Vec<f64> = found.positions.iter().map(|p| p.x).collect();
        assert!(x[0] == 1. && x[1].is_nan() && x[2].is_nan() && x[3] == 0.001, "{x:?}");
        assert_eq!(found.notes, ["the header promises 9 frames, the table has 2"]);
    }

    #[test]
    fn commas_and_odd_numbers_of_empty_cells_between_names_are_understood() {
        let text = HEAD.replace('\t', ",") + "1,0,1,2,3,4,5,6\n";
        assert_eq!(parse(&text).expect("commas").positions.len(), 2);
        let text = HEAD.replace("\ta:x\t\t\tb\t\t", "\t\ta:x\t\tb\t").replace("\t\tX1", "\t\t\tX1");
        let found = parse(&(text + "1\t0\t1\t2\t3\t4\t5\t6\n")).expect("one empty cell per name");
        assert_eq!(found.markers[1].name, "b");
        assert_eq!(found.positions[1].z, 0.006);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (text, message) in [
            ("", "a.trc, line 4: needed the names of the markers"),
            (&HEAD.replace("Z2", ""), "a.trc, line 5: needed X, Y and Z of each of 2 markers"),
            (&HEAD.replace("mm", "furlong"), "a.trc, line 3: no unit is named `furlong`"),
            (HEAD, "a.trc: the table has names of markers but no rows"),
            (&format!("{HEAD}1\t0\t1\t2\t3\t4\t5\n"), "a.trc, line 6: needed 8 cells for 2 markers, found 7"),
            (&format!("{HEAD}1\t0\t1\t2\t3\t4\t5\t6\t7\n"), "a.trc, line 6: needed 8 cells for 2 markers, found more"),
            (&format!("{HEAD}1\t0\t1\tq\t3\t4\t5\t6\n"), "a.trc, line 6: marker `a:x`: needed a number, found `q`"),
            (&format!("{HEAD}x\t0\t1\t2\t3\t4\t5\t6\n"), "a.trc, line 6: column `frame`: needed a whole number"),
        ] {
            let found = parse(text).expect_err("refused");
            assert!(found.starts_with(message), "{found}");
        }
    }
}
