//! What can be wrong with a scene or its options.

use jointscope_motion::MotionError;

/// Why a scene could not be simulated: what was needed, and what was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// No scene has that name.
    #[error("there is no scene `{name}`; the scenes are {known}")]
    UnknownScene {
        /// The name asked for.
        name: String,
        /// All names, separated by commas.
        known: String,
    },
    /// An option is out of its range.
    #[error("option `{option}` must be {expected}, found {found}")]
    OutOfRange {
        /// Name of the option.
        option: &'static str,
        /// Its range in words.
        expected: &'static str,
        /// The value given.
        found: f64,
    },
    /// The scene has nothing that the option could change.
    #[error("option `{option}` does not apply to scene `{scene}`")]
    NotApplicable {
        /// Name of the option.
        option: &'static str,
        /// Name of the scene.
        scene: String,
    },
    /// An option is about features, which bodies seen as poses do not have.
    #[error("option `{option}` is about tracked features, and bodies seen as `poses` have none")]
    NeedsPoints {
        /// Name of the option.
        option: &'static str,
    },
    /// An option is about tracked poses, and bodies are seen as points.
    #[error("option `{option}` is about bodies seen as poses: it needs the option `poses`")]
    NeedsPoses {
        /// Name of the option.
        option: &'static str,
    },
    /// A body turns too fast for its position to be followed over full turns.
    #[error(
        "body `{body}` turns by {degrees:.0}° from one frame to the next; only less than 180° can be followed: ask for more `frames` or a smaller `sweep_deg`"
    )]
    TooFast {
        /// Name of the body.
        body: String,
        /// Largest turn between two frames, degrees.
        degrees: f64,
    },
    /// A body of a scene made by hand contradicts itself.
    #[error("body `{body}`: {detail}")]
    Body {
        /// Name of the body.
        body: String,
        /// What was needed, and found.
        detail: String,
    },
    /// The recording could not be put together; for instance, a body lost all its samples to dropouts.
    #[error(transparent)]
    Recording(#[from] MotionError),
}
