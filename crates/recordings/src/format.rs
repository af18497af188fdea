//! The formats of recordings.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::RecordingError;

/// How a recording is written in its file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// A table of points or poses with a header, `"csv"`; see [`csv_table`](crate::csv_table).
    Csv,
    /// Positions or poses of one body, one row per frame, without header, `"poses"`; see
    /// [`pose_text`](crate::pose_text).
    Poses,
    /// Arrays of points in an archive of numpy, `"npz"`; see [`npz`](crate::npz).
    Npz,
    /// Markers in the binary format of motion capture, `"c3d"`; see [`c3d`](crate::c3d).
    C3d,
    /// A text table of markers, `"trc"`; see [`trc`](crate::trc).
    Trc,
    /// Qualisys's text table of markers, `"qualisys"`; see [`qualisys`](crate::qualisys).
    Qualisys,
    /// Vicon Nexus's table of trajectories, `"vicon"`; see [`vicon`](crate::vicon).
    Vicon,
    /// `OptiTrack` Motive's table of markers and rigid bodies, `"motive"`; see [`motive`](crate::motive).
    Motive,
    /// Poses of one body as the `EuRoC` data sets write them, `"euroc"`; see [`euroc`](crate::euroc).
    Euroc,
    /// A table of points or poses in columns, `"parquet"`, in programs built with the feature `parquet`; see
    /// `parquet_table`.
    Parquet,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 10] = [
        Self::Csv,
        Self::Poses,
        Self::Npz,
        Self::C3d,
        Self::Trc,
        Self::Qualisys,
        Self::Vicon,
        Self::Motive,
        Self::Euroc,
        Self::Parquet,
    ];

    /// The format that the extension of a file tells, in upper or lower case: `csv` and `tsv` are tables, `log`, `txt`
    /// and `tum` are pose text, `npz`, `c3d`, `trc` and `parquet` are themselves.
    ///
    /// # Errors
    /// [`RecordingError::UnknownExtension`].
    pub fn of_path(path: &Path) -> Result<Self, RecordingError> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("csv" | "tsv") => Ok(Self::Csv),
            Some("log" | "txt" | "tum") => Ok(Self::Poses),
            Some("npz") => Ok(Self::Npz),
            Some("c3d") => Ok(Self::C3d),
            Some("trc") => Ok(Self::Trc),
            Some("parquet") => Ok(Self::Parquet),
            _ => Err(RecordingError::UnknownExtension { path: path.into() }),
        }
    }

    /// The format that the beginning of a file tells, and if it tells none, [its extension](Self::of_path).
    ///
    /// # Errors
    /// [`RecordingError::UnknownExtension`].
    pub fn of_file(path: &Path, bytes: &[u8]) -> Result<Self, RecordingError> {
        Self::of_content(bytes).map_or_else(|| Self::of_path(path), Ok)
    }

    fn of_content(bytes: &[u8]) -> Option<Self> {
        /// No first line that is looked at is longer.
        const LONGEST_LINE: usize = 1 << 12;

        match bytes {
            [b'P', b'K', 3, 4, ..] => return Some(Self::Npz),
            [2, 80, ..] => return Some(Self::C3d),
            [b'P', b'A', b'R', b'1' | b'E', ..] => return Some(Self::Parquet),
            _ => {}
        }
        let start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let line = start[..start.len().min(LONGEST_LINE)].split(|byte| *byte == b'\n' || *byte == b'\r').next()?;
        let line = String::from_utf8_lossy(line);
        let first = line.split([',', ';', '\t']).next().unwrap_or_default().trim().trim_matches('"');
        match first {
            "PathFileType" => Some(Self::Trc),
            "NO_OF_FRAMES" => Some(Self::Qualisys),
            "Format Version" => Some(Self::Motive),
            "Trajectories" | "Devices" | "Joints" | "Segments" | "Model Outputs" | "Events" => Some(Self::Vicon),
            _ if first.starts_with('#') && first.contains("timestamp") && line.contains(',') => Some(Self::Euroc),
            _ => None,
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Csv => "csv",
            Self::Poses => "poses",
            Self::Npz => "npz",
            Self::C3d => "c3d",
            Self::Trc => "trc",
            Self::Qualisys => "qualisys",
            Self::Vicon => "vicon",
            Self::Motive => "motive",
            Self::Euroc => "euroc",
            Self::Parquet => "parquet",
        })
    }
}

impl FromStr for Format {
    type Err = RecordingError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL.into_iter().find(|format| format.to_string() == name).ok_or_else(|| RecordingError::UnknownName {
            what: "format",
            found: name.into(),
            known: "csv, poses, npz, c3d, trc, qualisys, vicon, motive, euroc and parquet",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_tells_the_format_in_any_case() {
        let of = |path: &str| Format::of_path(Path::new(path));
        assert_eq!(of("a/door.csv").expect("table"), Format::Csv);
        assert_eq!(of("door.TSV").expect("table"), Format::Csv);
        for path in ["M2U00389.log", "door.txt", "slam.tum"] {
            assert_eq!(of(path).expect("pose text"), Format::Poses);
        }
        assert_eq!(of("clip.Npz").expect("archive"), Format::Npz);
        assert_eq!(of("trial.C3D").expect("markers"), Format::C3d);
        assert_eq!(of("trial.trc").expect("markers"), Format::Trc);
        assert_eq!(of("trial.parquet").expect("columns"), Format::Parquet);
        for path in ["trial.mat", "csv", ""] {
            assert!(of(path).expect_err("unknown").to_string().contains("name the format"));
        }
    }

    #[test]
    fn the_beginning_of_a_file_tells_more_than_its_extension() {
        let of = |content: &str| Format::of_file(Path::new("a.csv"), content.as_bytes()).expect("known");
        assert_eq!(of("frame,body,x,y,z\n"), Format::Csv);
        assert_eq!(of(""), Format::Csv);
        assert_eq!(of("\u{feff}Trajectories,,,\r\n100\r\n"), Format::Vicon);
        assert_eq!(of("Format Version,1.23,Take Name,door\n"), Format::Motive);
        assert_eq!(of("NO_OF_FRAMES\t6000\n"), Format::Qualisys);
        assert_eq!(of("PathFileType\t4\t(X/Y/Z)\ta.trc\n"), Format::Trc);
        assert_eq!(of("#timestamp [ns],p_RS_R_x [m]\n"), Format::Euroc);
        assert_eq!(of("PK\u{3}\u{4}..."), Format::Npz);
        assert_eq!(of("\u{2}P..."), Format::C3d);
        assert_eq!(of("PAR1..."), Format::Parquet);
        assert_eq!(Format::of_file(Path::new("a.tum"), b"# timestamp x y z\n").expect("pose text"), Format::Poses);
    }

    #[test]
    fn names_are_the_same_as_text_and_in_configurations() {
        for format in Format::ALL {
            assert_eq!(format.to_string().parse::<Format>().expect("its own name"), format);
            let serde_name = toml::Value::try_from(format).expect("a name");
            assert_eq!(serde_name.as_str(), Some(format.to_string().as_str()));
        }
        let error = "tum".parse::<Format>().expect_err("an extension, not a format").to_string();
        assert!(error.starts_with("no format is named `tum`; known are csv, poses, npz, c3d"), "{error}");
    }
}
