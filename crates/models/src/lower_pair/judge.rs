//! From a mechanism and a motion to a joint with evidence.

use std::borrow::Cow;

use jointscope_motion::{End, Pose, PoseSeries, RelativeMotion, quantile, twist, twist::Twist};
use nalgebra::{Matrix3, Matrix6, Point3, SMatrix, SVector, Vector3};

use super::engine::Fit;
use super::telling::{joint_of, residual_rms, uncertainty};
use super::{Fitted, Geometry, Mechanism, drifting, misfit, random_effect};
use crate::{Confidence, Departure, Evidence, FitError, JointFit, Mobility, Rival};

/// Frames below which nothing is fitted.
const FEWEST: usize = 3;
/// Frames of a recording that count as independent where play, not noise, decides: further ones say nothing new about
/// a slow departure.
const INDEPENDENT_FRAMES: usize = 60;
/// Rounds of reweighting, and the residual, in medians, from which a frame loses weight.
const ROUNDS: usize = 3;
const REMOTE: f64 = 3.0;
/// Squared distance of a frame, in standard deviations, from which it counts as wrong rather than unlikely.
const WRONG: f64 = 36.0;
/// Share of the cost that may be left to gain of a fit that is roughly the best, and the least cost of a frame of one that
/// may be given up.
const ROUGHLY: f64 = 0.2;
const POOR: f64 = 30.0;
/// Variance of the noise that a misfit is allowed before it counts, in variances.
const ALLOWANCE: f64 = 1.25;
/// Turn that a joint must explain for its play to be a share of it, radians; 10 degrees.
const EXPLAINED_TURN: f64 = 0.1745;
/// Orientations of trackers may be slowly wrong by this, radians: 3 degrees where they are weighed, 0.7 degrees where
/// they are charged, at a price.
const WRONG_WEIGHT: f64 = 0.0524;
const WRONG_TURN: f64 = 0.0122;
const WRONG_PRICE: f64 = 4.0;
/// Squared departure beyond which a joint is not the right one.
const ADEQUATE: f64 = 25.0;
/// Share of the freedom in white noise that drifting noise leaves at least.
const LEAST_FREEDOM: f64 = 0.1;
/// Independent shapes of a slow departure over merged frames.
const SLOW_SHAPES: f64 = 3.0;

/// A mechanism fitted to a series of poses.
#[derive(Debug, Clone)]
pub struct Judged {
    /// By noise alone.
    pub ideal: Fitted,
    /// By noise and play, robustly.
    pub adequate: Fitted,
    /// Likelihood terms.
    pub evidence: Evidence,
    /// Misfit beyond noise: root mean square distance at the moving body, metres, and angle, radians.
    pub misfit: (f64, f64),
    /// Range of the turn that the joint explains, radians.
    pub sweep: f64,
    /// By which frames far off weigh less; none where none is.
    pub(super) weights: Vec<Weights>,
}

/// Fits a mechanism to the poses of a pair, and says how well it explains them.
///
/// # Errors
/// [`FitError::TooFewFrames`]; [`FitError::Unsuitable`] if one of the bodies shows no orientation.
///
/// # References
/// docs/method.md, "Evidence" and "Play".
pub fn judge(mechanism: &dyn Mechanism, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
    let series = motion.pose_series().ok_or_else(|| FitError::Unsuitable {
        needed: "poses of both bodies".into(),
        found: "one of them shows a single feature".into(),
    })?;
    let judged = judge_beside(mechanism, series, &Rival::of(motion))?;
    let confidence = Confidence::new((-0.5 * judged.evidence.own_charge()).exp().clamp(0.0, 1.0))?;
    let fitted = judged.fitted();
    let (joint, moving_axis) = joint_of(mechanism, series, fitted, motion.recording_frames());
    let mut result = JointFit::new(confidence, joint)
        .with_part("misfit_distance", judged.misfit.0)
        .with_part("misfit_angle", judged.misfit.1)
        .with_part("sweep", judged.sweep.to_degrees())
        .with_part("departure", judged.evidence.departure.map_or(0.0, |departure| departure.squared))
        .with_part("chi_squared_per_freedom", judged.evidence.chi_squared_per_freedom())
        .with_residual(residual_rms(series, fitted));
    let constants = mechanism.constant_names().iter().zip(&fitted.placement.constants);
    result.parts.extend(constants.map(|(name, value)| (*name, *value)));
    if matches!(mechanism.geometry(&fitted.placement.constants), Geometry::Axis { .. }) {
        let centre = (fitted.placement.joint.inverse() * fitted.placement.home).translation.vector;
        result.parts.insert("radius", centre.x.hypot(centre.y));
    }
    result.axis_in_moving = moving_axis;
    result.axis_uncertainty = uncertainty(mechanism, &judged, series, result.joint.axis.as_ref());
    result.evidence = Some(judged.evidence);
    Ok(result)
}

/// Fits a mechanism to a series of poses: once by noise and play, robustly, and from there by noise alone.
///
/// # Errors
/// [`FitError::TooFewFrames`].
pub fn judge_series(mechanism: &dyn Mechanism, series: &PoseSeries) -> Result<Judged, FitError> {
    judge_beside(mechanism, series, &Rival::NONE)
}

/// The same, roughly where a rival cannot be outdone.
fn judge_beside(mechanism: &dyn Mechanism, series: &PoseSeries, rival: &Rival) -> Result<Judged, FitError> {
    let count = series.poses().len();
    if count < FEWEST {
        return Err(FitError::TooFewFrames { needed: FEWEST, found: count });
    }
    let starts = mechanism.starts(series);
    let plays = series.ends().iter().any(|end| end.shift_play > 0.0);
    let play = if plays { series.usual_play() } else { [0.0; 2] };
    let roots = if plays { series.whitening_with_play() } else { series.whitening() };
    let failed = || FitError::Fault { what: "the fit of the mechanism has no finite cost".into() };
    let mut fit = Fit::begin(mechanism, series.poses(), roots, &starts).ok_or_else(failed)?;
    if rival.is_known() && plays && !series.tracked() && fit.settle_roughly(ROUGHLY) > POOR {
        let rough = fit.fitted();
        if weights_of(&rough.residuals, series, play).is_none() {
            let sweep = sweep(mechanism, &rough);
            let found = departure(&rough, mechanism, series, sweep, None);
            let evidence = evidence_of(mechanism, series, &rough, Some(&found));
            if rival.outdoes(&evidence) {
                let (misfit, ideal, adequate) = (found.misfit, rough.clone(), rough);
                return Ok(Judged { ideal, adequate, evidence, misfit, sweep, weights: Vec::new() });
            }
        }
    }
    let weights = settle_robustly(&mut fit, series, roots, play);
    let adequate = fit.fitted();
    fit.reweigh(weighted(series.whitening(), &weights));
    let ideal = fit.fitted();
    if !(adequate.chi_squared.is_finite() && ideal.chi_squared.is_finite()) {
        return Err(failed());
    }
    let mut evidence = evidence_of(mechanism, series, &ideal, None);
    if series.correlation_time() > 1.0 {
        evidence.freedom = drifting::expected(mechanism, series, &ideal).max(LEAST_FREEDOM * evidence.freedom);
    }
    let sweep = sweep(mechanism, &adequate);
    let mut judged = Judged { ideal, adequate, evidence, misfit: (0.0, 0.0), sweep, weights };
    if plays {
        let mut departure = departure(&judged.adequate, mechanism, series, sweep, None);
        if series.tracked() && mechanism.mobility().turns < 3 && departure.squared > WRONG_PRICE {
            // Orientations may be wrong: a turn that moves nothing is no motion.
            let loose = [WRONG_WEIGHT, play[1]];
            let (starts, roots) = ([judged.adequate.placement], series.whitening_with(loose));
            if let Some(mut other) = Fit::begin(mechanism, series.poses(), &roots, &starts) {
                settle_robustly(&mut other, series, &roots, loose);
                let other = other.fitted();
                let mut found = self::departure(&other, mechanism, series, sweep, Some(WRONG_TURN));
                found.squared += WRONG_PRICE;
                if found.squared < departure.squared {
                    judged.adequate = other;
                    departure = found;
                }
            }
        }
        judged.misfit = departure.misfit;
        judged.evidence.departure = Some(departure.evidence());
    }
    if let Some(usual) = mechanism.usual_constant(series.radius())
        && judged.is_noise()
    {
        let Fitted { placement, constant_variance, .. } = &judged.ideal;
        let drawn = drawn_cost(placement.constants.x, series.correlation_time() * constant_variance, usual);
        judged.evidence.prior_cost += (drawn - evidence.observations.ln()).min(0.0);
    }
    Ok(judged)
}

/// What a fit states, the misfit as play left to be added where it is not given.
fn evidence_of(mechanism: &dyn Mechanism, series: &PoseSeries, fitted: &Fitted, misfit: Option<&Found>) -> Evidence {
    Evidence {
        chi_squared: chi_squared(series, &fitted.residuals),
        configuration_cost: configuration_cost(mechanism, series, fitted),
        departure: misfit.map(Found::evidence),
        ..Evidence::of_poses(mechanism.mobility(), series)
    }
}

/// What residuals leave unexplained. Robust weights find the joint; what the frames cost is told without them.
pub(super) fn chi_squared(series: &PoseSeries, residuals: &[Twist]) -> f64 {
    let square = |(white, residual): (&Matrix6<f64>, &Twist)| (white * residual).norm_squared();
    let squares: Vec<f64> = series.whitening().iter().zip(residuals).map(square).collect();
    series.merged_cost() + sum_of(&squares, 6.0, series.correlation_time())
}

impl Evidence {
    /// What a model of so much mobility costs for poses that it explains exactly, by whatever positions: the terms that
    /// depend on the series alone. To be added are `chi_squared` of what the model leaves, `configuration_cost` of its
    /// positions, and `departure`, unless joints are ideal.
    pub fn of_poses(mobility: Mobility, series: &PoseSeries) -> Self {
        Self {
            chi_squared: series.merged_cost(),
            configuration_cost: 0.0,
            prior_cost: hidden_cost(mobility, series),
            mobility,
            freedom: freedom(mobility, series),
            observations: observations(series),
            correlation_time: series.correlation_time(),
            departure: None,
        }
    }
}

/// Price of a constant that was drawn from a Gaussian about 0 of this standard deviation and fitted with this variance:
/// `-2 ln` of what integrating it out leaves of the likelihood.
fn drawn_cost(constant: f64, variance: f64, usual: f64) -> f64 {
    let usual = usual * usual;
    (1.0 + usual / variance.max(f64::MIN_POSITIVE)).ln() + constant * constant / (usual + variance)
}

/// Cost of a motion that no single frame shows: what rests is more likely at rest.
fn hidden_cost(mobility: Mobility, series: &PoseSeries) -> f64 {
    const HIDDEN: f64 = 2.0;
    let merged = series.poses().len() < series.seen();
    if merged && mobility.turns + mobility.slides > 0 { HIDDEN } else { 0.0 }
}

/// Numbers that count as independent, for the price of parameters.
fn observations(series: &PoseSeries) -> f64 {
    let count = series.poses().len();
    // Six numbers per pose; of the means of merged ones, which are as many as it takes to see any motion, fewer.
    let each = if count < series.seen() { 5 } else { 6 };
    (each * count.min(INDEPENDENT_FRAMES)) as f64
}

/// Numbers observed less numbers fitted: geometry and home pose, and the positions of every frame.
fn freedom(mobility: Mobility, series: &PoseSeries) -> f64 {
    let free = f64::from(mobility.turns + mobility.slides);
    // Mean and spread of the positions are parameters, but take nothing from the residuals.
    let fixed = mobility.parameters as f64 - free - free * (free + 1.0) / 2.0;
    (6.0 * series.seen() as f64 - free * series.poses().len() as f64 - fixed).max(0.0) + series.merged_motion()
}

impl Judged {
    /// The fit by noise alone where noise explains the misfit, else the one by noise and play.
    pub fn fitted(&self) -> &Fitted {
        if self.is_noise() { &self.ideal } else { &self.adequate }
    }

    /// Whether noise alone explains the misfit.
    pub(super) fn is_noise(&self) -> bool {
        let excess = self.evidence.excess();
        self.evidence.departure.is_none_or(|departure| excess < 10.0 || excess < departure.squared)
    }
}

/// Weights of rotation and position of a frame.
pub(super) type Weights = [f64; 2];

/// Roots of the information of every pose with the frames' weights, if there are any.
pub(super) fn weighted<'a>(roots: &'a [Matrix6<f64>], weights: &[Weights]) -> Cow<'a, [Matrix6<f64>]> {
    if weights.is_empty() {
        return Cow::Borrowed(roots);
    }
    let weigh = |(root, weights): (&Matrix6<f64>, &Weights)| {
        let mut root = *root;
        for column in 0..6 {
            root.column_mut(column).scale_mut(weights[column / 3].sqrt());
        }
        root
    };
    roots.iter().zip(weights).map(weigh).collect()
}

/// Fits with weights that fall with the fourth power of what is far off, of rotation and position each on its own: a
/// flat marker's orientation flips while its position stays good. Gives the weights.
fn settle_robustly<'a>(
    fit: &mut Fit<'a>,
    series: &PoseSeries,
    roots: &'a [Matrix6<f64>],
    play: [f64; 2],
) -> Vec<Weights> {
    let mut weights: Vec<Weights> = Vec::new();
    fit.settle();
    for _ in 1..ROUNDS {
        let Some(new) = weights_of(fit.residuals(), series, play) else { break };
        weights = new;
        fit.reweigh(weighted(roots, &weights));
    }
    weights
}

/// Weights by residuals; `None` where none is far off.
fn weights_of(residuals: &[Twist], series: &PoseSeries, play: [f64; 2]) -> Option<Vec<Weights>> {
    let lengths = |part: usize| residuals.iter().map(move |e| e.fixed_rows::<3>(part).norm()).collect();
    let (turns, shifts): (Vec<f64>, Vec<f64>) = (lengths(0), lengths(3));
    let typical =
        |values: &[f64], play: f64, noise: f64| REMOTE * quantile(&mut values.to_vec(), 0.5).max(play).max(noise);
    let turn = typical(&turns, play[0], series.turn_noise());
    let shift = typical(&shifts, play[1], series.ends()[0].shift_noise);
    let most = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    if most(&turns) < 2.0 * turn && most(&shifts) < 2.0 * shift {
        return None;
    }
    let weight = |length: f64, limit: f64| (limit / length.max(limit)).powi(4) + 1e-6;
    Some(turns.iter().zip(&shifts).map(|(r, x)| [weight(*r, turn), weight(*x, shift)]).collect())
}

/// The first positions of every frame, and their noise.
fn cut<const D: usize>(
    positions: &[Vector3<f64>],
    noise: &[nalgebra::Matrix3<f64>],
) -> (Vec<SVector<f64, D>>, Vec<SMatrix<f64, D, D>>) {
    let positions = positions.iter().map(|q| q.fixed_rows::<D>(0).into_owned()).collect();
    (positions, noise.iter().map(|noise| noise.fixed_view::<D, D>(0, 0).into_owned()).collect())
}

/// Price of the positions.
fn configuration_cost(mechanism: &dyn Mechanism, series: &PoseSeries, fitted: &Fitted) -> f64 {
    /// A turn from which angles are compared on the circle, as rotations are, radians.
    const FULL: f64 = 6.0;
    let mut positions: Vec<Vector3<f64>> = fitted.positions.iter().map(|q| mechanism.spread_coordinates(q)).collect();
    let turns = positions.iter().map(|q| q.x);
    let range = turns.clone().fold(f64::NEG_INFINITY, f64::max) - turns.fold(f64::INFINITY, f64::min);
    if mechanism.mobility().turns == 1 && range > FULL {
        for q in &mut positions {
            q.x -= std::f64::consts::TAU * (q.x / std::f64::consts::TAU).round();
        }
    }
    let cost = |positions: &[Vector3<f64>], noise: &[Matrix3<f64>]| match mechanism.freedoms() {
        0 => 0.0,
        1 => {
            let (q, noise) = cut::<1>(positions, noise);
            random_effect::cost(&q, &noise)
        }
        2 => {
            let (q, noise) = cut::<2>(positions, noise);
            random_effect::cost(&q, &noise)
        }
        _ => random_effect::cost(positions, noise),
    };
    let told = cost(&positions, &fitted.position_noise);
    let of_choice = 2.0 * observations(series).ln() * series.correlation_time();
    let otherwise = mechanism.told_otherwise(&positions, &fitted.position_noise);
    otherwise.map_or(told, |other| told.min(cost(&other.positions, &other.noise) + of_choice))
}

/// Range of the turn that the joint explains, radians, at most a full one.
fn sweep(mechanism: &dyn Mechanism, fitted: &Fitted) -> f64 {
    if mechanism.mobility().turns == 0 {
        return 0.0;
    }
    let range = if mechanism.mobility().turns == 1 {
        misfit::range(fitted.positions.iter().map(|q| q.x))
    } else {
        let turns: Vec<Vector3<f64>> = fitted
            .positions
            .iter()
            .map(|q| twist::rotation_log(&mechanism.pose(q, &fitted.placement.constants).rotation))
            .collect();
        misfit::vector_range(&turns)
    };
    range.min(std::f64::consts::TAU)
}

struct Found {
    squared: f64,
    per_noise: f64,
    misfit: (f64, f64),
}

impl Found {
    fn evidence(&self) -> Departure {
        Departure { squared: self.squared, per_noise: self.per_noise, adequate: ADEQUATE }
    }
}

/// The misfit beyond noise in units of play, judged at both bodies.
fn departure(
    fitted: &Fitted,
    mechanism: &dyn Mechanism,
    series: &PoseSeries,
    sweep: f64,
    wrong_turn: Option<f64>,
) -> Found {
    let mobility = mechanism.mobility();
    let (held_turns, held_slides) = (3.0 - f64::from(mobility.turns), 3.0 - f64::from(mobility.slides));
    let play = series.play();
    let turn_noise = series.turn_noise();
    let turns: Vec<f64> = fitted.residuals.iter().map(|e| e.fixed_rows::<3>(0).norm()).collect();
    let turn_square = if held_turns > 0.0 {
        (misfit::mean_square(&turns, turn_noise) - ALLOWANCE * held_turns * turn_noise.powi(2)).max(0.0)
    } else {
        0.0
    };
    let frames = series.poses().len() as f64;
    let least = play.least_turn.to_radians();
    let mut found = Found { squared: 0.0, per_noise: 0.0, misfit: (0.0, turn_square.sqrt()) };
    let share = 1.0 / series.ends().len() as f64;
    for (number, end) in series.ends().iter().enumerate() {
        let shifts = shifts_at(end, number, series, fitted);
        let noise = end.shift_noise;
        let square = (misfit::mean_square(&shifts, noise) - ALLOWANCE * held_slides * noise.powi(2)).max(0.0);
        // A rigid connection does not travel, and has no share of it.
        let rigid = mobility.turns + mobility.slides == 0;
        let shift_play = if rigid { end.rest_play } else { end.shift_play };
        let load = (shift_play / end.radius.max(1e-9)).min(play.load_turn.to_radians()).max(least);
        let own = if sweep > EXPLAINED_TURN { least.max(play.turn * sweep) } else { load };
        let drift = play.drift * (series.correlation_time() - 1.0) / (series.correlation_time() + 1.0);
        let turn_play = wrong_turn.unwrap_or(own.hypot(drift * turn_noise));
        found.squared += share * (square / shift_play.powi(2) + turn_square / turn_play.powi(2));
        // What noise alone would charge for the misfit, part by part, by what play would.
        let by_noise = [over_chance(&turns, turn_noise, held_turns), over_chance(&shifts, noise, held_slides)];
        let ratios = [(turn_play / turn_noise).powi(2), (shift_play / noise).powi(2)];
        let by_play: f64 = by_noise.iter().zip(ratios).map(|(cost, ratio)| cost / ratio.max(f64::MIN_POSITIVE)).sum();
        found.per_noise += share * frames * by_noise.iter().sum::<f64>() / by_play.max(f64::MIN_POSITIVE);
        if number == 0 {
            found.misfit.0 = square.sqrt();
        }
    }
    // Of merged frames few are left, and play is shared out among the few shapes that a slow departure then can have.
    let shapes = if series.poses().len() < series.seen() { SLOW_SHAPES } else { 1.0 };
    found.per_noise /= series.correlation_time() * shapes;
    found
}

/// Sum of squared distances in units of the noise, of single wrong frames no more than a logarithm.
///
/// A wrong pose may be anywhere, as likely within every factor of distance. It is single frames that are wrong, not most
/// of them, and drifting ones are wrong together.
fn sum_of(squares: &[f64], coordinates: f64, correlation_time: f64) -> f64 {
    // By Wilson and Hilferty, the median of a sum of so many squares.
    let median = coordinates * (1.0 - 2.0 / (9.0 * coordinates)).powi(3);
    let usual = quantile(&mut squares.to_vec(), 0.5) / median;
    let wrong = WRONG * correlation_time * usual.max(1.0);
    let cost = |square: f64| if square > wrong { wrong * (1.0 + (square / wrong).ln() / 6.0) } else { square };
    squares.iter().map(|square| cost(*square)).sum()
}

/// Sum of squares in units of the noise beyond its expectation, never below what chance may hide.
fn over_chance(lengths: &[f64], noise: f64, held: f64) -> f64 {
    let count = lengths.len() as f64;
    let squares: Vec<f64> = lengths.iter().map(|length| (length / noise).powi(2)).collect();
    let sum = sum_of(&squares, 3.0, 1.0);
    (sum - held * count).max(0.5 * (2.0 * 3.0 * count).sqrt())
}

/// How far a body's centre is from where the fit puts it, per frame, metres.
fn shifts_at(end: &End, number: usize, series: &PoseSeries, fitted: &Fitted) -> Vec<f64> {
    let shift = |(residual, pose): (&Twist, &Pose)| {
        let lever = if number == 0 { Vector3::zeros() } else { (pose.inverse() * Point3::from(end.centre)).coords };
        (twist::linear(residual) + twist::angular(residual).cross(&lever)).norm()
    };
    fitted.residuals.iter().zip(series.poses()).map(shift).collect()
}

impl JointFit {
    /// A slide whose rail may be bent: the evidence of an arc that turns little, where that is better.
    pub(crate) fn or_bent(mut self, arc: &Self, bend: f64, sweep: f64) -> Self {
        let turned = arc.parts.get("sweep").copied().unwrap_or(0.0);
        self.parts.insert("bend", turned);
        // An arc that turns no more than rails do says nothing about hinges.
        let prior_cost = bend_cost(turned, bend) - far_hinge_cost(turned.max(2.0 * bend), sweep);
        // Bent or not, a slide is not likelier than a straight one beforehand.
        let own = self.evidence.map_or(0, |evidence| evidence.mobility.parameters);
        let of_bend = |e: &Evidence| e.mobility.parameters.saturating_sub(own) as f64 * e.observations.max(1.0).ln();
        let bent = |e: Evidence| Evidence { prior_cost: e.prior_cost + prior_cost.max(-of_bend(&e)), ..e };
        self.alternatives.extend(arc.evidence.map(bent));
        self
    }
}

/// `-2 ln` of how likely a hinge is that turns by so many degrees.
pub(crate) fn far_hinge_cost(turned: f64, sweep: f64) -> f64 {
    -2.0 * (turned.max(1e-3) / sweep).min(1.0).ln()
}

/// The same for a slide whose rail turns by so many degrees.
pub(crate) fn bend_cost(turned: f64, bend: f64) -> f64 {
    (turned / bend).powi(2) + 2.0 * (1.25 * bend / 180.0).ln()
}
