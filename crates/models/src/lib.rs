//! Joint models: hypotheses about how one body may move relative to another, and the catalog of all that are linked.
//!
//! A joint model is a struct of settings that implements [`JointModel`], one method, and is registered by one line:
//!
//! ```
//! use jointscope_models::{Confidence, FitError, Joint, JointFit, JointModel, joint_model};
//! use jointscope_motion::RelativeMotion;
//! use schemars::JsonSchema;
//! use serde::{Deserialize, Serialize};
//!
//! /// Holds while the moving body stays within reach.
//! #[derive(Debug, Serialize, Deserialize, JsonSchema)]
//! #[serde(default, deny_unknown_fields)]
//! struct Leash {
//!     /// Length of the leash in metres.
//!     #[schemars(extend("exclusiveMinimum" = 0.0))]
//!     length: f64,
//! }
//!
//! impl Default for Leash {
//!     fn default() -> Self {
//!         Self { length: 1.0 }
//!     }
//! }
//!
//! joint_model!(Leash, "leash", "stays within a distance of where it started");
//!
//! impl JointModel for Leash {
//!     fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
//!         let travel = motion.net_lengths().relative;
//!         let confidence = Confidence::new(if travel <= self.length { 1.0 } else { 0.0 })?;
//!         Ok(JointFit::new(confidence, Joint::default()).with_part("travel", travel))
//!     }
//!
//!     fn parts(&self) -> &'static [&'static str] {
//!         &["travel"]
//!     }
//! }
//!
//! let catalog = jointscope_models::Catalog::linked()?;
//! assert!(catalog.names().any(|name| name == "leash"));
//! # Ok::<(), jointscope_models::CatalogError>(())
//! ```
//!
//! A program uses the models of a crate by naming it: `use my_joints as _;`. Without that line the linker drops the
//! crate and its models with it.
//!
//! # Conventions
//! Metres, radians; axes in the coordinates of the reference body; positions of a joint are 0 at the first frame.

mod catalog;
mod confidence;
pub mod conformance;
mod fit;
pub mod lower_pair;
mod plugin;
pub mod point_path;
mod rival;
pub mod settings;
pub mod thesis;

pub use catalog::{Catalog, CatalogError};
pub use confidence::{Confidence, NotAConfidence};
pub use fit::{Axis, AxisUncertainty, Departure, Evidence, FitError, Joint, JointFit, Mobility, Positions};
pub use plugin::{JointModel, JointModelPlugin, Origin};
pub use rival::Rival;

pub use {inventory, jointscope_motion as motion, toml};
