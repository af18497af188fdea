//! `man`: manual pages.

use std::path::{Path, PathBuf};

use clap::{Args, CommandFactory};
use clap_mangen::Man;

use crate::{failure::Failure, output};

/// Print the manual page, or write those of all commands into a folder
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Write jointscope.1 and a page for every command into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut program = crate::Arguments::command();
    program.build();
    let Some(folder) = &arguments.out else {
        return output::print(&String::from_utf8_lossy(&page(program)?));
    };
    output::make_folder(folder)?;
    let mut pages = vec![(folder.join("jointscope.1"), page(program.clone())?)];
    for command in program.get_subcommands().filter(|command| command.get_name() != "help") {
        let name = format!("jointscope-{}", command.get_name());
        pages.push((folder.join(format!("{name}.1")), page(command.clone())?));
    }
    let files: Vec<(&Path, &[u8])> = pages.iter().map(|(path, page)| (path.as_path(), page.as_slice())).collect();
    output::write_files(&files)
}

fn page(command: clap::Command) -> Result<Vec<u8>, Failure> {
    let mut page = Vec::new();
    Man::new(command).render(&mut page).map_err(Failure::data)?;
    Ok(page)
}
