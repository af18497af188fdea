//! What a fitted mechanism tells of its joint, as it was asked for: axis, positions, and how well the axis is known.

use jointscope_motion::{Pose, PoseSeries, twist, twist::Twist};
use nalgebra::{DVector, Matrix3, Matrix3x6, Point3, Translation3, Unit, Vector3};

use super::{Fitted, Geometry, Judged, Mechanism, Placement};
use crate::{Axis, AxisUncertainty, Joint, Positions};

/// Coordinates that slow departures have in a recording, for the uncertainty of axes.
const SLOW_FRAMES: f64 = 12.0;

/// Root mean square distance of the moving body's features from the joint, metres.
pub(super) fn residual_rms(series: &PoseSeries, fitted: &Fitted) -> f64 {
    let radius = series.ends()[0].radius;
    let square = |residual: &Twist| {
        twist::linear(residual).norm_squared() + twist::angular(residual).norm_squared() * radius.powi(2) * 2.0 / 3.0
    };
    (fitted.residuals.iter().map(square).sum::<f64>() / fitted.residuals.len() as f64).sqrt()
}

/// Uncertainty of the axis: of the fit, and of the coordinates in which it is told.
pub(super) fn uncertainty(
    mechanism: &dyn Mechanism,
    judged: &Judged,
    series: &PoseSeries,
    axis: Option<&Axis>,
) -> Option<AxisUncertainty> {
    let axis = axis?;
    let covariance = judged.fitted().joint_covariance;
    // Play is slow: more frames do not average it.
    let slow = if judged.is_noise() { 1.0 } else { (series.poses().len() as f64 / SLOW_FRAMES).max(1.0) };
    let factor = series.correlation_time().max(slow);
    let of_fit = |indices: &[usize]| factor * indices.iter().map(|&k| covariance[(k, k)]).sum::<f64>();
    let (of_start_angle, of_start_distance) = series.start().map_or((0.0, 0.0), |start| {
        let across = |covariance: Matrix3<f64>| {
            let along = axis.direction.map_or(0.0, |direction| direction.dot(&(covariance * *direction)));
            covariance.trace() - along
        };
        let mut lever = Matrix3x6::zeros();
        lever.fixed_view_mut::<3, 3>(0, 0).copy_from(&-(axis.point.coords - start.centre).cross_matrix());
        lever.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
        let turns = start.covariance.fixed_view::<3, 3>(0, 0).into_owned();
        (across(turns), across(lever * start.covariance * lever.transpose()))
    });
    let angle = |indices: &[usize]| Some((of_fit(indices) + of_start_angle).sqrt().min(std::f64::consts::FRAC_PI_2));
    let distance = |indices: &[usize]| Some((of_fit(indices) + of_start_distance).sqrt().min(1e9));
    let (angle, distance) = match mechanism.geometry(&judged.fitted().placement.constants) {
        Geometry::Nothing => return None,
        Geometry::Direction | Geometry::Plane => (angle(&[0, 1]), None),
        Geometry::Axis { .. } => (angle(&[0, 1]), distance(&[3, 4])),
        Geometry::Centre => (None, distance(&[3, 4, 5])),
    };
    Some(AxisUncertainty { angle, distance })
}

/// The joint as asked for: axis in the coordinates of the reference and in those of the moving body, and positions.
pub(super) fn joint_of(
    mechanism: &dyn Mechanism,
    series: &PoseSeries,
    fitted: &Fitted,
    frames: usize,
) -> (Joint, Option<Axis>) {
    let Placement { joint, home, constants } = fitted.placement;
    let mut rows = positions(mechanism, series, fitted, frames);
    let backwards = mechanism.freedoms() == 1 && rows.as_mut().is_some_and(turn_to_positive);
    let sign = if backwards { -1.0 } else { 1.0 };
    let positions = rows.map(|rows| Positions::of_freedoms(mechanism.freedoms(), rows.data.into()));
    let geometry = mechanism.geometry(&constants);
    let first = series.poses()[0];
    let axis = |pose: Pose, body: Vector3<f64>, origin: Vector3<f64>, sign: f64| -> Option<Axis> {
        let z = pose.rotation * Vector3::z();
        let foot = pose.translation.vector + z * z.dot(&(body - pose.translation.vector));
        let (point, directed, pitch) = match geometry {
            Geometry::Nothing => return None,
            Geometry::Direction | Geometry::Plane => (body, true, None),
            Geometry::Axis { pitch } => (foot, true, pitch),
            Geometry::Centre => (pose.translation.vector, false, None),
        };
        let direction = directed.then(|| Unit::new_normalize(z * sign));
        Some(Axis { point: Point3::from(point + origin), direction, pitch })
    };
    // The centre of the body asked to be the moving one at the first frame, seen from either body.
    let centre = if series.reversed() { reference_centre(series) } else { first * Point3::origin() };
    let [of_reference, of_moving] = mechanism.axis_at_home(&constants).map(|point| joint * Translation3::from(point));
    let in_reference = axis(of_reference, centre.coords, series.origin(), sign);
    let seen_from_moving = (first.inverse() * centre).coords;
    let in_moving = axis(home.inverse() * of_moving, seen_from_moving, series.moving_origin(), sign);
    let opposite = |axis: Axis| Axis { direction: axis.direction.map(|direction| -direction), ..axis };
    let (axis, other) = if series.reversed() {
        (in_moving.map(opposite), in_reference.map(opposite))
    } else {
        (in_reference, in_moving)
    };
    (Joint { axis, positions }, other)
}

/// Centre of the series' reference body, in its coordinates.
fn reference_centre(series: &PoseSeries) -> Point3<f64> {
    Point3::from(series.ends().get(1).map_or_else(Vector3::zeros, |end| end.centre))
}

/// Positions of every frame of the recording, counted from the first; NaN where the pair is not seen.
fn positions(mechanism: &dyn Mechanism, series: &PoseSeries, fitted: &Fitted, frames: usize) -> Option<DVector<f64>> {
    let freedoms = mechanism.freedoms();
    if freedoms == 0 {
        return None;
    }
    let Placement { joint, home, constants } = fitted.placement;
    let mut rows = DVector::from_element(frames * freedoms, f64::NAN);
    let whole = series.frames().len() == series.every_pose().len();
    let (back, away) = (joint.inverse(), home.inverse() * joint);
    let mut previous = fitted.positions[0];
    let mut first: Option<Pose> = None;
    // The centre of the body asked to be the moving one, in joint coordinates.
    let centre = if series.reversed() {
        joint.inverse() * reference_centre(series)
    } else {
        joint.inverse() * home * Point3::origin()
    };
    // Seen from the other body everything runs backwards.
    let seen = |h: &Pose| if series.reversed() { h.inverse() } else { *h };
    let axes = if series.reversed() { home.rotation.inverse() * joint.rotation } else { joint.rotation };
    let mut origin = Vector3::zeros();
    for (index, (frame, pose)) in series.every_pose().iter().enumerate() {
        let q = if whole {
            fitted.positions[index]
        } else {
            mechanism.project(&(back * pose * away), &previous, &constants)
        };
        previous = q;
        let h = mechanism.pose(&q, &constants);
        let started = *first.get_or_insert_with(|| {
            origin = q;
            h
        });
        let shown = match mechanism.geometry(&constants) {
            Geometry::Plane => {
                let moved = seen(&h) * centre - seen(&started) * centre;
                Vector3::new(q.x - origin.x, moved.x, moved.y)
            }
            // In the axes of the body asked to be the reference.
            Geometry::Centre if mechanism.mobility().turns == 3 => {
                let turned = seen(&h) * seen(&started).inverse();
                axes * twist::rotation_log(&turned.rotation)
            }
            _ => q - origin,
        };
        for k in 0..freedoms {
            rows[frame * freedoms + k] = shown[k];
        }
    }
    Some(rows)
}

/// Turns a joint's direction such that its farthest position is positive; says whether it had to be turned.
fn turn_to_positive(rows: &mut DVector<f64>) -> bool {
    let seen = || rows.iter().filter(|q| !q.is_nan());
    let (least, most) = seen().fold((0.0_f64, 0.0_f64), |(least, most), q| (least.min(*q), most.max(*q)));
    let backwards = -least > most;
    if backwards {
        // Adding 0 keeps the start at +0.
        rows.iter_mut().for_each(|q| *q = -*q + 0.0);
    }
    backwards
}
