//! Finds the joint between every pair of bodies of a recording: the front door of the library.
//!
//! ```
//! use jointscope_detection::{Configuration, Detector};
//! use jointscope_models::Catalog;
//! use jointscope_motion::{Body, Pose, Recording, nalgebra::Vector3};
//!
//! // A door that opens by 1.2 rad about the z axis, seen as poses.
//! let poses = (0..60).map(|i| Some(Pose::rotation(Vector3::z() * 0.02 * f64::from(i)))).collect();
//! let recording = Recording::new((0..60).collect(), None, vec![Body::from_poses("door", poses)?])?;
//!
//! let detector = Detector::new(Configuration::parse("", &Catalog::linked()?)?);
//! let detection = detector.detect(recording, None)?;
//! let door = &detection.pairs[0];
//! assert_eq!((door.reference.as_str(), door.verdict.joint.as_str()), ("world", "revolute"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bodies;
mod builder;
mod configuration;
mod detection;
mod detector;
mod error;
mod kind;
mod live;
mod pairs;
pub mod place;
mod remarks;
mod scale;
pub mod schema;
pub mod starter;
mod structure;
mod watched;

pub use bodies::Bodies;
pub use builder::ConfigurationBuilder;
pub use configuration::{Configuration, NamedModel, OutputSettings, RecordingSettings};
pub use detection::{Detection, ModelFinding, PairDetection};
pub use detector::Detector;
pub use error::DetectionError;
pub use kind::JointKind;
pub use live::LiveDetector;
pub use scale::{PairScale, ScaleCurve, ScaleSearch, ScaleSettings, ScaledBody};
pub use structure::{Branch, Coupling, Indirect, Structure};

pub use jointscope_models::settings::SettingsError;
pub use jointscope_scoring::{Account, Explanation, Quantity, RuleError, RuleKind, ScoringSettings};
