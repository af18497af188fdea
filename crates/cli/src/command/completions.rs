//! `completions`: what a shell needs to complete the program's words.

use clap::{Args, CommandFactory};
use clap_complete::{Shell, generate};

use crate::{failure::Failure, output, program_name};

/// Print completions for a shell
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The shell
    #[arg(value_enum, value_name = "SHELL")]
    shell: Shell,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut script = Vec::new();
    generate(arguments.shell, &mut crate::Arguments::command(), program_name(), &mut script);
    output::print(&String::from_utf8_lossy(&script))
}
