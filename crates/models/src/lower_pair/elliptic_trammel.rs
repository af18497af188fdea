//! `elliptic-trammel`: a bar whose ends slide along two crossing lines, Cardan's motion.

use jointscope_motion::{Pose, PoseSeries, RelativeMotion, twist::Twist};
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Geometry, Mechanism, Mobility, Placement, judge, misfit_and, starts, turn_about_z};
use crate::{Evidence, FitError, JointFit, JointModel, joint_model};

/// Elliptic trammel (Cardan motion): two points of one body, the bar, slide along two lines of the other, the frame, that
/// cross at a right angle; every point of the bar runs on an ellipse about the crossing.
///
/// `L_t = g h(q_t) g⁻¹ L_0` with `h(q) = Ty(-2 r sin q) Rz(q)`: the bar turns by `q` while its middle, the pin, turns by
/// `-q` on a circle of radius `r` about the axis; `g` places axis and pin at `q = 0`, `L_0` the moving body. Either body
/// may be the bar: with `h(-q)⁻¹` it is the reference, and the better of both fits counts.
///
/// Convention: positions are turns of the moving body in radians, unwrapped, 0 at the first frame, the farthest positive by
/// the right-hand rule; the axis is through the crossing in the frame's coordinates, and through the pin in the bar's; pitch
/// 0. Parts tell `crank`, the radius `r` in metres, and `bar`: 1 if the moving body is the bar, 0 if the reference is.
///
/// Its motions form no group. With `r = 0` it is a revolute joint, which is likelier beforehand: see `crank` and `prior`.
/// The path of a single point cannot tell it; such bodies are not judged.
///
/// References: docs/method.md, "Mechanisms".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EllipticTrammel {
    /// How large cranks usually are, as a standard deviation: metres for each metre of the body's radius.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub crank: f64,
    /// How likely a trammel is beforehand, as a share of how likely any other joint is.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub prior: f64,
}

impl Default for EllipticTrammel {
    fn default() -> Self {
        Self { crank: 1.0, prior: 0.4 }
    }
}

joint_model!(EllipticTrammel, "elliptic-trammel", "points on ellipses, as those of a bar that slides along two lines");

/// The mechanism with one of the bodies as its bar.
#[derive(Debug, Clone, Copy)]
struct Trammel {
    /// Usual crank for each metre of the body's radius.
    usual: f64,
    /// Whether the series' moving body is the bar.
    bar_moves: bool,
}

impl Mechanism for Trammel {
    fn mobility(&self) -> Mobility {
        // Axis, pin, and phase between them; home, but for its share in the phase; crank; mean and spread of an angle.
        Mobility { turns: 1, slides: 0, parameters: 13, advances: false, roams: true }
    }

    fn constants(&self) -> usize {
        1
    }

    fn usual_constant(&self, radius: f64) -> Option<f64> {
        Some(self.usual * radius)
    }

    fn constant_names(&self) -> &'static [&'static str] {
        &["crank"]
    }

    fn geometry(&self, _: &Vector2<f64>) -> Geometry {
        Geometry::Axis { pitch: Some(0.0) }
    }

    fn axis_at_home(&self, constants: &Vector2<f64>) -> [Vector3<f64>; 2] {
        let (crossing, pin) = (Vector3::zeros(), Vector3::new(constants.x, 0.0, 0.0));
        if self.bar_moves { [crossing, pin] } else { [pin, crossing] }
    }

    fn pose(&self, q: &Vector3<f64>, constants: &Vector2<f64>) -> Pose {
        let of_bar = |angle: f64| {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
            Pose::from_parts(Vector3::new(0.0, -2.0 * constants.x * angle.sin(), 0.0).into(), turn)
        };
        if self.bar_moves { of_bar(q.x) } else { of_bar(-q.x).inverse() }
    }

    fn twists(&self, q: &Vector3<f64>, constants: &Vector2<f64>) -> [Twist; 3] {
        let r = constants.x;
        let twist = if self.bar_moves {
            let (sin, cos) = q.x.sin_cos();
            Twist::new(0.0, 0.0, 1.0, -2.0 * r * sin, -2.0 * r * cos, 0.0)
        } else {
            let (sin, cos) = (2.0 * q.x).sin_cos();
            Twist::new(0.0, 0.0, 1.0, r * sin, -r * (1.0 + cos), 0.0)
        };
        [twist, Twist::zeros(), Twist::zeros()]
    }

    fn constant_twists(&self, q: &Vector3<f64>, _: &Vector2<f64>) -> [Twist; 2] {
        let twist = if self.bar_moves {
            Twist::new(0.0, 0.0, 0.0, 0.0, -2.0 * q.x.sin(), 0.0)
        } else {
            let (sin, cos) = (2.0 * q.x).sin_cos();
            Twist::new(0.0, 0.0, 0.0, 1.0 - cos, -sin, 0.0)
        };
        [twist, Twist::zeros()]
    }

    fn project(&self, motion: &Pose, previous: &Vector3<f64>, _: &Vector2<f64>) -> Vector3<f64> {
        Vector3::new(turn_about_z(motion, previous.x), 0.0, 0.0)
    }

    fn starts(&self, series: &PoseSeries) -> Vec<Placement> {
        starts::on_a_trammel(series, self.bar_moves)
    }
}

impl JointModel for EllipticTrammel {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        let reversed = motion.pose_series().is_some_and(PoseSeries::reversed);
        let with = |bar_moves: bool| -> Result<JointFit, FitError> {
            let mut fit = judge(&Trammel { usual: self.crank, bar_moves }, motion)?;
            if let Some(evidence) = &mut fit.evidence {
                evidence.prior_cost -= 2.0 * self.prior.ln();
            }
            // The sign of a crank is a choice of the phase.
            fit.parts.entry("crank").and_modify(|crank| *crank = crank.abs());
            Ok(fit.with_part("bar", if bar_moves == reversed { 0.0 } else { 1.0 }))
        };
        let [moving, reference] = [with(true)?, with(false)?];
        let cost = |fit: &JointFit| fit.evidence.as_ref().map_or(f64::INFINITY, Evidence::noise_cost);
        let charge = |fit: &JointFit| fit.evidence.as_ref().map_or(f64::INFINITY, Evidence::own_charge);
        let moves = charge(&moving).total_cmp(&charge(&reference)).then(cost(&moving).total_cmp(&cost(&reference)));
        Ok(if moves.is_gt() { reference } else { moving })
    }

    fn states_evidence(&self) -> bool {
        true
    }

    fn parts(&self) -> &'static [&'static str] {
        const ALL: [&str; 8] = misfit_and(&["radius", "crank", "bar"]);
        &ALL
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jointscope_motion::twist;

    #[test]
    fn twists_are_derivatives_of_the_pose() {
        /// Central differences of steps of 1e-5, radians and metres.
        const EXACT: f64 = 1e-9;
        const STEP: f64 = 1e-5;
        for bar_moves in [true, false] {
            let trammel = Trammel { usual: 1.0, bar_moves };
            let constants = Vector2::new(0.12, 0.0);
            for q in [-2.0, 0.0, 0.7, 4.0].map(|q| Vector3::new(q, 0.0, 0.0)) {
                let at = |dq: f64, dr: f64| {
                    let moved = trammel.pose(&(q + Vector3::x() * dq), &(constants + Vector2::x() * dr));
                    twist::log(&(moved * trammel.pose(&q, &constants).inverse()))
                };
                let by_q = (at(STEP, 0.0) - at(-STEP, 0.0)) / (2.0 * STEP);
                let by_r = (at(0.0, STEP) - at(0.0, -STEP)) / (2.0 * STEP);
                assert!((by_q - trammel.twists(&q, &constants)[0]).norm() < EXACT, "{bar_moves} {q}: {by_q}");
                assert!((by_r - trammel.constant_twists(&q, &constants)[0]).norm() < EXACT, "{bar_moves} {q}: {by_r}");
                let told = trammel.project(&trammel.pose(&q, &constants), &q, &constants);
                assert!((told - q).norm() < EXACT, "{bar_moves} {q}: {told}");
            }
        }
    }

    #[test]
    fn pin_and_crossing_keep_their_distance() {
        let constants = Vector2::new(0.12, 0.0);
        for bar_moves in [true, false] {
            let trammel = Trammel { usual: 1.0, bar_moves };
            let [of_reference, of_moving] = trammel.axis_at_home(&constants);
            for q in [-1.0, 0.3, 2.5] {
                let moved = trammel.pose(&Vector3::new(q, 0.0, 0.0), &constants) * nalgebra::Point3::from(of_moving);
                assert!(((moved.coords - of_reference).norm() - 0.12).abs() < 1e-12, "{bar_moves} {q}");
            }
        }
    }
}
