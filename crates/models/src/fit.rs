//! What a joint model finds: a fitted joint and how well it explains the motion.

use std::collections::BTreeMap;

use nalgebra::{Point3, Unit, Vector3};

use crate::{Confidence, NotAConfidence};

/// The result of fitting a joint model to a relative motion.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct JointFit {
    /// How sure the model is.
    pub confidence: Confidence,
    /// The partial scores and measures behind the confidence, by name; a measure may be infinite, never NaN.
    pub parts: BTreeMap<&'static str, f64>,
    /// Likelihood terms, from models that state a likelihood.
    pub evidence: Option<Evidence>,
    /// Other ways in which the same joint may explain the motion, a bent rail say; the best counts.
    pub alternatives: Vec<Evidence>,
    /// Root mean square distance of the samples from the fitted joint, metres.
    pub residual_rms: Option<f64>,
    /// How well the data determine the axis, from models that can say.
    pub axis_uncertainty: Option<AxisUncertainty>,
    /// The joint itself.
    pub joint: Joint,
    /// The axis in the coordinates of the moving body, from models that fit it there too; else it is carried by the
    /// measured pose of one frame.
    pub axis_in_moving: Option<Axis>,
    /// What a user should know about this fit, in sentences.
    pub notes: Vec<String>,
}

impl JointFit {
    /// A fit with nothing but a confidence and a joint.
    pub fn new(confidence: Confidence, joint: Joint) -> Self {
        Self {
            confidence,
            parts: BTreeMap::new(),
            evidence: None,
            alternatives: Vec::new(),
            residual_rms: None,
            axis_uncertainty: None,
            joint,
            axis_in_moving: None,
            notes: Vec::new(),
        }
    }

    /// Adds a partial score or measure.
    #[must_use]
    pub fn with_part(mut self, name: &'static str, value: f64) -> Self {
        self.parts.insert(name, value);
        self
    }

    /// Refuses what no fit may contain, which would be a fault of the model: NaN, or positions for another number of
    /// frames than the recording's.
    ///
    /// # Errors
    /// [`FitError::Fault`].
    pub fn sound(self, frames: usize) -> Result<Self, FitError> {
        let fault = |what: String| Err(FitError::Fault { what });
        if let Some((part, _)) = self.parts.iter().find(|(_, value)| value.is_nan()) {
            return fault(format!("its part `{part}` is not a number"));
        }
        if self.residual_rms.is_some_and(|rms| !rms.is_finite()) {
            return fault("its residual is not a number".into());
        }
        if let Some(AxisUncertainty { angle, distance }) = self.axis_uncertainty
            && angle.into_iter().chain(distance).any(|x| !(x.is_finite() && x >= 0.0))
        {
            return fault("its axis's uncertainty is not a number".into());
        }
        for axis in self.joint.axis.iter().chain(&self.axis_in_moving) {
            let numbers = axis.point.iter().chain(axis.direction.iter().flat_map(|d| d.iter())).chain(&axis.pitch);
            if numbers.into_iter().any(|x| !x.is_finite()) {
                return fault("its axis is not made of numbers".into());
            }
        }
        match self.joint.positions.as_ref().map(|positions| positions.iter().count()) {
            Some(rows) if rows != frames => fault(format!("it gives {rows} positions for {frames} frames")),
            _ => Ok(self),
        }
    }

    /// The same fit in coordinates of the reference that are `reference` times as large, and of the moving body that are
    /// `moving` times as large.
    ///
    /// Positions are known for angles or lengths by the mobility of the evidence, angles first; without evidence they stay.
    /// Parts stay as the model measured them.
    #[must_use]
    pub fn scaled(mut self, reference: f64, moving: f64) -> Self {
        self.residual_rms = self.residual_rms.map(|rms| rms * reference);
        self.axis_uncertainty = self.axis_uncertainty.map(|uncertainty| uncertainty.scaled(reference));
        self.axis_in_moving = self.axis_in_moving.map(|axis| axis.scaled(moving));
        self.joint.axis = self.joint.axis.map(|axis| axis.scaled(reference));
        if let Some((positions, evidence)) = self.joint.positions.as_mut().zip(self.evidence) {
            positions.scale_lengths(usize::from(evidence.mobility.turns), reference);
        }
        self
    }

    /// States how far the samples are from the joint, metres.
    #[must_use]
    pub fn with_residual(mut self, rms: f64) -> Self {
        self.residual_rms = Some(rms);
        self
    }
}

/// The likelihood of a motion under a model, in the terms by which models of different size can be compared.
///
/// A [mechanism](crate::lower_pair) gets it from [`judge`](crate::lower_pair::judge). Another model that looks at the
/// poses of a pair begins with [`Evidence::of_poses`] and adds what it leaves and how its positions spread; all
/// models of a configuration must speak of the same poses with the same noise, or they cannot be compared.
/// docs/plugins.md, "Evidence without a mechanism", has an example.
///
/// # References
/// docs/method.md, "Evidence", equations (10) and (11), and "Play", (12) to (17).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Weighted sum of squared residuals, `Σ eᵀ N⁻¹ e` with the covariance `N` of each pose, of single wrong frames no
    /// more than a logarithm; with [`PoseSeries::merged_cost`](jointscope_motion::PoseSeries::merged_cost).
    pub chi_squared: f64,
    /// Its expectation, if the model is right: numbers observed less numbers fitted.
    pub freedom: f64,
    /// Cost of the joint's positions over time, in units of -2 log likelihood:
    /// [`cost_of_positions`](crate::lower_pair::cost_of_positions); 0 without positions.
    pub configuration_cost: f64,
    /// Cost of what is unlikely beforehand, a hinge far from its body say, in units of -2 log likelihood.
    pub prior_cost: f64,
    /// What the joint leaves free, and parameters fitted; tells which models can do all that others can.
    pub mobility: Mobility,
    /// Number of independent observations `n`, for the price of parameters, `ln n` each.
    pub observations: f64,
    /// Frames that count as one because noise drifts; 1 for white noise.
    pub correlation_time: f64,
    /// The misfit as play of the joint; `None` if joints are ideal.
    pub departure: Option<Departure>,
}

/// A misfit beyond noise, in units of what play makes likely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Departure {
    /// Square of the misfit, in standard deviations of the play.
    pub squared: f64,
    /// By how much play absorbs more than noise does: cost of a misfit by noise over its cost by play.
    pub per_noise: f64,
    /// Square beyond which the joint is not the right one.
    pub adequate: f64,
}

impl Evidence {
    /// -2 log likelihood with noise as the only explanation, without the price of parameters.
    pub fn noise_cost(&self) -> f64 {
        (self.chi_squared + self.configuration_cost) / self.correlation_time
    }

    /// `χ²` by its degrees of freedom: 1 for a model that is right about joint and noise.
    pub fn chi_squared_per_freedom(&self) -> f64 {
        if self.freedom > 0.0 { self.chi_squared / self.freedom } else { 1.0 }
    }

    /// Frames that the recording is worth, were their errors independent: six numbers each of what is left of the noise
    /// after the fit.
    pub fn independent_frames(&self) -> f64 {
        self.freedom / (6.0 * self.correlation_time)
    }

    /// What `χ²` has more than chance gives it.
    pub(crate) fn excess(&self) -> f64 {
        let chance = self.freedom + 2.0 * (2.0 * self.freedom).sqrt();
        (self.chi_squared - chance).max(0.0) / self.correlation_time
    }

    /// What the misfit costs, were this the only model, in units of -2 log likelihood; a model's own confidence is
    /// `exp(-charge / 2)`.
    pub fn own_charge(&self) -> f64 {
        self.departure.map_or(self.excess(), |departure| departure.charge(self.excess()))
    }
}

impl Departure {
    /// Squared departure from which its likelihood falls faster than a Gaussian's: no joint has so much play.
    const HARD: f64 = 60.0;

    /// Cost of a misfit that costs `by_noise` as noise: the cheaper explanation counts, as with a variance that is the
    /// sum of both.
    pub fn charge(&self, by_noise: f64) -> f64 {
        let least = by_noise / self.per_noise.max(f64::MIN_POSITIVE);
        let squared = self.squared.max(least);
        let by_play = squared * (1.0 + squared / Self::HARD);
        if by_noise > 0.0 && by_play > 0.0 { by_noise / (1.0 + by_noise / by_play) } else { 0.0 }
    }
}

/// What a mechanism leaves free, and what it takes to describe it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mobility {
    /// Independent turns, 0 to 3.
    pub turns: u8,
    /// Independent slides, 0 to 3.
    pub slides: u8,
    /// Parameters that a fit determines, those of the positions' distribution included.
    pub parameters: usize,
    /// Whether it advances along an axis that it turns about, freely or in proportion: what turns in a plane or about
    /// a point does not.
    pub advances: bool,
    /// Whether the place that it turns about moves across the axis, freely or in proportion: that of a hinge or a ball
    /// does not.
    pub roams: bool,
}

impl Mobility {
    /// Whether this mechanism can do all that another can, and more, as far as turns and slides tell.
    pub fn contains(&self, other: &Self) -> bool {
        let as_free = self.turns >= other.turns
            && self.slides >= other.slides
            && (self.advances || !other.advances)
            && (self.roams || !other.roams);
        as_free && (self.turns + self.slides > other.turns + other.slides || self.parameters > other.parameters)
    }
}

/// Standard deviations of a fitted axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisUncertainty {
    /// Root of the expected squared angle between fitted and true direction, radians; `None` without a direction.
    pub angle: Option<f64>,
    /// Root of the expected squared distance of the axis's point from the true axis, plane or centre, metres; `None`
    /// where the axis is a direction only.
    pub distance: Option<f64>,
}

impl AxisUncertainty {
    /// The same in coordinates that are `factor` times as large.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self { distance: self.distance.map(|distance| distance * factor), ..*self }
    }
}

/// A fitted joint. A rigid connection has neither axis nor positions.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Joint {
    /// Where the joint is.
    pub axis: Option<Axis>,
    /// Its positions over the frames of the recording.
    pub positions: Option<Positions>,
}

/// Axis, normal or centre of a joint, in metres, in the coordinates of the reference body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// A point of the axis or plane; the centre of a spherical joint; where the moving body is, for a prismatic one.
    pub point: Point3<f64>,
    /// Unit direction of the axis, or normal; `None` for a spherical joint.
    pub direction: Option<Unit<Vector3<f64>>>,
    /// Metres along per radian about the axis: 0 for a revolute joint, `None` where there is no turn.
    pub pitch: Option<f64>,
}

impl Axis {
    /// The same axis in other coordinates.
    #[must_use]
    pub fn seen_from(&self, target_from_source: &jointscope_motion::Pose) -> Self {
        Self {
            point: target_from_source * self.point,
            direction: self.direction.map(|d| target_from_source.rotation * d),
            ..*self
        }
    }

    /// The same axis in coordinates that are `factor` times as large.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self { point: self.point * factor, pitch: self.pitch.map(|pitch| pitch * factor), ..*self }
    }
}

/// The positions of a joint: metres or radians, unwrapped over full turns, one row per frame of the recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Positions {
    freedoms: usize,
    values: Vec<f64>,
}

impl Positions {
    /// Positions of a joint with one degree of freedom; `None` where it is not seen.
    pub fn of_one_freedom(positions: impl IntoIterator<Item = Option<f64>>) -> Self {
        Self { freedoms: 1, values: positions.into_iter().map(|q| q.unwrap_or(f64::NAN)).collect() }
    }

    /// Positions of a joint with several degrees of freedom, frame after frame; NaN where it is not seen.
    ///
    /// # Panics
    /// If `values` does not fill whole frames.
    pub fn of_freedoms(freedoms: usize, values: Vec<f64>) -> Self {
        assert!(freedoms > 0 && values.len().is_multiple_of(freedoms), "one value per degree of freedom and frame");
        Self { freedoms, values }
    }

    /// Degrees of freedom.
    pub fn freedoms(&self) -> usize {
        self.freedoms
    }

    /// One row per frame; `None` where the joint is not seen.
    pub fn iter(&self) -> impl Iterator<Item = Option<&[f64]>> {
        self.values.chunks_exact(self.freedoms).map(|row| row.iter().all(|q| !q.is_nan()).then_some(row))
    }

    /// Least and greatest value of each degree of freedom; `None` if the joint is never seen.
    pub fn ranges(&self) -> Option<Vec<[f64; 2]>> {
        self.iter().flatten().fold(None, |ranges, row| {
            let ranges = ranges.unwrap_or_else(|| row.iter().map(|&q| [q, q]).collect::<Vec<_>>());
            Some(ranges.iter().zip(row).map(|(&[least, most], &q)| [least.min(q), most.max(q)]).collect())
        })
    }

    fn scale_lengths(&mut self, angles: usize, factor: f64) {
        for row in self.values.chunks_exact_mut(self.freedoms) {
            row.iter_mut().skip(angles).for_each(|q| *q *= factor);
        }
    }

    /// The same positions counted in the opposite direction.
    #[must_use]
    pub fn reversed(mut self) -> Self {
        // Adding 0 keeps the start at +0.
        self.values.iter_mut().for_each(|q| *q = -*q + 0.0);
        self
    }
}

/// Why a model cannot judge a motion at all. A bad fit is a low confidence, not an error.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// No feature is seen often enough.
    #[error("needs {needed} frames of a feature, but none is seen in more than {found}")]
    TooFewFrames {
        /// Frames needed.
        needed: usize,
        /// The most frames in which a feature is seen.
        found: usize,
    },
    /// The model needs something that these bodies do not show.
    #[error("needs {needed}, but {found}")]
    Unsuitable {
        /// What the model needs.
        needed: String,
        /// What was found instead.
        found: String,
    },
    /// The model computed something that no fit may contain: a bug in the model.
    #[error("the model is at fault: {what}")]
    Fault {
        /// What is wrong.
        what: String,
    },
    /// The model computed something that is no confidence: a bug in the model.
    #[error(transparent)]
    NotAConfidence(#[from] NotAConfidence),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_is_a_fault_of_the_model() {
        let fit = |joint| JointFit::new(Confidence::ONE, joint);
        let axis = Axis { point: Point3::new(0.0, f64::NAN, 0.0), direction: None, pitch: None };
        for broken in [
            fit(Joint::default()).with_part("p", f64::NAN),
            fit(Joint::default()).with_residual(f64::INFINITY),
            fit(Joint { axis: Some(axis), positions: None }),
            fit(Joint { axis: None, positions: Some(Positions::of_one_freedom([Some(0.0)])) }),
        ] {
            assert!(matches!(broken.sound(2), Err(FitError::Fault { .. })));
        }
        assert!(fit(Joint::default()).with_part("p", f64::INFINITY).sound(2).is_ok());
    }

    #[test]
    fn ranges_skip_frames_that_are_not_seen() {
        let positions = Positions::of_one_freedom([Some(0.0), None, Some(-1.5), Some(2.0)]);
        assert_eq!(positions.ranges(), Some(vec![[-1.5, 2.0]]));
        assert_eq!(positions.iter().nth(1), Some(None));
        assert_eq!(Positions::of_one_freedom([None]).ranges(), None);
        let plane = Positions::of_freedoms(2, vec![0.0, 1.0, f64::NAN, 0.0, 3.0, -1.0]);
        assert_eq!(plane.ranges(), Some(vec![[0.0, 3.0], [-1.0, 1.0]]));
    }
}
