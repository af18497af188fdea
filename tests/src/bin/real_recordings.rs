//! Prints `docs/real-recordings.md`; with `--text [PART OF A CASE'S NAME] [--config FILE]` one line per case instead.

use std::process::ExitCode;

use jointscope_tests::{detector, real};

fn main() -> ExitCode {
    let Some(folder) = real::folder() else { return ExitCode::FAILURE };
    let mut arguments = std::env::args().skip(1).peekable();
    let (mut text, mut config) = (None, String::new());
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--text" => text = Some(arguments.next_if(|part| !part.starts_with("--")).unwrap_or_default()),
            "--config" => {
                let file = arguments.next().expect("a file after --config");
                config = std::fs::read_to_string(file).expect("a readable configuration");
            }
            other => {
                eprintln!("`{other}` is not understood; use --text [PART OF A CASE'S NAME] [--config FILE]");
                return ExitCode::FAILURE;
            }
        }
    }
    match text {
        Some(part) => print!("{}", real::text(&folder, &part, &detector(&config))),
        None => print!("{}", real::page(&real::outcomes(&folder))),
    }
    ExitCode::SUCCESS
}
