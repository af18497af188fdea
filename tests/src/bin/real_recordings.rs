//! Prints `docs/real-recordings.md`.

use std::process::ExitCode;

use jointscope_tests::real;

fn main() -> ExitCode {
    let Some(folder) = real::folder() else { return ExitCode::FAILURE };
    print!("{}", real::page(&folder));
    ExitCode::SUCCESS
}
