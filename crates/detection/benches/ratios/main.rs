//! Speed as ratios: ours beside the floor, which is reading memory once, and beside what others would use.
//!
//! All that is compared takes turns, A B A B …, within one run, and the medians of the ratios of the rounds count. Results
//! are compared before times are: a number without equal results does not count.
//!
//! ```sh
//! cargo build --release -p jointscope-cli && cargo bench -p jointscope-detection --bench ratios [-- GROUP ...] [--write]
//! ```
//!
//! `--write` writes `docs/performance.md`, unless memory was disturbed too much. Peers outside this program, numpy, scipy
//! and Eigen, are left out by name where they are absent.

mod alternation;
mod document;
mod doublings;
mod floor;
mod likelihood;
mod live;
mod long;
mod peer;
mod program;
mod registration;
mod row;
mod scale;
#[path = "../peers/svd.rs"]
mod svd;
mod thesis;

use std::process::ExitCode;

use document::Document;

/// A group of rows, by the name that selects it.
type Group = (&'static str, fn(&mut Document));

const GROUPS: [Group; 8] = [
    ("registration", registration::measure),
    ("thesis", thesis::measure),
    ("scale", scale::measure),
    ("long", long::measure),
    ("live", live::measure),
    ("likelihood", likelihood::measure),
    ("program", program::measure),
    ("doublings", doublings::measure),
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // Tests build and start every bench, and only a bench is asked to measure.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return ExitCode::SUCCESS;
    }
    let write = arguments.iter().any(|argument| argument == "--write");
    let chosen: Vec<&String> = arguments.iter().filter(|argument| !argument.starts_with("--")).collect();
    if let Some(unknown) = chosen.iter().find(|name| GROUPS.iter().all(|(known, _)| known != **name)) {
        eprintln!("there is no group `{unknown}`: needed {}", GROUPS.map(|(name, _)| name).join(", "));
        return ExitCode::FAILURE;
    }
    if write && !chosen.is_empty() {
        eprintln!("--write needs all groups: leave out {}", chosen[0]);
        return ExitCode::FAILURE;
    }
    let mut document = Document::default();
    for (name, measure) in GROUPS {
        if chosen.is_empty() || chosen.iter().any(|chosen| *chosen == name) {
            measure(&mut document);
        }
    }
    println!("{}", document.tables());
    if !write {
        return ExitCode::SUCCESS;
    }
    match document.write() {
        Ok(path) => {
            println!("written: {}", path.display());
            ExitCode::SUCCESS
        }
        Err(reason) => {
            eprintln!("not written: {reason}");
            ExitCode::FAILURE
        }
    }
}
