//! Small files of every format, written by hand.

#![allow(dead_code, reason = "not every test needs every sample")]

mod c3d;

use std::fmt::Write as _;
use std::io::Cursor;

use jointscope_motion::{Body, Pose, Recording, Tracks};
use jointscope_recordings::{write_csv, write_npz};
use nalgebra::{Point3, Vector3};

pub(crate) use c3d::{C3d, Numbers, Processor};

pub(crate) const FRAMES: usize = 12;
pub(crate) const NAMES: [&str; 7] = ["box:a", "box:b", "box:c", "lid:a", "lid:b", "lid:c", "nail"];

/// Where a marker is, in whole millimetres; `None` now and then.
pub(crate) fn millimetres(frame: usize, marker: usize) -> Option<[f64; 3]> {
    if (frame * NAMES.len() + marker) % 11 == 5 {
        return None;
    }
    let turn = if marker < 3 { 0. } else { 0.1 * frame as f64 };
    let [x, y] = [[100., 50.], [300., 80.], [200., 250.]][marker % 3];
    let (sin, cos) = f64::sin_cos(turn);
    Some([x * cos - y * sin, x * sin + y * cos, 700. + 10. * marker as f64].map(f64::round))
}

/// The cells of all markers in a frame.
fn cells(frame: usize, separator: char, missing: &str) -> String {
    (0..NAMES.len()).fold(String::new(), |text, marker| {
        let cell = |x: Option<f64>| x.map_or(missing.into(), |x| x.to_string());
        let position = millimetres(frame, marker);
        (0..3).fold(text, |text, i| format!("{text}{separator}{}", cell(position.map(|p| p[i]))))
    })
}

pub(crate) fn trc() -> String {
    let mut text = format!(
        "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n50\t50\t{FRAMES}\t{}\tmm\nFrame#\tTime",
        NAMES.len()
    );
    for name in NAMES {
        let _ = write!(text, "\t{name}\t\t");
    }
    text += "\n\t";
    for number in 1..=NAMES.len() {
        let _ = write!(text, "\tX{number}\tY{number}\tZ{number}");
    }
    text += "\n\n";
    for frame in 0..FRAMES {
        let _ = writeln!(text, "{}\t{}{}", frame + 1, frame as f64 / 50., cells(frame, '\t', ""));
    }
    text
}

pub(crate) fn qualisys() -> String {
    let mut text =
        format!("NO_OF_FRAMES\t{FRAMES}\nFREQUENCY\t50\nDATA_INCLUDED\t3D\nMARKER_NAMES\t{}\n", NAMES.join("\t"));
    text += "Frame\tTime";
    for name in NAMES {
        let _ = write!(text, "\t{name} X\t{name} Y\t{name} Z");
    }
    text += "\n";
    for frame in 0..FRAMES {
        let _ = writeln!(text, "{}\t{}{}", frame + 1, frame as f64 / 50., cells(frame, '\t', "0"));
    }
    text
}

pub(crate) fn vicon() -> String {
    let mut text = String::from("Trajectories\n50\n,");
    for name in NAMES {
        let _ = write!(text, ",{name},,");
    }
    let (columns, units) = (",X,Y,Z".repeat(NAMES.len()), ",mm,mm,mm".repeat(NAMES.len()));
    let _ = writeln!(text, "\nFrame,Sub Frame{columns}\n,{units}");
    for frame in 0..FRAMES {
        let _ = writeln!(text, "{},0{}", frame + 1, cells(frame, ',', ""));
    }
    text
}

pub(crate) fn motive() -> String {
    let mut text = String::from(
        "Format Version,1.23,Take Name,a,Export Frame Rate,50,Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global\n\n",
    );
    let row = |first: &str, of_marker: &dyn Fn(&str) -> String, of_body: [&str; 8]| {
        let markers = NAMES.map(|name| [of_marker(name), of_marker(name), of_marker(name)].join(",")).join(",");
        format!("{first},{markers},{}\n", of_body.join(","))
    };
    text += &row(",Type", &|_| "Marker".into(), ["Rigid Body"; 8]);
    text += &row(",Name", &|name| name.into(), ["Hammer"; 8]);
    text += &row(",ID", &|_| "7".into(), ["9"; 8]);
    let kinds =
        ["Rotation", "Rotation", "Rotation", "Rotation", "Position", "Position", "Position", "Mean Marker Error"];
    text += &row(",", &|_| "Position".into(), kinds);
    let _ = writeln!(text, "Frame,Time (Seconds){},X,Y,Z,W,X,Y,Z,", ",X,Y,Z".repeat(NAMES.len()));
    for frame in 0..FRAMES {
        let pose = if frame == 4 { ",,,,,,,,".into() } else { format!(",0,0,0.6,0.8,{frame},2,3,0.1") };
        let _ = writeln!(text, "{frame},{}{}{pose}", frame as f64 / 50., cells(frame, ',', ""));
    }
    text
}

pub(crate) fn euroc() -> String {
    let rows =
        (0..FRAMES).map(|frame| format!("{},{frame},2,3,0.8,0,0,0.6,1,1,1\n", 1_000_000_000 + 5_000_000 * frame));
    format!(
        "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z [],v_x,v_y,v_z\n{}",
        rows.collect::<String>()
    )
}

pub(crate) fn tum() -> String {
    (0..FRAMES).fold(String::new(), |text, frame| format!("{text}{frame}.5 {frame} 2 3 0 0 0.6 0.8\n"))
}

/// The markers with a prefix as points of two bodies, metres.
pub(crate) fn points() -> Recording {
    let body = |name: &str, markers: std::ops::Range<usize>| {
        let missing = Point3::from([f64::NAN; 3]);
        let sample = |frame, marker| millimetres(frame, marker).map_or(missing, |p| Point3::from(p.map(|x| x / 1000.)));
        let samples = (0..FRAMES).flat_map(|frame| markers.clone().map(move |marker| sample(frame, marker)));
        let tracks = Tracks::new(markers.len(), samples.collect()).expect("full frames");
        Body::from_points(name, ["a", "b", "c"].map(String::from).to_vec(), tracks).expect("seen")
    };
    let times = (0..FRAMES).map(|frame| frame as f64 / 50.).collect();
    let numbers = (1..=FRAMES as u64).collect();
    Recording::new(numbers, Some(times), vec![body("box", 0..3), body("lid", 3..6)]).expect("sound")
}

pub(crate) fn csv_of_points() -> Vec<u8> {
    let mut bytes = Vec::new();
    write_csv(&points(), &mut bytes).expect("written");
    bytes
}

pub(crate) fn csv_of_poses() -> Vec<u8> {
    let pose = |frame: usize| (frame != 3).then(|| Pose::new(Vector3::x(), Vector3::z() * 0.1 * frame as f64));
    let body = Body::from_poses("door", (0..FRAMES).map(pose).collect()).expect("seen");
    let recording = Recording::new((0..FRAMES as u64).collect(), None, vec![body]).expect("sound");
    let mut bytes = Vec::new();
    write_csv(&recording, &mut bytes).expect("written");
    bytes
}

/// Tables in columns: our own, and the same table from pandas (categories, small integers, nulls, Snappy), polars
/// (categories, Zstandard) and Arrow (floats of 16 bits, groups of five rows, pages of the second version).
#[cfg(feature = "parquet")]
pub(crate) fn in_columns() -> [(&'static str, Vec<u8>); 4] {
    let mut own = Vec::new();
    jointscope_recordings::write_parquet(&points(), &mut own).expect("written");
    [
        ("own.parquet", own),
        ("pandas.parquet", include_bytes!("pandas.parquet").into()),
        ("polars.parquet", include_bytes!("polars.parquet").into()),
        ("arrow.parquet", include_bytes!("arrow.parquet").into()),
    ]
}

pub(crate) fn npz() -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    write_npz(&points(), &mut file).expect("written");
    file.into_inner()
}
