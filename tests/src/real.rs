//! Real recordings made by others, and the truth about them as far as it is known.

mod cases;
mod known;
mod mat;
mod mha;
mod misses;
mod outcome;
mod page;
mod pickle;
mod transform;
mod trolley;

use std::path::PathBuf;

pub use cases::{Case, Truth, cases};
pub use misses::EXPLANATIONS;
pub use outcome::{Outcome, analyse, outcomes, text};
pub use page::page;

/// The folder of real recordings: `JOINTSCOPE_REAL_DATA`, or `shared/data/real` beside the project; `None`, said
/// aloud, where it is absent.
pub fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("JOINTSCOPE_REAL_DATA")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/real")), PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("SKIPPED: the real recordings are absent; set JOINTSCOPE_REAL_DATA to their folder");
    None
}
