//! Vicon Nexus's table of trajectories.
//!
//! ```text
//! Trajectories
//! 100
//! ,,box:left,,,box:right,,
//! Frame,Sub Frame,X,Y,Z,X,Y,Z
//! ,,mm,mm,mm,mm,mm,mm
//! 1,0,…
//! ```
//!
//! Sections of other data, before and after, are passed over; a blank line ends a section. Derivatives (`X'`, `X''`)
//! are left out. The second line is the frames per second, from which the times follow. Samples are missing where a cell
//! is empty or NaN.

use std::path::Path;

use crate::marker_table::{Samples, Source, check_length, frame, is_blank, lines};
use crate::text::{decode, number, quoted};
use crate::{Format, Markers, RecordingError, Unit};

/// Reads the markers of a table; `path` is named in errors, and `unit` takes the place of the unit that the file states.
///
/// # Errors
/// [`RecordingError::Line`] and [`RecordingError::File`] for what is said of tables [above](self).
pub fn parse(bytes: &[u8], path: &Path, unit: Option<Unit>) -> Result<Markers, RecordingError> {
    let text = decode(bytes, path)?;
    let separator = if text.lines().take(8).any(|line| line.contains(',')) { ',' } else { '\t' };
    let mut lines = lines(text, separator).skip_while(|(_, cells)| cells[0] != "Trajectories");
    let (title, _) = lines.next().ok_or_else(|| {
        RecordingError::in_file(path, "needed a section `Trajectories`, found none; export the trajectories")
    })?;
    let mut next = |what: &str| {
        let missing = || format!("needed {what} below `Trajectories`, found the end of the file; export it again");
        lines.next().ok_or_else(|| RecordingError::at_line(path, title, missing()))
    };
    let at = |line: u64| move |problem: String| RecordingError::at_line(path, line, problem);
    let (line, cells) = next("the frames per second")?;
    let rate = number(cells[0]).map_err(at(line))?;
    if !(rate > 0. && rate.is_finite()) {
        return Err(at(line)(format!("needed the frames per second, found {}", quoted(cells[0]))));
    }
    let (_, names) = next("the names of the markers")?;
    let (line, columns) = next("the names of the columns")?;
    if !(columns[0].eq_ignore_ascii_case("Frame")) {
        return Err(at(line)(format!("needed a column `Frame` first, found {}", quoted(columns[0]))));
    }
    let places: Vec<usize> = (2..columns.len().saturating_sub(2))
        .filter(|&column| [columns[column], columns[column + 1], columns[column + 2]] == ["X", "Y", "Z"])
        .collect();
    if places.is_empty() {
        return Err(at(line)("needed columns X, Y, Z, found none; export the trajectories again".into()));
    }
    let names: Vec<String> =
        places.iter().map(|&column| names.get(column).copied().unwrap_or_default().to_owned()).collect();
    let (line, units) = next("the units")?;
    let (unit, unit_stated) = match unit {
        Some(unit) => (unit, false),
        None => (Unit::of_name(units.get(places[0]).copied().unwrap_or_default()).map_err(at(line))?, true),
    };
    if let Some(other) = places.iter().find(|&&place| unit_stated && units.get(place) != units.get(places[0])) {
        let found = quoted(units.get(*other).copied().unwrap_or_default());
        return Err(at(line)(format!("needed one unit for all markers, found {unit} and {found}; export them alike")));
    }
    let needed = places.last().map_or(0, |last| last + 3);
    let mut samples = Samples::default();
    let mut row = Vec::new();
    let mut first = None;
    for (line, cells) in lines.take_while(|(_, cells)| !is_blank(cells)) {
        let mut read = || {
            check_length(&cells, needed, names.len())?;
            let frame = frame(cells[0])?;
            let elapsed = frame.saturating_sub(*first.get_or_insert(frame));
            samples.begin(line, frame, elapsed as f64 / rate)?;
            row.clear();
            row.extend(places.iter().flat_map(|&place| &cells[place..place + 3]));
            samples.markers(&row, &names, unit, false)
        };
        read().map_err(at(line))?;
    }
    samples.into_markers(path, Source { format: Format::Vicon, unit, unit_stated, rate: Some(rate) }, names, Vec::new())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Markers, String> {
        super::parse(text.as_bytes(), Path::new("a.csv"), None).map_err(|error| error.to_string())
    }

    const HEAD: &str =
        "Trajectories,,,\r\n50,,,\r\n,,box:a,,,b,,\r\nFrame,Sub Frame,X,Y,Z,X,Y,Z\r\n,,mm,mm,mm,mm,mm,mm\r\n";

    #[test]
    fn trajectories_end_at_a_blank_line_and_other_sections_are_passed_over() {
        let text = format!(
            "Devices\n1000\n,,f\nFrame,Sub Frame,Fx\n,,N\n1,0,5\n\n{HEAD}3,0,1000,2,3,,,\n5,0,1,2,3,4,5,6\n\nOther,1\n"
        );
        let found = parse(&text).expect("sound");
        assert_eq!((found.frame_numbers, found.times), (vec![3, 5], Some(vec![0., 0.04])));
        assert_eq!((found.unit, found.rate), (Unit::Millimetre, Some(50.)));
        assert_eq!(found.markers[0].body.as_deref(), Some("box"));
        assert!(found.positions[0].x == 1. && found.positions[1].x.is_nan());
    }

    #[test]
    fn derivatives_are_left_out() {
        let text = "Trajectories\n50\n,,a,,,a,,,b,,\nFrame,Sub Frame,X,Y,Z,X',Y',Z',X,Y,Z\n,,m,m,m,m/s,m/s,m/s,m,m,m\n1,0,1,2,3,4,5,6,7,8,9\n";
        let found = parse(text).expect("sound");
        assert_eq!(found.positions.iter().map(|p| p.x).collect::<Vec<_>>(), [1., 7.]);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (text, message) in [
            ("Devices\n1\n", "a.csv: needed a section `Trajectories`"),
            ("Trajectories\n", "a.csv, line 1: needed the frames per second below"),
            ("Trajectories\nfast\n", "a.csv, line 2: needed a number, found `fast`"),
            ("Trajectories\n0\n", "a.csv, line 2: needed the frames per second, found `0`"),
            (&HEAD.replace(",mm,mm,mm\r", ",m,m,m\r"), "a.csv, line 5: needed one unit for all markers"),
            (HEAD, "a.csv: the table has names of markers but no rows"),
            (&format!("{HEAD}1,0,1,2,3\n"), "a.csv, line 6: needed 8 cells for 2 markers, found 5"),
            (&format!("{HEAD}1,0,1,2,3,4,5,6\n1,0,1,2,3,4,5,6\n"), "a.csv, line 7: needed a frame after 1 of line 6"),
        ] {
            let found = parse(text).expect_err("refused");
            assert!(found.starts_with(message), "{found}");
        }
    }
}
