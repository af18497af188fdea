//! `convert`: a recording in another format.

use std::{
    io::Cursor,
    path::{Path, PathBuf},
};

use clap::{Args, ValueEnum};
use jointscope_motion::Recording;
use jointscope_recordings::{
    Format, Grouping, Markers, ReadOptions, RecordingError, Unit, group, lost_in_npz, lost_in_trc, read_markers,
    write_csv, write_npz, write_trc,
};

use crate::{failure::Failure, output};

/// Write a recording in another format
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The recording
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The file to write: `.csv`, `.npz`, `.trc` or `.parquet`
    #[arg(value_name = "OUT")]
    output: PathBuf,
    /// Write the points or the poses alone, of a file that has both
    #[arg(long, value_enum)]
    only: Option<Only>,
    /// Format of the file to read, if neither its content nor its extension tells
    #[arg(long, value_name = "FORMAT", value_parser = super::named::<Format>)]
    input_format: Option<Format>,
    /// Unit of the lengths in the file to read: m, cm, mm or in; the one that the file states, or m, if left out
    #[arg(long, value_parser = super::named::<Unit>)]
    unit: Option<Unit>,
    /// Say nothing about what the format cannot hold, or what is odd
    #[arg(long)]
    quiet: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Only {
    /// Markers and other points
    Points,
    /// Bodies that the file gives as poses
    Poses,
}

/// What writes a format.
type Write = fn(Markers, &Path) -> Result<Written, RecordingError>;

/// A file's content, and what is to be said.
struct Written {
    bytes: Vec<u8>,
    /// What is odd about the recording.
    notes: Vec<String>,
    /// What the format cannot hold of it.
    lost: Option<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let write = writer(&arguments.output)?;
    if is_one_file(&arguments.input, &arguments.output) {
        let error = format!("{}: is the recording itself, which is not overwritten", arguments.output.display());
        return Err(Failure::usage_with_help(error, "name another file to write"));
    }
    let options = ReadOptions { format: arguments.input_format, unit: arguments.unit, ..ReadOptions::default() };
    let mut markers = read_markers(&arguments.input, &options).map_err(super::unread)?;
    match arguments.only {
        Some(Only::Points) => markers.poses.clear(),
        Some(Only::Poses) => (markers.markers, markers.positions) = (Vec::new(), Vec::new()),
        None if !markers.poses.is_empty() && !markers.markers.is_empty() => {
            let error =
                format!("{}: the file has points and poses, and one file holds either", arguments.input.display());
            return Err(Failure::data_with_help(error, "give --only points or --only poses"));
        }
        None => {}
    }
    if markers.markers.is_empty() && markers.poses.is_empty() {
        return Err(Failure::data(format!(
            "{}: the file has none of these; leave --only out",
            arguments.input.display()
        )));
    }
    let Written { bytes, notes, lost } = write(markers, &arguments.input).map_err(Failure::data)?;
    let replaced = arguments.output.is_file();
    output::make_folder_of(&arguments.output)?;
    output::write_files(&[(&arguments.output, &bytes)])?;
    if !arguments.quiet {
        for note in &notes {
            output::remark(&arguments.input, note);
        }
        if let Some(lost) = lost {
            output::remark(&arguments.output, &lost);
        }
        if replaced {
            output::remark(&arguments.output, "was there already, and was overwritten");
        }
    }
    Ok(())
}

/// Whether two paths lead to one file.
fn is_one_file(a: &Path, b: &Path) -> bool {
    a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b))
}

/// What writes the format that the extension of a file tells.
fn writer(path: &Path) -> Result<Write, Failure> {
    // Tables are written with commas, which a name in `.tsv` would deny.
    let of_tabs = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("tsv"));
    match Format::of_path(path) {
        Ok(Format::Csv) if !of_tabs => Ok(|markers, path| with_bodies(markers, path, write_csv, |_| None)),
        Ok(Format::Npz) => Ok(|markers, path| {
            with_bodies(markers, path, |recording, bytes| write_npz(recording, Cursor::new(bytes)), lost_in_npz)
        }),
        Ok(Format::Trc) => Ok(|markers, _| {
            let mut bytes = Vec::new();
            write_trc(&markers, &mut bytes)?;
            let lost = lost_in_trc(&markers);
            Ok(Written { bytes, notes: markers.notes, lost })
        }),
        #[cfg(feature = "parquet")]
        Ok(Format::Parquet) => Ok(|markers, path| {
            let write =
                |recording: &Recording, bytes: &mut Vec<u8>| jointscope_recordings::write_parquet(recording, bytes);
            with_bodies(markers, path, write, |_| None)
        }),
        #[cfg(not(feature = "parquet"))]
        Ok(Format::Parquet) => {
            let error = format!("{}: this program was built without the feature `parquet`", path.display());
            Err(Failure::usage_with_help(error, "build it with `--features parquet`, or write `.csv`"))
        }
        _ => {
            let path = path.display();
            let error =
                format!("{path}: csv, npz, trc and parquet can be written, and the extension tells none of them");
            Err(Failure::usage_with_help(error, "let the name end with `.csv`, `.npz`, `.trc` or `.parquet`"))
        }
    }
}

/// Writes a format that knows bodies.
fn with_bodies(
    markers: Markers,
    path: &Path,
    write: impl Fn(&Recording, &mut Vec<u8>) -> Result<(), RecordingError>,
    lost: impl Fn(&Recording) -> Option<String>,
) -> Result<Written, RecordingError> {
    let (recording, notes) = group(markers, &Grouping::All, path)?;
    let mut bytes = Vec::new();
    write(&recording, &mut bytes)?;
    Ok(Written { bytes, notes, lost: lost(&recording) })
}
