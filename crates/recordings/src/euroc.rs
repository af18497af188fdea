//! Poses of one body, as the `EuRoC` data sets write them.
//!
//! A line that begins with `#timestamp` names the columns; then `t,x,y,z,qw,qx,qy,qz` with the time in whole
//! nanoseconds and the scalar of the quaternion first, or `t,x,y,z` alone. Further columns, of velocities and biases, are
//! not looked at. The body is named after the file. Frames are the rows, counted from 0; times never fall. A sample is
//! missing if a cell is empty or NaN, or the quaternion all zeros.

use std::path::Path;

use jointscope_motion::{Body, Recording, Tracks};
use nalgebra::Point3;

use crate::marker_table::{check_length, is_blank, lines};
use crate::pose::pose;
use crate::pose_text::body_name;
use crate::text::{decode, number, quoted};
use crate::{RecordingError, Unit};

/// Reads the poses of one body; `path` names the body, and is named in errors.
///
/// # Errors
/// [`RecordingError::Line`] and [`RecordingError::File`] for what is said of tables [above](self);
/// [`RecordingError::Motion`], for instance if no row has a sample.
pub fn parse(bytes: &[u8], path: &Path, unit: Unit) -> Result<Recording, RecordingError> {
    let mut lines = lines(decode(bytes, path)?, ',');
    let (_, columns) = lines.next().unwrap_or_default();
    let rotation = columns.len() >= 8;
    if columns.len() != 4 && !rotation {
        let found = columns.len();
        let problem = format!("needed 4 columns (t x y z), or 8 and more (t x y z qw qx qy qz), found {found}");
        return Err(RecordingError::at_line(path, 1, problem));
    }
    let named = |column: usize, letters: &str| {
        let name: String = columns[column].split('[').next().unwrap_or_default().trim().into();
        name.is_empty() || name.ends_with(letters)
    };
    let order = ["x", "y", "z", "w", "x", "y", "z"];
    if let Some(wrong) = (1..columns.len().min(8)).find(|&column| !named(column, order[column - 1])) {
        let problem = format!(
            "needed the columns t x y z qw qx qy qz in this order, found {} as number {}; write it as a table with a \
             header that says what its columns are",
            quoted(columns[wrong]),
            wrong + 1
        );
        return Err(RecordingError::at_line(path, 1, problem));
    }
    let (mut times, mut points, mut poses) = (Vec::new(), Vec::new(), Vec::new());
    for (line, cells) in lines {
        if is_blank(&cells) {
            continue;
        }
        let mut read = || {
            check_length(&cells, if rotation { 8 } else { 4 }, 1)?;
            let nanoseconds: u64 = cells[0]
                .parse()
                .map_err(|_| format!("needed a time in whole nanoseconds, found {}; correct it", quoted(cells[0])))?;
            times.push(nanoseconds as f64 / 1e9);
            let value =
                |column: usize| number(cells[column]).map_err(|problem| format!("column {}: {problem}", column + 1));
            let [x, y, z] = [value(1)?, value(2)?, value(3)?];
            if rotation {
                let [qw, qx, qy, qz] = [value(4)?, value(5)?, value(6)?, value(7)?];
                poses.push(pose([x, y, z, qx, qy, qz, qw], unit)?);
            } else {
                points.push(Point3::from([x, y, z].map(|length| unit.to_metres(length))));
            }
            Ok(())
        };
        read().map_err(|problem: String| RecordingError::at_line(path, line, problem))?;
    }
    if times.is_empty() {
        return Err(RecordingError::in_file(path, "the file has no rows; needed at least one"));
    }
    let body = if rotation {
        Body::from_poses(body_name(path), poses)
    } else {
        Tracks::new(1, points).and_then(|tracks| Body::from_points(body_name(path), vec!["position".into()], tracks))
    };
    let frames = (0..times.len() as u64).collect();
    body.and_then(|body| Recording::new(frames, Some(times), vec![body])).map_err(RecordingError::motion(path))
}

#[cfg(test)]
mod tests {
    use jointscope_motion::Observation;

    use super::*;

    const HEAD: &str =
        "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_x\n";

    fn parse(text: &str) -> Result<Recording, String> {
        super::parse(text.as_bytes(), Path::new("drone.csv"), Unit::Metre).map_err(|error| error.to_string())
    }

    #[test]
    fn the_scalar_comes_first_and_times_are_nanoseconds() {
        let recording =
            parse(&format!("{HEAD}1500000000,1,2,3,0,0,0,1,9\n1505000000,1,2,3,0,0,0,0,9\n")).expect("sound");
        assert_eq!(recording.times(), Some(&[1.5, 1.505][..]));
        let Observation::Poses(poses) = recording.bodies()[0].observation() else { panic!("poses") };
        assert_eq!(
            (recording.bodies()[0].name(), poses[0].map(|pose| pose.rotation.k), poses[1]),
            ("drone", Some(1.), None)
        );
        let points = parse("#timestamp, x, y, z\n5,1,2,3\n").expect("positions");
        assert!(matches!(points.bodies()[0].observation(), Observation::Points { .. }));
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (text, message) in [
            ("#timestamp, x\n", "drone.csv, line 1: needed 4 columns"),
            (&HEAD.replace("q_RS_w", "q_RS_x"), "drone.csv, line 1: needed the columns t x y z qw qx qy qz"),
            (HEAD, "drone.csv: the file has no rows"),
            (&format!("{HEAD}1.5,1,2,3,1,0,0,0\n"), "drone.csv, line 2: needed a time in whole nanoseconds"),
            (&format!("{HEAD}1,1,2,3,1,0\n"), "drone.csv, line 2: needed 8 cells"),
            (&format!("{HEAD}1,1,2,3,2,0,0,0\n"), "drone.csv, line 2: needed a unit quaternion"),
        ] {
            let found = parse(text).expect_err("refused");
            assert!(found.starts_with(message), "{found}");
        }
    }
}
