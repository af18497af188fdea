//! Qualisys's text table of markers.
//!
//! Lines `KEY`, tab, value, of which `FREQUENCY` and `MARKER_NAMES` are read; then, if the exporter was asked for it, a
//! line of column names `Frame`, `Time`, `heel X`, `heel Y`, `heel Z` …; then one row per frame, with or without the
//! columns of frame and time; all separated by tabs.
//!
//! * **Unit** is the millimetre, unless another one is given.
//! * **Samples** are missing where a cell is empty or NaN, or all three are zero.
//! * **Frames** without a column of their own count from 1, times without one follow from `FREQUENCY`.

use std::path::Path;

use crate::marker_table::{Samples, Source, check_width, frame, is_blank, lines};
use crate::text::{decode, number, quoted};
use crate::{Format, Markers, RecordingError, Unit};

/// Reads the markers of a table; `path` is named in errors, and `unit` takes the place of millimetres.
///
/// # Errors
/// [`RecordingError::Line`] and [`RecordingError::File`] for what is said of tables [above](self).
pub fn parse(bytes: &[u8], path: &Path, unit: Option<Unit>) -> Result<Markers, RecordingError> {
    let text = decode(bytes, path)?;
    let Header { names, rate, columns, rows_from } = Header::read(text, path)?;
    let (unit, unit_stated) = (unit.unwrap_or(Unit::Millimetre), unit.is_none());
    let mut samples = Samples::default();
    let needed = columns + 3 * names.len();
    for (line, cells) in lines(text, '\t').skip(rows_from) {
        if is_blank(&cells) {
            continue;
        }
        let mut read = || {
            check_width(&cells, needed, names.len())?;
            let row = samples.frame_numbers.len() as u64;
            let frame = if columns > 0 { frame(cells[0])? } else { row + 1 };
            let time = if columns > 1 { number(cells[1])? } else { (frame.saturating_sub(1)) as f64 / rate };
            samples.begin(line, frame, time)?;
            samples.markers(&cells[columns..needed], &names, unit, true)
        };
        read().map_err(|problem| RecordingError::at_line(path, line, problem))?;
    }
    samples.into_markers(
        path,
        Source { format: Format::Qualisys, unit, unit_stated, rate: Some(rate) },
        names,
        Vec::new(),
    )
}

/// What stands above the rows.
struct Header {
    names: Vec<String>,
    rate: f64,
    /// Columns before those of the markers: 0 to 2.
    columns: usize,
    /// Lines before the first row.
    rows_from: usize,
}

impl Header {
    fn read(text: &str, path: &Path) -> Result<Self, RecordingError> {
        let (mut names, mut rate) = (None, f64::NAN);
        for (line, cells) in lines(text, '\t') {
            let refuse = |problem: String| RecordingError::at_line(path, line, problem);
            let key = cells[0];
            if key == "FREQUENCY" {
                rate = cells.get(1).map_or(Ok(f64::NAN), |cell| number(cell)).map_err(refuse)?;
            } else if key == "MARKER_NAMES" {
                let named = cells[1..].iter().take_while(|cell| !cell.is_empty());
                names = Some(named.map(ToString::to_string).collect::<Vec<_>>());
            } else if matches!(key, "BODY_NAMES" | "NO_OF_BODIES") {
                return Err(refuse(
                    "this is a table of rigid bodies, not of markers; export the 3D data instead".into(),
                ));
            }
            let is_key = key.starts_with(|first: char| first.is_ascii_uppercase()) && key.contains('_')
                || matches!(key, "FREQUENCY" | "DESCRIPTION");
            if is_key || is_blank(&cells) {
                continue;
            }
            let needed = names.as_ref().filter(|names| !names.is_empty()).ok_or_else(|| {
                refuse("needed the names of the markers in a line MARKER_NAMES above, found none; export them".into())
            })?;
            if !(rate > 0. && rate.is_finite()) {
                return Err(refuse("needed the frames per second in a line FREQUENCY above, found none".into()));
            }
            let has_names = cells.iter().any(|cell| cell.ends_with(" X"));
            let columns = if has_names {
                let columns = cells.iter().take_while(|cell| !cell.ends_with(" X")).count();
                let fits = |(at, name): (usize, &String)| {
                    cells.get(columns + 3 * at).and_then(|cell| cell.strip_suffix(" X")) == Some(name.as_str())
                };
                if columns > 2 || !needed.iter().enumerate().all(fits) {
                    let found = quoted(cells.get(columns).copied().unwrap_or_default());
                    return Err(refuse(format!(
                        "needed `Frame`, `Time` and the columns of the markers in the order of MARKER_NAMES, found \
                         {found} first; export the table again"
                    )));
                }
                columns
            } else {
                let filled = cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
                filled.saturating_sub(3 * needed.len()).min(2)
            };
            let rows_from = usize::try_from(line).unwrap_or(usize::MAX) - usize::from(!has_names);
            return Ok(Self { names: needed.clone(), rate, columns, rows_from });
        }
        Err(RecordingError::in_file(path, "the table has no rows; needed a line of markers per frame"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Markers, String> {
        super::parse(text.as_bytes(), Path::new("a.tsv"), None).map_err(|error| error.to_string())
    }

    const HEAD: &str = "NO_OF_FRAMES\t2\r\nFREQUENCY\t100\r\nMARKER_NAMES\ta\tb\r\n";

    #[test]
    fn empty_and_zero_samples_are_missing() {
        let text = format!(
            "{HEAD}Frame\tTime\ta X\ta Y\ta Z\tb X\tb Y\tb Z\r\n7\t0.5\t1000\t2000\t3000\t\t\t\r\n8\t0.6\t0\t0\t0\t1\t0\t0\t\n"
        );
        let found = parse(&text).expect("sound");
        assert_eq!((found.frame_numbers, found.times), (vec![7, 8], Some(vec![0.5, 0.6])));
        assert_eq!((found.unit, found.rate), (Unit::Millimetre, Some(100.)));
        assert_eq!(found.positions[0], nalgebra::Point3::new(1., 2., 3.));
        assert!(found.positions[1].x.is_nan() && found.positions[2].x.is_nan());
        assert_eq!(found.positions[3].x, 0.001);
    }

    #[test]
    fn tables_without_columns_of_frame_and_time_count_themselves() {
        let found = parse(&format!("{HEAD}1\t2\t3\t4\t5\t6\n1\t2\t3\t4\t5\t6\n")).expect("sound");
        assert_eq!((found.frame_numbers, found.times), (vec![1, 2], Some(vec![0., 0.01])));
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (text, message) in [
            ("1\t2\t3\n", "a.tsv, line 1: needed the names of the markers"),
            ("MARKER_NAMES\ta\n1\t2\t3\n", "a.tsv, line 2: needed the frames per second"),
            (HEAD, "a.tsv: the table has no rows"),
            (&format!("{HEAD}Frame\tTime\tb X\tb Y\tb Z\n"), "a.tsv, line 4: needed `Frame`, `Time` and the columns"),
            (&format!("{HEAD}1\t2\t3\t4\n"), "a.tsv, line 4: needed 6 cells for 2 markers, found 4"),
            ("NO_OF_BODIES\t1\n", "a.tsv, line 1: this is a table of rigid bodies"),
        ] {
            let found = parse(text).expect_err("refused");
            assert!(found.starts_with(message), "{found}");
        }
    }
}
