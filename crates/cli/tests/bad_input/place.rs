//! A place to run the program in, and recordings for it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::process::Stdio;
use tempfile::TempDir;

pub(crate) const DATA: i32 = 1;
pub(crate) const USAGE: i32 = 2;

/// A folder to run the program in.
pub(crate) struct Place(TempDir);

impl Place {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    /// A folder with an empty configuration, which means the default models, and a recording.
    pub(crate) fn with(recording: impl AsRef<[u8]>) -> Self {
        let place = Self::new();
        place.write("c.toml", "");
        place.write("r.csv", recording);
        place
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        fs::write(path, content).expect("written");
    }

    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_jointscope"));
        command.args(arguments).current_dir(self.0.path()).stdin(Stdio::null());
        for variable in ["FORCE_COLOR", "CLICOLOR_FORCE", "NO_GRAPHICS"] {
            command.env_remove(variable);
        }
        command
    }

    pub(crate) fn run(&self, arguments: &[&str]) -> Outcome {
        let output = self.command(arguments).output().expect("the program starts");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
        let outcome = Outcome { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) };
        assert!(!outcome.stderr.contains("panicked"), "{arguments:?}: {outcome:?}");
        outcome
    }

    /// Runs the program, which must refuse and leave everything as it was.
    pub(crate) fn refused(&self, arguments: &[&str], code: i32, message: &[&str]) {
        let before = self.files();
        let outcome = self.run(arguments);
        assert_eq!(outcome.code, Some(code), "{arguments:?}: {outcome:?}");
        assert_eq!(outcome.stdout, "", "{arguments:?}");
        for part in message {
            assert!(outcome.stderr.contains(part), "{arguments:?}: `{part}` is missing in\n{}", outcome.stderr);
        }
        assert_eq!(self.files(), before, "{arguments:?}");
    }

    /// Runs the program, which must do it and say nothing beside the result; gives the result.
    pub(crate) fn done(&self, arguments: &[&str]) -> String {
        let outcome = self.run(arguments);
        assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""), "{arguments:?}: {outcome:?}");
        outcome.stdout
    }

    /// Every file and folder below, with its size.
    pub(crate) fn files(&self) -> BTreeMap<PathBuf, u64> {
        let mut files = BTreeMap::new();
        let mut folders = vec![self.0.path().to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).expect("a folder") {
                let path = entry.expect("an entry").path();
                let metadata = path.symlink_metadata().expect("metadata");
                if metadata.is_dir() {
                    folders.push(path.clone());
                }
                files.insert(path, if metadata.is_file() { metadata.len() } else { 0 });
            }
        }
        files
    }
}

#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

pub(crate) const RUN: [&str; 5] = ["run", "--config", "c.toml", "--input", "r.csv"];
pub(crate) const RUN_JSON: [&str; 7] = ["run", "--config", "c.toml", "--input", "r.csv", "--format", "json"];

/// Features of every body, from its hinge: neither on one line nor in one plane, and all away from the hinge.
pub(crate) const SHAPE: [[f64; 3]; 4] = [[0.5, 0., 0.], [0.7, 0., 0.1], [0.5, 0.2, 0.25], [0.6, 0.1, 0.4]];

/// A recording of some bodies, frames and features; `sample` gives x, y, z as text.
pub(crate) fn table(
    bodies: &[&str],
    frames: usize,
    features: usize,
    sample: impl Fn(usize, usize, usize) -> Option<[String; 3]>,
) -> String {
    let mut text = "frame,body,feature,x,y,z\n".to_owned();
    for frame in 0..frames {
        for (body, name) in bodies.iter().enumerate() {
            for feature in 0..features {
                if let Some([x, y, z]) = sample(frame, body, feature) {
                    writeln!(text, "{frame},{name},{feature},{x},{y},{z}").expect("a text grows");
                }
            }
        }
    }
    text
}

/// Bodies that turn about parallel axes: the first rests, every further one turns faster.
pub(crate) fn turning(frame: usize, body: usize, feature: usize) -> [f64; 3] {
    let [x, y, z] = SHAPE[feature % SHAPE.len()];
    let (sine, cosine) = (0.1 * (frame * body) as f64).sin_cos();
    [body as f64 + x * cosine - y * sine, x * sine + y * cosine, z]
}

pub(crate) fn shown(xyz: [f64; 3]) -> [String; 3] {
    xyz.map(|x| x.to_string())
}

/// A wall and a door that turns by 63 degrees.
pub(crate) fn door() -> String {
    table(&["wall", "door"], 12, 4, |frame, body, feature| Some(shown(turning(frame, body, feature))))
}

/// The door with one cell of line 32 replaced.
pub(crate) fn door_with(cell: &str) -> String {
    table(&["wall", "door"], 12, 4, |frame, body, feature| {
        let mut sample = shown(turning(frame, body, feature));
        if (frame, body, feature) == (3, 1, 2) {
            cell.clone_into(&mut sample[0]);
        }
        Some(sample)
    })
}

pub(crate) fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).expect("JSON")
}

/// The notes of the first pair, one per line.
pub(crate) fn notes(result: &serde_json::Value) -> String {
    let notes = result["pairs"][0]["notes"].as_array().expect("notes").iter();
    notes.map(|note| note.as_str().expect("text")).collect::<Vec<_>>().join("\n")
}

/// Runs a recording that is legal but decides nothing; gives the result after checking joint and doubt.
pub(crate) fn undecided(recording: &str, joint: &str, note: &str) -> serde_json::Value {
    let place = Place::with(recording);
    let table = place.done(&RUN);
    assert!(table.contains(&format!("{joint} ?")) && table.contains(note), "{table}");
    let result = json(&place.done(&RUN_JSON));
    let pair = &result["pairs"][0];
    assert_eq!((pair["joint"].as_str(), pair["determined"].as_bool()), (Some(joint), Some(false)));
    assert!(notes(&result).contains(note), "{}", notes(&result));
    result
}
