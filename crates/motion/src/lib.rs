//! Bodies that move: tracked features or poses over frames, point-set registration, relative motion.
//!
//! Everything here is about *how bodies move*; nothing here knows what a joint is.
//!
//! ```text
//! Recording ─ Body ─┬─ Tracks (points)  ─ registration ─┐
//!                   └─ poses ───────────────────────────┴─ BodyMotion ─┐
//!                                                          BodyMotion ─┴─ RelativeMotion
//! ```
//!
//! # Conventions
//! * Metres, seconds, radians, `f64`.
//! * A [`Pose`] is named by its direction: `target_from_source` maps source coordinates to target coordinates.
//! * A body's coordinates coincide with the recording's coordinates at the body's first posed frame, so the pose
//!   `recording_from_body` of that frame is the identity.
//! * Frames are indices `0..T` into the recording; a missing sample or pose is `None`, never a number.

mod answers;
mod body;
mod body_motion;
mod columns;
mod depth;
mod depth_gain;
mod error;
mod extent;
mod flat_rows;
mod frame_by_frame;
mod growing;
mod instructions;
mod leaps;
mod line;
mod noise;
mod play;
mod pose_series;
mod poses;
mod prefetch;
mod quantile;
mod recording;
mod registration;
mod registration_in_lanes;
mod relative_motion;
mod robust;
mod rotation_in_lanes;
mod scale;
mod selection;
mod settings;
mod settled;
mod start;
mod tracked;
mod tracks;
pub mod twist;
mod uncertainty;
mod whitening;

pub use body::{Body, Observation};
pub use body_motion::{BodyMotion, Noise, Outlier};
pub use columns::{Columns, Rows, Summary};
pub use depth_gain::{DepthGain, Undone, undo_depth_gain};
pub use error::MotionError;
pub use extent::{Extents, extent, extent_of_rows, farthest_of_rows, path_length, path_length_of_rows};
pub use frame_by_frame::FrameByFrame;
pub use growing::GrowingRecording;
pub use instructions::{Instructions, arch, sum_of_lanes};
pub use leaps::{Leaps, leaps};
pub use noise::Deformation;
pub use play::Play;
pub use pose_series::{End, PoseSeries, Start};
pub use quantile::quantile;
pub use recording::Recording;
pub use registration::{RegistrationError, register};
pub use registration_in_lanes::register_frames;
pub use relative_motion::{Lengths, RelativeMotion, RelativeMotionError, Trajectories, Trajectory};
pub use rotation_in_lanes::fit_rotations;
pub use scale::{linear_scales, scaled_pose};
pub use selection::evenly;
pub use settings::{DepthGainSetting, MotionSettings, NoiseSetting, Registration};
pub use tracks::{Tracks, stay_but_for};

pub use nalgebra;

/// Rigid motion, element of SE(3), named `target_from_source`.
pub type Pose = nalgebra::Isometry3<f64>;
