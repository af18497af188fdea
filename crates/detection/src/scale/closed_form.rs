//! The scale as a parameter of a joint.

use jointscope_models::{Evidence, JointModel, lower_pair::Followed};
use jointscope_motion::RelativeMotion;

/// Logarithms of scales that are looked at.
const RANGE: f64 = 1.8;
/// Standard error of a scale from which it counts as not shown.
const VAGUE: f64 = 0.03;
/// First distance of neighbours at which the cost is compared, and its limits.
const STRIDE: f64 = 0.02;
const LEAST_STRIDE: f64 = 1e-7;
const MOST_STRIDE: f64 = 0.3;
/// By which share the next distance may be shorter: where costs saturate, a far parabola says little of a narrow valley.
const NEARER: f64 = 0.125;
/// First distance where the scale is known, looks there, and by which factor a distance may differ from the width of the
/// valley.
const STRIDE_BESIDE: f64 = 0.001;
const LOOKS: usize = 4;
const FITTING: f64 = 4.0;
/// Deviation of the logarithm of a scale of which nothing is known beforehand.
const ANY: f64 = 1.0;
/// Distance to which a fit at one scale is followed instead of fitted anew.
const FOLLOWED: f64 = 0.05;
/// Strides towards the least cost, and rounds of parabolas through three costs.
const STRIDES: usize = 12;
const ROUNDS: usize = 10;

/// What is known of the logarithm of a scale beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Belief {
    pub(crate) mean: f64,
    pub(crate) deviation: f64,
}

impl Belief {
    /// Where next to nothing is known but about where to look.
    pub(crate) fn about(mean: f64) -> Self {
        Self { mean, deviation: ANY }
    }
}

/// The scale that a joint asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Estimate {
    /// Logarithm of the factor by which the moving body's positions must be multiplied.
    pub(crate) logarithm: f64,
    /// Standard error of the logarithm by the data alone.
    pub(crate) standard_error: f64,
    /// As [`PairScale::signal`](crate::PairScale::signal).
    pub(crate) signal: f64,
    /// Price of the parameter, in units of -2 log likelihood.
    pub(crate) price: f64,
}

impl Estimate {
    /// Of a joint to which the scale does not matter.
    pub(crate) fn none(belief: Belief) -> Self {
        Self { logarithm: belief.mean, standard_error: f64::INFINITY, signal: 0.0, price: 0.0 }
    }

    pub(crate) fn factor(&self) -> f64 {
        self.logarithm.exp()
    }

    pub(crate) fn is_observable(&self) -> bool {
        self.standard_error < VAGUE && self.logarithm.abs() < RANGE
    }
}

/// Finds the scale by which a joint explains the motion best.
///
/// *Definition.* Minimises `χ²(κ)/τ + ((ln κ - μ)/s)²`, where every frame's residual is weighed by the noise of both
/// bodies at that scale: least squares with errors in both, which is not drawn to small scales, and flat where the scale
/// does not show. The standard error is read off the curvature at the minimum, and grows with a misfit beyond noise. A
/// scale that was fitted costs `ln(1 + s²/σ²) + (ln κ - μ)²/(s² + σ²)`, what integrating over it leaves of the
/// likelihood.
///
/// # References
/// docs/method.md, "One camera".
pub(crate) fn estimate(
    model: &dyn JointModel,
    plain: &RelativeMotion<'_>,
    starts: &[f64],
    belief: Belief,
) -> Option<Estimate> {
    let mut valley = Valley { model, plain, belief, followed: None };
    let before = valley.evidence_at(belief.mean)?;
    if is_free(&before) {
        return Some(Estimate::none(belief));
    }
    let mut least = (valley.cost_of(belief.mean, &before), Some(before));
    let mut x = belief.mean;
    for start in starts.iter().map(|scale| scale.ln()).filter(|start| start.abs() < RANGE) {
        let found = valley.at(start);
        if found.0 < least.0 {
            (x, least) = (start, found);
        }
    }
    let mut stride = STRIDE;
    let mut bend = f64::NAN;
    for _ in 0..ROUNDS {
        let (mut left, mut right) = (valley.at(x - stride), valley.at(x + stride));
        for _ in 0..STRIDES {
            if least.0 <= left.0 && least.0 <= right.0 {
                break;
            }
            if left.0 < right.0 {
                (x, right, least) = (x - stride, least, left);
                left = valley.at(x - stride);
            } else {
                (x, left, least) = (x + stride, least, right);
                right = valley.at(x + stride);
            }
        }
        bend = (left.0 + right.0 - 2.0 * least.0) / (stride * stride);
        if !(bend.is_finite() && bend > 0.0) {
            stride *= NEARER;
            continue;
        }
        let step = ((left.0 - right.0) / (2.0 * stride * bend)).clamp(-stride, stride);
        let there = valley.at(x + step);
        if there.0 < least.0 {
            (x, least) = (x + step, there);
        }
        // A joint that does not fit tells its scale the less exactly.
        let misfit = least.1.map_or(1.0, |evidence| evidence.chi_squared_per_freedom().max(1.0));
        let deviation = (2.0 * misfit / bend).sqrt();
        if step.abs() < 0.05 * deviation && stride < 4.0 * deviation {
            break;
        }
        stride = (2.0 * deviation).clamp(LEAST_STRIDE.max(NEARER * stride), MOST_STRIDE);
    }
    Some(valley.told(x, bend, &least.1?))
}

/// How well a joint shows a scale that was found in another way, by what it costs at scales beside it.
///
/// As [`estimate`], but for the scale, which stays; and by that, where nothing shows beside the scale: it may be far from the
/// one that this joint asks for.
pub(crate) fn shown_at(model: &dyn JointModel, plain: &RelativeMotion<'_>, logarithm: f64) -> Option<Estimate> {
    let mut valley = Valley { model, plain, belief: Belief::about(logarithm), followed: None };
    let here = valley.evidence_at(logarithm)?;
    if is_free(&here) {
        return Some(Estimate::none(valley.belief));
    }
    let least = valley.cost_of(logarithm, &here);
    let mut beside = |stride: f64| valley.at(logarithm - stride).0 + valley.at(logarithm + stride).0;
    let mut stride = STRIDE_BESIDE;
    let mut bend = f64::NAN;
    let frames = plain.pose_series().map_or(0, |series| series.poses().len()) as f64;
    for _ in 0..LOOKS {
        bend = (beside(stride) - 2.0 * least) / (stride * stride);
        if !(bend.is_finite() && bend > 0.0) {
            stride = (stride / NEARER).min(MOST_STRIDE);
            continue;
        }
        let deviation = (2.0 / bend).sqrt();
        // No frame is pushed far where all of them together cost no more than one each.
        let fits = stride <= deviation * FITTING || bend * stride * stride <= 2.0 * frames;
        if deviation <= stride * FITTING && fits {
            break;
        }
        stride = deviation.clamp(LEAST_STRIDE.max(NEARER * stride), MOST_STRIDE);
    }
    let told = valley.told(logarithm, bend, &here);
    if told.is_observable() {
        return Some(told);
    }
    Some(Estimate { logarithm, ..estimate(model, plain, &[], valley.belief)? })
}

/// Whether a joint allows everything, so that the scale does not matter to it.
fn is_free(evidence: &Evidence) -> bool {
    evidence.mobility.turns + evidence.mobility.slides >= 6
}

/// What a joint costs at every scale.
struct Valley<'a> {
    model: &'a dyn JointModel,
    plain: &'a RelativeMotion<'a>,
    belief: Belief,
    /// The latest fit that can be followed, and the scale at which it was begun.
    followed: Option<(f64, Followed<'a>)>,
}

impl Valley<'_> {
    fn evidence_at(&mut self, logarithm: f64) -> Option<Evidence> {
        let scaled = self.plain.moving().scaled(logarithm.exp());
        let motion = self.plain.rescaled(self.plain.reference(), &scaled).ok()?;
        let Some((mechanism, series)) = self.model.mechanism().zip(motion.pose_series()) else {
            return self.model.fit(&motion).ok()?.evidence;
        };
        let near = |(begun, _): &&mut (f64, Followed<'_>)| (logarithm - *begun).abs() <= FOLLOWED;
        if let Some((_, followed)) = self.followed.as_mut().filter(near)
            && let Some(chi_squared) = followed.chi_squared(series)
        {
            return Some(Evidence { chi_squared, ..*followed.evidence() });
        }
        let begun = Followed::begin(mechanism, series).ok()?;
        let evidence = *begun.evidence();
        self.followed = Some((logarithm, begun));
        Some(evidence)
    }

    /// The cost at a scale, infinite where there is none, and what it is of.
    fn at(&mut self, logarithm: f64) -> (f64, Option<Evidence>) {
        let found = if logarithm.abs() > RANGE { None } else { self.evidence_at(logarithm) };
        (found.as_ref().map_or(f64::INFINITY, |evidence| self.cost_of(logarithm, evidence)), found)
    }

    fn cost_of(&self, logarithm: f64, evidence: &Evidence) -> f64 {
        let Belief { mean, deviation } = self.belief;
        evidence.chi_squared / evidence.correlation_time + ((logarithm - mean) / deviation).powi(2)
    }

    /// What the curvature at a scale tells.
    fn told(&self, logarithm: f64, bend: f64, found: &Evidence) -> Estimate {
        let usual = self.belief.deviation.powi(2);
        let by_data = bend / 2.0 - usual.recip();
        if !(by_data.is_finite() && by_data > 0.0) {
            return Estimate::none(self.belief);
        }
        let variance = found.chi_squared_per_freedom().max(1.0) / by_data;
        let frames = self.plain.pose_series().map_or(1, |series| series.poses().len()) as f64;
        Estimate {
            logarithm,
            standard_error: variance.sqrt(),
            signal: (by_data * found.correlation_time / frames).sqrt(),
            // As all parameters: nothing that is known beforehand is less than a single observation tells.
            price: (1.0 + (usual / variance).min(found.observations)).ln()
                + (logarithm - self.belief.mean).powi(2) / (usual + variance),
        }
    }
}
