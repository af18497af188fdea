//! A detection as text, pictures, pages and robot descriptions: a table for people, JSON for programs.

mod html;
mod joint_motion;
mod json;
#[cfg(feature = "mcap")]
mod live;
mod outlook;
mod pair_view;
mod picture;
mod printable;
mod report;
mod robot;
mod table;
mod tree;
mod words;

pub use html::to_html;
pub use json::to_json;
#[cfg(feature = "mcap")]
pub use live::to_mcap;
pub use picture::{pairs_to_svg, to_svg};
pub use printable::printable;
pub use report::Report;
pub use robot::{to_mjcf, to_urdf};
pub use table::{Style, to_styled_table, to_table};
