//! The unit of length of a file.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::RecordingError;

/// The unit of the positions in a file; recordings are always in metres.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
pub enum Unit {
    /// `"m"`.
    #[default]
    #[serde(rename = "m")]
    Metre,
    /// `"cm"`.
    #[serde(rename = "cm")]
    Centimetre,
    /// `"mm"`.
    #[serde(rename = "mm")]
    Millimetre,
    /// `"in"`, 25.4 mm.
    #[serde(rename = "in")]
    Inch,
}

impl Unit {
    /// A length in this unit, in metres.
    pub fn to_metres(self, length: f64) -> f64 {
        // Whole numbers are exact: 9 mm become the double nearest to 0.009, which 9 × 0.001 is not.
        match self {
            Self::Metre => length,
            Self::Centimetre => length / 100.,
            Self::Millimetre => length / 1000.,
            Self::Inch => length * 127. / 5000.,
        }
    }
}

impl Unit {
    /// The unit that a file of motion capture names, `mm` as well as `Millimeters`.
    pub(crate) fn of_name(name: &str) -> Result<Self, String> {
        match name.to_ascii_lowercase().as_str() {
            "m" | "meter" | "meters" | "metre" | "metres" => Ok(Self::Metre),
            "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => Ok(Self::Centimetre),
            "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => Ok(Self::Millimetre),
            "in" | "inch" | "inches" => Ok(Self::Inch),
            _ => Err(format!(
                "no unit is named {}; known are m, cm, mm and in; state which it is by `unit`",
                crate::text::quoted(name)
            )),
        }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Metre => "m",
            Self::Centimetre => "cm",
            Self::Millimetre => "mm",
            Self::Inch => "in",
        })
    }
}

impl FromStr for Unit {
    type Err = RecordingError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        [Self::Metre, Self::Centimetre, Self::Millimetre, Self::Inch]
            .into_iter()
            .find(|unit| unit.to_string() == name)
            .ok_or_else(|| RecordingError::UnknownName { what: "unit", found: name.into(), known: "m, cm, mm and in" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_become_metres_without_needless_rounding() {
        let metres = [Unit::Metre, Unit::Centimetre, Unit::Millimetre, Unit::Inch].map(|unit| unit.to_metres(9.));
        assert!(metres == [9., 0.09, 0.009, 0.2286]);
    }

    #[test]
    fn names_are_the_same_as_text_and_in_configurations() {
        for unit in [Unit::Metre, Unit::Centimetre, Unit::Millimetre, Unit::Inch] {
            assert_eq!(unit.to_string().parse::<Unit>().expect("its own name"), unit);
            let serde_name = toml::Value::try_from(unit).expect("a name");
            assert_eq!(serde_name.as_str(), Some(unit.to_string().as_str()));
        }
        assert!("metre".parse::<Unit>().expect_err("spelled out").to_string().ends_with("known are m, cm, mm and in"));
    }
}
