//! `gear-coupled`: two gears that mesh, a joint model for Jointscope.

use jointscope_models::lower_pair::{Geometry, Mechanism, Mobility, Placement, judge, starts, turn_about_z};
use jointscope_models::motion::{Pose, PoseSeries, RelativeMotion, twist::Twist};
use jointscope_models::{Confidence, FitError, JointFit, JointModel, joint_model};
use nalgebra::{Matrix2x6, Matrix6, Point3, Translation3, UnitQuaternion, Vector2, Vector3, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Gear-coupled joint: two wheels that mesh, on parallel axes at a constant distance. When the line between the axes
/// turns by q, seen from one wheel, the other turns about its own axis by `ratio` q, seen from that line.
///
/// `h(q) = Rz(q) · Tx(distance) · Rz(ratio q) · Tx(-distance)` with the ratio of the teeth; the distance is found.
///
/// Convention: the axis is that of the better known body; q is in radians.
///
/// Degenerate cases: axes that nearly coincide are a hinge's, with confidence 0. Bodies that show a single point are not
/// judged.
///
/// References: docs/method.md of Jointscope, "Mechanisms".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GearCoupled {
    /// Teeth of the reference body.
    #[schemars(range(min = 1, max = 10_000))]
    pub teeth_of_reference: u32,
    /// Teeth of the moving body.
    #[schemars(range(min = 1, max = 10_000))]
    pub teeth_of_moving: u32,
    /// Whether one wheel runs inside the other.
    pub inside: bool,
    /// Least distance of the axes, metres: closer ones are a hinge's.
    #[schemars(range(min = 0.0))]
    pub least_distance: f64,
}

impl Default for GearCoupled {
    fn default() -> Self {
        Self { teeth_of_reference: 1, teeth_of_moving: 1, inside: false, least_distance: 0.01 }
    }
}

joint_model!(GearCoupled, "gear-coupled", "two wheels that mesh, on parallel axes");

impl JointModel for GearCoupled {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        /// How likely it is beforehand that axes of gears nearly coincide.
        const UNLIKELY: f64 = 1e-6;
        let [reference, moving] = [self.teeth_of_reference, self.teeth_of_moving].map(f64::from);
        if self.inside && reference == moving {
            let needed = "a smaller wheel inside a larger one".into();
            return Err(FitError::Unsuitable { needed, found: "both have as many teeth".into() });
        }
        let ratio = if self.inside { -reference / moving } else { reference / moving };
        // Seen from the other body, the wheels change places.
        let reversed = motion.pose_series().is_some_and(PoseSeries::reversed);
        let mesh = Mesh { ratio: if reversed { ratio.recip() } else { ratio } };
        let mut fit = judge(&mesh, motion)?;
        if fit.parts.get("distance").is_none_or(|distance| distance.abs() < self.least_distance) {
            fit.confidence = Confidence::ZERO;
            if let Some(evidence) = &mut fit.evidence {
                evidence.prior_cost -= 2.0 * UNLIKELY.ln();
            }
        }
        Ok(fit)
    }

    fn states_evidence(&self) -> bool {
        true
    }

    fn parts(&self) -> &'static [&'static str] {
        &["distance", "misfit_distance", "misfit_angle", "sweep", "departure", "chi_squared_per_freedom", "radius"]
    }
}

/// The motion of wheels of a known ratio. Its one constant is the distance of their axes.
#[derive(Debug)]
struct Mesh {
    ratio: f64,
}

impl Mechanism for Mesh {
    fn mobility(&self) -> Mobility {
        // Placement 5, for sliding along z shows nothing; home 6; distance 1; less 1, for where q is 0; mean and spread
        // of q 2.
        Mobility { turns: 1, slides: 0, parameters: 13, advances: false, roams: true }
    }

    fn constants(&self) -> usize {
        1
    }

    fn constant_names(&self) -> &'static [&'static str] {
        &["distance"]
    }

    fn geometry(&self, _: &Vector2<f64>) -> Geometry {
        Geometry::Axis { pitch: Some(0.0) }
    }

    fn pose(&self, q: &Vector3<f64>, constants: &Vector2<f64>) -> Pose {
        let arm = Translation3::new(constants.x, 0.0, 0.0);
        about_z(q.x) * arm * about_z(self.ratio * q.x) * arm.inverse()
    }

    fn twists(&self, q: &Vector3<f64>, constants: &Vector2<f64>) -> [Twist; 3] {
        // By 1 about the near axis, and by the ratio about the far one.
        let (sin, cos) = q.x.sin_cos();
        let far = self.ratio * constants.x;
        [Twist::new(0.0, 0.0, 1.0 + self.ratio, far * sin, -far * cos, 0.0), Twist::zeros(), Twist::zeros()]
    }

    fn constant_twists(&self, q: &Vector3<f64>, _: &Vector2<f64>) -> [Twist; 2] {
        // A longer arm carries the body along, less what the body's own turn takes back.
        let (arm, body) = (q.x.sin_cos(), ((1.0 + self.ratio) * q.x).sin_cos());
        [Twist::new(0.0, 0.0, 0.0, arm.1 - body.1, arm.0 - body.0, 0.0), Twist::zeros()]
    }

    fn project(&self, motion: &Pose, previous: &Vector3<f64>, constants: &Vector2<f64>) -> Vector3<f64> {
        let whole = 1.0 + self.ratio;
        if whole.abs() > 0.5 {
            return Vector3::x() * (turn_about_z(motion, whole * previous.x) / whole);
        }
        // The body hardly turns; the way of its axis tells.
        let axis = motion * Point3::new(constants.x, 0.0, 0.0);
        let angle = axis.y.atan2(axis.x);
        Vector3::x() * (angle + std::f64::consts::TAU * ((previous.x - angle) / std::f64::consts::TAU).round())
    }

    fn starts(&self, series: &PoseSeries) -> Vec<Placement> {
        starts::about_axes(series).into_iter().filter_map(|start| self.about(series, &start)).collect()
    }
}

impl Mesh {
    /// The placement about a direction of the axes. The turn `θ` of the body gives `q = θ / (1 + ratio)`; across the
    /// axes, the body's origin runs on `c + a exp(i q) + b exp(i θ)`: linear in the near axis `c`, the arm `a` and the
    /// place `b` of the origin.
    fn about(&self, series: &PoseSeries, start: &Placement) -> Option<Placement> {
        let (axes, home) = (start.joint.rotation, start.home.rotation);
        let (mut turn, mut height) = (0.0, 0.0);
        let (mut normal, mut right) = (Matrix6::identity() * 1e-9, Vector6::zeros());
        for pose in series.poses() {
            let motion = axes.inverse() * pose.rotation * home.inverse() * axes;
            turn = turn_about_z(&Pose::from_parts(Translation3::identity(), motion), turn);
            let ((s, c), (sin, cos)) = ((turn / (1.0 + self.ratio)).sin_cos(), turn.sin_cos());
            let row = Matrix2x6::new(1.0, 0.0, c, -s, cos, -sin, 0.0, 1.0, s, c, sin, cos);
            let place = axes.inverse() * pose.translation.vector;
            normal += row.tr_mul(&row);
            right += row.tr_mul(&place.xy());
            height += place.z / series.poses().len() as f64;
        }
        let solution = normal.cholesky()?.solve(&right);
        let [c, a, b] = [0, 2, 4].map(|index| Vector2::new(solution[index], solution[index + 1]));
        let lift = |place: Vector2<f64>| Translation3::from(axes * place.push(height));
        Some(Placement {
            joint: lift(c) * axes * about_z(a.y.atan2(a.x)),
            home: lift(c + a + b) * home,
            constants: Vector2::new(a.norm(), 0.0),
        })
    }
}

fn about_z(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle)
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
        // Second-order error of the step, with accelerations of order 10.
        const CLOSE: f64 = 1e-10;
        for (q, ratio, distance) in [(0.3, 2.0, 0.2), (-1.1, -3.0, 0.4), (2.5, -0.8, 0.1)] {
            let (mesh, q, constants) = (Mesh { ratio }, Vector3::x() * q, Vector2::x() * distance);
            let h = mesh.pose(&q, &constants);
            let check = |moved: Pose, along: Twist| {
                let off = (twist::exp(&(along * STEP)) * h).inverse() * moved;
                assert!(twist::log(&off).norm() < CLOSE, "{off}");
            };
            check(mesh.pose(&(q + Vector3::x() * STEP), &constants), mesh.twists(&q, &constants)[0]);
            check(mesh.pose(&q, &(constants + Vector2::x() * STEP)), mesh.constant_twists(&q, &constants)[0]);
            let found = mesh.project(&h, &(q + Vector3::x() * 0.1), &constants);
            assert!((found - q).norm() < 1e-12, "{found}");
        }
    }
}
