//! What a report is about.

use jointscope_detection::Detection;
use jointscope_motion::Recording;

/// A detection with the recording that it was made from: what pictures and robot descriptions need.
#[derive(Debug, Clone, Copy)]
pub struct Report<'a> {
    /// The joints.
    pub detection: &'a Detection,
    /// The recording, or [`Detection::repaired`] where there is one, with the same bodies; one that has the world in
    /// addition, or lacks it, will do.
    pub recording: &'a Recording,
    /// The configuration's text, to be shown; may be empty.
    pub settings: &'a str,
}
