//! How motion is recovered from observations: the settings a user may choose.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a body's poses are found from its features.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Registration {
    /// Every frame to the body's mean shape, alternately refined: the most accurate.
    #[default]
    Shape,
    /// Every frame to the first one.
    First,
    /// Every frame to the one before, as in the thesis (Algorithm 3).
    Chained,
}

/// Noise of the observed positions.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected \"estimate\" or a number of metres")]
pub enum NoiseSetting {
    /// From the residuals of the registration.
    #[default]
    #[serde(with = "estimate")]
    #[schemars(with = "EstimateWord")]
    Estimate,
    /// Known standard deviation per coordinate, metres.
    Known(#[schemars(range(min = 0.0))] f64),
}

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum EstimateWord {
    Estimate,
}

mod estimate {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(serializer: S) -> Result<S::Ok, S::Error> {
        super::EstimateWord::Estimate.serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<(), D::Error> {
        super::EstimateWord::deserialize(deserializer).map(|_| ())
    }
}

/// How motion is recovered from observations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MotionSettings {
    /// How poses are found from features: "shape", "first" or "chained" (the thesis).
    pub registration: Registration,
    /// Standard deviation of a coordinate in metres, or "estimate" to find it from the data.
    pub noise: NoiseSetting,
    /// Distance in metres of the four virtual features by which models that look at points see a body given as poses.
    #[schemars(range(max = 1000.0), extend("exclusiveMinimum" = 0.0))]
    pub pose_radius: f64,
}

impl Default for MotionSettings {
    fn default() -> Self {
        Self { registration: Registration::default(), noise: NoiseSetting::default(), pose_radius: 0.1 }
    }
}
