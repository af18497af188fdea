//! `thesis-revolute`: every trajectory on a circle, and the circles' centres on one line.

use jointscope_motion::{Columns, RelativeMotion, Trajectory};
use nalgebra::{Point3, Unit, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::centre_line::{CentreLine, Centres};
use super::lanes::{self, Turned};
use super::occupied::Degrees;
use super::{
    AxisRadius, Circle, CircleMethod, ROUNDING, above_rounding, is_still, occupied, positions, principal_axes,
    q_function, trajectories_by_feature,
};
use crate::{Axis, Confidence, FitError, Joint, JointFit, JointModel, Positions, joint_model};

/// Revolute joint: every feature moves on a circle, far enough to show it, and the centres lie on one axis.
///
/// `confidence = circle_fit · occupied_angle · axis_fit`. `circle_fit` is the share of points whose distance from the
/// centre is within a tolerance of the radius; `occupied_angle = 1 - Q(mean angle, μ, λ)` with the angle, in whole
/// degrees, that a trajectory occupies on its circle; `axis_fit` is the share of centres inside a tube around the
/// line through all centres.
///
/// Convention: the direction is such that the farthest position is positive; the axis point is the mean of the
/// centres.
///
/// Degenerate cases: without motion the confidence is 0; a straight trajectory is a circle of infinite radius that
/// occupies one degree. Features in one plane across the axis (a turntable) have all centres in one place and no line
/// through them: see `turntable`. A body with one feature has one centre: see `lone_trajectory`. A feature that stays in
/// one place to the digit, on the axis say, is left out if others move.
///
/// References: thesis section 5.3, equations (21)-(44).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ThesisRevolute {
    /// `ci` of section 5.3: how far from the circle a point may lie, as a share of the radius.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub circle_tolerance: f64,
    /// How circles are fitted.
    pub circle: CircleMethod,
    /// How the circle fits of the trajectories are put together.
    pub trajectories: CombineTrajectories,
    /// μ of equation (42): the occupied angle that is half convincing, in degrees.
    #[schemars(range(min = 0.0, max = 360.0))]
    pub angle_mean: f64,
    /// λ of equation (42): how sharply the score rises there, per degree.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub angle_steepness: f64,
    /// Radius of the tube around the axis of equation (43), as a share of what `axis_radius` names.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub axis_tolerance: f64,
    /// What the radius of that tube is a share of.
    pub axis_radius: AxisRadius,
    /// What to do where all circles have one centre, as with a body of a single feature.
    pub lone_trajectory: LoneTrajectory,
    /// Take the axis from the planes' normals where the centres form no line (end of section 5.3); the tube around
    /// it is then a share of the circles' radius.
    pub turntable: bool,
    /// Spread of the centres across their line, as a share of the spread along it, from which they form no line.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub turntable_spread: f64,
}

/// How the circle fits of several trajectories are put together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CombineTrajectories {
    /// Their mean.
    Mean,
    /// The least of them.
    Minimum,
    /// Their product, which noise makes vanish.
    Product,
}

/// What circles with one centre say about an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LoneTrajectory {
    /// Their normal is the axis, which fits.
    Normal,
    /// Nothing: the joint is not revolute.
    Refuse,
}

impl Default for ThesisRevolute {
    fn default() -> Self {
        Self {
            circle_tolerance: 0.03,
            circle: CircleMethod::Taubin,
            trajectories: CombineTrajectories::Mean,
            angle_mean: 20.0,
            angle_steepness: 0.5,
            axis_tolerance: 0.1,
            axis_radius: AxisRadius::Line,
            lone_trajectory: LoneTrajectory::Normal,
            turntable: false,
            turntable_spread: 0.5,
        }
    }
}

joint_model!(ThesisRevolute, "thesis-revolute", "trajectories on circles about one axis (thesis 5.3)");

impl JointModel for ThesisRevolute {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        let (all, turning) = match motion.columns().filter(|columns| columns.frames() > 2) {
            Some(columns) => self.seen_in_rows(motion, columns),
            None => self.seen_in(motion, &trajectories_by_feature(motion, 3)?),
        };
        let arcs = all.telling();
        let count = arcs.len() as f64;
        let fits = arcs.iter().map(|arc| arc.on_circle);
        let circle_fit = match self.trajectories {
            CombineTrajectories::Mean => fits.sum::<f64>() / count,
            CombineTrajectories::Minimum => fits.fold(1.0, f64::min),
            CombineTrajectories::Product => fits.product(),
        };
        let angle = arcs.iter().map(|arc| f64::from(arc.degrees)).sum::<f64>() / count;
        let occupied_angle = 1.0 - q_function(angle, self.angle_mean, self.angle_steepness);
        let axis_fit = turning.as_ref().map_or(0.0, |turning| turning.about.inside as f64 / count);

        let mut joint = Joint::default();
        let mut residual = None;
        if let Some(Turning { about: CentreLine { point, direction, .. }, angles, off }) = turning {
            let backwards = positions::points_backwards(&angles);
            let positions = Positions::of_one_freedom(angles);
            joint.axis =
                Some(Axis { point, direction: Some(if backwards { -direction } else { direction }), pitch: Some(0.0) });
            joint.positions = Some(if backwards { positions.reversed() } else { positions });
            residual = Some(off);
        }
        let confidence = Confidence::new(circle_fit * occupied_angle * axis_fit)?;
        let mut fit = JointFit::new(confidence, joint)
            .with_part("circle_fit", circle_fit)
            .with_part("occupied_angle", occupied_angle)
            .with_part("occupied_degrees", angle)
            .with_part("axis_fit", axis_fit);
        fit.residual_rms = residual;
        Ok(fit)
    }

    fn parts(&self) -> &'static [&'static str] {
        &["circle_fit", "occupied_angle", "occupied_degrees", "axis_fit"]
    }
}

/// A trajectory and its circle.
struct Arc {
    /// Of the moving body.
    feature: usize,
    /// `None` for a straight line.
    circle: Option<Circle>,
    /// Share of its points on the circle.
    on_circle: f64,
    /// Whole degrees that it occupies.
    degrees: u16,
    is_still: bool,
}

impl Arc {
    /// A straight line lies on its infinite circle, and occupies a degree; a point lies on none.
    fn without_circle(feature: usize, is_still: bool) -> Self {
        let on_circle = if is_still { 0.0 } else { 1.0 };
        Self { feature, circle: None, on_circle, degrees: u16::from(!is_still), is_still }
    }
}

/// The arcs of all features, those that move before those that are still.
struct Arcs {
    all: Vec<Arc>,
    moving: usize,
}

impl Arcs {
    fn of(mut all: Vec<Arc>) -> Self {
        all.sort_unstable_by_key(|arc| (arc.is_still, arc.feature));
        let moving = all.partition_point(|arc| !arc.is_still);
        Self { all, moving }
    }

    /// A feature exactly on the axis has no circle, and says nothing where others move.
    fn telling(&self) -> &[Arc] {
        if self.moving == 0 { &self.all } else { &self.all[..self.moving] }
    }
}

/// What all trajectories show of turning about one axis.
struct Turning {
    about: CentreLine,
    /// Radians, per frame of the recording.
    angles: Vec<Option<f64>>,
    /// Root mean square distance of the samples from their features' circles about the axis, metres.
    off: f64,
}

impl ThesisRevolute {
    fn seen_in(&self, motion: &RelativeMotion<'_>, tracks: &[(usize, Trajectory<'_>)]) -> (Arcs, Option<Turning>) {
        let arc = |(feature, track): &(usize, Trajectory<'_>)| {
            let is_still = is_still(track);
            let Some(circle) = Circle::through(track.points, self.circle) else {
                return Arc::without_circle(*feature, is_still);
            };
            let on_circle = self.share_on_circle(track, &circle);
            let degrees = occupied(track.points.iter().map(|point| circle.on_unit_circle(point)));
            Arc { feature: *feature, circle: Some(circle), on_circle, degrees, is_still }
        };
        let arcs = Arcs::of(tracks.iter().map(arc).collect());
        let turning = self.axis(arcs.telling()).map(|about| Turning {
            angles: positions::angles(motion, about.point, about.direction),
            off: off_circles(motion, arcs.telling(), about.point, about.direction),
            about,
        });
        (arcs, turning)
    }

    /// The same of features that are always seen: moments tell circles and axis, and one look the rest.
    fn seen_in_rows(&self, motion: &RelativeMotion<'_>, columns: Columns<'_>) -> (Arcs, Option<Turning>) {
        let known = columns.summaries();
        let arc = |(feature, circle): (usize, Option<Circle>)| {
            let is_still = known[feature].moved <= ROUNDING * known[feature].magnitude;
            match circle {
                Some(circle) => Arc { feature, circle: Some(circle), on_circle: 0.0, degrees: 0, is_still },
                None => Arc::without_circle(feature, is_still),
            }
        };
        let mut arcs = Arcs::of(Circle::through_all(known, self.circle).into_iter().enumerate().map(arc).collect());
        let axis = self.axis(arcs.telling());
        let mut turned =
            axis.as_ref().map(|axis| Turned::about(axis.point, positions::across(axis.direction), columns));
        let mut degrees = vec![Degrees::default(); arcs.all.len()];
        columns.in_turn(|frame, rows| {
            for (arc, degrees) in arcs.all.iter_mut().zip(&mut degrees) {
                let rows = rows[arc.feature];
                if let Some(circle) = &arc.circle {
                    arc.on_circle += lanes::on_circle(rows, circle, self.circle_tolerance, degrees);
                }
                if let Some(turned) = &mut turned {
                    turned.add(frame, arc.feature, rows);
                }
            }
        });
        let count = columns.frames() as f64;
        for (arc, degrees) in arcs.all.iter_mut().zip(degrees).filter(|(arc, _)| arc.circle.is_some()) {
            arc.on_circle /= count;
            arc.degrees = degrees.occupied();
        }
        let turning = axis.zip(turned).map(|(about, turned)| {
            let telling = arcs.telling();
            let sum: f64 = telling.iter().map(|arc| turned.off_circle(arc.feature, columns.frames())).sum();
            let off = above_rounding((sum / (telling.len() as f64 * count)).sqrt(), columns);
            Turning { about, angles: positions::unwrapped(motion, &turned), off }
        });
        (arcs, turning)
    }

    /// Equation (41): share of points on the circle.
    fn share_on_circle(&self, track: &Trajectory<'_>, circle: &Circle) -> f64 {
        let on_circle = |point: &&Point3<f64>| {
            let (x, y) = circle.on_unit_circle(point);
            (x.hypot(y) - 1.0).abs() <= self.circle_tolerance
        };
        track.points.iter().filter(on_circle).count() as f64 / track.points.len() as f64
    }

    /// The axis to which arcs point.
    fn axis(&self, arcs: &[Arc]) -> Option<CentreLine> {
        self.axis_of(arcs.iter().filter_map(|arc| arc.circle.as_ref()))
    }

    fn axis_of<'c>(&self, circles: impl Iterator<Item = &'c Circle> + Clone) -> Option<CentreLine> {
        let places: Vec<Point3<f64>> = circles.clone().map(|c| c.centre).collect();
        let mean_radius = circles.clone().map(|c| c.radius).sum::<f64>() / places.len() as f64;
        let centres = Centres::new(&places, mean_radius)?;
        let one_centre = centres.are_one();
        if one_centre && self.lone_trajectory == LoneTrajectory::Refuse {
            return None;
        }
        let (direction, spread) = centres.extent();
        if one_centre || (self.turntable && spread > self.turntable_spread) {
            let normals = circles.map(|c| c.normal.into_inner() * c.normal.transpose()).sum();
            return Some(centres.along(principal_axes(normals)[0].1, self.axis_tolerance, AxisRadius::Circle));
        }
        Some(centres.along(direction, self.axis_tolerance, self.axis_radius))
    }
}

/// Root mean square distance of the samples from their features' circles about a common axis, metres.
fn off_circles(motion: &RelativeMotion<'_>, arcs: &[Arc], point: Point3<f64>, direction: Unit<Vector3<f64>>) -> f64 {
    let place = |p: &Point3<f64>| {
        let d = p - point;
        (direction.cross(&d).norm(), direction.dot(&d))
    };
    let (mut sum, mut count) = (0.0, 0.0);
    for arc in arcs {
        let points = motion.trajectories().get(arc.feature).points;
        let samples = points.len() as f64;
        let total = points.iter().map(place).fold((0.0, 0.0), |(r, h), (radius, height)| (r + radius, h + height));
        let (radius, height) = (total.0 / samples, total.1 / samples);
        sum += points.iter().map(place).map(|(r, h)| (r - radius).powi(2) + (h - height).powi(2)).sum::<f64>();
        count += samples;
    }
    (sum / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circles(centres: &[[f64; 3]]) -> Vec<Circle> {
        let circle = |c: &[f64; 3]| Circle {
            centre: (*c).into(),
            normal: Vector3::z_axis(),
            radius: 0.5,
            x_axis: Vector3::x_axis(),
        };
        centres.iter().map(circle).collect()
    }

    #[test]
    fn centres_beside_the_axis_do_not_count() {
        // Extent 1 m along z: the tube's radius is 0.1 m. One centre of five is 0.15 m off.
        let circles = circles(&[[0., 0., -0.5], [0., 0., -0.25], [0.15, 0., 0.], [0., 0., 0.25], [0., 0., 0.5]]);
        let axis = ThesisRevolute::default().axis_of(circles.iter()).expect("an axis");
        assert_eq!(axis.inside, 4);
        assert!(axis.direction.cross(&Vector3::z()).norm() < 0.1);
    }

    #[test]
    fn a_turntable_takes_its_axis_from_the_normals() {
        let circles = circles(&[[0.001, 0., 0.], [-0.001, 0.001, 0.], [0., -0.001, 0.0005], [0.0005, 0.001, -0.001]]);
        let angle = |turntable| {
            let axis = ThesisRevolute { turntable, ..Default::default() }.axis_of(circles.iter()).expect("an axis");
            axis.direction.cross(&Vector3::z()).norm().asin().to_degrees()
        };
        assert!(angle(true) < 1e-6 && angle(false) > 30.0, "{} {}", angle(true), angle(false));
    }

    #[test]
    fn one_circle_has_its_normal_for_an_axis_unless_refused() {
        let circles = circles(&[[1., 2., 3.]]);
        assert_eq!(ThesisRevolute::default().axis_of(circles.iter()).expect("its normal").inside, 1);
        let refuse = ThesisRevolute { lone_trajectory: LoneTrajectory::Refuse, ..Default::default() };
        assert!(refuse.axis_of(circles.iter()).is_none());
    }
}
