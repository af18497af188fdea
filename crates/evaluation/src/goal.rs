//! What a measure should be.

use std::fmt;

use serde::Serialize;

use crate::Measure;

/// Where a value should lie, in the unit of its measure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    /// This or more.
    AtLeast(f64),
    /// This or less.
    AtMost(f64),
    /// From the first to the second.
    Between(f64, f64),
}

impl Bound {
    /// Whether a value lies within.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::AtLeast(least) => value >= least,
            Self::AtMost(most) => value <= most,
            Self::Between(least, most) => (least..=most).contains(&value),
        }
    }

    /// How bad a value is, for finding the worst of several: more is worse.
    pub(crate) fn badness(self, value: f64) -> f64 {
        match self {
            Self::AtLeast(_) => -value,
            Self::AtMost(_) => value,
            Self::Between(least, most) => (value / (least * most).sqrt()).ln().abs(),
        }
    }
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AtLeast(least) => write!(f, ">= {least}"),
            Self::AtMost(most) => write!(f, "<= {most}"),
            Self::Between(least, most) => write!(f, "{least} to {most}"),
        }
    }
}

/// A demand on a measure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Goal {
    /// What is measured.
    pub measure: Measure,
    /// What it must be.
    pub must: Bound,
    /// What it should be.
    pub aim: Bound,
}

/// How values stand to a goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Standing {
    /// Worse than what must be, or not measured everywhere.
    Missed,
    /// As good as it must be.
    Must,
    /// As good as it should be.
    Aim,
}

impl Goal {
    /// How a value stands.
    pub fn standing(&self, value: f64) -> Standing {
        if self.aim.holds(value) {
            Standing::Aim
        } else if self.must.holds(value) {
            Standing::Must
        } else {
            Standing::Missed
        }
    }
}

impl fmt::Display for Standing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Missed => "missed",
            Self::Must => "must",
            Self::Aim => "aim",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_on_a_bound_hold() {
        assert!(Bound::AtLeast(98.0).holds(98.0) && !Bound::AtLeast(98.0).holds(97.9));
        assert!(Bound::AtMost(1.35).holds(1.35) && !Bound::AtMost(1.35).holds(1.36));
        let band = Bound::Between(0.7, 1.6);
        assert!(band.holds(0.7) && band.holds(1.6) && !band.holds(0.69) && !band.holds(1.61));
        assert!(![Bound::AtLeast(0.0), Bound::AtMost(0.0), band].iter().any(|bound| bound.holds(f64::NAN)));
    }

    #[test]
    fn a_goal_is_aimed_at_met_or_missed() {
        let goal = Goal { measure: Measure::Types, must: Bound::AtLeast(98.0), aim: Bound::AtLeast(99.5) };
        let standings = [99.5, 99.0, 97.0].map(|value| goal.standing(value));
        assert_eq!(standings, [Standing::Aim, Standing::Must, Standing::Missed]);
        assert!(Standing::Missed < Standing::Must && Standing::Must < Standing::Aim);
    }

    #[test]
    fn the_worst_is_the_farthest_from_what_is_wanted() {
        assert!(Bound::AtLeast(98.0).badness(90.0) > Bound::AtLeast(98.0).badness(99.0));
        assert!(Bound::AtMost(1.0).badness(2.0) > Bound::AtMost(1.0).badness(0.5));
        let band = Bound::Between(0.5, 2.0);
        assert!(band.badness(0.4) > band.badness(1.9) && band.badness(3.0) > band.badness(0.4));
    }
}
