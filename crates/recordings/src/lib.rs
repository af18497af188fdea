//! Files of tracked points and poses, read into a [`Recording`](jointscope_motion::Recording) and written from one.
//!
//! ```text
//! file ─ read ─┬─ csv_table, parquet_table                one row per sample: points or poses of any number of bodies
//!              ├─ pose_text, euroc                        one row per frame: positions or poses of one body
//!              ├─ npz                                     numpy's arrays: points of any number of bodies
//!              └─ c3d, trc, qualisys, vicon, motive       markers of motion capture ─ grouping ─ bodies
//! ```
//!
//! # Conventions
//! * A [`Unit`] is the unit of the *file*; recordings are always in metres.
//! * A missing sample is an absent row, an empty cell or NaN; infinity is an error.
//! * Every error names the file, and the line or array in it, says what was needed and found, and what to do.
//! * Files are not trusted: whatever their bytes, reading ends with a recording or an error, in memory that grows with
//!   the size of the file.

pub mod c3d;
pub mod csv_table;
pub mod euroc;
pub mod motive;
pub mod npz;
#[cfg(feature = "parquet")]
pub mod parquet_table;
pub mod pose_text;
pub mod qualisys;
pub mod trc;
pub mod vicon;

mod cells;
mod columns;
mod csv_write;
mod error;
mod format;
mod grid;
mod grouping;
mod inspection;
mod mapped;
mod marker_table;
mod markers;
mod npy;
mod npz_write;
#[cfg(feature = "parquet")]
mod parquet_write;
mod pose;
mod read;
mod several;
mod suggestion;
mod text;
mod trc_write;
mod unit;
mod writable;

pub use csv_write::write_csv;
pub use error::RecordingError;
pub use format::Format;
pub use grouping::{BodyPatterns, Grouping, group};
pub use inspection::{Group, Inspection, Presence, inspect};
pub use markers::{Marker, Markers};
pub use npz_write::{lost_in_npz, write_npz};
#[cfg(feature = "parquet")]
pub use parquet_write::write_parquet;
pub use read::{ReadOptions, read, read_markers, read_with_notes};
pub use several::join;
pub use suggestion::{SuggestedBody, Suggestion, suggest};
pub use trc_write::{lost_in_trc, write_trc};
pub use unit::Unit;
