//! Markers written as TRC.

use std::collections::BTreeSet;
use std::io::Write;

use crate::markers::Marker;
use crate::{Markers, RecordingError};

/// What a TRC table does not hold of markers, in one sentence; `None` if nothing is lost: bodies other than by a prefix
/// of the markers' names.
pub fn lost_in_trc(markers: &Markers) -> Option<String> {
    let told = |marker: &&Marker| **marker != Marker::of_name(marker.name.clone());
    let example = markers.markers.iter().find(told)?;
    Some(format!(
        "the format tells a body by what stands before a marker's last colon, and `{}` will be read otherwise; .csv and \
         .parquet hold bodies",
        example.name
    ))
}

/// Writes markers as a [TRC table](crate::trc) in metres and seconds.
///
/// Names, frame numbers, times and positions survive being read again: numbers are written as short as they can be and
/// still be read as the same `f64`; missing samples are empty cells. Where times are unknown their column is empty and
/// the rate 0, which other programs may not like.
///
/// # Errors
/// [`RecordingError::Unwritable`] if there are no markers but poses, or a name is repeated, empty, or has blanks around
/// it, tabs, quotes or line breaks in it; [`RecordingError::Write`] if `out` fails.
pub fn write_trc(markers: &Markers, out: &mut impl Write) -> Result<(), RecordingError> {
    if let Some((name, _)) = markers.poses.first() {
        return Err(RecordingError::unwritable(format!(
            "needed markers, found poses of body `{name}`; write poses as csv, or leave them out"
        )));
    }
    let mut names = BTreeSet::new();
    for marker in &markers.markers {
        let name = &marker.name;
        if name.is_empty() || name.trim() != name || name.contains(['\t', '\n', '\r', '"']) {
            return Err(RecordingError::unwritable(format!(
                "needed a marker name without blanks around it, tabs, quotes and line breaks, found {name:?}; rename it"
            )));
        }
        if !names.insert(name) {
            return Err(RecordingError::unwritable(format!("two markers are named `{name}`; rename one of them")));
        }
    }
    let (frames, count) = (markers.frames(), markers.markers.len());
    let rate = markers.rate.or_else(|| {
        let times = markers.times.as_deref()?;
        let duration = times.last()? - times.first()?;
        (duration > 0.).then(|| (frames - 1) as f64 / duration)
    });
    let rate = rate.unwrap_or(0.);
    let first = markers.frame_numbers.first().copied().unwrap_or(0);
    writeln!(out, "PathFileType\t4\t(X/Y/Z)\tmarkers.trc")?;
    writeln!(
        out,
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames"
    )?;
    writeln!(out, "{rate}\t{rate}\t{frames}\t{count}\tm\t{rate}\t{first}\t{frames}")?;
    write!(out, "Frame#\tTime")?;
    for marker in &markers.markers {
        write!(out, "\t{}\t\t", marker.name)?;
    }
    write!(out, "\n\t")?;
    for number in 1..=count {
        write!(out, "\tX{number}\tY{number}\tZ{number}")?;
    }
    writeln!(out)?;
    for frame in 0..frames {
        write!(out, "\n{}\t", markers.frame_numbers[frame])?;
        if let Some(times) = &markers.times {
            write!(out, "{}", times[frame])?;
        }
        for point in &markers.positions[frame * count..(frame + 1) * count] {
            if point.iter().any(|x| x.is_nan()) {
                write!(out, "\t\t\t")?;
            } else {
                write!(out, "\t{}\t{}\t{}", point.x, point.y, point.z)?;
            }
        }
    }
    writeln!(out)?;
    Ok(())
}
