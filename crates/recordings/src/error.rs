//! What can be wrong with files of recordings.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use jointscope_motion::MotionError;

/// Why a recording could not be read or written: where, what was needed, what was found, and what to do.
///
/// Messages are complete in themselves: causes are part of the text and not repeated by `source`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The file cannot be opened or read.
    #[error("{path}: cannot be read: {cause}; {}", advice(.cause))]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        cause: io::Error,
    },
    /// A directory was given for a file.
    #[error("{path}: needed a file, found a directory; name one recording in it")]
    Directory {
        /// The directory.
        path: PathBuf,
    },
    /// The extension does not tell the format.
    #[error(
        "{path}: the extension does not tell the format; known are csv and tsv (tables), log, txt and tum (pose \
         text), npz, c3d, trc and parquet; otherwise name the format: csv, poses, npz, c3d, trc, qualisys, vicon, \
         motive, euroc or parquet"
    )]
    UnknownExtension {
        /// The file.
        path: PathBuf,
    },
    /// No format or unit has this name.
    #[error("no {what} is named `{found}`; known are {known}")]
    UnknownName {
        /// "format" or "unit".
        what: &'static str,
        /// The name given.
        found: String,
        /// The names there are.
        known: &'static str,
    },
    /// A line of a text file is not as it should be.
    #[error("{path}, line {line}: {problem}")]
    Line {
        /// The file.
        path: PathBuf,
        /// Line in the file, from 1.
        line: u64,
        /// What was needed and found, and what to do.
        problem: String,
    },
    /// A row of a table that is no text is not as it should be.
    #[error("{path}, row {row}: {problem}")]
    Row {
        /// The file.
        path: PathBuf,
        /// Row of the table, from 1.
        row: u64,
        /// What was needed and found, and what to do.
        problem: String,
    },
    /// The file as a whole, or an array in it, is not as it should be.
    #[error("{path}: {problem}")]
    File {
        /// The file.
        path: PathBuf,
        /// What was needed and found, and what to do.
        problem: String,
    },
    /// The content is well written, but not a recording.
    #[error("{path}: {problem}")]
    Motion {
        /// The file.
        path: PathBuf,
        /// What is wrong with the bodies.
        problem: MotionError,
    },
    /// A pattern for the markers of a body does not fit the file.
    #[error("{path}: body `{body}`, pattern `{pattern}`: {problem}; {help}")]
    Pattern {
        /// The file.
        path: PathBuf,
        /// The body.
        body: String,
        /// The pattern.
        pattern: String,
        /// What is wrong.
        problem: String,
        /// What to do.
        help: String,
    },
    /// Which markers are on one body is not known.
    #[error("{path}: {problem}")]
    Ungrouped {
        /// The file.
        path: PathBuf,
        /// What was found.
        problem: String,
    },
    /// The format cannot hold this recording.
    #[error("the recording cannot be written in this format: {problem}")]
    Unwritable {
        /// What the format lacks, and what to do.
        problem: String,
    },
    /// Writing failed.
    #[error("the recording cannot be written: {cause}")]
    Write {
        /// What the system says.
        cause: io::Error,
    },
}

impl RecordingError {
    pub(crate) fn at_line(path: &Path, line: u64, problem: impl Into<String>) -> Self {
        Self::Line { path: path.into(), line, problem: problem.into() }
    }

    #[cfg(feature = "parquet")]
    pub(crate) fn at_row(path: &Path, row: u64, problem: impl Into<String>) -> Self {
        Self::Row { path: path.into(), row, problem: problem.into() }
    }

    pub(crate) fn in_file(path: &Path, problem: impl Into<String>) -> Self {
        Self::File { path: path.into(), problem: problem.into() }
    }

    pub(crate) fn motion(path: &Path) -> impl Fn(MotionError) -> Self {
        move |problem| Self::Motion { path: path.into(), problem }
    }

    pub(crate) fn unwritable(problem: impl Into<String>) -> Self {
        Self::Unwritable { problem: problem.into() }
    }
}

impl From<io::Error> for RecordingError {
    /// An error while writing; errors while reading carry the path and are made by hand.
    fn from(cause: io::Error) -> Self {
        Self::Write { cause }
    }
}

fn advice(cause: &io::Error) -> &'static str {
    match cause.kind() {
        ErrorKind::NotFound => "check the path",
        ErrorKind::PermissionDenied => "check the permissions of the file and its folders",
        _ => "check the path and the disk it is on",
    }
}
