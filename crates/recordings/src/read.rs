//! From a path to a recording.

use std::fs;
use std::path::Path;

use jointscope_motion::Recording;

use crate::grouping::group;
use crate::mapped::Bytes;
use crate::{
    Format, Grouping, Markers, RecordingError, Unit, c3d, csv_table, euroc, motive, npz, pose_text, qualisys, trc,
    vicon,
};

/// What a file does not say about itself.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ReadOptions {
    /// The format; if `None`, [the file tells](Format::of_file).
    pub format: Option<Format>,
    /// The unit of the file's positions; if `None`, the one that the file states, or metres.
    pub unit: Option<Unit>,
    /// Which markers make which body.
    pub grouping: Grouping,
}

/// Reads a recording from a file.
///
/// # Errors
/// [`RecordingError`], with the path: the file is missing, a directory or not permitted, its format is unknown, its
/// content is not as the format needs it, or its markers do not make the bodies asked for.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Recording, RecordingError> {
    read_with_notes(path, options).map(|(recording, _)| recording)
}

/// Reads a recording from a file, and says in sentences what is odd about it and which markers are left out.
///
/// # Errors
/// As [`read`].
pub fn read_with_notes(path: &Path, options: &ReadOptions) -> Result<(Recording, Vec<String>), RecordingError> {
    match open(path, options)? {
        (Content::Recording(recording), format, unit) if options.grouping != Grouping::Own => {
            group(Markers::of_recording(recording, format, unit), &options.grouping, path)
        }
        (Content::Recording(recording), ..) => Ok((recording, Vec::new())),
        (Content::Markers(markers), ..) => group(markers, &options.grouping, path),
    }
}

/// Reads what a file holds, before markers are put together to bodies.
///
/// # Errors
/// As [`read`], but for bodies.
pub fn read_markers(path: &Path, options: &ReadOptions) -> Result<Markers, RecordingError> {
    Ok(match open(path, options)? {
        (Content::Recording(recording), format, unit) => Markers::of_recording(recording, format, unit),
        (Content::Markers(markers), ..) => markers,
    })
}

/// What formats give.
enum Content {
    /// Bodies, from formats that tell them.
    Recording(Recording),
    /// Markers, from all others.
    Markers(Markers),
}

fn open(path: &Path, options: &ReadOptions) -> Result<(Content, Format, Unit), RecordingError> {
    let cannot_read = |cause| RecordingError::Read { path: path.into(), cause };
    if fs::metadata(path).map_err(cannot_read)?.is_dir() {
        return Err(RecordingError::Directory { path: path.into() });
    }
    let bytes = Bytes::of(path).map_err(cannot_read)?;
    let format = options.format.map_or_else(|| Format::of_file(path, &bytes), Ok)?;
    let unit = options.unit.unwrap_or_default();
    let content = match format {
        Format::Csv => Content::Recording(csv_table::parse(&bytes, path, unit)?),
        Format::Poses => Content::Recording(pose_text::parse(&bytes, path, unit)?),
        Format::Npz => Content::Recording(npz::parse(&bytes, path, unit)?),
        Format::Euroc => Content::Recording(euroc::parse(&bytes, path, unit)?),
        Format::Parquet => Content::Recording(in_columns(&bytes, path, unit)?),
        Format::C3d => Content::Markers(c3d::parse(&bytes, path, options.unit)?),
        Format::Trc => Content::Markers(trc::parse(&bytes, path, options.unit)?),
        Format::Qualisys => Content::Markers(qualisys::parse(&bytes, path, options.unit)?),
        Format::Vicon => Content::Markers(vicon::parse(&bytes, path, options.unit)?),
        Format::Motive => Content::Markers(motive::parse(&bytes, path, options.unit)?),
    };
    Ok((content, format, unit))
}

#[cfg(feature = "parquet")]
use crate::parquet_table::parse as in_columns;

#[cfg(not(feature = "parquet"))]
fn in_columns(_: &[u8], path: &Path, _: Unit) -> Result<Recording, RecordingError> {
    Err(RecordingError::in_file(
        path,
        "this program was built without the feature `parquet`; build it with `--features parquet`, or write the table \
         as csv",
    ))
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    fn refused(path: &Path) -> String {
        read(path, &ReadOptions::default()).expect_err("refused").to_string()
    }

    #[test]
    fn a_missing_file_and_a_directory_are_named() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let missing = folder.path().join("door.csv");
        let message = refused(&missing);
        assert!(
            message.starts_with(&missing.display().to_string()) && message.ends_with("check the path"),
            "{message}"
        );
        assert!(refused(folder.path()).contains("needed a file, found a directory"));
    }

    #[cfg(unix)]
    #[test]
    fn a_file_without_permission_is_named() {
        use std::os::unix::fs::PermissionsExt;

        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("door.csv");
        fs::write(&path, "x").expect("written");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o000)).expect("permissions set");
        if fs::read(&path).is_ok() {
            println!("skipped: this user may read every file");
            return;
        }
        assert!(refused(&path).contains("check the permissions"));
    }

    #[test]
    fn an_unknown_extension_needs_the_name_of_the_format() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("door.dat");
        fs::write(&path, "1000 0 0\n2000 0 0\n").expect("written");
        assert!(refused(&path).contains("name the format"));
        let options =
            ReadOptions { format: Some(Format::Poses), unit: Some(Unit::Millimetre), ..ReadOptions::default() };
        let recording = read(&path, &options).expect("pose text");
        assert_eq!((recording.frames(), recording.bodies()[0].name()), (2, "door"));
    }

    #[test]
    fn every_real_recording_of_one_tracked_body_is_read() {
        let folder = std::env::var_os("JOINTSCOPE_REAL_DATA").map_or_else(
            || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/real")),
            PathBuf::from,
        );
        if !folder.is_dir() {
            println!("skipped: the folder of real recordings is absent; set JOINTSCOPE_REAL_DATA to name it");
            return;
        }
        let mut files = 0;
        let mut folders: Vec<_> =
            ["tum_kitchen_pose6d", "tum_points", "tum_rect_tracker"].map(|name| folder.join(name)).into();
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).expect("a folder of the data set") {
                let path = entry.expect("an entry").path();
                if path.is_dir() {
                    folders.push(path);
                    continue;
                }
                let recording = read(&path, &ReadOptions::default()).expect("a sound recording");
                let text = fs::read_to_string(&path).expect("text");
                assert_eq!(recording.frames(), text.lines().filter(|line| !line.trim().is_empty()).count());
                files += 1;
            }
        }
        assert!(files > 0);
        println!("{files} real recordings read");
    }
}
