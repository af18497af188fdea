//! `prismatic`: a slide along a straight line.

use jointscope_motion::{Pose, PoseSeries, RelativeMotion, twist::Twist};
use nalgebra::{Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::revolute::hinge;
use super::{Geometry, Mechanism, Mobility, Placement, judge, misfit_and, starts};
use crate::{FitError, JointFit, JointModel, joint_model, point_path};

/// Prismatic joint: translation along a line that is fixed in both bodies, without any turn.
///
/// `L_t = g h(q_t) g⁻¹ L_0` with `h(q) = Tz(q)`; `g` places the line, `L_0` the moving body.
///
/// Convention: positions in metres, 0 at the first frame, the farthest positive; the point is the moving body's
/// centroid there, and the direction has no pitch.
///
/// Rails are not quite straight. A slide is therefore also judged as an arc that turns by θ over its travel, at a
/// price of `(θ/bend)² + 2 ln(1.25 bend/180°) + 2 ln min(1, θ/sweep)`, and takes the better of the two evidences: what
/// distinguishes it from a hinge is how far it turns. The last term is for hinges, which lie near their bodies and
/// rarely turn by little.
///
/// Bodies that show one point: the point runs on a line, or on an arc of small turn.
///
/// References: docs/method.md, "Mechanisms" and "Joints lie near their bodies".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Prismatic {
    /// How far the rail of a slide may turn over the travel where the turn of the body is seen, degrees (standard
    /// deviation).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub bend: f64,
    /// The same where only the path of a point is seen.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub bend_of_path: f64,
    /// Sweep from which an arc is as likely a hinge as any, degrees.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub sweep: f64,
}

impl Default for Prismatic {
    fn default() -> Self {
        Self { bend: 2.0, bend_of_path: 8.0, sweep: 30.0 }
    }
}

joint_model!(Prismatic, "prismatic", "translation along a fixed line");

impl Mechanism for Prismatic {
    fn mobility(&self) -> Mobility {
        Mobility { turns: 0, slides: 1, parameters: 9, advances: false, roams: false }
    }

    fn geometry(&self, _: &Vector2<f64>) -> Geometry {
        Geometry::Direction
    }

    fn pose(&self, q: &Vector3<f64>, _: &Vector2<f64>) -> Pose {
        Pose::translation(0.0, 0.0, q.x)
    }

    fn twists(&self, _: &Vector3<f64>, _: &Vector2<f64>) -> [Twist; 3] {
        [Twist::new(0.0, 0.0, 0.0, 0.0, 0.0, 1.0), Twist::zeros(), Twist::zeros()]
    }

    fn project(&self, motion: &Pose, _: &Vector3<f64>, _: &Vector2<f64>) -> Vector3<f64> {
        Vector3::new(motion.translation.z, 0.0, 0.0)
    }

    fn starts(&self, series: &PoseSeries) -> Vec<Placement> {
        starts::along_the_travel(series)
    }
}

impl JointModel for Prismatic {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        if motion.pose_series().is_none() {
            return point_path::line(motion, self.bend_of_path);
        }
        let straight = judge(self, motion)?;
        let arc = hinge(motion)?;
        Ok(straight.or_bent(&arc, self.bend, self.sweep))
    }

    fn mechanism(&self) -> Option<&dyn Mechanism> {
        Some(self)
    }

    fn states_evidence(&self) -> bool {
        true
    }

    fn parts(&self) -> &'static [&'static str] {
        const ALL: [&str; 7] = misfit_and(&["leap_share", "bend"]);
        &ALL
    }
}
