//! Instructions that the main paths take, as `valgrind` counts them, compared with those in `instructions.txt`.
//!
//! ```sh
//! cargo bench -p jointscope-benches --bench instructions [-- CASE ...] [--write]
//! ```
//!
//! Unlike times, counts hardly depend on the machine and not on who else uses it. Every case is done once and several
//! times, in processes of their own, and the difference counts: neither the start nor the preparation. Valgrind knows no
//! AVX-512, so that what chooses its instructions at run time takes those for AVX2 at most.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::hint::black_box;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use jointscope_detection::{Configuration, Detector};
use jointscope_models::Catalog;
use jointscope_motion::{Recording, register_frames};
use jointscope_recordings::{Unit, csv_table, npz, write_csv, write_npz};
use jointscope_scenes::workloads::{hinge, kitchen, registrations};
use jointscope_scenes::{SceneOptions, simulate};

/// By how much a count may exceed the one noted, as a share of it. Hashes that begin with random numbers move the counts
/// by 0.1 %, a C library that takes other instructions for memory and functions, as it does on other processors, by 2.5 %.
const TOLERANCE: f64 = 0.05;

/// How many times more the case is done in the second process.
const TIMES: u64 = 2;

/// Something to be done, once it is prepared.
type Work = Box<dyn FnMut()>;

/// A name, and what prepares the work.
type Case = (&'static str, fn() -> Work);

const CASES: [Case; 5] = [
    ("registration", registration),
    ("thesis", thesis),
    ("likelihood", likelihood),
    ("archive", archive),
    ("table", table),
];

/// 2000 frames of 50 features.
fn registration() -> Work {
    let work = registrations(2000, 50, 1001).expect("a workload");
    let shape: Vec<_> = work.reference.iter().copied().map(Some).collect();
    let mut poses = vec![None; work.tracks.frames()];
    Box::new(move || register_frames(&shape, black_box(&work.tracks), &mut poses))
}

/// A pair of bodies, 200 frames of 40 features, by the thesis's models.
fn thesis() -> Work {
    detection(include_str!("../configs/thesis.toml"), hinge(200, 40, 1002).expect("a workload").recording)
}

/// A hinge, 50 frames of 20 features, by likelihood.
fn likelihood() -> Work {
    let options = SceneOptions { seed: 1008, ..SceneOptions::default() };
    detection("", simulate("revolute", &options).expect("a scene").recording)
}

fn detection(configuration: &str, recording: Recording) -> Work {
    let catalog = Catalog::linked().expect("unique names");
    let detector = Detector::new(Configuration::parse(configuration, &catalog).expect("valid"));
    Box::new(move || {
        let found = detector.detect(recording.clone(), None).expect("two bodies");
        assert_eq!(found.pairs[0].verdict.joint, "revolute");
    })
}

/// 300 frames of 5 bodies with 20 features, from numpy's arrays.
fn archive() -> Work {
    let mut file = Cursor::new(Vec::new());
    write_npz(&sample(), &mut file).expect("written");
    let bytes = file.into_inner();
    Box::new(move || drop(npz::parse(black_box(&bytes), Path::new("sample.npz"), Unit::Metre).expect("sound")))
}

/// The same from a table: 30 000 rows.
fn table() -> Work {
    let mut bytes = Vec::new();
    write_csv(&sample(), &mut bytes).expect("written");
    Box::new(move || drop(csv_table::parse(black_box(&bytes), Path::new("sample.csv"), Unit::Metre).expect("sound")))
}

fn sample() -> Recording {
    kitchen(5, 300, 20, 1003).expect("a workload").recording
}

/// Where the counts are noted.
fn noted_in() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("instructions.txt")
}

/// What counts depend on beside the code: compiler, processor, and the instructions that valgrind lets it have.
fn conditions() -> Result<String, String> {
    let rustc = Command::new(std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into())).arg("--version").output();
    let rustc = rustc.map_err(|error| format!("rustc does not start: {error}"))?;
    let (_, instructions) = run("instructions", 0)?;
    Ok(format!("{}, {}, {instructions}", String::from_utf8_lossy(&rustc.stdout).trim(), std::env::consts::ARCH))
}

/// Instructions that this program executes for a case done so many times, and what it prints.
fn run(case: &str, times: u64) -> Result<(u64, String), String> {
    let program = std::env::current_exe().map_err(|error| format!("this program is not found: {error}"))?;
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(program)
        .args(["--count", case, &times.to_string()])
        .env("RAYON_NUM_THREADS", "1")
        .output()
        .map_err(|error| format!("valgrind does not start: {error}"))?;
    let told = String::from_utf8_lossy(&output.stderr);
    let count = told.lines().find_map(|line| line.split_once("Collected :")?.1.trim().parse().ok());
    match count.filter(|_| output.status.success()) {
        Some(count) => Ok((count, String::from_utf8_lossy(&output.stdout).trim().to_owned())),
        None => Err(format!("`{case}` under valgrind failed:\n{told}")),
    }
}

/// Does a case so many times, in the process that valgrind watches.
fn do_case(case: &str, times: &str) {
    if let Some((_, prepare)) = CASES.iter().find(|(name, _)| *name == case) {
        let mut work = prepare();
        (0..times.parse().unwrap_or(0_u64)).for_each(|_| work());
    } else {
        #[cfg(target_arch = "x86_64")]
        let names = [("avx512f", is_x86_feature_detected!("avx512f")), ("avx2", is_x86_feature_detected!("avx2"))];
        #[cfg(not(target_arch = "x86_64"))]
        let names: [(&str, bool); 0] = [];
        println!("{}", names.iter().find(|(_, there)| *there).map_or("no wide instructions", |(name, _)| name));
    }
}

/// What the file of counts says: the conditions, and the counts by case.
fn noted() -> Result<(String, BTreeMap<String, u64>), String> {
    let path = noted_in();
    let text =
        std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}; --write makes it", path.display()))?;
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let conditions = lines.next().unwrap_or_default().to_owned();
    let count = |line: &str| {
        let (case, count) = line.split_once(' ')?;
        Some((case.to_owned(), count.trim().parse().ok()?))
    };
    let counts = lines.map(|line| count(line).ok_or_else(|| format!("{}: `{line}` is no count", path.display())));
    Ok((conditions, counts.collect::<Result<_, _>>()?))
}

fn write(conditions: &str, counts: &[(&str, u64)]) -> Result<(), String> {
    let mut text = format!(
        "# Written by `cargo bench -p jointscope-benches --bench instructions -- --write`: compiler, processor and widest\n\
         # instructions, then instructions per case.\n{conditions}\n"
    );
    for (case, count) in counts {
        let _ = writeln!(text, "{case} {count}");
    }
    std::fs::write(noted_in(), text).map_err(|error| format!("{}: {error}", noted_in().display()))
}

fn measure(chosen: &[String], rewrite: bool) -> Result<ExitCode, String> {
    if let Some(unknown) = chosen.iter().find(|name| CASES.iter().all(|(known, _)| known != name)) {
        return Err(format!("there is no case `{unknown}`: needed {}", CASES.map(|(name, _)| name).join(", ")));
    }
    if rewrite && !chosen.is_empty() {
        return Err("--write needs all cases: leave out their names".into());
    }
    let here = conditions()?;
    let mut counts = Vec::new();
    for (case, _) in CASES.iter().filter(|(name, _)| chosen.is_empty() || chosen.iter().any(|chosen| chosen == name)) {
        counts.push((*case, (run(case, 1 + TIMES)?.0.saturating_sub(run(case, 1)?.0)) / TIMES));
    }
    if rewrite {
        write(&here, &counts)?;
    }
    let (there, noted) = noted()?;
    let mut more = Vec::new();
    println!("{here}\n\n{:<14}{:>14}{:>14}", "", "instructions", "noted");
    for (case, count) in counts {
        let Some(&before) = noted.get(case) else {
            return Err(format!("no count of `{case}` is noted: --write does it"));
        };
        let change = count as f64 / before as f64 - 1.0;
        println!("{case:<14}{count:>14}{before:>14}  {:+.1} %", 100.0 * change);
        if change > TOLERANCE {
            more.push(case);
        }
        if change < -TOLERANCE {
            println!("`{case}` takes fewer: note it with --write, so that it stays so");
        }
    }
    if more.is_empty() {
        return Ok(ExitCode::SUCCESS);
    }
    if here != there {
        println!("not comparable: the counts were noted with {there}; write them anew with --write");
        return Ok(ExitCode::SUCCESS);
    }
    Err(format!(
        "more than {:.0} % more instructions than noted: {}; find out why, or if it must be, note them with --write",
        100.0 * TOLERANCE,
        more.join(", ")
    ))
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [mark, case, times] = &arguments[..]
        && mark == "--count"
    {
        do_case(case, times);
        return ExitCode::SUCCESS;
    }
    // Tests build and start every bench, and only a bench is asked to measure.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return ExitCode::SUCCESS;
    }
    if Command::new("valgrind").arg("--version").output().is_err() {
        println!("valgrind: absent, instructions are not counted");
        return ExitCode::SUCCESS;
    }
    let chosen: Vec<String> = arguments.iter().filter(|argument| !argument.starts_with("--")).cloned().collect();
    measure(&chosen, arguments.iter().any(|argument| argument == "--write")).unwrap_or_else(|problem| {
        eprintln!("{problem}");
        ExitCode::FAILURE
    })
}
