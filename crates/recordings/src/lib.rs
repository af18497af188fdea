//! Files of tracked points and poses, read into a [`Recording`](jointscope_motion::Recording) and written from one.
//!
//! ```text
//! file ─ read ─┬─ csv_table   header, one row per sample: points or poses of any number of bodies
//!              ├─ pose_text   no header, one row per frame: positions or poses of one body
//!              └─ npz         numpy's arrays: points of any number of bodies
//! ```
//!
//! # Conventions
//! * A [`Unit`] is the unit of the *file*; recordings are always in metres.
//! * A missing sample is an absent row, an empty cell or NaN; infinity is an error.
//! * Every error names the file, and the line or array in it, says what was needed and found, and what to do.
//! * Files are not trusted: whatever their bytes, reading ends with a recording or an error, in memory that grows with
//!   the size of the file.

pub mod csv_table;
pub mod npz;
pub mod pose_text;

mod columns;
mod csv_write;
mod error;
mod format;
mod grid;
mod npy;
mod npz_write;
mod pose;
mod read;
mod text;
mod unit;
mod writable;

pub use csv_write::write_csv;
pub use error::RecordingError;
pub use format::Format;
pub use npz_write::write_npz;
pub use read::{ReadOptions, read};
pub use unit::Unit;
