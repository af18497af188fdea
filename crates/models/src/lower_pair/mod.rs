//! Joints of rigid bodies by likelihood: lower pairs, and the engine on which further mechanisms can be built.
//!
//! A [`Mechanism`] says how its positions move the joint, and where a fit may begin; [`judge`] does the rest: it fits
//! the mechanism to the poses of a pair, robustly, weighs the misfit as noise and as play, prices the positions, and
//! gives axis, uncertainty and evidence. A lower pair is a subgroup of SE(3), but a mechanism need not be one; see
//! [`Universal`].
//!
//! A body that shows only one feature has no poses; its trajectory is judged by the [curves and
//! surfaces](crate::point_path) on which the joint moves a point.
//!
//! ```
//! use jointscope_models::lower_pair::{Geometry, Mechanism, Mobility, Placement, judge};
//! use jointscope_models::motion::{Pose, PoseSeries, RelativeMotion, twist::Twist, nalgebra::{Vector2, Vector3}};
//! use jointscope_models::{FitError, JointFit, JointModel};
//!
//! /// Slides along an axis and turns about it in proportion, by a pitch that is known.
//! #[derive(Debug)]
//! struct KnownScrew { pitch: f64 }
//!
//! impl Mechanism for KnownScrew {
//!     fn mobility(&self) -> Mobility { Mobility { turns: 1, slides: 0, parameters: 11, advances: false, roams: false } }
//!     fn geometry(&self, _: &Vector2<f64>) -> Geometry { Geometry::Axis { pitch: Some(self.pitch) } }
//!     fn pose(&self, q: &Vector3<f64>, _: &Vector2<f64>) -> Pose {
//!         Pose::new(Vector3::z() * self.pitch * q.x, Vector3::z() * q.x)
//!     }
//!     fn twists(&self, _: &Vector3<f64>, _: &Vector2<f64>) -> [Twist; 3] {
//!         [Twist::new(0.0, 0.0, 1.0, 0.0, 0.0, self.pitch), Twist::zeros(), Twist::zeros()]
//!     }
//!     fn project(&self, motion: &Pose, previous: &Vector3<f64>, _: &Vector2<f64>) -> Vector3<f64> {
//!         Vector3::x() * jointscope_models::lower_pair::turn_about_z(motion, previous.x)
//!     }
//!     fn starts(&self, series: &PoseSeries) -> Vec<Placement> {
//!         jointscope_models::lower_pair::starts::about_axes(series)
//!     }
//! }
//!
//! impl JointModel for KnownScrew {
//!     fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
//!         judge(self, motion)
//!     }
//! }
//! ```

mod cylindrical;
mod drifting;
mod elliptic_trammel;
mod engine;
mod followed;
mod free;
mod judge;
mod linearisation;
pub(crate) mod misfit;
mod mixing;
mod planar;
mod prismatic;
mod random_effect;
mod revolute;
mod rigid;
mod screw;
mod spherical;
pub mod starts;
mod telling;
mod universal;

pub use crate::Mobility;
pub use cylindrical::Cylindrical;
pub use elliptic_trammel::EllipticTrammel;
pub use engine::{Fitted, Placement, fit};
pub use followed::Followed;
pub use free::{Free, free_cost};
pub use judge::{Judged, judge, judge_series};
pub(crate) use judge::{bend_cost, far_hinge_cost};
pub use planar::Planar;
pub use prismatic::Prismatic;
pub use random_effect::cost as cost_of_positions;
pub use revolute::Revolute;
pub use rigid::Rigid;
pub use screw::Screw;
pub use spherical::Spherical;
pub use universal::Universal;

use std::fmt::Debug;

use jointscope_motion::{Pose, PoseSeries, twist::Twist};
use nalgebra::{Matrix3, Vector2, Vector3};

/// Parts of every fit of a mechanism.
const MISFIT: [&str; 5] = ["misfit_distance", "misfit_angle", "sweep", "departure", "chi_squared_per_freedom"];

/// Names of the parts that [`judge`] gives: `radius` where the mechanism has an axis, the others always.
pub const PARTS: [&str; 6] = misfit_and(&["radius"]);

/// The parts of every fit of a mechanism, and further ones.
const fn misfit_and<const ALL: usize>(further: &[&'static str]) -> [&'static str; ALL] {
    assert!(ALL == MISFIT.len() + further.len(), "as many as there are");
    let mut all = [""; ALL];
    let mut k = 0;
    while k < ALL {
        all[k] = if k < MISFIT.len() { MISFIT[k] } else { further[k - MISFIT.len()] };
        k += 1;
    }
    all
}

/// What of a joint's coordinates has a meaning; the joint's z axis is its axis or normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Geometry {
    /// Nothing: a rigid connection.
    Nothing,
    /// The direction of a slide.
    Direction,
    /// An axis, with a pitch in metres per radian where turn and slide are tied; `None` where they are not.
    Axis {
        /// Metres per radian.
        pitch: Option<f64>,
    },
    /// The normal of a plane.
    Plane,
    /// A centre.
    Centre,
}

/// A mechanism of at most three degrees of freedom and two constants.
///
/// # Convention
/// `reference_from_moving = joint · h(q) · joint⁻¹ · home`, where `h(0)` is the identity and `h` is told in the joint's
/// own coordinates. Twists are `[ω; v]`; positions are radians or metres, in an order of the mechanism's choice, and
/// unused ones are 0.
pub trait Mechanism: Debug {
    /// Degrees of freedom and parameters.
    fn mobility(&self) -> Mobility;

    /// Number of positions, at most three.
    fn freedoms(&self) -> usize {
        let Mobility { turns, slides, .. } = self.mobility();
        usize::from(turns + slides)
    }

    /// Number of constants, at most two.
    fn constants(&self) -> usize {
        0
    }

    /// How large the first constant usually is, as a standard deviation about 0, for bodies of this radius in metres.
    ///
    /// Where told, a constant that the data hardly determine costs less than a parameter.
    fn usual_constant(&self, _radius: f64) -> Option<f64> {
        None
    }

    /// Names under which [`judge`] gives the constants as parts; none are given if left out.
    fn constant_names(&self) -> &'static [&'static str] {
        &[]
    }

    /// What of the joint's coordinates has a meaning.
    fn geometry(&self, constants: &Vector2<f64>) -> Geometry;

    /// Where the joint's axis or centre is while `h` is the identity, in joint coordinates: as a point fixed in the
    /// reference, and as one fixed in the moving body.
    fn axis_at_home(&self, _constants: &Vector2<f64>) -> [Vector3<f64>; 2] {
        [Vector3::zeros(); 2]
    }

    /// `h(q)`.
    fn pose(&self, q: &Vector3<f64>, constants: &Vector2<f64>) -> Pose;

    /// Twists by which `h(q)` changes with each position, taken on the left: `h(q + dq) = exp(Σ twist dq) h(q)`.
    fn twists(&self, q: &Vector3<f64>, constants: &Vector2<f64>) -> [Twist; 3];

    /// The same for the constants.
    fn constant_twists(&self, _q: &Vector3<f64>, _constants: &Vector2<f64>) -> [Twist; 2] {
        [Twist::zeros(); 2]
    }

    /// Positions after a step: their sum, unless positions are no vector space.
    fn advance(&self, q: &Vector3<f64>, step: &Vector3<f64>) -> Vector3<f64> {
        q + step
    }

    /// The positions whose `h` is nearest to a motion, near those of the frame before.
    fn project(&self, motion: &Pose, previous: &Vector3<f64>, constants: &Vector2<f64>) -> Vector3<f64>;

    /// Where fits begin.
    fn starts(&self, series: &PoseSeries) -> Vec<Placement>;

    /// Positions in which the spread of the motion is measured. Mechanisms whose spreads are compared must measure
    /// alike: angles in radians, slides in metres, along the twists of the motion.
    fn spread_coordinates(&self, q: &Vector3<f64>) -> Vector3<f64> {
        *q
    }

    /// Positions, and their covariances, told otherwise such that they spread less, slides as those of another place of the
    /// body say; `None` if there is but one way. The choice is one of two parameters more.
    ///
    /// # References
    /// docs/method.md, equation (11a).
    fn told_otherwise(&self, _positions: &[Vector3<f64>], _noise: &[Matrix3<f64>]) -> Option<Otherwise> {
        None
    }
}

/// Positions of the same motion, told otherwise.
#[derive(Debug, Clone)]
pub struct Otherwise {
    /// Of every frame, metres and radians.
    pub positions: Vec<Vector3<f64>>,
    /// Covariance of the positions in every frame.
    pub noise: Vec<Matrix3<f64>>,
}

/// The turn of a motion about z, radians, unwrapped to be near the one before.
pub fn turn_about_z(motion: &Pose, previous: f64) -> f64 {
    let q = motion.rotation.coords;
    let angle = 2.0 * q.z.atan2(q.w);
    angle + std::f64::consts::TAU * ((previous - angle) / std::f64::consts::TAU).round()
}
