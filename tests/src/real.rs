//! Real recordings made by others, and the truth about them as far as it is known.

use std::path::{Path, PathBuf};

use jointscope_detection::PairDetection;
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

/// What came out of one recording.
struct Outcome {
    recording: RealRecording,
    pair: PairDetection,
}

impl Outcome {
    /// Whether the verdict is right, where the truth is known.
    fn is_right(&self) -> Option<bool> {
        self.recording.truth.map(|truth| truth == self.pair.verdict.joint)
    }

    /// The row of the page's table.
    fn row(&self) -> String {
        let Self { recording, pair } = self;
        let confidences = pair.verdict.confidences.iter().map(|(_, confidence)| format!("{confidence:.3}"));
        let fit = pair.models.get(&pair.verdict.joint).and_then(|fit| fit.as_ref().ok());
        format!(
            "| {} | {} | {} | {}{} | {} | {} | {} |\n",
            recording.name,
            pair.frames_used,
            recording.truth.unwrap_or("unknown"),
            pair.verdict.joint,
            if pair.determined { "" } else { " ?" },
            self.is_right().map_or("", |right| if right { "right" } else { "**wrong**" }),
            confidences.collect::<Vec<_>>().join(" / "),
            fit.and_then(|fit| fit.residual_rms).map_or("-".into(), |rms| format!("{:.1}", 1000.0 * rms)),
        )
    }
}

/// The page `docs/real-recordings.md`: file by file, the verdict beside the truth.
///
/// # Panics
/// If a recording cannot be read or analysed.
pub fn page(root: &Path) -> String {
    let detector = detector(THESIS);
    let analyse = |recording: RealRecording| {
        let read = read(&recording.path, &ReadOptions::default()).expect("a sound recording");
        let mut detection = detector.detect(read, None).expect("a body against the world");
        Outcome { recording, pair: detection.pairs.remove(0) }
    };
    let outcomes: Vec<Outcome> = recordings(root).into_iter().map(analyse).collect();
    let count = |condition: &dyn Fn(&Outcome) -> bool| outcomes.iter().filter(|outcome| condition(outcome)).count();
    let known = count(&|outcome| outcome.is_right().is_some());
    let right = count(&|outcome| outcome.is_right() == Some(true));
    let sure = count(&|outcome| outcome.is_right().is_some() && outcome.pair.determined);
    let sure_and_wrong = count(&|outcome| outcome.is_right() == Some(false) && outcome.pair.determined);
    let rows: String = outcomes.iter().map(Outcome::row).collect();
    let remarks = FOLDERS.map(|folder| format!("* `{}`: {}.\n", folder.name, folder.remark)).concat();
    format!(
        "# Real recordings\n\n\
         Recordings that others made of real doors and drawers, each of one body against the world, analysed with the\n\
         thesis's method (`configs/thesis.toml`), nothing tuned. The recordings are not part of this project; a test\n\
         analyses them where they are present and compares this page. Write it anew with\n\n\
         ```sh\n\
         cargo run --release -p jointscope-tests --bin real-recordings > docs/real-recordings.md\n\
         ```\n\n\
         **{right} of {known}** recordings with known joint come out right; of the {sure} that are called determined,\n\
         {sure_and_wrong} are wrong. A `?` marks verdicts that are not determined. Confidences: rigid / prismatic / revolute /\n\
         disconnected. Residual: root mean square, mm, from the joint of the verdict.\n\n\
         | recording | frames | truth | verdict | | confidences | residual |\n\
         |---|---|---|---|---|---|---|\n\
         {rows}\n\
         About the recordings\n\n{remarks}"
    )
}
