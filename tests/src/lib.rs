//! What the tests share, and joint models written outside the project's crates.

pub mod common_centre;
pub mod gantry;
pub mod real;

use jointscope_detection::{Configuration, Detector};
use jointscope_models::Catalog;

/// The thesis's own profile.
pub const THESIS: &str = include_str!("../../configs/thesis.toml");

/// A detector by a configuration text.
///
/// # Panics
/// If the text is no configuration.
pub fn detector(text: &str) -> Detector {
    let catalog = Catalog::linked().expect("unique names");
    Detector::new(Configuration::parse(text, &catalog).expect("a valid configuration"))
}
