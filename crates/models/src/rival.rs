//! A joint that is known to explain the motion, and what no other can cost and still count.

use jointscope_motion::RelativeMotion;

use crate::{Departure, Evidence};

/// What is known before other joints are fitted: how likely one is that explains any motion.
///
/// A [mechanism](crate::lower_pair) that leaves so much unexplained after its first iterations that it cannot come near
/// is not fitted to the end. Its evidence is then that of a fit that is nearly the best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rival {
    /// Its [noise cost](Evidence::noise_cost).
    pub noise_cost: f64,
    /// [Charge](Departure::charge) from which another joint has no share of the verdict.
    pub charge: f64,
}

/// By how much further iterations may lower a misfit, squared in units of play, and what noise makes of it: play and noise
/// weigh turns and shifts differently.
const MISFIT_MAY_FALL: f64 = 3.0;
const COST_MAY_FALL: f64 = 20.0;

impl Rival {
    /// Nothing is known.
    pub const NONE: Self = Self { noise_cost: f64::INFINITY, charge: f64::INFINITY };

    /// Tells all models that will look at a motion; before the first of them does.
    pub fn tell(self, motion: &RelativeMotion<'_>) {
        motion.once(|| self);
    }

    /// What was told.
    pub(crate) fn of(motion: &RelativeMotion<'_>) -> Self {
        motion.once(|| Self::NONE)
    }

    pub(crate) fn is_known(&self) -> bool {
        self.charge < f64::INFINITY
    }

    /// Whether a joint has no share of the verdict, however its fit goes on.
    pub(crate) fn outdoes(&self, evidence: &Evidence) -> bool {
        let Some(departure) = evidence.departure else { return false };
        let by_noise = evidence.chi_squared / (COST_MAY_FALL * evidence.correlation_time) - self.noise_cost;
        let squared = departure.squared / MISFIT_MAY_FALL;
        Departure { squared, per_noise: f64::INFINITY, ..departure }.charge(by_noise) > self.charge
    }
}
