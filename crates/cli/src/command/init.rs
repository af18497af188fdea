//! `init`: a configuration to start from.

use clap::{Args, builder::PossibleValue};
use jointscope_detection::starter::{self, PROFILES};

use super::catalog;
use crate::{failure::Failure, output};

/// Print a configuration with every key, its default and what it does
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// What it is for
    #[arg(long, default_value = PROFILES[0].name, value_parser = profiles())]
    profile: String,
}

/// The names of the profiles, with their summaries.
fn profiles() -> Vec<PossibleValue> {
    PROFILES.iter().map(|profile| PossibleValue::new(profile.name).help(profile.summary)).collect()
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let profile = PROFILES.iter().find(|profile| profile.name == arguments.profile).unwrap_or(&PROFILES[0]);
    output::print(&starter::text(profile, &catalog()?))
}
