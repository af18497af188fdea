//! The document that the measurement writes.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{fs, process};

use jointscope_motion::Instructions;

use crate::alternation::Spread;
use crate::row::{Row, short};

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/performance.md");

/// What a doubling of something costs.
pub(crate) struct Doubling {
    pub what: String,
    pub from: String,
    pub to: String,
    pub time: f64,
    pub factor: Spread,
}

#[derive(Default)]
pub(crate) struct Document {
    rows: Vec<Row>,
    doublings: Vec<Doubling>,
    absent: Vec<String>,
    disturbed: Vec<String>,
}

impl Document {
    pub(crate) fn row(&mut self, row: Row) {
        println!("{}", row.line());
        self.rows.push(row);
    }

    pub(crate) fn doubling(&mut self, doubling: Doubling) {
        self.doublings.push(doubling);
    }

    /// A peer that is not there.
    pub(crate) fn absent(&mut self, peer: String) {
        eprintln!("left out: {peer}");
        if !self.absent.contains(&peer) {
            self.absent.push(peer);
        }
    }

    pub(crate) fn disturbed(&mut self, what: String) {
        eprintln!("remark: {what}");
        self.disturbed.push(what);
    }

    /// The tables, and the remarks about them.
    pub(crate) fn tables(&self) -> String {
        let mut text = String::new();
        if !self.rows.is_empty() {
            text += "| goal | what | wanted | measured (middle 80 %) | |\n|---|---|---|---|---|\n";
            let mut rows: Vec<&Row> = self.rows.iter().collect();
            rows.sort_by_key(|row| row.goal[1..].parse::<u32>().unwrap_or(0));
            for row in rows {
                text += &(row.line() + "\n");
            }
        }
        if !self.doublings.is_empty() {
            text +=
                "\n| doubled | from | to | time before, ms | times as long (middle 80 %) |\n|---|---|---|---|---|\n";
            for Doubling { what, from, to, time, factor } in &self.doublings {
                let [median, low, high] = [factor.median, factor.low, factor.high].map(short);
                let time = short(1e3 * time);
                let _ = writeln!(text, "| {what} | {from} | {to} | {time} | {median} ({low} to {high}) |");
            }
        }
        for peer in &self.absent {
            let _ = writeln!(text, "\nLeft out, because it is absent here: {peer}.");
        }
        for remark in &self.disturbed {
            let _ = writeln!(text, "\nRemark: {remark}.");
        }
        text
    }

    /// Writes the document, unless memory was disturbed.
    pub(crate) fn write(&self) -> Result<PathBuf, String> {
        if let Some(remark) = self.disturbed.first() {
            return Err(format!("{remark}; measure again when the machine is quieter"));
        }
        let path = Path::new(PATH).to_owned();
        let text = format!("{INTRODUCTION}\nMeasured on {}.\n\n{}\n{EXPLANATION}", machine(), self.tables());
        fs::write(&path, text).map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(path)
    }
}

/// Processor, cores and compiler.
fn machine() -> String {
    let processor = fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("model name"))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    });
    let processor = processor.unwrap_or_else(|| format!("a processor of kind {}", std::env::consts::ARCH));
    let instructions = Instructions::here().last().map_or("scalar", |set| set.name());
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let compiler = process::Command::new("rustc").arg("--version").output();
    let compiler =
        compiler.map_or_else(|_| "rustc".into(), |found| String::from_utf8_lossy(&found.stdout).into_owned());
    format!("{processor} ({instructions}), {cores} cores, {}", compiler.trim())
}

const INTRODUCTION: &str = "\
# Performance

This page is written by

```sh
cargo build --release -p jointscope-cli && cargo bench -p jointscope-detection --bench ratios -- --write
```

Times depend on the machine and on who else uses it; ratios hardly do. What is compared takes turns within one run, round
after round, each beside the *floor*, which is reading memory once; the medians of the ratios of the rounds count. Times
are those that a process computes; where threads or whole programs are compared, those that one waits. A round counts
where the floor at its start and at its end is within 15 % of its median; where too few do, the page is not written.
W2, which is quick, is done once by both before it is timed, lest it count what others left in caches.
Before anything is timed its results are compared: with the scalar solve and nalgebra's singular value
decomposition for registrations, with numpy for the thesis's scores, and between numbers of threads.
";

const EXPLANATION: &str = "\
Workloads: W1 is 100 000 frames of 50 features of one body; W2 is one hinge, 437 frames of 40 features; W3 is 50 bodies,
1225 pairs, 1000 frames of 40 features; W4 is W2 with the second body seen at 1/0.94 of its scale; W5 is a hinge of 100 000
frames of 100 features. Thesis scores are those of `configs/thesis.toml`, beside numpy with every frame
registered to the first, as the script there does it. Peers are in `crates/detection/benches/peers`.

`cargo bench -p jointscope-detection --bench workloads` measures the same workloads with criterion, for work on one of
them.
";
