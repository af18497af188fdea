//! The poses of one body as seen from another, with their uncertainty: all that likelihoods need of a pair.

mod merged;

use std::sync::OnceLock;

use nalgebra::{Matrix3, Matrix6, Point3, Translation3, Vector3};

use merged::Mean;

use crate::answers::Answers;
use crate::noise::{believed_drift, slowness};
use crate::selection::{Common, sampled, telling};
use crate::whitening::Roots;
use crate::{BodyMotion, Play, Pose, leaps, quantile};

/// Features whose travel is measured.
const TRAVELLERS: usize = 4;
/// Least uncertainty of a rotation, radians, and of a position as a share of the bodies' size: what rounding and
/// calibration leave of a recording without noise.
const LEAST_TURN: f64 = 1.7e-4;
const LEAST_SHIFT: f64 = 7e-5;
/// Largest uncertainty of a rotation that is used as a measure, radians.
const MOST_TURN: f64 = 1.0;
/// Range from 2 to 98 % of a standard normal variable.
const NOISE_RANGE: f64 = 4.107;

/// Relative poses of two bodies and their uncertainty: all that a likelihood looks at.
///
/// # Convention
/// The pair is taken in an order of its own, so that it does not matter which body is called the reference: the one
/// that rests by definition, or else the better known one, is the reference *here*, and [`PoseSeries::reversed`] says
/// whether that exchanges the bodies. Poses are taken about the moving body's centre: coordinates of the reference are
/// moved by [`PoseSeries::origin`], those of the moving body by [`PoseSeries::moving_origin`]: a point `p` of the moving
/// body is at `poses()[t] * (p - moving_origin()) + origin()` in the coordinates of the reference.
///
/// # For models
/// A fit ignores the order: misfit and evidence are the same either way. What is told is not: axis and positions are
/// those that were asked for. Where the series is reversed, a model inverts every pose before it tells positions, and
/// gives the axis it found in the coordinates of the moving body *here*, which is the reference that was asked for,
/// with the opposite direction, as the joint moves backwards when seen from the other side.
/// Where a fit begins must turn with the coordinates: from mean, principal directions or products of the poses, not
/// from fixed axes; the conformance suite of `jointscope-models` compares fits in turned coordinates.
#[derive(Debug, Clone)]
#[expect(clippy::struct_excessive_bools, reason = "each says something else of the series")]
pub struct PoseSeries {
    frames: Vec<usize>,
    poses: Vec<Pose>,
    noise: Vec<Matrix6<f64>>,
    reversed: bool,
    origin: Vector3<f64>,
    moving_origin: Vector3<f64>,
    correlation_time: f64,
    tracked: bool,
    smooth: bool,
    vague: bool,
    merged_cost: f64,
    merged_motion: f64,
    turn: f64,
    /// Of the pair, metres, and the share of an error that lasts to the next frame.
    size: f64,
    drift: f64,
    bodies: Vec<Outline>,
    ends: OnceLock<Vec<End>>,
    play: Play,
    observed: usize,
    leaps: usize,
    leap_share: f64,
    evenly: bool,
    seen: usize,
    every_pose: Vec<(usize, Pose)>,
    start: Option<Start>,
    pub(crate) roots: Roots,
    answers: Answers,
}

/// How well the coordinates of the body that was asked to be the reference are known: they are those of the recording
/// at one frame, and that frame has noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Covariance of the body's pose at its first frame, as a twist `[ω; v]` about its centre, in its coordinates.
    pub covariance: Matrix6<f64>,
    /// Its centre, in its coordinates, metres.
    pub centre: Vector3<f64>,
}

/// One of the two bodies as it is seen in its own coordinates.
#[derive(Debug, Clone)]
struct Outline {
    /// As [`End::centre`].
    centre: Vector3<f64>,
    /// Its features, from the centre, metres.
    features: Vec<Vector3<f64>>,
}

/// What matters at one of the two bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct End {
    /// Where the body's centre is: in the moving body's coordinates (zero), or in the reference's.
    pub centre: Vector3<f64>,
    /// How far the body's features travel as seen from the other body, metres.
    pub travel: f64,
    /// Root mean square distance of its features from its centre, metres.
    pub radius: f64,
    /// Noise of its position relative to the other body, metres per coordinate.
    pub shift_noise: f64,
    /// Play of its position, metres.
    pub shift_play: f64,
    /// The same for a body that does not travel at all, metres.
    pub rest_play: f64,
}

impl PoseSeries {
    /// The series of a pair, of the frames that say something of their own, or of those of another series; `None` if one
    /// of the bodies has no poses, or no frame shows both.
    pub(crate) fn between(
        asked_reference: &BodyMotion<'_>,
        asked_moving: &BodyMotion<'_>,
        as_in: Option<&Self>,
    ) -> Option<Self> {
        let play = asked_moving.play();
        let reversed = comes_first(asked_moving, asked_reference);
        let (reference, moving) =
            if reversed { (asked_moving, asked_reference) } else { (asked_reference, asked_moving) };
        let both = reference.likely_poses().iter().zip(moving.likely_poses()).enumerate();
        let mut common: Vec<Common> = both.filter_map(|(frame, (r, m))| Some((frame, (*r)?, (*m)?))).collect();
        let observed = common.len();
        let size = if reference.is_at_rest() { moving.size() } else { reference.size().max(moving.size()) };
        let noise_of = |body: &BodyMotion<'_>| body.noise().position.unwrap_or(0.0);
        let places: Vec<Vector3<f64>> =
            common.iter().map(|(_, r, m)| (r.inverse() * m * moving.centre()).coords).collect();
        let noise = noise_of(reference).hypot(noise_of(moving)).max(LEAST_SHIFT * size);
        let leaping = leaps(&places, LEAST_SHIFT * size);
        let mut leaves = leaping.frames.iter();
        match as_in {
            Some(other) => {
                common
                    .retain(|(frame, _, _)| other.every_pose.binary_search_by_key(frame, |(known, _)| *known).is_ok());
            }
            None => common.retain(|_| !leaves.next().copied().unwrap_or(false)),
        }
        let (of_reference, of_moving) = (reference.pose_covariances(), moving.pose_covariances());
        let (_, first_reference, first_moving) = common.first()?;
        let (moving_origin, reference_centre) = (moving.centre().coords, reference.centre());
        let origin = (first_reference.inverse() * first_moving * Point3::from(moving_origin)).coords;
        let line = |(body, poses_it): (&BodyMotion<'_>, bool)| Some((body.centre(), body.line()?, poses_it));
        let lines: Vec<_> = [(moving, true), (reference, false)].into_iter().filter_map(line).collect();
        let [before, after] = [-origin, moving_origin].map(|by| Pose::from(Translation3::from(by)));
        let (taken, evenly) = match as_in {
            Some(other) => {
                let known = |index: &usize| other.frames.binary_search(&common[*index].0).is_ok();
                ((0..common.len()).filter(known).collect(), other.evenly)
            }
            None => telling_sample(&common, reference, moving, noise),
        };
        let (mut frames, mut poses, mut noise) = (Vec::new(), Vec::new(), Vec::new());
        for index in taken {
            let (frame, reference_pose, moving_pose) = &common[index];
            frames.push(*frame);
            poses.push(before * reference_pose.inverse() * moving_pose * after);
            let turn = moving_pose.rotation.inverse().to_rotation_matrix();
            let lever = moving_pose.inverse() * (reference_pose * reference_centre) - Point3::from(moving_origin);
            let mut covariance = rotated(&of_moving[*frame], turn.matrix())
                + carried(&rotated(&of_reference[*frame], turn.matrix()), &lever);
            for k in 0..3 {
                covariance[(k, k)] += LEAST_TURN.powi(2);
                covariance[(k + 3, k + 3)] += (LEAST_SHIFT * size).powi(2).max(f64::MIN_POSITIVE.sqrt());
            }
            // What nothing tells of the turn about a line through a body.
            for &(centre, direction, poses_it) in &lines {
                let pose = if poses_it { moving_pose } else { reference_pose };
                let along = turn * (pose.rotation * direction);
                let lever = if poses_it {
                    Vector3::zeros()
                } else {
                    moving_pose.inverse() * (pose * centre) - Point3::from(moving_origin)
                };
                let mut twist = nalgebra::Vector6::zeros();
                twist.fixed_rows_mut::<3>(0).copy_from(&along);
                twist.fixed_rows_mut::<3>(3).copy_from(&lever.cross(&along));
                covariance += twist * twist.transpose() * UNSEEN_TURN * UNSEEN_TURN;
            }
            noise.push(covariance);
        }
        let drift = believed_drift(reference.drift().max(moving.drift()), poses.len());
        let mut series = Self {
            frames,
            poses,
            noise,
            reversed,
            origin,
            moving_origin,
            correlation_time: (1.0 + drift) / (1.0 - drift),
            tracked: reference.is_tracked() && !reference.is_at_rest() || moving.is_tracked(),
            smooth: reference.is_smooth() || moving.is_smooth(),
            vague: [reference, moving].iter().any(|body| body.line().is_some()),
            merged_cost: 0.0,
            merged_motion: 0.0,
            turn: 0.0,
            size,
            drift,
            bodies: vec![Outline { centre: Vector3::zeros(), features: moving.features_about_centre() }],
            ends: OnceLock::new(),
            play: *play,
            observed,
            leaps: observed - common.len(),
            leap_share: as_in.map_or(leaping.share, |other| other.leap_share),
            evenly,
            seen: 0,
            start: start_of(asked_reference),
            roots: Roots::default(),
            answers: Answers::default(),
            every_pose: common.iter().map(|(frame, r, m)| (*frame, before * r.inverse() * m * after)).collect(),
        };
        series.seen = series.poses.len();
        series.turn = series.turn_range();
        if !reference.is_at_rest() {
            let (centre, features) = (reference_centre.coords - origin, reference.features_about_centre());
            series.bodies.push(Outline { centre, features });
        }
        Some(series)
    }

    fn end(&self, Outline { centre, features }: &Outline, of_reference: bool) -> End {
        let Self { size, drift, play, .. } = self;
        let travel = far_apart(features)
            .into_iter()
            .map(|feature| {
                let place = Point3::from(centre + feature);
                let seen = |pose: &Pose| if of_reference { pose.inverse() * place } else { pose * place };
                range(&self.poses.iter().map(|pose| seen(pose).coords).collect::<Vec<_>>())
            })
            .fold(0.0, f64::max);
        let square = features.iter().map(Vector3::norm_squared).sum::<f64>() / features.len().max(1) as f64;
        let shift_noise = self.shift_noise_at(centre, of_reference);
        let drifting = play.drift * drift * shift_noise;
        let rest_play = (play.size * size + play.distance).hypot(drifting);
        // What noise adds to the range is no travel.
        let of_noise = NOISE_RANGE * shift_noise.hypot((2.0_f64 / 3.0 * square).sqrt() * self.turn_noise());
        let moved = (travel.powi(2) - of_noise.powi(2)).max(0.0).sqrt();
        let shift_play = (play.travel * moved + play.size * size + play.distance).hypot(drifting);
        End { centre: *centre, travel, radius: square.sqrt(), shift_noise, shift_play, rest_play }
    }

    /// Noise of the position of a body's centre as seen from the other body, metres per coordinate.
    fn shift_noise_at(&self, centre: &Vector3<f64>, of_reference: bool) -> f64 {
        let of_pose = |(noise, pose): (&Matrix6<f64>, &Pose)| {
            let shift = noise.fixed_view::<3, 3>(3, 3).trace();
            if !of_reference {
                return shift / 3.0;
            }
            // Of twists about a point from which the pose's centre is at the lever.
            let lever = -(pose.inverse() * Point3::from(*centre)).coords.cross_matrix();
            let (turn, mixed) = (noise.fixed_view::<3, 3>(0, 0), noise.fixed_view::<3, 3>(0, 3));
            (shift + 2.0 * (lever * mixed).trace() + (lever * turn * lever.transpose()).trace()) / 3.0
        };
        median(self.noise.iter().zip(&self.poses).map(of_pose).collect()).sqrt()
    }

    /// What several fits ask of these poses, computed once: by the type of the answer, which should belong to who asks.
    pub fn once<T: Clone + Send + Sync + 'static>(&self, ask: impl FnOnce() -> T) -> T {
        self.answers.get_or_ask(ask)
    }

    /// Frames of the recording, increasing.
    pub fn frames(&self) -> &[usize] {
        &self.frames
    }

    /// `reference_from_moving`, about the origins: maps a point of the moving body, less
    /// [`moving_origin`](Self::moving_origin), to the reference's coordinates, less [`origin`](Self::origin). The first
    /// has no translation, but for noise: the moving body's centre is where the coordinates start.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// Covariance of every pose, rad and m squared, as a twist `[ω; v]` in the moving body's coordinates about its
    /// centre: the true pose is `pose · exp(twist)`.
    pub fn noise(&self) -> &[Matrix6<f64>] {
        &self.noise
    }

    /// Whether reference and moving body are exchanged here: then poses are `asked_moving_from_asked_reference`.
    pub fn reversed(&self) -> bool {
        self.reversed
    }

    /// Where coordinates start, in the reference's coordinates, metres.
    pub fn origin(&self) -> Vector3<f64> {
        self.origin
    }

    /// Where coordinates start, in the moving body's coordinates, metres.
    pub fn moving_origin(&self) -> Vector3<f64> {
        self.moving_origin
    }

    /// Frames that count as one independent observation, because errors drift; 1 for white noise.
    pub fn correlation_time(&self) -> f64 {
        self.correlation_time
    }

    /// Variance of the mean of so many successive errors, in those of the mean of independent ones; 1 for white noise.
    pub fn slowness(&self, frames: f64) -> f64 {
        slowness((self.correlation_time - 1.0) / (self.correlation_time + 1.0), frames)
    }

    /// Whether a tracker gave the poses, whose rotations may be slowly wrong.
    pub fn tracked(&self) -> bool {
        self.tracked
    }

    /// Whether successive errors of tracked poses are alike, which hides how large they are.
    pub fn smooth(&self) -> bool {
        self.smooth
    }

    /// Whether a turn of one of the bodies is not seen at all.
    pub fn vague(&self) -> bool {
        self.vague
    }

    /// What is already paid for the frames that were merged, in units of -2 log likelihood.
    pub fn merged_cost(&self) -> f64 {
        self.merged_cost
    }

    /// What of that is not noise: frames that were merged differ by their motion, too.
    pub fn merged_motion(&self) -> f64 {
        self.merged_motion
    }

    /// Range of the rotation, radians, at most a full turn.
    pub fn turn(&self) -> f64 {
        self.turn
    }

    /// What matters at the moving body and, unless it is the world, at the reference.
    pub fn ends(&self) -> &[End] {
        let end = |(number, body)| self.end(body, number > 0);
        self.ends.get_or_init(|| self.bodies.iter().enumerate().map(end).collect())
    }

    /// Extent of the joint's neighbourhood: the radius of the moving body, metres.
    pub fn radius(&self) -> f64 {
        self.ends().iter().map(|end| end.radius).fold(0.0, f64::max)
    }

    /// Play of joints, as set.
    pub fn play(&self) -> &Play {
        &self.play
    }

    /// Frames that were seen, of which the series may hold fewer.
    pub fn observed(&self) -> usize {
        self.observed
    }

    /// Frames left out because the bodies leap apart in them, and are back in the next.
    pub fn leaps(&self) -> usize {
        self.leaps
    }

    /// Share of the frames in which the bodies leap apart, also where it is so large that none was left out.
    pub fn leap_share(&self) -> f64 {
        self.leap_share
    }

    /// Poses of the series before any were merged.
    pub fn seen(&self) -> usize {
        self.seen
    }

    /// `reference_from_moving` of every frame that shows both bodies, about the origins, with the frame: also those
    /// that the series passes over or merges, but no leaps.
    pub fn every_pose(&self) -> &[(usize, Pose)] {
        &self.every_pose
    }

    /// How well the coordinates of the body asked to be the reference are known; `None` where they are given: by the
    /// world, or by a tracker's first pose.
    pub fn start(&self) -> Option<&Start> {
        self.start.as_ref()
    }

    /// How far the poses are from their mean, in standard deviations of their noise: root mean square over the six
    /// coordinates. About 1 for bodies that do not move.
    pub fn signal(&self) -> f64 {
        let Some(mean) = Mean::of(self, 0..self.poses.len()) else { return 0.0 };
        (mean.cost / (6 * self.poses.len()) as f64).sqrt()
    }

    /// Whether what was taken for noise is nearly all of the motion: noise at rest, or single poses in no order.
    pub fn is_unordered(&self) -> bool {
        /// Share of the spread.
        const NEARLY: f64 = 0.4;
        let spread = |vectors: Vec<Vector3<f64>>| {
            let count = vectors.len().max(1) as f64;
            let mean = vectors.iter().sum::<Vector3<f64>>() / count;
            let square = vectors.iter().map(|v| (v - mean).component_mul(&(v - mean))).sum::<Vector3<f64>>() / count;
            square.max().sqrt()
        };
        let Some(middle) = self.poses.get(self.poses.len() / 2) else { return false };
        let shifts = spread(self.poses.iter().map(|pose| pose.translation.vector).collect());
        let turns =
            spread(self.poses.iter().map(|pose| (pose.rotation * middle.rotation.inverse()).scaled_axis()).collect());
        self.ends()[0].shift_noise > NEARLY * shifts || self.turn_noise() > NEARLY * turns
    }

    /// Whether neither turn nor travel, as ranges, exceed so many standard deviations of the noise.
    pub fn is_within_noise(&self, deviations: f64) -> bool {
        let End { travel, shift_noise, .. } = self.ends()[0];
        self.turn < deviations * self.turn_noise() && travel < deviations * shift_noise
    }

    pub(crate) fn with_noise(&self, factor: f64) -> Self {
        let mut series = self.clone();
        series.noise.iter_mut().for_each(|noise| *noise *= factor * factor);
        let larger = |end: &End| End { shift_noise: factor * end.shift_noise, ..*end };
        series.ends = OnceLock::from(self.ends().iter().map(larger).collect::<Vec<_>>());
        series
    }

    /// Noise of the rotation, radians per coordinate.
    pub fn turn_noise(&self) -> f64 {
        let of_frames = self.noise.iter().map(|noise| noise.fixed_view::<3, 3>(0, 0).trace() / 3.0);
        median(of_frames.collect()).sqrt().min(MOST_TURN)
    }

    fn turn_range(&self) -> f64 {
        let Some(middle) = self.poses.get(self.poses.len() / 2) else { return 0.0 };
        let turns: Vec<Vector3<f64>> =
            self.poses.iter().map(|pose| (pose.rotation * middle.rotation.inverse()).scaled_axis()).collect();
        range(&turns).min(std::f64::consts::TAU)
    }
}

/// The frames, by their index in `common`, that say something of their own, fewer of a long recording, and whether they
/// lie evenly in time.
fn telling_sample(
    common: &[Common],
    reference: &BodyMotion<'_>,
    moving: &BodyMotion<'_>,
    noise: f64,
) -> (Vec<usize>, bool) {
    let fresh = telling(common, reference, moving);
    let poses: Vec<Pose> = fresh.iter().map(|&index| common[index].1.inverse() * common[index].2).collect();
    let arm = if moving.is_tracked() { 0.0 } else { moving.size() / 2.0 };
    let sample = sampled(&poses, &moving.centre(), arm, noise);
    (sample.frames.iter().map(|index| fresh[*index]).collect(), sample.evenly)
}

/// Uncertainty of a turn that is not seen, radians.
const UNSEEN_TURN: f64 = 3.0;

fn start_of(reference: &BodyMotion<'_>) -> Option<Start> {
    if reference.is_at_rest() || reference.is_tracked() {
        return None;
    }
    Some(Start { covariance: reference.start_covariance()?, centre: reference.centre().coords })
}

/// Whether a body comes first in the order in which pairs are taken.
fn comes_first(body: &BodyMotion<'_>, other: &BodyMotion<'_>) -> bool {
    let rank = |body: &BodyMotion<'_>| {
        let covariances = body.pose_covariances();
        let posed = || body.likely_poses().iter().zip(covariances).filter(|(pose, _)| pose.is_some());
        let turns = posed().map(|(_, covariance)| covariance.fixed_view::<3, 3>(0, 0).trace()).sum::<f64>();
        (!body.is_at_rest(), turns / posed().count().max(1) as f64)
    };
    let (a, b) = (rank(body), rank(other));
    a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then_with(|| body.name().cmp(other.name())).is_lt()
}

/// A covariance in turned axes.
fn rotated(covariance: &Matrix6<f64>, turn: &Matrix3<f64>) -> Matrix6<f64> {
    let mut result = Matrix6::zeros();
    for (row, column) in [(0, 0), (0, 3), (3, 0), (3, 3)] {
        let block = turn * covariance.fixed_view::<3, 3>(row, column) * turn.transpose();
        result.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
    }
    result
}

/// A covariance of twists about a centre, as twists about the point from which the centre is at `lever`, to the second order
/// of the turns: docs/method.md, equation (7c).
fn carried(covariance: &Matrix6<f64>, lever: &Vector3<f64>) -> Matrix6<f64> {
    let mut adjoint = Matrix6::identity();
    adjoint.fixed_view_mut::<3, 3>(3, 0).copy_from(&lever.cross_matrix());
    let mut carried = adjoint * covariance * adjoint.transpose();
    // A turn of which nothing is known takes the point no farther than the lever is long.
    let turns = covariance.fixed_view::<3, 3>(0, 0);
    let turns = turns / (1.0 + turns.trace());
    let moved = turns * lever;
    let mixed = turns * moved * lever.transpose();
    let squares = 2.0 * turns.norm_squared() * lever * lever.transpose();
    let bends = turns * lever.dot(&moved) + moved * moved.transpose() - 2.0 * (mixed + mixed.transpose()) + squares;
    let mut places = carried.fixed_view_mut::<3, 3>(3, 3);
    places += bends / 4.0;
    carried
}

/// A few points as far apart as can be, beginning with the one farthest from the origin.
fn far_apart(points: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut chosen = vec![Vector3::zeros()];
    for _ in 0..TRAVELLERS {
        let apart = |p: &&Vector3<f64>| chosen.iter().map(|c| (*p - c).norm_squared()).fold(f64::INFINITY, f64::min);
        match points.iter().max_by(|a, b| apart(a).total_cmp(&apart(b))) {
            Some(farthest) => chosen.push(*farthest),
            None => break,
        }
    }
    chosen
}

/// Range from 2 to 98 % along the direction of the largest spread.
pub(crate) fn range(points: &[Vector3<f64>]) -> f64 {
    if points.len() < 2 {
        return 0.0;
    }
    let mut column = Vec::with_capacity(points.len());
    let centre = Vector3::from_fn(|axis, _| {
        column.clear();
        column.extend(points.iter().map(|p| p[axis]));
        let middle = column.len() / 2;
        *column.select_nth_unstable_by(middle, f64::total_cmp).1
    });
    column.clear();
    column.extend(points.iter().map(|p| (p - centre).norm()));
    let reach = 2.0 * quantile(&mut column, 0.95) + f64::MIN_POSITIVE;
    let near = points.iter().map(|p| p - centre).filter(|p| p.norm() <= reach);
    let scatter = near.map(|p| p * p.transpose()).sum::<Matrix3<f64>>();
    let eigen = scatter.symmetric_eigen();
    let widest = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    column.clear();
    column.extend(points.iter().map(|p| widest.dot(&(p - centre))));
    quantile(&mut column, 0.98) - quantile(&mut column, 0.02)
}

pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() { 0.0 } else { quantile(&mut values, 0.5) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twist;

    /// Share of the second order: turns are divided by `1 + tr S = 1.009`, and enter twice.
    const CLOSE: f64 = 0.03;

    /// What uncertain turns do to a far place has the covariance of its first and second order, by quadrature that is exact
    /// for fourth powers of normal variables.
    #[test]
    fn covariances_are_carried_over_long_levers_to_the_second_order() {
        let axes = twist::exp(&nalgebra::Vector6::new(0.4, -0.7, 1.1, 0.0, 0.0, 0.0)).rotation.to_rotation_matrix();
        let deviations = Vector3::new(0.08, 0.02, 0.05);
        let turns = axes * Matrix3::from_diagonal(&deviations.component_mul(&deviations)) * axes.transpose();
        let lever = Vector3::new(3.0, -1.0, 2.0);
        let nodes = [(-3_f64.sqrt(), 1.0 / 6.0), (0.0, 2.0 / 3.0), (3_f64.sqrt(), 1.0 / 6.0)];
        let (mut mean, mut square) = (Vector3::zeros(), Matrix3::zeros());
        for (x, of_x) in nodes {
            for (y, of_y) in nodes {
                for (z, of_z) in nodes {
                    let turn = axes * deviations.component_mul(&Vector3::new(x, y, z));
                    let first = turn.cross(&lever);
                    let moved = first + turn.cross(&first) / 2.0;
                    mean += moved * (of_x * of_y * of_z);
                    square += moved * moved.transpose() * (of_x * of_y * of_z);
                }
            }
        }
        let expected = square - mean * mean.transpose();
        let mut covariance = Matrix6::zeros();
        covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&turns);
        let found = carried(&covariance, &lever).fixed_view::<3, 3>(3, 3).into_owned();
        let first = lever.cross_matrix() * turns * lever.cross_matrix().transpose();
        assert!((found - expected).norm() < CLOSE * (expected - first).norm(), "{found} {expected}");
    }
}
