//! Real recordings made by others, and the truth about them as far as it is known.

use std::path::{Path, PathBuf};

use jointscope_recordings::{ReadOptions, read};

use crate::{THESIS, detector};

/// A folder of recordings of one body each against the world.
struct Folder {
    name: &'static str,
    /// The joint of its files, unless stated for one; `None` where nobody knows.
    truth: Option<&'static str>,
    /// Files of another joint.
    except: &'static [(&'static str, Option<&'static str>)],
    /// How the truth is known, and what makes the recordings hard.
    remark: &'static str,
}

const FOLDERS: [Folder; 10] = [
    Folder {
        name: "tum_kitchen_pose6d",
        truth: Some("revolute"),
        except: &[("M2U00394.log", Some("prismatic")), ("M2U00407.log", Some("prismatic"))],
        remark: "checkerboards on kitchen doors and drawers; truth by fits to the positions; the tracker's orientation jumps by 5 to 86 degrees in all files but 410",
    },
    Folder {
        name: "tum_points/cabinet_one",
        truth: Some("revolute"),
        except: &[],
        remark: "truth by name; the radius varies by a fifth",
    },
    Folder { name: "tum_points/cabinet_two", truth: None, except: &[], remark: "as near to a line as to a circle" },
    Folder {
        name: "tum_points/drawer_one",
        truth: Some("prismatic"),
        except: &[],
        remark: "truth by name; in 004 the hook slips by 17 mm",
    },
    Folder { name: "tum_points/iros_dishwasher", truth: Some("revolute"), except: &[], remark: "truth by name" },
    Folder { name: "tum_points/iros_drawer", truth: Some("prismatic"), except: &[], remark: "truth by name" },
    Folder { name: "tum_points/iros_left_door", truth: Some("revolute"), except: &[], remark: "truth by name" },
    Folder { name: "tum_points/iros_right_door", truth: Some("revolute"), except: &[], remark: "truth by name" },
    Folder { name: "tum_points/microwave", truth: Some("revolute"), except: &[], remark: "truth by name" },
    Folder { name: "tum_points/sliding_cabinet", truth: Some("prismatic"), except: &[], remark: "truth by name" },
];

/// The folder of real recordings: `JOINTSCOPE_REAL_DATA`, or `shared/data/real` beside the project; `None`, said
/// aloud, where it is absent.
pub fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("JOINTSCOPE_REAL_DATA")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/real")), PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("SKIPPED: the real recordings are absent; set JOINTSCOPE_REAL_DATA to their folder");
    None
}

/// One recording, and its joint where it is known.
#[derive(Debug)]
pub struct RealRecording {
    /// Folder and file, as shown.
    pub name: String,
    /// The file.
    pub path: PathBuf,
    /// The joint between the body and the world.
    pub truth: Option<&'static str>,
}

/// All recordings of single bodies, in order.
///
/// # Panics
/// If a folder cannot be listed.
pub fn recordings(root: &Path) -> Vec<RealRecording> {
    FOLDERS.iter().flat_map(|folder| files(root, folder)).collect()
}

fn files(root: &Path, folder: &Folder) -> Vec<RealRecording> {
    let listed = std::fs::read_dir(root.join(folder.name)).expect("a folder of the real recordings");
    let mut files: Vec<PathBuf> = listed.map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    let known = |path: PathBuf| {
        let file = path.file_name().expect("a file").to_string_lossy().into_owned();
        let except = folder.except.iter().find(|(name, _)| *name == file).map(|(_, truth)| *truth);
        RealRecording { name: format!("{}/{file}", folder.name), path, truth: except.unwrap_or(folder.truth) }
    };
    files.into_iter().map(known).collect()
}

/// The page `docs/real-recordings.md`: file by file, the verdict beside the truth.
///
/// # Panics
/// If a recording cannot be read or analysed.
pub fn page(root: &Path) -> String {
    let detector = detector(THESIS);
    let mut rows = String::new();
    let (mut known, mut right, mut sure, mut wrong_and_sure) = (0, 0, 0, 0);
    for folder in &FOLDERS {
        for recording in files(root, folder) {
            let read = read(&recording.path, &ReadOptions::default()).expect("a sound recording");
            let frames = read.frames();
            let detection = detector.detect(read, None).expect("a body against the world");
            let pair = &detection.pairs[0];
            let verdict = &pair.verdict;
            let is_right = recording.truth.map(|truth| truth == verdict.joint);
            known += usize::from(is_right.is_some());
            right += usize::from(is_right == Some(true));
            sure += usize::from(pair.determined && is_right.is_some());
            wrong_and_sure += usize::from(pair.determined && is_right == Some(false));
            let residual = pair.models.get(&verdict.joint).and_then(|fit| fit.as_ref().ok()?.residual_rms);
            let confidences = verdict.confidences.iter().map(|(_, confidence)| format!("{confidence:.3}"));
            rows += &format!(
                "| {} | {frames} | {} | {}{} | {} | {} | {} |\n",
                recording.name,
                recording.truth.unwrap_or("unknown"),
                verdict.joint,
                if pair.determined { "" } else { " ?" },
                match is_right {
                    Some(true) => "right",
                    Some(false) => "**wrong**",
                    None => "",
                },
                confidences.collect::<Vec<_>>().join(" / "),
                residual.map_or("-".into(), |rms| format!("{:.1}", 1000.0 * rms)),
            );
        }
    }
    let remarks = FOLDERS.iter().map(|folder| format!("* `{}`: {}.\n", folder.name, folder.remark));
    format!(
        "# Real recordings\n\n\
         Recordings that others made of real doors and drawers, each of one body against the world, analysed with the\n\
         thesis's method (`configs/thesis.toml`), nothing tuned. The recordings are not part of this project; a test\n\
         analyses them where they are present and compares this page. Write it anew with\n\n\
         ```sh\n\
         cargo run --release -p jointscope-tests --bin real-recordings > docs/real-recordings.md\n\
         ```\n\n\
         **{right} of {known}** recordings with known joint come out right; of the {sure} that are called determined,\n\
         {wrong_and_sure} are wrong. A `?` marks verdicts that are not determined. Confidences: rigid / prismatic / revolute /\n\
         disconnected. Residual: root mean square, mm, from the joint of the verdict.\n\n\
         | recording | frames | truth | verdict | | confidences | residual |\n\
         |---|---|---|---|---|---|---|\n\
         {rows}\n\
         About the recordings\n\n{}",
        remarks.collect::<String>()
    )
}
