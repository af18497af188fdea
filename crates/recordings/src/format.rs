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
}

impl Format {
    /// The format that the extension of a file tells, in upper or lower case: `csv` and `tsv` are tables, `log`, `txt`
    /// and `tum` are pose text, `npz` is itself.
    ///
    /// # Errors
    /// [`RecordingError::UnknownExtension`].
    pub fn of_path(path: &Path) -> Result<Self, RecordingError> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("csv" | "tsv") => Ok(Self::Csv),
            Some("log" | "txt" | "tum") => Ok(Self::Poses),
            Some("npz") => Ok(Self::Npz),
            _ => Err(RecordingError::UnknownExtension { path: path.into() }),
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Csv => "csv",
            Self::Poses => "poses",
            Self::Npz => "npz",
        })
    }
}

impl FromStr for Format {
    type Err = RecordingError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        [Self::Csv, Self::Poses, Self::Npz].into_iter().find(|format| format.to_string() == name).ok_or_else(|| {
            RecordingError::UnknownName { what: "format", found: name.into(), known: "csv, poses and npz" }
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
        for path in ["trial.c3d", "csv", ""] {
            assert!(of(path).expect_err("unknown").to_string().contains("name the format"));
        }
    }

    #[test]
    fn names_are_the_same_as_text_and_in_configurations() {
        for format in [Format::Csv, Format::Poses, Format::Npz] {
            assert_eq!(format.to_string().parse::<Format>().expect("its own name"), format);
            let serde_name = toml::Value::try_from(format).expect("a name");
            assert_eq!(serde_name.as_str(), Some(format.to_string().as_str()));
        }
        let error = "tum".parse::<Format>().expect_err("an extension, not a format").to_string();
        assert_eq!(error, "no format is named `tum`; known are csv, poses and npz");
    }
}
