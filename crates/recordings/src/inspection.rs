//! What a file holds, told for people and programs.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::grouping::{Members, own};
use crate::suggestion::{measured, suggest};
use crate::{Format, Markers, Unit};

/// What a file holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inspection {
    /// The file.
    pub path: PathBuf,
    /// Its format.
    pub format: Format,
    /// Its unit of length.
    pub unit: Unit,
    /// Whether the file states the unit.
    pub unit_stated: bool,
    /// Number of frames.
    pub frames: usize,
    /// Numbers of the first and the last frame.
    pub frame_numbers: [u64; 2],
    /// Frames per second, stated by the file or from its times.
    pub rate: Option<f64>,
    /// Seconds from the first to the last frame.
    pub duration: Option<f64>,
    /// The markers, in the file's order.
    pub markers: Vec<Presence>,
    /// Bodies that the file gives as poses.
    pub poses: Vec<Presence>,
    /// The bodies that a reading of the file gives, or that are suggested.
    pub bodies: Vec<Group>,
    /// How these bodies are known: `file` or `distances`.
    pub bodies_from: &'static str,
    /// Markers that keep their distances to several bodies, and are in none.
    pub ambiguous: Vec<String>,
    /// Of these, the most that keep their distances to each other, and may be one body.
    pub together: Vec<String>,
    /// Further markers that are in no body.
    pub alone: Vec<String>,
    /// What is odd about the file.
    pub notes: Vec<String>,
}

/// Where something is seen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Presence {
    /// Its name.
    pub name: String,
    /// The body that it is on.
    pub body: Option<String>,
    /// Share of the frames that do not show it.
    pub missing: f64,
    /// Number of times it is lost after it was seen and found again.
    pub gaps: usize,
    /// Frames of the longest of them.
    pub longest_gap: usize,
    /// Frames before it is first seen and after it is last seen.
    pub outside: usize,
}

/// Markers of one body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// Its name.
    pub name: String,
    /// Names of its markers; none for a body given as poses.
    pub markers: Vec<String>,
    /// A pattern that these markers and no other have, if there is a simple one.
    pub pattern: Option<String>,
    /// By how much the distances of its markers vary, metres: the largest variation of a pair.
    pub variation: Option<f64>,
    /// Standard deviation of a coordinate of its markers from where a rigid shape has it, metres.
    pub residual: Option<f64>,
}

/// Looks at what a file holds; bodies are those that the file tells, unless there are none or `suggested` is true.
pub fn inspect(markers: &Markers, path: &Path, suggested: bool) -> Inspection {
    let mut notes = markers.notes.clone();
    let told = if suggested { None } else { own(markers, path, &mut notes).ok() };
    let (bodies_from, mut bodies, ambiguous, together): (_, Vec<Group>, _, _) = if let Some(groups) = told {
        let bodies = groups.iter().map(|(name, members)| group(name, members, markers, &mut notes));
        ("file", bodies.collect(), Vec::new(), Vec::new())
    } else {
        let suggestion = suggest(markers);
        let bodies = suggestion.bodies.into_iter().map(|body| {
            let mut group = group(&body.name, &Members::Markers(body.markers), markers, &mut notes);
            (group.variation, group.residual) = (Some(body.variation), Some(body.residual));
            group
        });
        ("distances", bodies.collect(), suggestion.ambiguous, suggestion.together)
    };
    if bodies_from == "distances" {
        bodies.extend(
            markers.poses.iter().enumerate().map(|(i, (name, _))| group(name, &Members::Poses(i), markers, &mut notes)),
        );
    }
    let body_of = |name: &str| {
        let of = |body: &&Group| body.markers.iter().any(|marker| marker == name);
        bodies.iter().find(of).map(|body| body.name.clone())
    };
    let presences: Vec<Presence> = (0..markers.markers.len())
        .map(|index| {
            let name = &markers.markers[index].name;
            presence(name, body_of(name), markers.path(index).map(|point| !point.iter().any(|x| x.is_nan())))
        })
        .collect();
    let poses = markers.poses.iter();
    let poses =
        poses.map(|(name, poses)| presence(name, Some(name.clone()), poses.iter().map(Option::is_some))).collect();
    let names = |of: Vec<usize>| of.into_iter().map(|marker| markers.markers[marker].name.clone()).collect::<Vec<_>>();
    let (ambiguous, together) = (names(ambiguous), names(together));
    let alone = presences.iter().filter(|marker| marker.body.is_none() && !ambiguous.contains(&marker.name));
    let times = markers.times.as_deref().unwrap_or_default();
    let duration = times.last().zip(times.first()).map(|(last, first)| last - first);
    let steps = markers.frame_numbers.last().zip(markers.frame_numbers.first()).map_or(0, |(last, first)| last - first);
    let rate = duration.filter(|duration| *duration > 0.).map(|duration| steps as f64 / duration);
    Inspection {
        path: path.into(),
        format: markers.format,
        unit: markers.unit,
        unit_stated: markers.unit_stated,
        frames: markers.frames(),
        frame_numbers: [
            markers.frame_numbers.first().copied().unwrap_or(0),
            markers.frame_numbers.last().copied().unwrap_or(0),
        ],
        rate: markers.rate.or(rate),
        duration,
        alone: alone.map(|marker| marker.name.clone()).collect(),
        markers: presences,
        poses,
        bodies,
        bodies_from,
        ambiguous,
        together,
        notes,
    }
}

/// A body as it is told, with a note where it is none.
fn group(name: &str, members: &Members, markers: &Markers, notes: &mut Vec<String>) -> Group {
    let Members::Markers(members) = members else {
        return Group { name: name.into(), markers: Vec::new(), pattern: None, variation: None, residual: None };
    };
    let measured = measured(members, markers);
    if measured.as_ref().is_some_and(|measured| measured.falls_apart) {
        notes.push(format!(
            "body `{name}`: most of its markers do not keep their distances: it is no rigid body; --suggest-bodies shows \
             which markers keep them, and `bodies` under [recording] says which belong together"
        ));
    }
    Group {
        name: name.into(),
        markers: members.iter().map(|&marker| markers.markers[marker].name.clone()).collect(),
        pattern: pattern(members, markers),
        variation: measured.as_ref().map(|measured| measured.variation),
        residual: measured.map(|measured| measured.residual),
    }
}

/// `PREFIX:*`, if it fits the members and nothing else.
fn pattern(members: &[usize], markers: &Markers) -> Option<String> {
    let (prefix, _) = markers.markers[*members.first()?].name.rsplit_once(':')?;
    let text = format!("{prefix}:*");
    let pattern = glob::Pattern::new(&text).ok()?;
    let alike = |(index, marker): (usize, &crate::Marker)| pattern.matches(&marker.name) == members.contains(&index);
    markers.markers.iter().enumerate().all(alike).then_some(text)
}

fn presence(name: &str, body: Option<String>, seen: impl Iterator<Item = bool>) -> Presence {
    let seen: Vec<bool> = seen.collect();
    let (first, last) = (seen.iter().position(|seen| *seen), seen.iter().rposition(|seen| *seen));
    let (mut gaps, mut longest_gap, mut current) = (0, 0, 0);
    let inside = first.zip(last).map_or(&[][..], |(first, last)| &seen[first..=last]);
    for &seen in inside {
        if seen {
            current = 0;
        } else {
            gaps += usize::from(current == 0);
            current += 1;
            longest_gap = longest_gap.max(current);
        }
    }
    let shown = seen.iter().filter(|seen| **seen).count();
    Presence {
        name: name.into(),
        body,
        missing: 1. - shown as f64 / seen.len().max(1) as f64,
        gaps,
        longest_gap,
        outside: seen.len() - inside.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_lie_between_frames_that_show_a_marker() {
        let seen = "..xx.x...x..".chars().map(|letter| letter == 'x');
        let found = presence("a", None, seen);
        assert_eq!((found.gaps, found.longest_gap, found.outside), (2, 3, 4));
        assert!((found.missing - 8. / 12.).abs() < 1e-12);
        let never = presence("a", None, [false, false].into_iter());
        assert_eq!((never.gaps, never.outside, never.missing), (0, 2, 1.));
    }
}
