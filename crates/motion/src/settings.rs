//! How motion is recovered from observations: the settings a user may choose.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Play;

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
    Known(#[schemars(range(min = 0.0, max = 1000.0))] f64),
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

/// Compression of the depth changes of every body, as a single camera makes it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected \"none\", \"estimate\" or a number from 0.2 to 3")]
pub enum DepthGainSetting {
    /// Depths are what they are.
    #[default]
    #[serde(with = "no_gain")]
    #[schemars(with = "NoGainWord")]
    None,
    /// From the rigidity of each body.
    #[serde(with = "estimate")]
    #[schemars(with = "EstimateWord")]
    Estimate,
    /// Known: depth changes are seen so many times as large as they are.
    Known(#[schemars(range(min = 0.2, max = 3.0))] f64),
}

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum NoGainWord {
    None,
}

mod no_gain {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(serializer: S) -> Result<S::Ok, S::Error> {
        super::NoGainWord::None.serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<(), D::Error> {
        super::NoGainWord::deserialize(deserializer).map(|_| ())
    }
}

mod play_setting {
    use schemars::JsonSchema;
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    use super::Play;

    #[derive(Serialize, Deserialize, JsonSchema)]
    #[serde(untagged)]
    pub(super) enum Written {
        /// A share of the travel, or "none".
        Share(String),
        /// Metres.
        Distance(#[schemars(range(min = 0.0, max = 1000.0))] f64),
        /// Every share by itself.
        Table(Play),
    }

    pub(super) fn serialize<S: Serializer>(play: &Play, serializer: S) -> Result<S::Ok, S::Error> {
        play.serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Play, D::Error> {
        match Written::deserialize(deserializer)? {
            Written::Table(play) => Ok(play),
            Written::Distance(0.0) => Ok(Play::NONE),
            Written::Distance(distance) => Ok(Play { distance, travel: 0.0, ..Play::default() }),
            Written::Share(text) if text == "none" => Ok(Play::NONE),
            Written::Share(text) => {
                let number = text.strip_suffix('%').and_then(|number| number.trim().parse::<f64>().ok());
                let percent = number.filter(|percent| (0.0..=100.0).contains(percent));
                let travel = percent.ok_or_else(|| {
                    D::Error::custom(format!(
                        "expected a share of 0 to 100 % such as \"0.7 %\", a number of metres without quotes, or \
                         \"none\", found \"{text}\""
                    ))
                })? / 100.0;
                Ok(Play { travel, ..Play::default() })
            }
        }
    }
}

/// How motion is recovered from observations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MotionSettings {
    /// How poses are found from features: "shape", "first" or "chained" (the thesis).
    pub registration: Registration,
    /// Whether registration to the "shape" leaves out wild samples and features that belong to something else, and
    /// tells noise along the viewing ray from noise across it.
    pub robust: bool,
    /// Standard deviation of a coordinate in metres, or "estimate" to find it from the data.
    pub noise: NoiseSetting,
    /// How far real joints depart from ideal ones: a share of the travel such as "0.7 %", a number of metres, "none",
    /// or a table of all shares.
    #[serde(with = "play_setting")]
    #[schemars(with = "play_setting::Written")]
    pub play: Play,
    /// How much a single camera compresses depth changes: "none", "estimate" to find it for every body from its
    /// rigidity, or a number.
    pub depth_gain: DepthGainSetting,
    /// Distance in metres of the four virtual features by which models that look at points see a body given as poses.
    #[schemars(range(max = 1000.0), extend("exclusiveMinimum" = 0.0))]
    pub pose_radius: f64,
}

impl Default for MotionSettings {
    fn default() -> Self {
        Self {
            registration: Registration::default(),
            robust: true,
            noise: NoiseSetting::default(),
            play: Play::default(),
            depth_gain: DepthGainSetting::default(),
            pose_radius: 0.1,
        }
    }
}
