//! Text without header: the positions or poses of one body, one row per frame.
//!
//! Cells are separated by blanks; blank lines and lines that begin with `#` are skipped. The number of columns, the
//! same in all rows, tells what they are:
//!
//! | columns | content |
//! |---|---|
//! | 3 | `x y z`: one feature, labelled `position` |
//! | 4 | `t x y z` |
//! | 7 | `x y z qx qy qz qw` |
//! | 8 | `t x y z qx qy qz qw`, as the TUM benchmarks write trajectories |
//! | 9 | `x y z qx qy qz qw width height`, as detectors of rectangles log them; the size is read and ignored |
//!
//! * **Body.** One, named after the file without its extension; poses are `recording_from_tracked`.
//! * **Frames** are the rows, counted from 0. Rows with time are sorted by it first; no time occurs twice.
//! * **Samples.** A row with a NaN (other than in time or size) or with a quaternion of zeros is a frame without
//!   sample. The norm of a quaternion is within 5 % of 1, and is made 1.

use std::path::Path;

use jointscope_motion::{Body, Recording, Tracks};
use nalgebra::Point3;

use crate::pose::pose;
use crate::text::{decode, number};
use crate::{RecordingError, Unit};

/// Reads the positions or poses of one body; `path` names the body, and is named in errors.
///
/// # Errors
/// [`RecordingError::Line`] and [`RecordingError::File`] for what is said of pose text [above](self);
/// [`RecordingError::Motion`], for instance if no row has a sample.
pub fn parse(bytes: &[u8], path: &Path, unit: Unit) -> Result<Recording, RecordingError> {
    let (layout, mut rows) = rows(decode(bytes, path)?, path)?;
    if layout.time {
        sort_by_time(&mut rows, path)?;
    }
    let times = layout.time.then(|| rows.iter().map(|row| row.time).collect());
    let body = if layout.rotation {
        let read =
            |row: &Row| pose(row.values, unit).map_err(|problem| RecordingError::at_line(path, row.line, problem));
        let poses = rows.iter().map(read).collect::<Result<_, _>>()?;
        Body::from_poses(body_name(path), poses)
    } else {
        let position = |row: &Row| {
            let [x, y, z, ..] = row.values;
            Point3::from([x, y, z].map(|length| unit.to_metres(length)))
        };
        Tracks::new(1, rows.iter().map(position).collect())
            .and_then(|tracks| Body::from_points(body_name(path), vec!["position".into()], tracks))
    };
    let frames = (0..rows.len() as u64).collect();
    body.and_then(|body| Recording::new(frames, times, vec![body])).map_err(RecordingError::motion(path))
}

/// What the columns are.
#[derive(Clone, Copy)]
struct Layout {
    columns: usize,
    time: bool,
    rotation: bool,
}

impl Layout {
    fn of_columns(columns: usize) -> Option<Self> {
        let (time, rotation) = match columns {
            3 => (false, false),
            4 => (true, false),
            7 | 9 => (false, true),
            8 => (true, true),
            _ => return None,
        };
        Some(Self { columns, time, rotation })
    }
}

struct Row {
    line: u64,
    /// NaN if there is none.
    time: f64,
    /// Position and quaternion; NaN if there is none.
    values: [f64; 7],
}

fn rows(text: &str, path: &Path) -> Result<(Layout, Vec<Row>), RecordingError> {
    let mut layout = None;
    let mut rows = Vec::new();
    let mut cells = Vec::new();
    for (line, content) in (1..).zip(text.lines()) {
        let content = content.trim();
        if content.is_empty() || content.starts_with('#') {
            continue;
        }
        let refuse = |problem: String| RecordingError::at_line(path, line, problem);
        cells.clear();
        cells.extend(content.split_whitespace());
        let layout = match layout {
            Some(layout) => layout,
            None => *layout.insert(Layout::of_columns(cells.len()).ok_or_else(|| refuse(unknown(content)))?),
        };
        if cells.len() != layout.columns {
            let (needed, found) = (layout.columns, cells.len());
            return Err(refuse(format!(
                "needed {needed} numbers as in the rows before, found {found}; mark lost samples nan"
            )));
        }
        rows.push(row(&cells, layout, line).map_err(refuse)?);
    }
    let nothing = || RecordingError::in_file(path, "the file has no rows; needed rows such as `x y z qx qy qz qw`");
    Ok((layout.ok_or_else(nothing)?, rows))
}

fn unknown(content: &str) -> String {
    let advice = if content.contains([',', ';']) {
        "read a table with separators and header as csv"
    } else {
        "see which columns each number means"
    };
    format!(
        "needed 3 numbers (x y z), 4 (t x y z), 7 (x y z qx qy qz qw), 8 (t x y z qx qy qz qw) or 9 (with width and \
         height at the end), found {} columns; {advice}",
        content.split_whitespace().count()
    )
}

fn row(cells: &[&str], layout: Layout, line: u64) -> Result<Row, String> {
    let mut numbers = [f64::NAN; 9];
    for (column, (value, cell)) in numbers.iter_mut().zip(cells).enumerate() {
        *value = number(cell).map_err(|problem| format!("column {}: {problem}", column + 1))?;
    }
    let first = usize::from(layout.time);
    let time = if layout.time { numbers[0] } else { f64::NAN };
    if layout.time && time.is_nan() {
        return Err("column 1: needed a time in seconds, found NaN; remove the row".into());
    }
    let mut values = [f64::NAN; 7];
    values.copy_from_slice(&numbers[first..first + 7]);
    Ok(Row { line, time, values })
}

fn sort_by_time(rows: &mut [Row], path: &Path) -> Result<(), RecordingError> {
    rows.sort_by(|a, b| a.time.total_cmp(&b.time));
    match rows.windows(2).find(|pair| pair[0].time >= pair[1].time) {
        Some([first, second]) => {
            let (first, second, time) = (first.line.min(second.line), first.line.max(second.line), first.time);
            let problem =
                format!("needed one row per time, found time {time} again after line {first}; remove one row");
            Err(RecordingError::at_line(path, second, problem))
        }
        _ => Ok(()),
    }
}

/// The name of a body in a file that names none: the file's own, without folder and extension.
pub(crate) fn body_name(path: &Path) -> String {
    match path.file_stem().map(|stem| stem.to_string_lossy().trim().to_owned()) {
        Some(name) if !name.is_empty() => name,
        _ => "body".into(),
    }
}

#[cfg(test)]
mod tests {
    use jointscope_motion::Observation;
    use proptest::prelude::*;

    use super::*;

    fn read(text: &str) -> Result<Recording, RecordingError> {
        parse(text.as_bytes(), Path::new("logs/door.log"), Unit::Millimetre)
    }

    fn refused(text: &str) -> String {
        read(text).expect_err("refused").to_string()
    }

    /// Positions in metres as (x, y, z), of bodies of either kind.
    fn positions(recording: &Recording) -> Vec<Option<[f64; 3]>> {
        match recording.bodies()[0].observation() {
            Observation::Points { tracks, .. } => {
                (0..tracks.frames()).map(|frame| tracks.get(frame, 0).map(|point| point.coords.into())).collect()
            }
            Observation::Poses(poses) => {
                poses.iter().map(|pose| pose.map(|pose| pose.translation.vector.into())).collect()
            }
            Observation::AtRest(_) => vec![],
        }
    }

    #[test]
    fn the_number_of_columns_tells_what_they_are() {
        let layouts = [
            ("1000 2000 3000", false, None),
            ("0.5 1000 2000 3000", false, Some(0.5)),
            ("1000 2000 3000 0 0 0 1", true, None),
            ("0.5 1000 2000 3000 0 0 0 1", true, Some(0.5)),
            ("1000 2000 3000 0 0 0 1 500 nan", true, None),
        ];
        for (row, rotation, time) in layouts {
            let recording = read(&format!("# a log\r\n\r\n\t{row}  \r\n")).expect("sound");
            assert_eq!(recording.bodies()[0].name(), "door");
            assert_eq!(matches!(recording.bodies()[0].observation(), Observation::Poses(_)), rotation);
            assert_eq!(recording.times().map(|times| times[0]), time);
            assert_eq!(positions(&recording), [Some([1., 2., 3.])]);
        }
    }

    #[test]
    fn rows_without_time_are_numbered_and_nan_is_a_frame_without_sample() {
        let recording = read("1 2 3\n# lost\nnan 0 0\n\n4 5 6\n").expect("sound");
        assert_eq!(recording.frame_numbers(), [0, 1, 2]);
        assert_eq!(positions(&recording)[1], None);
        let lost = read("0 0 0 0 0 0 0\n1 2 3 0 0 0 1\n").expect("sound");
        assert_eq!(positions(&lost)[0], None);
    }

    #[test]
    fn rows_with_time_are_sorted() {
        let recording = read("2 2000 0 0\n1 1000 0 0\n").expect("sound");
        assert_eq!(recording.times(), Some(&[1., 2.][..]));
        assert_eq!(positions(&recording), [Some([1., 0., 0.]), Some([2., 0., 0.])]);
    }

    #[test]
    fn a_repeated_or_unknown_time_is_refused() {
        let error = refused("1 0 0 0\n3 0 0 0\n1 0 0 0\n");
        assert!(error.starts_with("logs/door.log, line 3: needed one row per time, found time 1 again after line 1"));
        assert!(refused("nan 0 0 0\n").starts_with("logs/door.log, line 1: column 1: needed a time in seconds"));
        assert!(refused("inf 0 0 0\n").starts_with("logs/door.log, line 1: column 1: needed a finite number"));
    }

    #[test]
    fn a_wrong_or_changing_number_of_columns_is_refused() {
        assert!(refused("1 2 3\n\n1 2\n").starts_with("logs/door.log, line 3: needed 3 numbers as in the rows before"));
        assert!(refused("1 2\n").starts_with("logs/door.log, line 1: needed 3 numbers (x y z), 4 (t x y z)"));
        assert!(refused("frame,body,x,y,z\n").ends_with("read a table with separators and header as csv"));
    }

    #[test]
    fn text_infinity_and_other_norms_are_refused_with_the_line() {
        assert!(refused("x y z\n").starts_with("logs/door.log, line 1: column 1: needed a number, found `x`"));
        assert!(refused("1 2 3\n1 -inf 3\n").starts_with("logs/door.log, line 2: column 2: needed a finite number"));
        let error = refused("# header\n0 0 0 0 0 0 1\n0 0 0 0 0 0 2\n");
        assert!(error.starts_with("logs/door.log, line 3: needed a unit quaternion"), "{error}");
    }

    #[test]
    fn a_file_without_rows_or_without_samples_is_refused() {
        assert!(refused("").starts_with("logs/door.log: the file has no rows"));
        assert!(refused("# only\n\n").starts_with("logs/door.log: the file has no rows"));
        assert!(refused("nan nan nan\n").starts_with("logs/door.log: body `door` has no sample in any frame"));
        assert!(parse(b"\xff", Path::new("a.log"), Unit::Metre).expect_err("not UTF-8").to_string().contains("UTF-8"));
    }

    #[test]
    fn a_file_without_a_name_still_names_its_body() {
        assert_eq!(body_name(Path::new("")), "body");
        assert_eq!(body_name(Path::new("a/M2U00389.log")), "M2U00389");
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_give_a_recording_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            let _ = parse(&bytes, Path::new("a.log"), Unit::Metre);
        }

        #[test]
        fn arbitrary_rows_give_a_recording_or_an_error(text in "([0-9.e#-]{1,4}|nan|inf|0 0 0 1|[ \t]|[ \n]){0,100}") {
            let _ = parse(text.as_bytes(), Path::new("a.log"), Unit::Metre);
        }
    }
}
