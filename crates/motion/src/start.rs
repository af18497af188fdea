//! Where a body was at its first frame, told by the frames that follow.

use nalgebra::{Matrix6, Point3, Translation3, UnitQuaternion, Vector3, Vector6};

use crate::Pose;

/// Highest power of time by which a motion is described, and powers beyond it that must be of no use.
const DEGREES: usize = 4;
const BEYOND: usize = 2;
const TERMS: usize = DEGREES + BEYOND;
/// Fewest frames, most frames, and the factor from one number of frames to the next.
const FEWEST: usize = 8;
const MOST: usize = 200;
const GROWTH: f64 = 1.4;
/// Turn up to which rotations add up like vectors, radians.
const LARGEST_TURN: f64 = 0.5;

/// A body's pose at its first frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FirstPose {
    /// `recording_from_body`.
    pub(crate) pose: Pose,
    /// Covariance of a twist `[ω; v]` about the body's centre, in axes of the recording.
    pub(crate) covariance: Matrix6<f64>,
}

/// The first pose by itself, or by a polynomial over as many of the first frames as one describes: bodies move smoothly
/// and trackers' noise does not.
///
/// Of all degrees up to the third, and all numbers of frames over which nothing but noise is left and two further
/// degrees would change nothing, the one that knows the first pose best. `correlation_time` frames count as one.
pub(crate) fn first_pose(
    poses: &[Option<Pose>],
    covariances: &[Matrix6<f64>],
    centre: &Point3<f64>,
    correlation_time: f64,
) -> Option<FirstPose> {
    let start = poses.iter().position(Option::is_some)?;
    let first = poses[start]?;
    let alone = FirstPose { pose: first, covariance: covariances[start] };
    let departures: Vec<(f64, Vector6<f64>, Vector6<f64>)> = poses[start..]
        .iter()
        .zip(&covariances[start..])
        .enumerate()
        .filter_map(|(time, (pose, covariance))| {
            let pose = pose.as_ref()?;
            let turn = (pose.rotation * first.rotation.inverse()).scaled_axis();
            let shift = pose * centre - first * centre;
            let departure = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
            Some((time as f64, departure, covariance.diagonal() * correlation_time))
        })
        .take(MOST)
        .take_while(|(_, departure, _)| departure.fixed_rows::<3>(0).norm() < LARGEST_TURN)
        .collect();
    if departures.iter().any(|(_, _, variances)| !(variances.min() > 0.0)) {
        return Some(alone);
    }
    let mut best = (alone.covariance.diagonal() * correlation_time, Vector6::zeros());
    let mut open = [true; DEGREES];
    let mut count = FEWEST;
    while count <= departures.len() && open.contains(&true) {
        let coordinates: Vec<Coordinate> = (0..6).map(|k| Coordinate::of(&departures[..count], k)).collect();
        for degree in (0..DEGREES).filter(|degree| open[*degree]).collect::<Vec<_>>() {
            let left: f64 = coordinates.iter().map(|c| c.left(degree)).sum();
            let beyond: f64 = coordinates.iter().map(|c| c.beyond(degree)).sum();
            if !(is_chance(left, 6 * (count - degree - 1)) && is_chance(beyond, 6 * BEYOND)) {
                open[degree] = false;
                continue;
            }
            let known = Vector6::from_fn(|k, _| coordinates[k].variance(degree));
            if shortfall(&known, &best.0) < 6.0 {
                best = (known, Vector6::from_fn(|k, _| coordinates[k].start(degree)));
            }
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of frames")]
        let next = (count as f64 * GROWTH) as usize;
        count = if count == departures.len() { next } else { next.min(departures.len()) };
    }
    let (variance, by) = best;
    if by == Vector6::zeros() {
        return Some(alone);
    }
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(by[0], by[1], by[2]));
    let shift = Vector3::new(by[3], by[4], by[5]);
    let pivot = first * centre;
    let moved = Translation3::from(pivot.coords + shift) * turn * Translation3::from(-pivot.coords);
    Some(FirstPose { pose: moved * first, covariance: Matrix6::from_diagonal(&variance) })
}

/// Sum of the ratios of variances.
fn shortfall(of: &Vector6<f64>, to: &Vector6<f64>) -> f64 {
    of.component_div(to).sum()
}

/// Whether a sum of squares of so many standard normal numbers is no larger than chance often makes it.
fn is_chance(sum: f64, count: usize) -> bool {
    let count = count as f64;
    sum <= count + (2.0 * count).sqrt()
}

/// One coordinate of the motion as a polynomial in time, of all degrees at once.
///
/// With the normal equations `A a = b` and `A = L Lᵀ`, `z = L⁻¹ b`: the power `k` lowers the sum of squares by `z_k²`,
/// whatever powers follow it.
struct Coordinate {
    squares: f64,
    z: Vector6<f64>,
    /// First column of `L⁻¹`.
    column: Vector6<f64>,
}

impl Coordinate {
    fn of(departures: &[(f64, Vector6<f64>, Vector6<f64>)], k: usize) -> Self {
        let last = departures.last().map_or(1.0, |(time, ..)| time.max(1.0));
        let (mut a, mut b, mut squares) = (Matrix6::zeros(), Vector6::zeros(), 0.0);
        for (time, departure, variances) in departures {
            let (s, y, weight) = (time / last, departure[k], 1.0 / variances[k]);
            let mut powers = Vector6::repeat(1.0);
            (1..TERMS).for_each(|power| powers[power] = powers[power - 1] * s);
            a += powers * powers.transpose() * weight;
            b += powers * (y * weight);
            squares += y * y * weight;
        }
        let mut unit = Vector6::zeros();
        unit[0] = 1.0;
        let (z, column) = a.cholesky().map_or((Vector6::repeat(f64::NAN), unit), |factor| {
            let solve = |x: &Vector6<f64>| factor.l().solve_lower_triangular(x).unwrap_or(*x);
            (solve(&b), solve(&unit))
        });
        Self { squares, z, column }
    }

    /// Sum of squares that a polynomial of this degree leaves.
    fn left(&self, degree: usize) -> f64 {
        self.squares - self.z.rows(0, degree + 1).norm_squared()
    }

    /// What further degrees would take off it.
    fn beyond(&self, degree: usize) -> f64 {
        self.z.rows(degree + 1, BEYOND).norm_squared()
    }

    fn start(&self, degree: usize) -> f64 {
        self.z.rows(0, degree + 1).dot(&self.column.rows(0, degree + 1))
    }

    fn variance(&self, degree: usize) -> f64 {
        self.column.rows(0, degree + 1).norm_squared()
    }
}
