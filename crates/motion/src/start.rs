//! Where a body was at its first frame, told by the frames that follow.

use nalgebra::{Matrix6, Point3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3, Vector6};

use crate::Pose;

/// Degrees of the polynomials in time by which a motion is described, from 0 on, and those beyond that must be of no use.
const DEGREES: usize = 6;
const BEYOND: usize = 2;
const TERMS: usize = DEGREES + BEYOND;
/// Fewest frames, most frames, and the factor from one number of frames to the next.
const FEWEST: usize = 8;
const MOST: usize = 200;
const GROWTH: f64 = 1.4;
/// Turn up to which rotations add up like vectors, radians.
const LARGEST_TURN: f64 = 1.2;

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
/// Of all degrees up to the fifth, and growing numbers of frames over which nothing but noise is left and two further
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
    let series: Vec<Departure> = poses[start..]
        .iter()
        .zip(&covariances[start..])
        .enumerate()
        .filter_map(|(time, (pose, covariance))| {
            let pose = pose.as_ref()?;
            Some(Departure {
                time: time as f64,
                of: [(pose.rotation * first.rotation.inverse()).scaled_axis(), pose * centre - first * centre],
                variance: [0, 3].map(|k| correlation_time * covariance.fixed_view::<3, 3>(k, k).trace() / 3.0),
                covariance: *covariance,
            })
        })
        .take(MOST)
        .take_while(|departure| departure.of[0].norm() < LARGEST_TURN)
        .collect();
    if series.iter().any(|departure| departure.variance.iter().any(|variance| *variance <= 0.0)) {
        return Some(alone);
    }
    let mut best: Option<(f64, usize, usize)> = None;
    let mut open = [true; DEGREES];
    let mut count = FEWEST;
    while count <= series.len() && open.contains(&true) {
        let parts = [0, 1].map(|part| Polynomials::of(&series[..count], part));
        for (degree, open) in open.iter_mut().enumerate() {
            let left: f64 = parts.iter().map(|part| part.left(degree)).sum();
            let beyond: f64 = parts.iter().map(|part| part.beyond(degree)).sum();
            *open &= is_chance(left, 6 * (count - degree - 1)) && is_chance(beyond, 6 * BEYOND);
            // That of the first frame alone is not larger for being like that of the next.
            let variance = |k: usize| parts[k].variance(degree) * correlation_time / series[0].variance[k];
            let known = variance(0) + variance(1);
            if *open && known < best.map_or(2.0, |(least, ..)| least) {
                best = Some((known, count, degree));
            }
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of frames")]
        let next = (count as f64 * GROWTH) as usize;
        count = if count == series.len() { next } else { next.min(series.len()) };
    }
    let Some((_, count, degree)) = best else { return Some(alone) };
    let parts = [0, 1].map(|part| Polynomials::of(&series[..count], part));
    let [turn, shift] = [0, 1].map(|part| parts[part].start(degree));
    let mut covariance = Matrix6::zeros();
    for departure in &series[..count] {
        let [turn, shift] = [0, 1].map(|part| parts[part].weight(departure, part, degree));
        let weights = Vector6::new(turn, turn, turn, shift, shift, shift);
        covariance += departure.covariance.component_mul(&(weights * weights.transpose())) * correlation_time;
    }
    let pivot = (first * centre).coords;
    let moved = Translation3::from(pivot + shift) * UnitQuaternion::from_scaled_axis(turn) * Translation3::from(-pivot);
    Some(FirstPose { pose: moved * first, covariance })
}

/// How a body's pose differs from its first.
struct Departure {
    /// Frames since the first.
    time: f64,
    /// Turn, radians, and shift of the centre, metres, in axes of the recording.
    of: [Vector3<f64>; 2],
    /// Variance of a coordinate of either.
    variance: [f64; 2],
    covariance: Matrix6<f64>,
}

/// Whether a sum of squares of so many standard normal numbers is no larger than chance often makes it.
fn is_chance(sum: f64, count: usize) -> bool {
    let count = count as f64;
    sum <= count + 2.0 * (2.0 * count).sqrt()
}

/// Turn or shift as a polynomial in time, of all degrees at once.
///
/// With the normal equations `A a = b` and `A = L Lᵀ`, `z = L⁻¹ b`: the power `k` lowers the sum of squares by `z_k²`,
/// whatever powers follow it.
struct Polynomials {
    last: f64,
    squares: f64,
    z: SMatrix<f64, TERMS, 3>,
    inverse: SMatrix<f64, TERMS, TERMS>,
}

impl Polynomials {
    fn of(series: &[Departure], part: usize) -> Self {
        let last = series.last().map_or(1.0, |departure| departure.time.max(1.0));
        let (mut a, mut b, mut squares) = (SMatrix::zeros(), SMatrix::zeros(), 0.0);
        for departure in series {
            let (powers, y, weight) =
                (powers(departure.time / last), departure.of[part], 1.0 / departure.variance[part]);
            a += powers * powers.transpose() * weight;
            b += powers * y.transpose() * weight;
            squares += y.norm_squared() * weight;
        }
        let inverse = a.cholesky().and_then(|factor| factor.l().try_inverse());
        let inverse = inverse.unwrap_or_else(|| SMatrix::repeat(f64::NAN));
        Self { last, squares, z: inverse * b, inverse }
    }

    /// Sum of squares that a polynomial of this degree leaves.
    fn left(&self, degree: usize) -> f64 {
        self.squares - self.z.rows(0, degree + 1).norm_squared()
    }

    /// What further degrees would take off it.
    fn beyond(&self, degree: usize) -> f64 {
        self.z.rows(degree + 1, BEYOND).norm_squared()
    }

    /// The polynomial at the first frame.
    fn start(&self, degree: usize) -> Vector3<f64> {
        (0..=degree).map(|k| self.z.row(k).transpose() * self.inverse[(k, 0)]).sum()
    }

    /// Variance of a coordinate of it.
    fn variance(&self, degree: usize) -> f64 {
        (0..=degree).map(|k| self.inverse[(k, 0)].powi(2)).sum()
    }

    /// Weight of one departure in it.
    fn weight(&self, departure: &Departure, part: usize, degree: usize) -> f64 {
        let along = self.inverse * powers(departure.time / self.last);
        (0..=degree).map(|k| self.inverse[(k, 0)] * along[k]).sum::<f64>() / departure.variance[part]
    }
}

fn powers(s: f64) -> SVector<f64, TERMS> {
    let mut powers = SVector::repeat(1.0);
    (1..TERMS).for_each(|power| powers[power] = powers[power - 1] * s);
    powers
}
