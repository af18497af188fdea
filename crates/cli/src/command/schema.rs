//! `schema`: what configurations look like, for editors.

use clap::Args;
use jointscope_detection::schema;

use super::catalog;
use crate::{failure::Failure, output};

/// Print the JSON schema of configurations, with all linked models, by which editors complete and check them
#[derive(Debug, Args)]
pub(crate) struct Arguments {}

pub(crate) fn run(_: &Arguments) -> Result<(), Failure> {
    output::print(&format!("{:#}\n", schema::of_configuration(&catalog()?)))
}
