//! A detection as text: a table for people, JSON for programs.

mod explanation;
mod json;
mod printable;
mod table;

pub use explanation::to_explanation;
pub use json::to_json;
pub use printable::printable;
pub use table::to_table;
