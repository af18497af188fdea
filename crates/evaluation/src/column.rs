//! What is evaluated: a detector under a name.

use jointscope_detection::{Configuration, Detector};

use crate::TYPES;

/// A detector under a name.
#[derive(Debug)]
pub struct Column {
    /// Its name in the results.
    pub name: String,
    pub(crate) detector: Detector,
    /// The same for recordings of a single camera.
    pub(crate) for_one_camera: Detector,
    /// Whether its rule knows all eight types; otherwise only classes can be scored.
    pub(crate) tells_types: bool,
}

impl Column {
    /// A detector by a configuration; what this says about a recording is not used.
    pub fn new(name: impl Into<String>, configuration: Configuration) -> Self {
        let known = configuration.rule.ignorance().confidences;
        let tells_types = TYPES.iter().all(|joint| known.iter().any(|(name, _)| name == joint));
        let for_one_camera = Detector::new(configuration.clone().for_one_camera());
        Self { name: name.into(), detector: Detector::new(configuration), for_one_camera, tells_types }
    }
}
