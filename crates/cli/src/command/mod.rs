//! The commands, one file each.

pub(crate) mod check;
pub(crate) mod completions;
pub(crate) mod convert;
pub(crate) mod evaluate;
mod explain;
pub(crate) mod init;
pub(crate) mod inspect;
pub(crate) mod man;
pub(crate) mod models;
pub(crate) mod reproduce;
pub(crate) mod run;
pub(crate) mod schema;
pub(crate) mod simulate;

use std::ops::Range;

use jointscope_models::{
    Catalog,
    settings::{self, SettingsError},
};
use jointscope_recordings::RecordingError;
use jointscope_scenes::names;

use crate::failure::Failure;

/// The linked joint models; two of one name are a fault of how the program was put together.
fn catalog() -> Result<Catalog, Failure> {
    Catalog::linked().map_err(Failure::usage)
}

/// A scene that does not exist, named at a place of the configuration.
fn unknown_scene(name: &str, place: Range<usize>) -> SettingsError {
    let known: Vec<&str> = names().into_iter().map(|(name, _)| name).collect();
    settings::unknown("scene", name, place, &known)
}

/// A body of a scene that turns too fast to be followed.
fn too_fast(body: &str, degrees: f64) -> String {
    format!(
        "body `{body}` turns by {degrees:.0} degrees from one frame to the next; only less than 180 can be followed"
    )
}

/// A recording that the command line names and that cannot be read.
fn unread(error: RecordingError) -> Failure {
    match error {
        RecordingError::UnknownExtension { .. } => {
            Failure::data_with_help(error, "give, for example, --input-format csv")
        }
        _ => Failure::data(error),
    }
}

/// Reads a word of the command line that stands for something.
fn named<T: std::str::FromStr<Err: std::fmt::Display>>(word: &str) -> Result<T, String> {
    word.parse().map_err(|error: T::Err| error.to_string())
}
