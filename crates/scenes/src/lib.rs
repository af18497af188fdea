//! Synthetic recordings of jointed bodies, with ground truth.
//!
//! ```
//! use jointscope_scenes::{SceneOptions, simulate};
//!
//! let options = SceneOptions { seed: 7, noise: Some(0.001), ..SceneOptions::default() };
//! let simulation = simulate("revolute", &options)?;
//! assert_eq!(simulation.recording.frames(), 50);
//! assert_eq!(simulation.truth.pairs[0].joint, "revolute");
//! # Ok::<(), jointscope_scenes::SceneError>(())
//! ```
//!
//! | module | what it makes |
//! |---|---|
//! | `joint`, `chain` | the kinematics of every kind of joint; the joint between any two bodies of a tree |
//! | `law` | joint positions over time: strokes, swings, smooth random motion, paths on a floor |
//! | `scene`, `simulation` | bodies, shapes and attachments put together; the recording they make |
//! | `departure` | joints that are not ideal: play and bends |
//! | `sensor` | noise, drift, wild samples, dropouts, and what a monocular camera does to depth |
//! | `tracker` | bodies seen as poses: their noise, wild poses, flips |
//! | `filter` | what a low-pass filter makes of a recording |
//! | `truth` | what is true of a recording, to be written beside it as `truth.json` |
//! | `nominal`, `table2`, [`experiments`] | the named scenes |
//! | [`workloads`] | large recordings for measuring speed |
//!
//! # Conventions
//! * Metres, seconds, radians; the camera is at the origin and looks along +z, x to the right and y down.
//! * A body's coordinates coincide with the recording's coordinates at frame 0, so every pose of frame 0 is the
//!   identity, and axes need no translation between bodies.
//! * Joint positions count from frame 0: q(0) = 0. Angles come before lengths.
//! * A recording is a function of the scene, its options and the seed. Noise, dropouts, shapes and motions draw from
//!   streams of their own, so changing one option leaves everything else as it was.

mod catalog;
mod chain;
mod departure;
mod error;
pub mod experiments;
mod filter;
mod joint;
pub mod law;
mod nominal;
mod options;
mod scene;
mod sensor;
mod simulation;
mod table2;
mod tracker;
mod truth;
pub mod workloads;

pub use catalog::{names, scene, simulate};
pub use error::SceneError;
pub use experiments::{EXPERIMENTS, Experiment, PrintedPair};
pub use joint::{Joint, JointKind};
pub use options::{BodyShape, SceneOptions};
pub use scene::{Attachment, Scene, SceneBody, Shape};
pub use sensor::Sensor;
pub use simulation::Simulation;
pub use truth::{BodyTruth, PairTruth, Positions, TrueAxis, Truth};
