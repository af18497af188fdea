//! The jointscope program, as a library.
//!
//! A program with further joint models is one that links their crate:
//!
//! ```no_run
//! // use my_joints as _;
//! fn main() -> std::process::ExitCode {
//!     jointscope_cli::main()
//! }
//! ```

mod command;
mod failure;
mod output;
mod place;
mod terminal;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use jointscope_motion::Instructions;
use jointscope_report::printable;

use crate::failure::Failure;

/// Finds the joints of things by watching them move.
#[derive(Debug, Parser)]
#[command(name = "jointscope", bin_name = program_name(), version, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Run(command::run::Arguments),
    Models(command::models::Arguments),
    Init(command::init::Arguments),
    Check(command::check::Arguments),
    Schema(command::schema::Arguments),
    Inspect(command::inspect::Arguments),
    Convert(command::convert::Arguments),
    Simulate(command::simulate::Arguments),
    Reproduce(command::reproduce::Arguments),
    Evaluate(command::evaluate::Arguments),
    Completions(command::completions::Arguments),
    Man(command::man::Arguments),
}

/// The program: reads the command line, does what it says, and tells how it went.
///
/// Exit codes: 0 done; 1 the data could not be read or processed; 2 wrong usage or configuration.
pub fn main() -> ExitCode {
    failure::set_style();
    let arguments = Arguments::parse();
    choose_instructions().and_then(|()| run(&arguments.command)).map_or_else(Failure::report, |()| ExitCode::SUCCESS)
}

fn run(command: &Command) -> Result<(), Failure> {
    match command {
        Command::Run(arguments) => command::run::run(arguments),
        Command::Models(arguments) => command::models::run(arguments),
        Command::Init(arguments) => command::init::run(arguments),
        Command::Check(arguments) => command::check::run(arguments),
        Command::Schema(arguments) => command::schema::run(arguments),
        Command::Inspect(arguments) => command::inspect::run(arguments),
        Command::Convert(arguments) => command::convert::run(arguments),
        Command::Simulate(arguments) => command::simulate::run(arguments),
        Command::Reproduce(arguments) => command::reproduce::run(arguments),
        Command::Evaluate(arguments) => command::evaluate::run(arguments),
        Command::Completions(arguments) => command::completions::run(arguments),
        Command::Man(arguments) => command::man::run(arguments),
    }
}

/// Takes the instructions that the environment asks for, such that a run of another machine can be repeated on this one.
fn choose_instructions() -> Result<(), Failure> {
    const VARIABLE: &str = "JOINTSCOPE_INSTRUCTIONS";
    let Some(wanted) = std::env::var_os(VARIABLE).filter(|wanted| !wanted.is_empty()) else { return Ok(()) };
    let here = Instructions::here();
    if here.iter().any(|set| wanted == set.name() && set.choose()) {
        return Ok(());
    }
    let names = here.iter().map(|set| set.name()).collect::<Vec<_>>().join(", ");
    let wanted = printable(&wanted.to_string_lossy());
    let help = format!("this machine has {names}; unset {VARIABLE} to use the best of them");
    Err(Failure::usage_with_help(
        format!("{VARIABLE} is `{wanted}`, which names no instructions of this machine"),
        &help,
    ))
}

/// The name the program was called by, for its help texts.
fn program_name() -> String {
    let called = std::env::args_os().next().map(std::path::PathBuf::from);
    let name = called.as_deref().and_then(|path| path.file_stem()).map(|name| name.to_string_lossy().into_owned());
    name.unwrap_or_else(|| "jointscope".into())
}
