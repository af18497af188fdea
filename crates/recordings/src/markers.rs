//! Markers over frames: what a file holds before its markers are put together to bodies.

use std::collections::BTreeMap;

use jointscope_motion::{Observation, Pose, Recording};
use nalgebra::Point3;

use crate::{Format, Unit};

/// What a file holds: markers and poses over common frames, not yet put together to bodies.
///
/// # Convention
/// Metres and seconds. Frame numbers increase, times never fall.
#[derive(Debug, Clone, PartialEq)]
pub struct Markers {
    /// The format that was read.
    pub format: Format,
    /// The unit of the file.
    pub unit: Unit,
    /// Whether the file states that unit, or it was given or assumed.
    pub unit_stated: bool,
    /// Frames per second, where the file states them.
    pub rate: Option<f64>,
    /// The number of each frame.
    pub frame_numbers: Vec<u64>,
    /// The time of each frame in seconds, where known.
    pub times: Option<Vec<f64>>,
    /// The markers, in the file's order.
    pub markers: Vec<Marker>,
    /// Their positions in metres: frame by frame, in the order of the markers; NaN where missing.
    pub positions: Vec<Point3<f64>>,
    /// Bodies that the file gives as poses `recording_from_tracked`, by name.
    pub poses: Vec<(String, Vec<Option<Pose>>)>,
    /// What is odd about the file, in sentences.
    pub notes: Vec<String>,
}

/// A marker: one tracked point.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Marker {
    /// The name that patterns are compared with, such as `SWL:Marker1`; where the file has bodies, `BODY:FEATURE`.
    pub name: String,
    /// What it is called as a feature of its body.
    pub label: String,
    /// The body that the file itself puts it on: by its prefix, `Subject:Marker`, or by a column of bodies.
    pub body: Option<String>,
}

impl Marker {
    /// A marker of a format that knows no bodies: the part of its name before the last colon is its body.
    pub(crate) fn of_name(name: String) -> Self {
        let parts = name.rsplit_once(':').map(|(body, rest)| (body.trim(), rest.trim()));
        let parts = parts.filter(|(body, rest)| !body.is_empty() && !rest.is_empty());
        let (body, label) = parts.map_or((None, name.as_str()), |(body, rest)| (Some(body.to_owned()), rest));
        Self { label: label.to_owned(), body, name }
    }
}

impl Markers {
    /// The markers and poses of a recording that was read with its bodies.
    pub(crate) fn of_recording(recording: Recording, format: Format, unit: Unit) -> Self {
        let (frame_numbers, times, bodies) = recording.into_parts();
        let (mut markers, mut poses, mut tracks_of) = (Vec::new(), Vec::new(), Vec::new());
        for body in &bodies {
            match body.observation() {
                Observation::Points { labels, tracks } => {
                    markers.extend(labels.iter().map(|label| Marker {
                        name: format!("{}:{label}", body.name()),
                        label: label.clone(),
                        body: Some(body.name().to_owned()),
                    }));
                    tracks_of.push(tracks);
                }
                Observation::Poses(of_body) => poses.push((body.name().to_owned(), of_body.clone())),
                Observation::AtRest(_) => {}
            }
        }
        let missing = Point3::from([f64::NAN; 3]);
        let mut positions = Vec::with_capacity(frame_numbers.len() * markers.len());
        for frame in 0..frame_numbers.len() {
            for tracks in &tracks_of {
                positions.extend(
                    (0..tracks.features()).map(|feature| tracks.get(frame, feature).copied().unwrap_or(missing)),
                );
            }
        }
        Self {
            format,
            unit,
            unit_stated: false,
            rate: None,
            frame_numbers,
            times,
            markers,
            positions,
            poses,
            notes: Vec::new(),
        }
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.frame_numbers.len()
    }

    /// The positions of one marker over the frames, NaN where missing.
    pub fn path(&self, marker: usize) -> impl Iterator<Item = Point3<f64>> + '_ {
        self.positions.iter().skip(marker).step_by(self.markers.len().max(1)).copied()
    }

    /// Number of frames that show a marker.
    pub fn seen(&self, marker: usize) -> usize {
        self.path(marker).filter(|point| !point.iter().any(|x| x.is_nan())).count()
    }
}

/// Names of markers made different: an unnamed one is called by its place from 1, a repeated one gets a number.
pub(crate) fn distinct(names: Vec<String>, notes: &mut Vec<String>) -> Vec<Marker> {
    let mut count: BTreeMap<String, usize> = BTreeMap::new();
    let taken: std::collections::BTreeSet<String> = names.iter().cloned().collect();
    let mut repeated = Vec::new();
    let name = |(index, name): (usize, String)| {
        let name = if name.is_empty() { format!("point {}", index + 1) } else { name };
        let times = count.entry(name.clone()).or_insert(0);
        *times += 1;
        if *times == 1 {
            return Marker::of_name(name);
        }
        if *times == 2 {
            repeated.push(name.clone());
        }
        let mut number = *times;
        while taken.contains(&format!("{name} #{number}")) {
            number += 1;
        }
        Marker::of_name(format!("{name} #{number}"))
    };
    let markers = names.into_iter().enumerate().map(name).collect();
    if !repeated.is_empty() {
        notes.push(format!("several markers have one name, and are numbered: {}", repeated.join(", ")));
    }
    markers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_prefix_of_a_marker_is_its_body() {
        assert_eq!(Marker::of_name("SWL:Marker1".into()).body.as_deref(), Some("SWL"));
        assert_eq!(Marker::of_name("a:b:c".into()).body.as_deref(), Some("a:b"));
        for name in ["RTHI1", ":x", "x:", ""] {
            assert_eq!(Marker::of_name(name.into()).body, None, "{name}");
        }
    }

    #[test]
    fn unnamed_and_repeated_markers_are_told_apart() {
        let mut notes = Vec::new();
        let names = ["a", "", "a", "b", "a"].map(String::from).to_vec();
        let found: Vec<_> = distinct(names, &mut notes).into_iter().map(|marker| marker.name).collect();
        assert_eq!(found, ["a", "point 2", "a #2", "b", "a #3"]);
        assert_eq!(notes, ["several markers have one name, and are numbered: a"]);
    }
}
