//! Markers put together to bodies.

use std::path::Path;

use glob::Pattern;
use jointscope_motion::{Body, MotionError, Recording, Tracks};

use crate::pose_text::body_name;
use crate::suggestion::suggest;
use crate::text::quoted;
use crate::{Marker, Markers, RecordingError};

/// Which markers make which body.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Grouping {
    /// The bodies that the file itself tells: by the prefixes of markers, `Subject:Marker`, or by its columns.
    #[default]
    Own,
    /// The same, and all further markers as one more body, named after the file; nothing that is seen is left out.
    All,
    /// By patterns of markers' names.
    Patterns(Vec<BodyPatterns>),
    /// By constancy of distances: see [`suggest`].
    Suggested,
}

/// The markers of one body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BodyPatterns {
    /// The body's name.
    pub name: String,
    /// Names of markers, in which `*` stands for any letters, `?` for any one, `[ab]` for one of some.
    pub patterns: Vec<String>,
}

/// The bodies of a grouping, and what is left out, in sentences.
///
/// Bodies are in order of the patterns, or else of first appearance; features in order of the patterns, and within one
/// pattern in the file's order. A pattern may also name a body that the file gives as poses.
///
/// # Errors
/// [`RecordingError::Pattern`] for a pattern that matches nothing or cannot be understood, or a marker in two bodies;
/// [`RecordingError::Ungrouped`] if the file tells no bodies, or none can be suggested; [`RecordingError::Motion`], for
/// instance for a body without any sample.
pub fn group(markers: Markers, grouping: &Grouping, path: &Path) -> Result<(Recording, Vec<String>), RecordingError> {
    let mut notes = markers.notes.clone();
    let mut ambiguous = Vec::new();
    let groups = match grouping {
        Grouping::Own => own(&markers, path, &mut notes)?,
        Grouping::All => all(&markers, path, &mut notes)?,
        Grouping::Patterns(patterns) => by_patterns(&markers, patterns, path)?,
        Grouping::Suggested => suggested(&markers, path, &mut ambiguous)?,
    };
    let by_name = matches!(grouping, Grouping::Patterns(_) | Grouping::Suggested);
    if by_name {
        let alone = (0..markers.markers.len()).filter(|&marker| !groups.iter().any(|(_, members)| members.has(marker)));
        notes.extend(without_body(&alone.collect::<Vec<_>>(), &ambiguous, &markers));
    }
    let mut bodies = Vec::new();
    for (name, members) in groups {
        let body = match members {
            Members::Markers(features) => {
                let label = |marker: &Marker| if by_name { marker.name.clone() } else { marker.label.clone() };
                let labels = features.iter().map(|&feature| label(&markers.markers[feature])).collect();
                body(name, labels, &features, &markers)
            }
            Members::Poses(index) => Body::from_poses(name, markers.poses[index].1.clone()),
        };
        bodies.push(body.map_err(RecordingError::motion(path))?);
    }
    let Markers { frame_numbers, times, .. } = markers;
    let recording = Recording::new(frame_numbers, times, bodies).map_err(RecordingError::motion(path))?;
    Ok((recording, notes))
}

/// What a body is made of.
pub(crate) enum Members {
    Markers(Vec<usize>),
    Poses(usize),
}

impl Members {
    fn has(&self, marker: usize) -> bool {
        matches!(self, Self::Markers(markers) if markers.contains(&marker))
    }
}

pub(crate) type Groups = Vec<(String, Members)>;

/// What the file itself tells about bodies.
struct Told {
    /// In order of first appearance, poses last; each is seen.
    groups: Groups,
    /// Markers of no body.
    alone: Vec<usize>,
    /// Markers of bodies that the file also gives as poses.
    posed: Vec<usize>,
    unseen: Vec<String>,
}

fn told(markers: &Markers) -> Told {
    let mut groups: Groups = Vec::new();
    let (mut alone, mut posed) = (Vec::new(), Vec::new());
    for (index, marker) in markers.markers.iter().enumerate() {
        let Some(body) = &marker.body else {
            alone.push(index);
            continue;
        };
        if markers.poses.iter().any(|(name, _)| name == body) {
            posed.push(index);
            continue;
        }
        match groups.iter_mut().find(|(name, _)| name == body) {
            Some((_, Members::Markers(members))) => members.push(index),
            _ => groups.push((body.clone(), Members::Markers(vec![index]))),
        }
    }
    groups.extend(markers.poses.iter().enumerate().map(|(index, (name, _))| (name.clone(), Members::Poses(index))));
    let seen = |members: &Members| match members {
        Members::Markers(members) => members.iter().any(|&marker| markers.seen(marker) > 0),
        Members::Poses(index) => markers.poses[*index].1.iter().any(Option::is_some),
    };
    let (groups, unseen): (Groups, Groups) = groups.into_iter().partition(|(_, members)| seen(members));
    Told { groups, alone, posed, unseen: unseen.into_iter().map(|(name, _)| name).collect() }
}

/// The groups that the file itself tells; poses take precedence over the markers of the same body.
pub(crate) fn own(markers: &Markers, path: &Path, notes: &mut Vec<String>) -> Result<Groups, RecordingError> {
    let Told { groups, alone, posed, unseen } = told(markers);
    let names = |of: &[usize]| of.iter().map(|&marker| markers.markers[marker].name.as_str()).collect::<Vec<_>>();
    if groups.is_empty() {
        check_seen(markers, path)?;
        let problem = format!(
            "the file has {} markers, {}, and does not say which of them are on one body",
            markers.markers.len(),
            list(&names(&alone))
        );
        return Err(RecordingError::Ungrouped { path: path.into(), problem });
    }
    notes.extend(left_out(&names(&alone), "are in no body, and left out"));
    notes.extend(left_out(&names(&posed), "are on bodies that the file gives as poses, and left out"));
    notes.extend(never_seen(&unseen));
    Ok(groups)
}

/// The same, and a body of all markers that are in none.
fn all(markers: &Markers, path: &Path, notes: &mut Vec<String>) -> Result<Groups, RecordingError> {
    check_seen(markers, path)?;
    let Told { mut groups, alone, posed, unseen } = told(markers);
    let rest: Vec<usize> = alone.into_iter().chain(posed).collect();
    if rest.iter().any(|&marker| markers.seen(marker) > 0) {
        let mut name = body_name(path);
        while groups.iter().any(|(other, _)| *other == name) {
            name.push('\'');
        }
        groups.push((name, Members::Markers(rest)));
    }
    notes.extend(never_seen(&unseen));
    Ok(groups)
}

fn never_seen(bodies: &[String]) -> Option<String> {
    match bodies {
        [] => None,
        [one] => Some(format!("body {} is never seen, and left out", quoted(one))),
        _ => {
            let names: Vec<&str> = bodies.iter().map(String::as_str).collect();
            Some(format!("{} bodies are never seen, and left out: {}", names.len(), list(&names)))
        }
    }
}

/// Refuses a file of which nothing is seen in any frame.
fn check_seen(markers: &Markers, path: &Path) -> Result<(), RecordingError> {
    let posed = markers.poses.iter().any(|(_, poses)| poses.iter().any(Option::is_some));
    if posed || (0..markers.markers.len()).any(|marker| markers.seen(marker) > 0) {
        return Ok(());
    }
    let names = markers.markers.iter().map(|marker| &marker.name).chain(markers.poses.iter().map(|(name, _)| name));
    let names: Vec<&str> = names.map(String::as_str).collect();
    let needed = "needed a sample of at least one marker or body";
    Err(RecordingError::in_file(
        path,
        match &names[..] {
            [] => format!("{needed}, found none of either; export them, too"),
            _ => format!("{needed}, found none of {}; export the recording with its positions", list(&names)),
        },
    ))
}

fn by_patterns(markers: &Markers, bodies: &[BodyPatterns], path: &Path) -> Result<Groups, RecordingError> {
    let mut owner: Vec<Option<&str>> = vec![None; markers.markers.len()];
    let mut groups = Vec::new();
    for BodyPatterns { name, patterns } in bodies {
        let refuse = |pattern: &str, problem: String, help: String| RecordingError::Pattern {
            path: path.into(),
            body: name.clone(),
            pattern: pattern.into(),
            problem,
            help,
        };
        let (mut features, mut pose) = (Vec::new(), None);
        for text in patterns {
            let pattern = Pattern::new(text).map_err(|error| {
                let help = "write * for any letters, ? for any one, [ab] for one of some, [*] for the star itself";
                refuse(text, format!("the pattern cannot be understood: {}", error.msg), help.into())
            })?;
            // A name that has the letters of a pattern in it is meant as it stands.
            let exact = markers.markers.iter().any(|marker| marker.name == *text);
            let fits = |name: &str| if exact { name == text } else { pattern.matches(name) };
            let found: Vec<usize> =
                (0..markers.markers.len()).filter(|&marker| fits(&markers.markers[marker].name)).collect();
            for &marker in &found {
                match owner[marker].replace(name) {
                    Some(other) if other != name => {
                        let problem = format!(
                            "marker {} is in body {} already",
                            quoted(&markers.markers[marker].name),
                            quoted(other)
                        );
                        let help = "put each marker on one body; bodies that share markers seem connected".into();
                        return Err(refuse(text, problem, help));
                    }
                    Some(_) => {}
                    None => features.push(marker),
                }
            }
            let posed: Vec<usize> =
                (0..markers.poses.len()).filter(|&index| pattern.matches(&markers.poses[index].0)).collect();
            if found.is_empty() && posed.is_empty() {
                return Err(refuse(text, "no marker has such a name".into(), nearest(markers, text)));
            }
            // Patterns for markers, such as a lone star, may fit the names of poses by chance.
            let several = |pose: &mut Option<usize>| {
                posed.len() > 1 || pose.replace(posed[0]).is_some_and(|other| other != posed[0])
            };
            if found.is_empty() && several(&mut pose) {
                let help = "give every one of them a body of its own".into();
                return Err(refuse(text, "several bodies have such a name".into(), help));
            }
        }
        let last = patterns.last().map_or("", String::as_str);
        match (features.is_empty(), pose) {
            (false, None) => groups.push((name.clone(), Members::Markers(features))),
            (true, Some(pose)) => groups.push((name.clone(), Members::Poses(pose))),
            (false, Some(_)) => {
                let help = "name either markers or one body that the file gives as poses".into();
                return Err(refuse(last, "both markers and poses have such names".into(), help));
            }
            (true, None) => {
                return Err(refuse(last, "the body has no marker".into(), "name its markers, or leave it out".into()));
            }
        }
    }
    Ok(groups)
}

fn suggested(markers: &Markers, path: &Path, ambiguous: &mut Vec<usize>) -> Result<Groups, RecordingError> {
    let suggestion = suggest(markers);
    if suggestion.bodies.is_empty() && markers.poses.is_empty() {
        let problem = format!(
            "no three of the {} markers keep their distances to each other while others do not",
            markers.markers.len()
        );
        return Err(RecordingError::Ungrouped { path: path.into(), problem });
    }
    *ambiguous = suggestion.ambiguous;
    let bodies = suggestion.bodies.into_iter().map(|body| (body.name, Members::Markers(body.markers)));
    let poses = markers.poses.iter().enumerate().map(|(index, (name, _))| (name.clone(), Members::Poses(index)));
    Ok(bodies.chain(poses).collect())
}

fn body(name: String, labels: Vec<String>, features: &[usize], markers: &Markers) -> Result<Body, MotionError> {
    let frames = markers.positions.chunks_exact(markers.markers.len());
    let positions = frames.flat_map(|frame| features.iter().map(|&feature| frame[feature])).collect();
    Body::from_points(name, labels, Tracks::new(features.len(), positions)?)
}

/// Says which markers are in no body, some of them because they could be in several.
fn without_body(alone: &[usize], ambiguous: &[usize], markers: &Markers) -> Option<String> {
    let names = |of: &[usize]| of.iter().map(|&marker| markers.markers[marker].name.as_str()).collect::<Vec<_>>();
    if !ambiguous.is_empty() && ambiguous.len() == alone.len() {
        return left_out(&names(alone), "keep their distances to more than one body, and are left out");
    }
    let note = left_out(&names(alone), "are in no body, and left out")?;
    Some(if ambiguous.is_empty() {
        note
    } else {
        format!("{note}; keeping their distances to more than one body: {}", list(&names(ambiguous)))
    })
}

fn left_out(names: &[&str], what: &str) -> Option<String> {
    match names {
        [] => None,
        [one] => {
            Some(format!("marker {} {}", quoted(one), what.replace("are ", "is ").replace("keep their ", "keeps its ")))
        }
        _ => Some(format!("{} markers {what}: {}", names.len(), list(names))),
    }
}

/// The first names of a list.
fn list(names: &[&str]) -> String {
    const SHOWN: usize = 8;
    let shown: Vec<String> = names.iter().take(SHOWN).map(|name| quoted(name)).collect();
    if names.len() > SHOWN { format!("{} …", shown.join(", ")) } else { shown.join(", ") }
}

/// The names most like a pattern.
fn nearest(markers: &Markers, pattern: &str) -> String {
    const SHOWN: usize = 4;
    let names = markers.markers.iter().map(|marker| &marker.name).chain(markers.poses.iter().map(|(name, _)| name));
    let mut names: Vec<&String> = names.collect();
    let alike = |name: &str| strsim::jaro_winkler(&name.to_lowercase(), &pattern.to_lowercase());
    names.sort_by(|a, b| alike(b).total_cmp(&alike(a)));
    let shown: Vec<String> = names.iter().take(SHOWN).map(|name| quoted(name)).collect();
    format!("the nearest names are {}; `inspect FILE` lists them all", shown.join(", "))
}
