//! How far real joints depart from ideal ones.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Play: what a real joint may depart from the ideal one, slowly and once per recording, beside the noise of every
/// frame. Standard deviations.
///
/// A drawer runs millimetres off its line, a hinge wobbles, skin slides. Without play any such departure, however
/// small, speaks against every simple joint as soon as frames are many enough.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Play {
    /// Of positions, as a share of how far the body's features travel.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub travel: f64,
    /// Of positions in addition, as a share of the bodies' size.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub size: f64,
    /// Of positions in addition, in metres.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub distance: f64,
    /// Of rotations, as a share of the turn that the joint itself explains.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub turn: f64,
    /// Of rotations at least, in degrees.
    #[schemars(range(min = 0.0, max = 90.0))]
    pub least_turn: f64,
    /// Of rotations of a slide at most, in degrees: a slide with play turns its load by the play over the load's radius.
    #[schemars(range(min = 0.0, max = 90.0))]
    pub load_turn: f64,
    /// Share of drifting noise (of skin or filters) that counts as play, times its correlation.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub drift: f64,
}

impl Default for Play {
    fn default() -> Self {
        Self { travel: 0.007, size: 0.001, distance: 0.0, turn: 0.005, least_turn: 0.1, load_turn: 1.0, drift: 0.5 }
    }
}

impl Play {
    /// Ideal joints: every departure is noise.
    pub const NONE: Self =
        Self { travel: 0.0, size: 0.0, distance: 0.0, turn: 0.0, least_turn: 0.0, load_turn: 0.0, drift: 0.0 };
}
