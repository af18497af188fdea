//! Where fits of mechanisms begin: linear estimates from all poses of a series.

use std::sync::Arc;

use jointscope_motion::{Pose, PoseSeries, twist::rotation_log};
use nalgebra::{
    Complex, Matrix3, Matrix4, Matrix6, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3, Vector6,
};

use super::{Placement, turn_about_z};

/// Share of the identity that keeps linear systems solvable where nothing turns.
const RIDGE: f64 = 1e-6;
/// Turn, radians, and shift, as a share of the body's radius, that rounding explains.
const ROUNDING: f64 = 1e-9;
/// Largest pitch that a screw begins with, metres per radian.
const LARGEST_PITCH: f64 = 5.0;

/// What all starts are made of.
struct Summary {
    /// Mean rotation.
    home: UnitQuaternion<f64>,
    /// Rotations relative to the mean, and their vectors.
    turned: Vec<Matrix3<f64>>,
    turns: Vec<Vector3<f64>>,
    shifts: Vec<Vector3<f64>>,
    mean_shift: Vector3<f64>,
    /// Principal directions of the turns and of the shifts, the largest first.
    turn_axes: [Vector3<f64>; 3],
    shift_axes: [Vector3<f64>; 3],
}

impl Summary {
    /// Of a series, made once for all mechanisms.
    fn of(series: &PoseSeries) -> Arc<Self> {
        series.once(|| Arc::new(Self::made(series)))
    }

    fn made(series: &PoseSeries) -> Self {
        let poses = series.poses();
        let count = poses.len() as f64;
        let squares = poses.iter().map(|pose| pose.rotation.coords * pose.rotation.coords.transpose());
        let eigen = squares.sum::<Matrix4<f64>>().symmetric_eigen();
        let coordinates = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
        let home = UnitQuaternion::from_quaternion(Quaternion::from(coordinates));
        let back = home.inverse();
        let turned = poses.iter().map(|pose| (pose.rotation * back).to_rotation_matrix().into_inner()).collect();
        let turns: Vec<Vector3<f64>> = poses.iter().map(|pose| rotation_log(&(pose.rotation * back))).collect();
        let shifts: Vec<Vector3<f64>> = poses.iter().map(|pose| pose.translation.vector).collect();
        let mean_shift = shifts.iter().sum::<Vector3<f64>>() / count;
        let turn_axes = principal(turns.iter().map(|w| w * w.transpose()).sum(), count * ROUNDING.powi(2));
        let scatter = shifts.iter().map(|t| (t - mean_shift) * (t - mean_shift).transpose()).sum();
        let shift_axes = principal(scatter, count * (ROUNDING * series.radius()).powi(2));
        Self { home, turned, turns, shifts, mean_shift, turn_axes, shift_axes }
    }

    fn placement(&self, z: Vector3<f64>, joint: Vector3<f64>, home: Vector3<f64>) -> Placement {
        Placement {
            joint: Pose::from_parts(joint.into(), facing(z)),
            home: Pose::from_parts(home.into(), self.home),
            constants: Vector2::zeros(),
        }
    }

    /// The points, one fixed in each body, that stay together best across the directions that `keep` projects on:
    /// `R_t a + p = t_t` by least squares. Gives the point in the reference and the moving body's place.
    ///
    /// R. M. Ehrig et al., J. Biomech. 39 (2006) and 40 (2007): the symmetrical centre of rotation estimation.
    fn common_point(&self, keep: &Matrix3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        for (turned, shift) in self.turned.iter().zip(&self.shifts) {
            let mut row = nalgebra::Matrix3x6::zeros();
            row.fixed_view_mut::<3, 3>(0, 0).copy_from(&(keep * turned));
            row.fixed_view_mut::<3, 3>(0, 3).copy_from(keep);
            normal += row.tr_mul(&row);
            right += row.tr_mul(&(keep * shift));
        }
        normal += Matrix6::identity() * (RIDGE * self.shifts.len() as f64);
        let solution = normal.cholesky().map_or_else(Vector6::zeros, |factor| factor.solve(&right));
        let arm = keep * solution.fixed_rows::<3>(0);
        let point = keep * solution.fixed_rows::<3>(3);
        (point, arm + point)
    }

    fn on_a_trammel(&self, axis: Vector3<f64>, bar_moves: bool) -> Placement {
        let facing = facing(axis);
        let (mut normal, mut right) = (Matrix3::<Complex<f64>>::zeros(), Vector3::<Complex<f64>>::zeros());
        for (turn, shift) in self.turned.iter().zip(&self.shifts) {
            let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*turn));
            let own = Pose::from_parts(Translation3::identity(), facing.inverse() * turn * facing);
            let turn = turn_about_z(&own, 0.0);
            let second = if bar_moves { -turn } else { 2.0 * turn };
            let row = Vector3::new(0.0, turn, second).map(|angle| Complex::from_polar(1.0, angle));
            let place = facing.inverse() * shift;
            normal += row.conjugate() * row.transpose();
            right += row.conjugate() * Complex::new(place.x, place.y);
        }
        let count = self.shifts.len() as f64;
        normal += Matrix3::identity() * Complex::from(RIDGE * count);
        let [centre, arm, pin] =
            normal.lu().solve(&right).map_or([Complex::ZERO; 3], |solution| [solution[0], solution[1], solution[2]]);
        let lift = axis.dot(&self.mean_shift);
        let place = |across: Complex<f64>| facing * Vector3::new(across.re, across.im, lift);
        // Seen from the bar, the crossing is on the other side of the pin.
        let (crossing, phase) = if bar_moves { (centre, pin.arg()) } else { (centre + pin, (-pin).arg()) };
        let turned = facing * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), phase);
        Placement {
            joint: Pose::from_parts(place(crossing).into(), turned),
            home: Pose::from_parts(place(centre + arm + pin).into(), self.home),
            constants: Vector2::new(pin.norm(), 0.0),
        }
    }

    fn about(&self, axis: Vector3<f64>) -> Placement {
        let across = Matrix3::identity() - axis * axis.transpose();
        let (point, home) = self.common_point(&across);
        let along = axis * axis.dot(&self.mean_shift);
        self.placement(axis, point, home + along)
    }
}

/// A rotation whose z axis is `z`.
fn facing(z: Vector3<f64>) -> UnitQuaternion<f64> {
    let x = z.cross(&Vector3::ith(z.iamin(), 1.0)).normalize();
    let axes = Matrix3::from_columns(&[x, z.cross(&x), z]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}

/// Principal directions, the largest first. Among those in which there is `nothing`, rounding is not to choose.
fn principal(scatter: Matrix3<f64>, nothing: f64) -> [Vector3<f64>; 3] {
    let eigen = (scatter + Matrix3::new(3.0, 0.5, 0.25, 0.5, 2.0, 0.5, 0.25, 0.5, 1.0) * nothing).symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    order.map(|k| eigen.eigenvectors.column(k).normalize())
}

/// The mean pose.
pub fn at_rest(series: &PoseSeries) -> Placement {
    let summary = Summary::of(series);
    summary.placement(Vector3::z(), Vector3::zeros(), summary.mean_shift)
}

/// Along the direction of the largest travel.
pub fn along_the_travel(series: &PoseSeries) -> Vec<Placement> {
    let summary = Summary::of(series);
    vec![summary.placement(summary.shift_axes[0], Vector3::zeros(), summary.mean_shift)]
}

/// About the main direction of the turns, and about the direction of the least travel.
pub fn about_axes(series: &PoseSeries) -> Vec<Placement> {
    let summary = Summary::of(series);
    [summary.turn_axes[0], summary.shift_axes[2]].map(|axis| summary.about(axis)).into()
}

/// As [`about_axes`], and about the direction of the largest travel.
pub fn about_axes_or_travel(series: &PoseSeries) -> Vec<Placement> {
    let summary = Summary::of(series);
    [summary.turn_axes[0], summary.shift_axes[2], summary.shift_axes[0]].map(|axis| summary.about(axis)).into()
}

/// The same with the pitch that the slides along the axis show, regressed on the turns.
pub fn with_pitch(series: &PoseSeries, starts: Vec<Placement>) -> Vec<Placement> {
    let pitched = |start: Placement| {
        let (back, away) = (start.joint.inverse(), start.home.inverse() * start.joint);
        let mut previous = 0.0;
        let pairs: Vec<(f64, f64)> = series
            .poses()
            .iter()
            .map(|pose| {
                let motion = back * pose * away;
                previous = turn_about_z(&motion, previous);
                (previous, motion.translation.z)
            })
            .collect();
        let count = pairs.len() as f64;
        let mean = pairs.iter().fold((0.0, 0.0), |sum, (q, s)| (sum.0 + q / count, sum.1 + s / count));
        let product: f64 = pairs.iter().map(|(q, s)| (q - mean.0) * (s - mean.1)).sum();
        let square: f64 = pairs.iter().map(|(q, _)| (q - mean.0).powi(2)).sum();
        let pitch = (product / square.max(1e-12)).clamp(-LARGEST_PITCH, LARGEST_PITCH);
        let lift = start.joint.rotation * Vector3::z() * (mean.1 - pitch * mean.0);
        Placement { home: Translation3::from(lift) * start.home, constants: Vector2::new(pitch, 0.0), ..start }
    };
    starts.into_iter().map(pitched).collect()
}

/// A bar on a trammel about the main direction of the turns, and about the direction of the least travel; the moving body is
/// the bar, or the frame.
///
/// Across the axis, and with body turns `ψ`, the moving body is at `c + α exp(iψ) + β exp(-iψ)` if it is the bar, and at
/// `c + α exp(iψ) + β exp(2iψ)` if it is the frame, by linear least squares: the crank is `|β|`, and `β` tells the phase.
pub fn on_a_trammel(series: &PoseSeries, bar_moves: bool) -> Vec<Placement> {
    let summary = Summary::of(series);
    [summary.turn_axes[0], summary.shift_axes[2]].map(|axis| summary.on_a_trammel(axis, bar_moves)).into()
}

/// Across the main direction of the turns, and across the direction of the least travel.
pub fn across_the_plane(series: &PoseSeries) -> Vec<Placement> {
    let summary = Summary::of(series);
    [summary.turn_axes[0], summary.shift_axes[2]]
        .map(|normal| summary.placement(normal, Vector3::zeros(), summary.mean_shift))
        .into()
}

/// About the point that stays where it is best.
pub fn about_a_point(series: &PoseSeries) -> Vec<Placement> {
    let summary = Summary::of(series);
    let (point, home) = summary.common_point(&Matrix3::identity());
    vec![summary.placement(Vector3::z(), point, home)]
}

/// About every two principal directions of the turns, through the point that stays where it is best.
pub fn about_two_axes(series: &PoseSeries) -> Vec<Placement> {
    let summary = Summary::of(series);
    let (point, home) = summary.common_point(&Matrix3::identity());
    let place = |(z, x): (usize, usize)| {
        let (z, x) = (summary.turn_axes[z], summary.turn_axes[x]);
        let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
        let joint = Pose::from_parts(point.into(), UnitQuaternion::from_rotation_matrix(&axes));
        Placement { joint, ..summary.placement(z, point, home) }
    };
    debug_assert_eq!(summary.turns.len(), summary.turned.len());
    [(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)].map(place).into()
}
