//! Joints of recordings, how they are read, and what is known of them.

use std::fmt;
use std::path::{Path, PathBuf};

use jointscope_detection::PairDetection;
use jointscope_motion::{Body, Recording, Tracks};
use jointscope_recordings::{BodyPatterns, Grouping, ReadOptions, Unit, read};
use nalgebra::{Point3, Quaternion, Translation3, UnitQuaternion};

use super::known::{FILES, FOLDERS, File, Folder};
use super::pickle::Value;
use super::{mat, mha, transform, trolley};

/// What is known of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Truth {
    /// It is this joint.
    Joint(&'static str),
    /// The recording does not decide between joints, and nothing may be determined.
    Undecidable,
    /// It looks like this joint and is another; it must not be determined as this one.
    Not(&'static str),
    /// Nobody knows; shown, not counted.
    Unknown,
}

impl Truth {
    /// Whether what was detected agrees with the truth, as far as that can be said.
    pub fn agrees(self, pair: &PairDetection) -> Option<bool> {
        match self {
            Self::Joint(joint) => Some(pair.verdict.joint == joint),
            Self::Undecidable => Some(!pair.determined),
            Self::Not(joint) => Some(!(pair.determined && pair.verdict.joint == joint)),
            Self::Unknown => None,
        }
    }
}

impl fmt::Display for Truth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Joint(joint) => f.write_str(joint),
            Self::Undecidable => f.write_str("undecidable"),
            Self::Not(joint) => write!(f, "not {joint}"),
            Self::Unknown => f.write_str("unknown"),
        }
    }
}

/// A body, and patterns of its markers' names.
pub(super) type Group = (&'static str, &'static [&'static str]);

/// How a pair of bodies is found in a file; one body is paired with the world.
#[derive(Debug, Clone, Copy)]
pub(super) enum Content {
    /// Text without header, read by the project itself.
    PoseText,
    /// Markers, read by the project itself: bodies and the patterns of their markers' names.
    Markers(&'static [Group]),
    /// Tools in the header of an image sequence.
    Mha(&'static [&'static str]),
    /// Stacked matrices under this name in a MATLAB file, metres.
    Mat(&'static str),
    /// Points under this key of a pickled dictionary, metres.
    PickledPoints(&'static str),
    /// Poses `x y z qx qy qz qw` in this entry of a pickled list, metres.
    PickledPoses(usize),
    /// A table of poses with the time of day.
    Trolley,
}

/// A joint of a recording.
#[derive(Debug, Clone)]
pub struct Case {
    /// Folder and file, and the pair where the file holds several bodies.
    pub name: String,
    /// The file.
    pub path: PathBuf,
    /// What is known of the joint.
    pub truth: Truth,
    content: Content,
}

impl Case {
    /// The configuration with which the program reads the file, as far as its recording goes; `None` if it cannot.
    pub fn configuration(&self) -> Option<String> {
        match self.content {
            Content::PoseText => Some(String::new()),
            Content::Markers(groups) => {
                let line = |(name, patterns): &Group| format!("{name:?} = {patterns:?}\n");
                Some(format!("[recording.bodies]\n{}", groups.iter().map(line).collect::<String>()))
            }
            _ => None,
        }
    }

    /// The recording of the pair.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub fn recording(&self) -> Result<Recording, String> {
        let bytes = || std::fs::read(&self.path).map_err(|error| error.to_string());
        let text = || std::fs::read_to_string(&self.path).map_err(|error| error.to_string());
        let recording = match self.content {
            Content::PoseText => read(&self.path, &ReadOptions::default()).map_err(|error| error.to_string()),
            Content::Markers(groups) => read(&self.path, &grouped(groups)).map_err(|error| error.to_string()),
            Content::Mha(tools) => text().and_then(|text| mha::parse(&text, tools)),
            Content::Mat(name) => bytes().and_then(|bytes| stacked(&mat::rows(&bytes, name)?)),
            Content::PickledPoints(key) => bytes().and_then(|bytes| points(&Value::parse(&bytes)?.key(key)?.rows()?)),
            Content::PickledPoses(entry) => {
                bytes().and_then(|bytes| poses(&Value::parse(&bytes)?.entry(entry)?.rows()?))
            }
            Content::Trolley => text().and_then(|text| trolley::parse(&text, "trolley")),
        };
        recording.map_err(|error| format!("{}: {error}", self.path.display()))
    }
}

/// How a file is read whose markers make these bodies.
fn grouped(groups: &[Group]) -> ReadOptions {
    let body = |(name, patterns): &Group| BodyPatterns {
        name: (*name).into(),
        patterns: patterns.iter().map(ToString::to_string).collect(),
    };
    ReadOptions { grouping: Grouping::Patterns(groups.iter().map(body).collect()), ..ReadOptions::default() }
}

/// Poses stacked as three rows each.
fn stacked(rows: &[Vec<f64>]) -> Result<Recording, String> {
    let row = |row: &Vec<f64>| row.as_slice().try_into().map_err(|_| "needed four columns".to_owned());
    let rows: Vec<[f64; 4]> = rows.iter().map(row).collect::<Result<_, _>>()?;
    let (matrices, []) = rows.as_chunks() else { return Err("needed three rows per pose".into()) };
    let poses = matrices.iter().map(|matrix| transform::pose(*matrix, Unit::Metre).map(Some));
    transform::recording(None, vec![("tool", poses.collect::<Result<_, _>>()?)])
}

fn points(rows: &[[f64; 3]]) -> Result<Recording, String> {
    Tracks::new(1, rows.iter().map(|row| Point3::from(*row)).collect())
        .and_then(|tracks| Body::from_points("hand", vec!["position".into()], tracks))
        .and_then(|body| Recording::new((0..rows.len() as u64).collect(), None, vec![body]))
        .map_err(|error| error.to_string())
}

fn poses(rows: &[[f64; 7]]) -> Result<Recording, String> {
    let pose = |&[x, y, z, qx, qy, qz, qw]: &[f64; 7]| {
        let rotation = UnitQuaternion::try_new(Quaternion::new(qw, qx, qy, qz), 0.5)?;
        Some(jointscope_motion::Pose::from_parts(Translation3::new(x, y, z), rotation))
    };
    transform::recording(None, vec![("part", rows.iter().map(pose).collect())])
}

/// All cases, in order.
///
/// # Panics
/// If a folder cannot be listed.
pub fn cases(root: &Path) -> Vec<Case> {
    let pairs = |file: &File| {
        let case = |(pair, content, truth): &(&str, Content, Truth)| Case {
            name: format!("{} {pair}", file.name).trim().to_owned(),
            path: root.join(file.name),
            truth: *truth,
            content: *content,
        };
        file.pairs.iter().map(case).collect::<Vec<_>>()
    };
    FOLDERS.iter().flat_map(|folder| files(root, folder)).chain(FILES.iter().flat_map(pairs)).collect()
}

fn files(root: &Path, folder: &Folder) -> Vec<Case> {
    let listed = std::fs::read_dir(root.join(folder.name)).expect("a folder of the real recordings");
    let mut files: Vec<PathBuf> = listed.map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    let known = |path: PathBuf| {
        let file = path.file_name().expect("a file").to_string_lossy().into_owned();
        let except = folder.except.iter().find(|(name, _)| *name == file).map(|(_, truth)| *truth);
        let truth = except.unwrap_or(folder.truth);
        Case { name: format!("{}/{file}", folder.name), path, truth, content: Content::PoseText }
    };
    files.into_iter().map(known).collect()
}
