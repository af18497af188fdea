//! Why conditions could not be evaluated.

use jointscope_detection::DetectionError;
use jointscope_scenes::SceneError;

/// Why conditions could not be evaluated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EvaluationError {
    /// A scene cannot be simulated.
    #[error("scene `{scene}` with seed {seed}: {error}")]
    Scene {
        /// Name of the scene.
        scene: &'static str,
        /// Its seed.
        seed: u64,
        /// What is wrong.
        error: SceneError,
    },
    /// A recording cannot be analysed.
    #[error("scene `{scene}` with seed {seed}: {error}")]
    Detection {
        /// Name of the scene.
        scene: &'static str,
        /// Its seed.
        seed: u64,
        /// What is wrong.
        error: DetectionError,
    },
    /// The picture cannot be drawn.
    #[error("the picture cannot be drawn: {what}")]
    Picture {
        /// What is wrong.
        what: String,
    },
    /// The threads could not be started.
    #[error("the threads cannot be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}
