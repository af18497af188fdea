//! A number in [0, 1].

use serde::Serialize;

/// How sure a model is that its joint explains the motion: a number from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize)]
pub struct Confidence(f64);

/// A number outside [0, 1], or none at all.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("a confidence lies from 0 to 1, but {0} was computed")]
pub struct NotAConfidence(pub f64);

impl Confidence {
    /// No confidence at all.
    pub const ZERO: Self = Self(0.0);
    /// Certainty.
    pub const ONE: Self = Self(1.0);

    /// Takes a number from 0 to 1.
    ///
    /// # Errors
    /// [`NotAConfidence`] for any other number and for NaN.
    pub fn new(value: f64) -> Result<Self, NotAConfidence> {
        if (0.0..=1.0).contains(&value) { Ok(Self(value)) } else { Err(NotAConfidence(value)) }
    }

    /// The number.
    pub fn value(self) -> f64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_numbers_from_zero_to_one_are_confidences() {
        assert_eq!(Confidence::new(1.0), Ok(Confidence::ONE));
        assert!([-0.1, 1.0 + 1e-12, f64::NAN, f64::INFINITY].iter().all(|x| Confidence::new(*x).is_err()));
    }
}
