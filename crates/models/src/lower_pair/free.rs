//! `free`: any motion.

use jointscope_motion::{PoseSeries, RelativeMotion, twist};
use nalgebra::Vector6;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Mobility, random_effect, starts};
use crate::{Confidence, Departure, Evidence, FitError, Joint, JointFit, JointModel, joint_model, point_path};

/// Free motion: the bodies are not connected; in results it is usually named `disconnected`.
///
/// `L_t` is any pose, with six positions per frame.
///
/// Convention: there is neither an axis nor a position.
///
/// Explains everything, at the price of six positions that spread; any joint that explains the motion nearly as well
/// costs less.
///
/// References: docs/method.md, "Mechanisms".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Free {
    /// What free motion counts in parameters: the fewer, the sooner a joint with play gives way to it. Mean and
    /// covariance of all positions are 27; those
    /// not counted still pay for what chance gains by them.
    #[schemars(range(min = 6, max = 27))]
    pub parameters: u8,
}

/// Mean and covariance of six coordinates.
const PARAMETERS: u8 = 27;

impl Default for Free {
    fn default() -> Self {
        Self { parameters: 18 }
    }
}

/// The -2 log likelihood of a free motion, without the price of parameters: the less, the better poses, single or merged,
/// tell the motion apart from noise.
pub fn free_cost(series: &PoseSeries) -> f64 {
    (series.merged_cost() + cost_of_departures(series)) / series.correlation_time()
}

/// Price of where the poses are, as positions about their mean.
fn cost_of_departures(series: &PoseSeries) -> f64 {
    #[derive(Clone)]
    struct Cost(f64);
    let cost = || {
        let home = starts::at_rest(series).home.inverse();
        let departures: Vec<Vector6<f64>> = series.poses().iter().map(|pose| twist::log(&(home * pose))).collect();
        Cost(random_effect::cost(&departures, series.noise()))
    };
    series.once(cost).0
}

joint_model!(Free, "free", "any motion: the bodies are not connected");

impl JointModel for Free {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        let Some(series) = motion.pose_series() else { return point_path::anywhere(motion) };
        let count = series.poses().len();
        if count < 3 {
            return Err(FitError::TooFewFrames { needed: 3, found: count });
        }
        let plays = series.ends().iter().any(|end| end.shift_play > 0.0);
        let mut fit = JointFit::new(Confidence::ONE, Joint::default()).with_residual(0.0);
        let mobility =
            Mobility { turns: 3, slides: 3, parameters: usize::from(self.parameters), advances: true, roams: true };
        // What every parameter that play does not charge gains by chance.
        let unpaid = f64::from(PARAMETERS.saturating_sub(self.parameters));
        fit.evidence = Some(Evidence {
            configuration_cost: cost_of_departures(series) + unpaid * series.correlation_time(),
            freedom: 6.0 * (series.seen() - count) as f64 + series.merged_motion(),
            departure: plays.then_some(Departure { squared: 0.0, per_noise: f64::INFINITY, adequate: 25.0 }),
            ..Evidence::of_poses(mobility, series)
        });
        Ok(fit)
    }

    fn states_evidence(&self) -> bool {
        true
    }

    /// Those of the path of a single point; of poses nothing is left to measure.
    fn parts(&self) -> &'static [&'static str] {
        &["misfit_distance", "departure", "chi_squared_per_freedom", "leap_share"]
    }
}
