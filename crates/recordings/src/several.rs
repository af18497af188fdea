//! Several files as one recording.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use jointscope_motion::{Body, Observation, Recording, Tracks};
use nalgebra::Point3;

use crate::RecordingError;

/// Frames of several files are the same frame if they are nearer in time than this share of the shortest usual step.
const SAME: f64 = 0.5;

/// Puts recordings of several files together: each gives its bodies.
///
/// Bodies of one name have the folders of their files before it, `a/door` and `b/door`, or the files where folders are the
/// same.
///
/// Frames are matched by their times, within half of the shortest of the files' median steps, if all files have times,
/// and by their numbers if none has. Frames that a file lacks are without samples of its bodies. Matched by time, frames
/// are numbered from 0, and have the earliest of their times.
///
/// # Errors
/// [`RecordingError::File`] if some files have times and others have none, and if nothing happens at the same time;
/// [`RecordingError::Motion`], for instance for two bodies of one name.
pub fn join(recordings: Vec<(PathBuf, Recording)>) -> Result<Recording, RecordingError> {
    let without = recordings.iter().find(|(_, recording)| recording.times().is_none());
    let with = recordings.iter().find(|(_, recording)| recording.times().is_some());
    let timed = match (without, with) {
        (Some((without, _)), Some((with, _))) => {
            let problem = format!(
                "the file has no times, and {} has; frames of several files are matched by times if all have them, and \
                 by numbers if none has",
                with.display()
            );
            return Err(RecordingError::in_file(without, problem));
        }
        (None, _) => true,
        _ => false,
    };
    let frames = if timed { by_time(&recordings) } else { by_number(&recordings) };
    let first = recordings.first().map_or_else(PathBuf::new, |(path, _)| path.clone());
    let shared = frames.iter().any(|frame| frame.sources.iter().filter(|source| source.is_some()).count() > 1);
    if recordings.len() > 1 && !shared {
        let problem = format!(
            "no frame of the file is also in another one; frames are matched by {}",
            if timed { "times: check that all files count them from the same moment" } else { "numbers" }
        );
        return Err(RecordingError::in_file(&first, problem));
    }
    let told_apart = told_apart(&recordings);
    let mut bodies: Vec<Body> = Vec::new();
    for (source, (path, recording)) in recordings.into_iter().enumerate() {
        let rows: Vec<Option<usize>> = frames.iter().map(|frame| frame.sources[source]).collect();
        for body in recording.bodies() {
            let name = told_apart.get(&(source, body.name().to_owned())).map_or(body.name(), String::as_str);
            if bodies.iter().any(|other| other.name() == name) {
                let problem = format!("body `{name}` is in another file too; rename one of them");
                return Err(RecordingError::in_file(&path, problem));
            }
            bodies.push(spread(body, name, &rows, &path)?);
        }
    }
    let times = timed.then(|| frames.iter().map(|frame| frame.time).collect());
    let numbers = frames.iter().map(|frame| frame.number).collect();
    Recording::new(numbers, times, bodies).map_err(RecordingError::motion(&first))
}

/// Names of bodies that several files have, by file and name: with the files' folders, or with the files where the folders
/// are the same; none where neither tells them apart.
fn told_apart(recordings: &[(PathBuf, Recording)]) -> BTreeMap<(usize, String), String> {
    let mut sources = BTreeMap::<&str, Vec<usize>>::new();
    for (source, (_, recording)) in recordings.iter().enumerate() {
        for body in recording.bodies() {
            sources.entry(body.name()).or_default().push(source);
        }
    }
    let folder = |source: &usize| recordings[*source].0.parent()?.file_name()?.to_str();
    let file = |source: &usize| recordings[*source].0.file_stem()?.to_str();
    let mut names = BTreeMap::new();
    for (body, sources) in sources.into_iter().filter(|(_, sources)| sources.len() > 1) {
        let all = |word: &dyn Fn(&usize) -> Option<String>| -> Option<Vec<String>> {
            let words = sources.iter().map(word).collect::<Option<Vec<String>>>()?;
            (words.iter().collect::<BTreeSet<_>>().len() == words.len()).then_some(words)
        };
        let words =
            all(&|source| folder(source).map(str::to_owned)).or_else(|| all(&|source| file(source).map(str::to_owned)));
        for (source, word) in sources.iter().zip(words.into_iter().flatten()) {
            names.insert((*source, body.to_owned()), format!("{word}/{body}"));
        }
    }
    names
}

/// A frame, and which of each file's frames it is.
struct Frame {
    number: u64,
    time: f64,
    sources: Vec<Option<usize>>,
}

fn by_number(recordings: &[(PathBuf, Recording)]) -> Vec<Frame> {
    let mut numbers: Vec<u64> =
        recordings.iter().flat_map(|(_, recording)| recording.frame_numbers()).copied().collect();
    numbers.sort_unstable();
    numbers.dedup();
    let sources = |number: u64| {
        recordings.iter().map(|(_, recording)| recording.frame_numbers().binary_search(&number).ok()).collect()
    };
    numbers.into_iter().map(|number| Frame { number, time: f64::NAN, sources: sources(number) }).collect()
}

fn by_time(recordings: &[(PathBuf, Recording)]) -> Vec<Frame> {
    let times = |source: usize| recordings[source].1.times().unwrap_or_default();
    let step = |source: usize| {
        let mut steps: Vec<f64> =
            times(source).windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.).collect();
        steps.sort_unstable_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied().unwrap_or(f64::INFINITY)
    };
    let tolerance = SAME * (0..recordings.len()).map(step).fold(f64::INFINITY, f64::min);
    let all =
        (0..recordings.len()).flat_map(|source| times(source).iter().enumerate().map(move |(i, t)| (*t, source, i)));
    let mut all: Vec<(f64, usize, usize)> = all.collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut frames: Vec<Frame> = Vec::new();
    for (time, source, index) in all {
        match frames.last_mut() {
            Some(frame) if frame.sources[source].is_none() && time - frame.time < tolerance => {
                frame.sources[source] = Some(index);
            }
            _ => {
                let mut sources = vec![None; recordings.len()];
                sources[source] = Some(index);
                frames.push(Frame { number: frames.len() as u64, time, sources });
            }
        }
    }
    frames
}

/// A body over other frames, under a name.
fn spread(body: &Body, name: &str, rows: &[Option<usize>], path: &Path) -> Result<Body, RecordingError> {
    let missing = Point3::from([f64::NAN; 3]);
    let spread = match body.observation() {
        Observation::Points { labels, tracks } => {
            let row = |row: &Option<usize>| {
                (0..tracks.features())
                    .map(|feature| row.and_then(|row| tracks.get(row, feature)).copied().unwrap_or(missing))
                    .collect::<Vec<_>>()
            };
            Tracks::new(tracks.features(), rows.iter().flat_map(row).collect())
                .and_then(|tracks| Body::from_points(name, labels.clone(), tracks))
        }
        Observation::Poses(poses) => Body::from_poses(name, rows.iter().map(|row| poses[(*row)?]).collect()),
        Observation::AtRest(_) => Ok(Body::at_rest(name, rows.len())),
    };
    spread.map_err(RecordingError::motion(path))
}

#[cfg(test)]
mod tests {
    use jointscope_motion::Pose;

    use super::*;

    fn poses(name: &str, numbers: Vec<u64>, times: Option<Vec<f64>>) -> (PathBuf, Recording) {
        let pose = |number: &u64| Some(Pose::translation(*number as f64, 0., 0.));
        let body = Body::from_poses(name, numbers.iter().map(pose).collect()).expect("seen");
        (format!("{name}.log").into(), Recording::new(numbers, times, vec![body]).expect("sound"))
    }

    fn x(recording: &Recording, body: usize) -> Vec<Option<f64>> {
        let Observation::Poses(poses) = recording.bodies()[body].observation() else { panic!("poses") };
        poses.iter().map(|pose| pose.map(|pose| pose.translation.x)).collect()
    }

    #[test]
    fn frames_without_times_are_matched_by_number() {
        let joined = join(vec![poses("a", vec![0, 1, 4], None), poses("b", vec![1, 2], None)]).expect("one shared");
        assert_eq!(joined.frame_numbers(), [0, 1, 2, 4]);
        assert_eq!(x(&joined, 0), [Some(0.), Some(1.), None, Some(4.)]);
        assert_eq!(x(&joined, 1), [None, Some(1.), Some(2.), None]);
    }

    #[test]
    fn frames_with_times_are_matched_within_half_a_step() {
        let a = poses("a", vec![0, 1, 2], Some(vec![0., 0.1, 0.2]));
        let b = poses("b", vec![7, 8], Some(vec![0.104, 0.26]));
        let joined = join(vec![a, b]).expect("one shared");
        assert_eq!(joined.times(), Some(&[0., 0.1, 0.2, 0.26][..]));
        assert_eq!(x(&joined, 1), [None, Some(7.), None, Some(8.)]);
    }

    #[test]
    fn files_that_do_not_go_together_are_refused() {
        let refused = |files| join(files).expect_err("refused").to_string();
        let times = || Some(vec![0., 1.]);
        let mixed = refused(vec![poses("a", vec![0, 1], times()), poses("b", vec![0, 1], None)]);
        assert!(mixed.starts_with("b.log: the file has no times, and a.log has"), "{mixed}");
        let apart = refused(vec![poses("a", vec![0, 1], None), poses("b", vec![2, 3], None)]);
        assert!(apart.starts_with("a.log: no frame of the file is also in another one"), "{apart}");
        let twice = refused(vec![poses("a", vec![0, 1], None), poses("a", vec![0, 1], None)]);
        assert!(twice.starts_with("a.log: body `a` is in another file too"), "{twice}");
    }

    #[test]
    fn bodies_of_one_name_have_their_folder_or_file_before_it() {
        let names = |paths: [&str; 2]| {
            let files = paths.map(|path| (path.into(), poses("001", vec![0, 1], None).1));
            let joined = join(files.into()).expect("told apart");
            joined.bodies().iter().map(|body| body.name().to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(names(["runs/a/001.log", "runs/b/001.log"]), ["a/001", "b/001"]);
        assert_eq!(names(["runs/x.csv", "runs/y.csv"]), ["x/001", "y/001"]);
    }
}
