//! `OptiTrack` Motive's table of markers and rigid bodies.
//!
//! ```text
//! Format Version,1.23,Take Name,door,Export Frame Rate,120,Rotation Type,Quaternion,Length Units,Meters,…
//!
//! ,Type,Rigid Body,…,Marker,…
//! ,Name,Door,…,Door:Marker1,…
//! ,ID,…
//! ,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,…
//! Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,…
//! 0,0.000000,…
//! ```
//!
//! * **Markers** are the columns of type `Marker`. `Rigid Body Marker` is where a marker would be by the pose of its
//!   body, and not read, as little as errors and bones' markers.
//! * **Poses** are the columns of type `Rigid Body` and `Bone`, whose rotation must be exported as a quaternion.
//! * **Samples** are missing where a cell is empty or NaN, or a quaternion all zeros.
//! * **Unit** is `Length Units` of the first line.

use std::collections::BTreeMap;
use std::path::Path;

use jointscope_motion::Pose;

use crate::marker_table::{Samples, Source, check_length, frame, is_blank, lines};
use crate::pose::pose;
use crate::text::{decode, number, quoted};
use crate::{Format, Markers, RecordingError, Unit};

/// Reads markers and poses of a table; `path` is named in errors, and `unit` takes the place of the unit that the file
/// states.
///
/// # Errors
/// [`RecordingError::Line`] and [`RecordingError::File`] for what is said of tables [above](self).
pub fn parse(bytes: &[u8], path: &Path, unit: Option<Unit>) -> Result<Markers, RecordingError> {
    let text = decode(bytes, path)?;
    let at = |line: u64| move |problem: String| RecordingError::at_line(path, line, problem);
    let mut lines = lines(text, ',');
    let (_, first) = lines.next().unwrap_or_default();
    let stated = |key: &str| {
        let place = first.iter().position(|cell| cell.eq_ignore_ascii_case(key))?;
        first.get(place + 1).copied().filter(|cell| !cell.is_empty())
    };
    let (unit, unit_stated) = match (unit, stated("Length Units")) {
        (Some(unit), _) => (unit, false),
        (None, Some(name)) => (Unit::of_name(name).map_err(at(1))?, true),
        (None, None) => (Unit::Metre, false),
    };
    if let Some(other) = stated("Coordinate Space").filter(|space| !space.eq_ignore_ascii_case("global")) {
        return Err(at(1)(format!("needed global coordinates, found {}; export them as global", quoted(other))));
    }
    let mut rows = BTreeMap::new();
    let (names_line, names) = loop {
        let Some((line, cells)) = lines.next() else {
            return Err(RecordingError::in_file(
                path,
                "needed a line that begins with `Frame`, found none; export it again",
            ));
        };
        if cells[0].eq_ignore_ascii_case("Frame") {
            break (line, cells);
        }
        match cells.get(1).copied().unwrap_or_default() {
            "" if cells.len() > 2 && !is_blank(&cells) => drop(rows.insert("Kind", cells)),
            "Type" => drop(rows.insert("Type", cells)),
            "Name" => drop(rows.insert("Name", cells)),
            _ => {}
        }
    };
    let cell = |row: &str, column: usize| rows.get(row).and_then(|row| row.get(column)).copied().unwrap_or_default();
    let columns = Columns::of(&names, cell).map_err(at(names_line))?;
    if columns.bodies.values().any(|cells| cells.0.is_none())
        && stated("Rotation Type").is_some_and(|kind| !kind.eq_ignore_ascii_case("quaternion"))
    {
        let kind = quoted(stated("Rotation Type").unwrap_or_default());
        return Err(at(1)(format!("needed rotations as quaternions, found {kind}; export them as quaternions")));
    }
    let mut samples = Samples::default();
    let mut poses: Vec<Vec<Option<Pose>>> = vec![Vec::new(); columns.poses.len()];
    let marker_names: Vec<String> = columns.markers.iter().map(|(name, _)| name.clone()).collect();
    let mut row = Vec::new();
    for (line, cells) in lines {
        if is_blank(&cells) {
            continue;
        }
        let mut read = || {
            check_length(&cells, columns.needed, marker_names.len())?;
            samples.begin(line, frame(cells[0])?, number(cells[1])?)?;
            row.clear();
            row.extend(columns.markers.iter().flat_map(|(_, places)| places.map(|place| cells[place])));
            samples.markers(&row, &marker_names, unit, false)?;
            for ((name, places), poses) in columns.poses.iter().zip(&mut poses) {
                let mut values = [f64::NAN; 7];
                for (value, place) in values.iter_mut().zip(places) {
                    *value = number(cells[*place]).map_err(|problem| format!("body {}: {problem}", quoted(name)))?;
                }
                poses.push(pose(values, unit).map_err(|problem| format!("body {}: {problem}", quoted(name)))?);
            }
            Ok(())
        };
        read().map_err(at(line))?;
    }
    let rate = stated("Export Frame Rate").or(stated("Capture Frame Rate"));
    let rate = rate.and_then(|cell| cell.parse().ok()).filter(|rate: &f64| *rate > 0. && rate.is_finite());
    let names = columns.poses.into_iter().map(|(name, _)| name);
    let poses = names.zip(poses).collect();
    let markers = samples.into_markers(
        path,
        Source { format: Format::Motive, unit, unit_stated, rate },
        marker_names,
        Vec::new(),
    )?;
    Ok(Markers { poses, ..markers })
}

/// Cells of a body's rotation, x y z w, and of its position.
type BodyCells = (Option<[usize; 4]>, Option<[usize; 3]>);

/// Where the cells of markers and bodies are.
struct Columns {
    /// Name and cells of each marker.
    markers: Vec<(String, [usize; 3])>,
    /// Name and cells of each body with rotation and position.
    poses: Vec<(String, [usize; 7])>,
    bodies: BTreeMap<String, BodyCells>,
    needed: usize,
}

impl Columns {
    fn of<'a>(names: &[&str], cell: impl Fn(&str, usize) -> &'a str) -> Result<Self, String> {
        let (mut markers, mut order) = (Vec::new(), Vec::new());
        let mut bodies: BTreeMap<String, BodyCells> = BTreeMap::new();
        for column in 2..names.len() {
            let following = |letters: &[&str]| {
                let there = names.get(column..column + letters.len()) == Some(letters);
                there && (column..column + letters.len()).all(|next| cell("Name", next) == cell("Name", column))
            };
            let (kind, name) = (cell("Type", column), cell("Name", column));
            let position = cell("Kind", column).eq_ignore_ascii_case("Position") && following(&["X", "Y", "Z"]);
            let rotation = cell("Kind", column).eq_ignore_ascii_case("Rotation") && following(&["X", "Y", "Z", "W"]);
            if kind.eq_ignore_ascii_case("Marker") && position {
                markers.push((name.to_owned(), [column, column + 1, column + 2]));
            } else if kind.eq_ignore_ascii_case("Rigid Body") || kind.eq_ignore_ascii_case("Bone") {
                if !bodies.contains_key(name) {
                    order.push(name.to_owned());
                }
                let cells = bodies.entry(name.to_owned()).or_default();
                if position && cells.1.replace([column, column + 1, column + 2]).is_some()
                    || rotation && cells.0.replace([column, column + 1, column + 2, column + 3]).is_some()
                {
                    return Err(format!("two bodies are named {}; rename one of them", quoted(name)));
                }
            }
        }
        let pose = |name: &String| match bodies[name] {
            (Some([qx, qy, qz, qw]), Some([x, y, z])) => Some((name.clone(), [x, y, z, qx, qy, qz, qw])),
            _ => None,
        };
        let poses: Vec<_> = order.iter().filter_map(pose).collect();
        if markers.is_empty() && poses.is_empty() && bodies.values().all(|cells| cells.0.is_some()) {
            return Err(
                "needed columns of type Marker or Rigid Body, found none; export markers or rigid bodies".into()
            );
        }
        let last = markers.iter().map(|(_, cells)| cells[2]).chain(poses.iter().flat_map(|(_, cells)| *cells)).max();
        Ok(Self { markers, poses, bodies, needed: last.map_or(2, |last| last + 1) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Markers, String> {
        super::parse(text.as_bytes(), Path::new("a.csv"), None).map_err(|error| error.to_string())
    }

    const HEAD: &str = "Format Version,1.23,Take Name,door,Export Frame Rate,120.000,Rotation Type,Quaternion,Length Units,Centimeters,Coordinate Space,Global\n\
        \n\
        ,Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body Marker,Rigid Body Marker,Rigid Body Marker,Marker,Marker,Marker\n\
        ,Name,Door,Door,Door,Door,Door,Door,Door,Door,Door:Marker1,Door:Marker1,Door:Marker1,Frame:1,Frame:1,Frame:1\n\
        ,ID,1,1,1,1,1,1,1,1,2,2,2,3,3,3\n\
        ,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error,Position,Position,Position,Position,Position,Position\n\
        Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X,Y,Z,X,Y,Z\n";

    #[test]
    fn rigid_bodies_are_poses_and_markers_are_those_that_were_measured() {
        let text = format!("{HEAD}0,0.000,0,0,0,1,100,0,0,0.1,9,9,9,1,2,3\n3,0.025,,,,,,,,,,,,,,\n");
        let found = parse(&text).expect("sound");
        assert_eq!((found.frame_numbers, found.times), (vec![0, 3], Some(vec![0., 0.025])));
        assert_eq!((found.unit, found.rate), (Unit::Centimetre, Some(120.)));
        assert_eq!(found.markers.len(), 1);
        assert_eq!((&*found.markers[0].name, found.markers[0].body.as_deref()), ("Frame:1", Some("Frame")));
        assert!(found.positions[0].z == 0.03 && found.positions[1].z.is_nan());
        let (name, poses) = &found.poses[0];
        assert_eq!((&**name, poses[0].map(|pose| pose.translation.x), poses[1]), ("Door", Some(1.), None));
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        let euler = HEAD.replace("Quaternion", "XYZ").replace("X,Y,Z,W,", "X,Y,Z,,");
        for (text, message) in [
            (HEAD.replace("Global", "Local"), "a.csv, line 1: needed global coordinates"),
            (HEAD.replace("Centimeters", "Ells"), "a.csv, line 1: no unit is named `Ells`"),
            (euler, "a.csv, line 1: needed rotations as quaternions, found `XYZ`"),
            (HEAD.replace("Frame,Time", "F,Time"), "a.csv: needed a line that begins with `Frame`"),
            (HEAD.replace("Rigid", "Soft").replace(",Marker", ",Mark"), "a.csv, line 7: needed columns of type Marker"),
            (HEAD.into(), "a.csv: the table has names of markers but no rows"),
            (format!("{HEAD}0,0,0,0,0,1\n"), "a.csv, line 8: needed 16 cells"),
            (
                format!("{HEAD}0,0,0,0,0,3,1,0,0,0,9,9,9,1,2,3\n"),
                "a.csv, line 8: body `Door`: needed a unit quaternion",
            ),
        ] {
            let found = parse(&text).expect_err("refused");
            assert!(found.starts_with(message), "{found}");
        }
    }
}
