//! A detection as text: a table for people, JSON for programs.

mod json;
mod printable;
mod table;

pub use json::to_json;
pub use printable::printable;
pub use table::to_table;
