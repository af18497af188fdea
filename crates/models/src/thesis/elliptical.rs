//! `elliptical`: every trajectory on an ellipse, alike in shape, and the ellipses' centres on one line.

use jointscope_motion::{RelativeMotion, Trajectory};
use nalgebra::{Point3, Unit, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::centre_line::{CentreLine, Centres};
use super::ellipse::Ellipse;
use super::{AxisRadius, Ellipses, is_still, occupied, positions, q_function, trajectories};
use crate::{Axis, Confidence, FitError, Joint, JointFit, JointModel, Positions, joint_model};

/// Confidence from which it is said what ellipses may come from.
const SURE: f64 = 0.5;
const ONE_CAMERA: &str = "features run on ellipses, as those of a hinge do where a single camera compresses depth: \
    `depth_gain` under [motion] undoes that; robot descriptions take the joint for a hinge";

/// Elliptical joint: every feature moves on an ellipse, far enough to show it, about one axis; the ellipses are alike in
/// the ratio of their axes, and in the direction of the long one.
///
/// `confidence = ellipse_fit · occupied_angle · axis_fit · eccentricity`. `ellipse_fit` is the share of points whose
/// distance from the ellipse is within a tolerance, as a share of the long semi-axis; `occupied_angle = 1 - Q(mean
/// angle, μ, λ)` with the eccentric angle, in whole degrees, that a trajectory occupies on its ellipse; `axis_fit` is
/// the share of centres inside a tube around the line across the planes; `eccentricity = (1 - Q(s, μ, λ)) · Q(ratio, μ,
/// λ)`: ellipses must be clearly better than circles, `s²` being the fall of the squared distances in variances of what
/// remains, and clearly flatter. A hinge is no elliptical joint, which may therefore be asked for before or after one.
///
/// Convention: the direction is the normal of the ellipses' planes, such that the farthest position is positive; the
/// axis point is the mean of the centres; positions are eccentric angles about it, radians, 0 at the first frame. Parts
/// tell `ratio` (short over long axis), the mean `semi_axis_long` and `semi_axis_short`, metres, and the unit direction
/// of the long axes.
///
/// Degenerate cases: without motion, or where all trajectories are straight, the confidence is 0. A short arc of an
/// ellipse is one of a circle: what noise does not let one see is not claimed.
///
/// References: thesis section 6.2, which proposes it; the scores are those of section 5.3, equations (41)-(44); the fit is
/// told in docs/method.md, "Ellipses".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Elliptical {
    /// How far from the ellipse a point may lie, as a share of the long semi-axis.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub ellipse_tolerance: f64,
    /// The occupied angle that is half convincing, in degrees.
    #[schemars(range(min = 0.0, max = 360.0))]
    pub angle_mean: f64,
    /// How sharply the score rises there, per degree.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub angle_steepness: f64,
    /// Radius of the tube around the axis, as a share of what `axis_radius` names.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub axis_tolerance: f64,
    /// What the radius of that tube is a share of.
    pub axis_radius: AxisRadius,
    /// Ratio of short to long axis that is half convincing.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub ratio_mean: f64,
    /// How sharply the score falls there.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub ratio_steepness: f64,
    /// How much better than circles ellipses must be to be half convincing, in standard deviations.
    #[schemars(range(min = 0.0))]
    pub significance_mean: f64,
    /// How sharply the score rises there, per standard deviation.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub significance_steepness: f64,
}

impl Default for Elliptical {
    fn default() -> Self {
        Self {
            ellipse_tolerance: 0.03,
            angle_mean: 20.0,
            angle_steepness: 0.5,
            axis_tolerance: 0.1,
            axis_radius: AxisRadius::Circle,
            ratio_mean: 0.95,
            ratio_steepness: 60.0,
            significance_mean: 4.0,
            significance_steepness: 1.5,
        }
    }
}

joint_model!(Elliptical, "elliptical", "trajectories on like ellipses about one axis (thesis 6.2)");

impl JointModel for Elliptical {
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        let mut tracks = trajectories(motion, 3)?;
        // A feature exactly on the axis has no ellipse, and says nothing where others move.
        tracks.retain(|track| !is_still(track));
        match Ellipses::through(&tracks) {
            Some(ellipses) => self.judge(motion, &tracks, &ellipses),
            None => Ok(JointFit::new(Confidence::ZERO, Joint::default())
                .with_part("ellipse_fit", 0.0)
                .with_part("occupied_angle", 0.0)
                .with_part("occupied_degrees", 0.0)
                .with_part("axis_fit", 0.0)
                .with_part("eccentricity", 0.0)),
        }
    }

    fn counts_observations(&self) -> bool {
        true
    }

    fn parts(&self) -> &'static [&'static str] {
        &[
            "ellipse_fit",
            "occupied_angle",
            "occupied_degrees",
            "axis_fit",
            "eccentricity",
            "significance",
            "ratio",
            "semi_axis_long",
            "semi_axis_short",
            "long_axis_x",
            "long_axis_y",
            "long_axis_z",
        ]
    }
}

impl Elliptical {
    fn judge(
        &self,
        motion: &RelativeMotion<'_>,
        tracks: &[Trajectory<'_>],
        ellipses: &Ellipses,
    ) -> Result<JointFit, FitError> {
        let count = tracks.len() as f64;
        let found: Vec<(&Trajectory<'_>, &Ellipse)> =
            tracks.iter().zip(&ellipses.each).filter_map(|(track, ellipse)| Some((track, ellipse.as_ref()?))).collect();
        let ellipse_fit = found.iter().map(|(_, ellipse)| self.share_on(ellipse)).sum::<f64>() / count;
        let (x, y) = ellipses.circular();
        let degrees = |(track, ellipse): &(&Trajectory<'_>, &Ellipse)| {
            let from_centre = track.points.iter().map(|point| point - ellipse.centre);
            f64::from(occupied(from_centre.map(|d| (x.dot(&d), y.dot(&d)))))
        };
        let angle = found.iter().map(degrees).sum::<f64>() / count;
        let occupied_angle = 1.0 - q_function(angle, self.angle_mean, self.angle_steepness);
        let places: Vec<Point3<f64>> = found.iter().map(|(_, ellipse)| ellipse.centre).collect();
        let long = found.iter().map(|(_, ellipse)| ellipse.long).sum::<f64>() / found.len() as f64;
        let Some(centres) = Centres::new(&places, long) else {
            return Err(FitError::Fault { what: "it has ellipses without centres".into() });
        };
        let CentreLine { point, direction, inside } =
            centres.along(ellipses.normal, self.axis_tolerance, self.axis_radius);
        let axis_fit = inside as f64 / count;
        let eccentricity = (1.0
            - q_function(ellipses.significance, self.significance_mean, self.significance_steepness))
            * q_function(ellipses.ratio, self.ratio_mean, self.ratio_steepness);

        let angles = positions::turns(motion, point, x, y);
        let backwards = positions::points_backwards(&angles);
        let positions = Positions::of_one_freedom(angles);
        let joint = Joint {
            axis: Some(Axis {
                point,
                direction: Some(if backwards { -direction } else { direction }),
                pitch: Some(0.0),
            }),
            positions: Some(if backwards { positions.reversed() } else { positions }),
        };
        let long_axis = headed(ellipses.long_axis);
        let confidence = Confidence::new(ellipse_fit * occupied_angle * axis_fit * eccentricity)?;
        let mut fit = JointFit::new(confidence, joint);
        if confidence.value() > SURE {
            fit.notes.push(ONE_CAMERA.into());
        }
        Ok(fit
            .with_residual(ellipses.residual)
            .with_part("ellipse_fit", ellipse_fit)
            .with_part("occupied_angle", occupied_angle)
            .with_part("occupied_degrees", angle)
            .with_part("axis_fit", axis_fit)
            .with_part("eccentricity", eccentricity)
            .with_part("significance", ellipses.significance)
            .with_part("ratio", ellipses.ratio)
            .with_part("semi_axis_long", long)
            .with_part("semi_axis_short", long * ellipses.ratio)
            .with_part("long_axis_x", long_axis.x)
            .with_part("long_axis_y", long_axis.y)
            .with_part("long_axis_z", long_axis.z))
    }

    /// Share of a trajectory's points that lie on its ellipse.
    fn share_on(&self, ellipse: &Ellipse) -> f64 {
        let near = |distance: &&f64| distance.abs() <= self.ellipse_tolerance * ellipse.long;
        ellipse.distances.iter().filter(near).count() as f64 / ellipse.distances.len() as f64
    }
}

/// Of a line's two directions, the one whose largest coordinate is positive.
fn headed(line: Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
    if line[line.iamax()] < 0.0 { -line } else { line }
}
