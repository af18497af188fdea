//! What was detected.

use std::collections::BTreeMap;

use jointscope_models::{Axis, AxisUncertainty, FitError, JointFit, Positions};
use jointscope_motion::{DepthGain, Noise, Pose, Recording};
use jointscope_scoring::{Explanation, Verdict};

use crate::{PairScale, Structure};

/// The joints of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// The bodies, in order of first appearance.
    pub bodies: Vec<String>,
    /// Number of frames.
    pub frames: usize,
    /// Seconds from first to last frame, where times are known.
    pub duration: Option<f64>,
    /// Every pair, in order of bodies or as asked.
    pub pairs: Vec<PairDetection>,
    /// `recording_from_body` of every body in every frame, as far as its orientation is seen.
    pub poses: Vec<Vec<Option<Pose>>>,
    /// What a single camera did, undone: bodies with restored depths, and multiplied by [`Detection::scales`]; `None`
    /// where there was nothing to undo. Axes, positions and poses are those of these bodies.
    pub repaired: Option<Recording>,
    /// By what every body was multiplied about the camera to be in one scale with the others, as far as pairs agree on
    /// one: 1 for the base, or the first of the bodies that are connected so; `None` where no scale was sought.
    pub scales: Option<Vec<f64>>,
    /// The mechanism that the pairs make.
    pub structure: Structure,
}

/// The joint between two bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct PairDetection {
    /// The body in whose coordinates the axis is given.
    pub reference: String,
    /// The other body.
    pub moving: String,
    /// What the rule concludes.
    pub verdict: Verdict,
    /// Whether the data decide; if not, `notes` say why.
    pub determined: bool,
    /// Axis of the verdict's joint, metres, in the reference body's coordinates.
    pub axis: Option<Axis>,
    /// How well the data determine it, from models that can say.
    pub axis_uncertainty: Option<AxisUncertainty>,
    /// The same axis in the moving body's coordinates.
    pub axis_in_moving: Option<Axis>,
    /// Positions of the verdict's joint, per frame of the recording.
    pub positions: Option<Positions>,
    /// The scale of the moving body beside the reference's; `None` where none was sought.
    pub scale: Option<PairScale>,
    /// Compression of depth changes that was undone, of the reference body and of the moving one; `None` where none was
    /// asked for.
    pub depth_gain: Option<[DepthGain; 2]>,
    /// Noise of the reference body.
    pub noise_reference: Noise,
    /// Noise of the moving body.
    pub noise_moving: Noise,
    /// Frames in which the relation of the bodies is seen.
    pub frames_used: usize,
    /// What every model found, by its name in the configuration.
    pub models: BTreeMap<String, ModelFinding>,
    /// What a user should know, in sentences.
    pub notes: Vec<String>,
    /// How the rule came to its verdict; filled in by whoever asks [`Detector::explain`](crate::Detector::explain).
    pub explanation: Option<Explanation>,
}

/// What a model found, or why it found nothing.
pub type ModelFinding = Result<JointFit, FitError>;
