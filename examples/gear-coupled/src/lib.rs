//! `gear-coupled`: two gears that mesh, a joint model for Jointscope.

use jointscope_models::lower_pair::{Geometry, Mechanism, Mobility, PARTS, Placement, judge, starts, turn_about_z};
use jointscope_models::motion::{Pose, PoseSeries, RelativeMotion, twist::Twist};
use jointscope_models::{FitError, JointFit, JointModel, joint_model};
use nalgebra::{Matrix2x6, Matrix6, Translation3, UnitQuaternion, Vector2, Vector3, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Gear-coupled joint: two parallel axes, one fixed in each body, at a constant distance; when the line between them
/// turns by q, the moving body turns about its own axis by `ratio` q. So do gears that mesh, and belts on pulleys.
///
/// `h(q) = Rz(q) · Tx(distance) · Rz(ratio q) · Tx(-distance)`; `ratio` and `distance` are found.
///
/// Convention: q is the turn of the line between the axes as seen from the better known body, in radians; the axis is
/// that body's. The part `ratio` is the turn of the moving body by the turn of the reference, both as seen from that
/// line: teeth of the reference by teeth of the moving body, positive where gears mesh from outside, negative where one
/// runs inside the other.
///
/// Degenerate cases: a ratio near 0 is a hinge, one near -1 a slide along a circle, and little motion shows neither. Bodies
/// that show a single point are not judged.
///
/// References: for the count of parameters, docs/method.md of Jointscope, "Mechanisms".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GearCoupled {
    /// Largest ratio that is looked for, of either sign; the smallest is its inverse.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 1.0))]
    pub largest_ratio: f64,
    /// How likely gears are beforehand, as a share of how likely any other joint is.
    #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
    pub prior: f64,
}

impl Default for GearCoupled {
    fn default() -> Self {
        Self { largest_ratio: 8.0, prior: 0.4 }
    }
}

joint_model!(GearCoupled, "gear-coupled", "two parallel axes that turn in a constant ratio");

impl JointModel for GearCoupled {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        let mut fit = judge(self, motion)?;
        if let Some(evidence) = &mut fit.evidence {
            evidence.prior_cost -= 2.0 * self.prior.ln();
        }
        let ratio = motion.pose_series().and_then(|series| ratio(series, &fit));
        Ok(match ratio {
            Some(ratio) => fit.with_part("ratio", ratio),
            None => fit,
        })
    }

    fn states_evidence(&self) -> bool {
        true
    }

    fn parts(&self) -> &'static [&'static str] {
        const ALL: [&str; PARTS.len() + 1] = {
            let mut all = ["ratio"; PARTS.len() + 1];
            let mut index = 0;
            while index < PARTS.len() {
                all[index] = PARTS[index];
                index += 1;
            }
            all
        };
        &ALL
    }
}

impl Mechanism for GearCoupled {
    fn mobility(&self) -> Mobility {
        // Placement 5, the joint slides along z unseen; home 6; ratio and distance 2; less 1 for where q is 0; mean and
        // spread of q 2.
        Mobility { turns: 1, slides: 0, parameters: 14, advances: false }
    }

    fn constants(&self) -> usize {
        2
    }

    fn geometry(&self, _: &Vector2<f64>) -> Geometry {
        Geometry::Axis { pitch: Some(0.0) }
    }

    fn pose(&self, q: &Vector3<f64>, constants: &Vector2<f64>) -> Pose {
        let arm = Translation3::new(constants.y, 0.0, 0.0);
        about_z(q.x) * arm * about_z(constants.x * q.x) * arm.inverse()
    }

    fn twists(&self, q: &Vector3<f64>, constants: &Vector2<f64>) -> [Twist; 3] {
        let [x, y] = far_axis(q, constants);
        let ratio = constants.x;
        // About the near axis by 1, about the far one by the ratio.
        [Twist::new(0.0, 0.0, 1.0 + ratio, ratio * y, -ratio * x, 0.0), Twist::zeros(), Twist::zeros()]
    }

    fn constant_twists(&self, q: &Vector3<f64>, constants: &Vector2<f64>) -> [Twist; 2] {
        let [x, y] = far_axis(q, constants);
        let (arm, body) = ((q.x).sin_cos(), ((1.0 + constants.x) * q.x).sin_cos());
        let by_ratio = Twist::new(0.0, 0.0, 1.0, y, -x, 0.0) * q.x;
        let by_distance = Twist::new(0.0, 0.0, 0.0, arm.1 - body.1, arm.0 - body.0, 0.0);
        [by_ratio, by_distance]
    }

    fn project(&self, motion: &Pose, previous: &Vector3<f64>, constants: &Vector2<f64>) -> Vector3<f64> {
        let whole = 1.0 + constants.x;
        if whole.abs() > 0.5 {
            return Vector3::x() * (turn_about_z(motion, whole * previous.x) / whole);
        }
        // The body hardly turns, so the way of its axis tells.
        let axis = motion * nalgebra::Point3::new(constants.y, 0.0, 0.0);
        Vector3::x() * near(axis.y.atan2(axis.x), previous.x)
    }

    fn starts(&self, series: &PoseSeries) -> Vec<Placement> {
        /// Starts that are tried per direction of the axes.
        const TRIED: usize = 4;
        let about = starts::about_axes(series).into_iter();
        about.flat_map(|start| self.ratios_that_fit(series, &start).into_iter().take(TRIED)).collect()
    }
}

impl GearCoupled {
    /// Ratios to try: evenly spaced in their logarithm, of either sign; not -1, where the turn tells nothing.
    fn ratios(&self) -> impl Iterator<Item = f64> {
        const STEPS: i32 = 12;
        let sizes = (-STEPS..=STEPS).map(|step| self.largest_ratio.powf(f64::from(step) / f64::from(STEPS)));
        sizes.flat_map(|size| [size, -size]).filter(|ratio| (1.0 + ratio).abs() > 0.1)
    }

    /// Placements about a direction for all ratios, the best first. With the turn `θ_t` of the body and a ratio,
    /// `q_t = θ_t / (1 + ratio)`, and the body's origin runs on `c + a exp(i q_t) + b exp(i θ_t)` in the plane across
    /// the axes: linear in the near axis `c`, the arm `a` and the place `b` of the origin.
    fn ratios_that_fit(&self, series: &PoseSeries, start: &Placement) -> Vec<Placement> {
        let (back, home) = (start.joint.rotation.inverse(), start.home.rotation);
        let mut turned = 0.0;
        let seen = series.poses().iter().map(|pose| {
            let turn = back * pose.rotation * home.inverse() * start.joint.rotation;
            turned = turn_about_z(&Pose::from_parts(Translation3::identity(), turn), turned);
            (turned, back * pose.translation.vector)
        });
        let seen: Vec<(f64, Vector3<f64>)> = seen.collect();
        let height = seen.iter().map(|(_, place)| place.z).sum::<f64>() / seen.len() as f64;
        let mut fitted: Vec<(f64, Placement)> = self
            .ratios()
            .filter_map(|ratio| {
                let row = |turn: f64| {
                    let ((s, c), (sin, cos)) = ((turn / (1.0 + ratio)).sin_cos(), turn.sin_cos());
                    Matrix2x6::new(1.0, 0.0, c, -s, cos, -sin, 0.0, 1.0, s, c, sin, cos)
                };
                let (mut normal, mut right) = (Matrix6::identity() * 1e-9, Vector6::zeros());
                for (turn, place) in &seen {
                    normal += row(*turn).tr_mul(&row(*turn));
                    right += row(*turn).tr_mul(&place.xy());
                }
                let solution = normal.cholesky()?.solve(&right);
                let misfit = seen.iter().map(|(turn, place)| (row(*turn) * solution - place.xy()).norm_squared()).sum();
                let [c, a, b] = [0, 2, 4].map(|index| Vector2::new(solution[index], solution[index + 1]));
                let lift = |place: Vector2<f64>| Translation3::from(start.joint.rotation * place.push(height));
                let placement = Placement {
                    joint: lift(c) * start.joint.rotation * about_z(a.y.atan2(a.x)),
                    home: lift(c + a + b) * home,
                    constants: Vector2::new(ratio, a.norm()),
                };
                Some((misfit, placement))
            })
            .collect();
        fitted.sort_by(|a, b| a.0.total_cmp(&b.0));
        fitted.into_iter().map(|(_, placement)| placement).collect()
    }
}

/// The turn of the moving body by that of the reference, as seen from the line between the axes.
fn ratio(series: &PoseSeries, fit: &JointFit) -> Option<f64> {
    let (joint, mut turned) = (&fit.joint, 0.0);
    let direction = joint.axis?.direction?;
    let positions: Vec<Option<&[f64]>> = joint.positions.as_ref()?.iter().collect();
    let seen = |pose: &Pose| if series.reversed() { pose.rotation.inverse() } else { pose.rotation };
    let (_, first) = series.every_pose().first()?;
    let back = seen(first).inverse();
    let (mut product, mut square) = (0.0, 0.0);
    for (frame, pose) in series.every_pose() {
        let turn = (seen(pose) * back).coords;
        turned = near(2.0 * direction.dot(&turn.xyz()).atan2(turn.w), turned);
        if let Some(&[q]) = positions.get(*frame).copied().flatten() {
            (product, square) = (product + q * turned, square + q * q);
        }
    }
    let ratio = product / square - 1.0;
    // Seen from the other body, the two change places.
    Some(if series.reversed() { 1.0 / ratio } else { ratio }).filter(|ratio| ratio.is_finite())
}

/// Where the far axis is at `q`.
fn far_axis(q: &Vector3<f64>, constants: &Vector2<f64>) -> [f64; 2] {
    let (sin, cos) = q.x.sin_cos();
    [constants.y * cos, constants.y * sin]
}

fn about_z(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle)
}

/// An angle, unwrapped to be near another.
fn near(angle: f64, other: f64) -> f64 {
    angle + std::f64::consts::TAU * ((other - angle) / std::f64::consts::TAU).round()
}

#[cfg(test)]
mod tests {
    use super::*;
    use jointscope_models::motion::twist;

    #[test]
    fn it_conforms() {
        jointscope_models::conformance::check_linked("gear-coupled");
    }

    #[test]
    fn twists_are_derivatives() {
        const STEP: f64 = 1e-6;
        // Second-order error of a step of 1e-6, with accelerations of order 10.
        const CLOSE: f64 = 1e-10;
        let gears = GearCoupled::default();
        for (q, ratio, distance) in [(0.3, 2.0, 0.2), (-1.1, -3.0, 0.4), (2.5, 0.5, 0.1)] {
            let (q, constants) = (Vector3::x() * q, Vector2::new(ratio, distance));
            let h = gears.pose(&q, &constants);
            let check = |moved: Pose, along: Twist| {
                let off = (twist::exp(&(along * STEP)) * h).inverse() * moved;
                assert!(twist::log(&off).norm() < CLOSE, "{off}");
            };
            check(gears.pose(&(q + Vector3::x() * STEP), &constants), gears.twists(&q, &constants)[0]);
            let [by_ratio, by_distance] = gears.constant_twists(&q, &constants);
            check(gears.pose(&q, &(constants + Vector2::x() * STEP)), by_ratio);
            check(gears.pose(&q, &(constants + Vector2::y() * STEP)), by_distance);
            let found = gears.project(&h, &(q + Vector3::x() * 0.1), &constants);
            assert!((found - q).norm() < 1e-12, "{found}");
        }
    }
}
