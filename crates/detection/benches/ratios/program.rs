//! S10: the whole program on W3 in a file, and loading it alone from an archive and from a table.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use jointscope_motion::Body;
use jointscope_recordings::{ReadOptions, read, write_csv, write_npz};
use jointscope_scenes::workloads::kitchen;

use crate::alternation::{Contestant, FEW_ROUNDS, ROUNDS, alternate, seconds_waited};
use crate::document::Document;
use crate::row::{Row, Wanted};
use crate::thesis::numbers;

/// Pairs that numpy judges in a round.
const PAIRS_OF_NUMPY: usize = 4;

/// The program, where cargo puts it beside this bench.
fn program() -> Option<PathBuf> {
    let bench = std::env::current_exe().ok()?;
    let path = bench.parent()?.parent()?.join(format!("cli{}", std::env::consts::EXE_SUFFIX));
    path.exists().then_some(path)
}

fn seconds(command: &mut Command) -> f64 {
    command.stdout(Stdio::null()).stderr(Stdio::null());
    seconds_waited(|| assert!(command.status().expect("starts").success(), "{command:?}"))
}

pub(crate) fn measure(document: &mut Document) {
    let recording = kitchen(50, 1000, 40, 1003).expect("a workload").recording;
    let folder = tempfile::tempdir().expect("a folder of temporary files");
    let (archive, table) = (folder.path().join("w3.npz"), folder.path().join("w3.csv"));
    write_npz(&recording, File::create(&archive).expect("a file")).expect("written");
    write_csv(&recording, &mut File::create(&table).expect("a file")).expect("written");
    let load = |path: &Path| read(path, &ReadOptions::default()).expect("the file just written");
    let floor = numbers(&recording);
    let loaded = load(&archive);
    // The format numbers features over all bodies, and keeps everything else.
    let kept = numbers(&loaded) == floor
        && loaded.frame_numbers() == recording.frame_numbers()
        && loaded.times() == recording.times()
        && loaded.bodies().iter().map(Body::name).eq(recording.bodies().iter().map(Body::name));
    drop(loaded);
    let fault = |kept: bool| (!kept).then(|| "what is read is not what was written".to_owned());
    let (of_archive, of_table) = (fault(kept), fault(load(&table) == recording));
    let Some(program) = program() else {
        document.absent("the program (build it: cargo build --release -p jointscope-cli)".into());
        return;
    };
    let start = || seconds(Command::new(&program).arg("--version"));
    let contestants = vec![
        Contestant::new("cat", || seconds(Command::new("cat").arg(&archive))),
        Contestant::new("wc", || seconds(Command::new("wc").arg("-l").arg(&table))),
        Contestant::new("start", start),
        Contestant::awaited("load the archive", || drop(load(&archive))),
        Contestant::new("start and load the archive", || start() + seconds_waited(|| drop(load(&archive)))),
        Contestant::new("start and load the table", || start() + seconds_waited(|| drop(load(&table)))),
    ];
    let times = alternate(document, "start and load", ROUNDS, &floor, contestants);
    let mut row = |what: &str, wanted, unit, measured, fault, bound| {
        document.row(Row { goal: "S10", what: what.into(), wanted, unit, measured, fault, bound });
    };
    if let Some(measured) = times.ratio("start and load the archive", "cat") {
        let what = "starting the program and loading W3.npz, by `cat` of the file";
        let bound = "pages of memory for the positions, which the system gives one by one";
        row(what, Wanted::AtMost(3.0), "×", measured, of_archive, bound);
    }
    if let Some(measured) = times.ratio("start and load the table", "wc") {
        let what = "starting the program and loading W3.csv, 2 million rows, by `wc -l` of the file";
        row(what, Wanted::Nothing, "×", measured, of_table, "");
    }
    for (name, what) in [
        ("start", "start alone"),
        ("load the archive", "loading W3.npz alone"),
        ("start and load the table", "starting and loading W3.csv"),
    ] {
        if let Some(measured) = times.seconds(name) {
            row(what, Wanted::Nothing, "ms", measured.times(1e3), None, "");
        }
    }
    whole(document, &program, &archive, &floor);
}

/// The program from start to table beside numpy's script on the same file.
fn whole(document: &mut Document, program: &Path, path: &Path, floor: &[f64]) {
    const PAIRS: usize = 1225;
    let thesis = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/thesis.toml");
    let run = || {
        let mut command = Command::new(program);
        command.args(["run", "--quiet", "--config"]).arg(&thesis).arg("--input").arg(path);
        command
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/thesis.py");
    // The script judges as many pairs as its requests name; one request for none is its start and its loading.
    let numpy = |pairs: usize| {
        let mut command = Command::new("sh");
        command.arg("-c").arg(format!("echo {pairs} | python3 {script} {}", path.display()));
        command.env("OMP_NUM_THREADS", "1").env("OPENBLAS_NUM_THREADS", "1");
        command
    };
    if !numpy(1).stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success()) {
        document.absent("thesis.py (what it needs is absent)".into());
        return;
    }
    let contestants = vec![
        Contestant::new("ours", || seconds(&mut run())),
        Contestant::new("numpy", || {
            let (one, some) = (seconds(&mut numpy(1)), seconds(&mut numpy(1 + PAIRS_OF_NUMPY)));
            one + (some - one) / PAIRS_OF_NUMPY as f64 * (PAIRS - 1) as f64
        }),
    ];
    let times = alternate(document, "whole program", FEW_ROUNDS, floor, contestants);
    if let Some(measured) = times.ratio("numpy", "ours") {
        document.row(Row {
            goal: "S10",
            what: "the whole program on W3.npz, all cores: numpy's script, from 5 pairs, by ours".into(),
            wanted: Wanted::AtLeast(50.0),
            unit: "×",
            measured,
            fault: None,
            bound: "detection",
        });
    }
}
