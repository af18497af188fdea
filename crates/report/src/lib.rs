//! A detection as text, pictures, pages and robot descriptions: a table for people, JSON for programs.
//!
//! ```
//! use jointscope_detection::{Configuration, Detector};
//! use jointscope_models::Catalog;
//! use jointscope_models::motion::{Body, Pose, Recording, nalgebra::Vector3};
//! use jointscope_report::{to_explanation, to_json, to_table};
//!
//! let poses = (0..60).map(|i| Some(Pose::rotation(Vector3::z() * 0.02 * f64::from(i)))).collect();
//! let recording = Recording::new((0..60).collect(), None, vec![Body::from_poses("door", poses)?])?;
//! let detector = Detector::new(Configuration::parse("", &Catalog::linked()?)?);
//! let mut detection = detector.detect(recording, None)?;
//!
//! let table = to_table(&detection);
//! assert!(table.contains("world") && table.contains("revolute"));
//! detection.pairs[0].explanation = Some(detector.explain(&detection.pairs[0]));
//! assert!(to_explanation(&detection.pairs[0]).contains("revolute costs least"));
//! assert!(to_json(&detection).contains("\"explanation\": {"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod explanation;
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

pub use explanation::to_explanation;
pub use html::to_html;
pub use json::to_json;
#[cfg(feature = "mcap")]
pub use live::to_mcap;
pub use picture::{pairs_to_svg, to_svg};
pub use printable::printable;
pub use report::Report;
pub use robot::{to_mjcf, to_urdf};
pub use table::{Style, to_styled_table, to_table};
