//! Why a recording cannot be analysed.

use jointscope_motion::MotionError;
use jointscope_scoring::RuleError;

/// Why a recording cannot be analysed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DetectionError {
    /// A pair names a body that the recording does not have.
    #[error("the recording has no body `{name}`; it has {}", list(known))]
    UnknownBody {
        /// The name.
        name: String,
        /// The bodies there are.
        known: Vec<String>,
    },
    /// What was given does not make a recording.
    #[error(transparent)]
    Recording(#[from] MotionError),
    /// A pair names one body twice.
    #[error("the pair [`{name}`, `{name}`] names one body twice")]
    PairOfOne {
        /// The name.
        name: String,
    },
    /// The rule has no verdict about a pair: an expression is not finite, say.
    #[error("{reference} - {moving}: {error}")]
    Rule {
        /// The pair.
        reference: String,
        /// The pair.
        moving: String,
        /// What is wrong, and where in the rule.
        error: Box<RuleError>,
    },
    /// The base of the mechanism is no body.
    #[error("the base of the mechanism is to be `{name}`, but the recording has {}", list(known))]
    UnknownBase {
        /// The name.
        name: String,
        /// The bodies there are.
        known: Vec<String>,
    },
    /// The world cannot be added.
    #[error(
        "a recording of one body is analysed against the world, but {0}; give the world another name by `world` under [recording]"
    )]
    World(MotionError),
}

fn list(names: &[String]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}
