//! What is true of a simulated recording.

use jointscope_motion::Pose;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::{Joint, JointKind, SceneOptions};

/// What is true of a simulated recording; serialised, it is the `truth.json` beside it.
///
/// # Convention
/// True metres, as if seen without noise and at scale 1 and depth gain 1, in the recording's coordinates at frame 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Always `jointscope-truth`.
    pub format: String,
    /// Version of the format.
    pub version: u32,
    /// Name of the scene.
    pub scene: String,
    /// Seed of everything random.
    pub seed: u64,
    /// The options of the scene, as given.
    pub options: SceneOptions,
    /// Every pair of bodies, by the order of bodies; the first one is the reference.
    pub pairs: Vec<PairTruth>,
    /// Every body.
    pub bodies: Vec<BodyTruth>,
}

impl Truth {
    /// What is true of two bodies, whichever of them is the reference.
    ///
    /// A pair found the other way round has the same joint and axis; its positions have the other sign.
    pub fn pair(&self, one: &str, other: &str) -> Option<&PairTruth> {
        self.pairs.iter().find(|pair| {
            (pair.reference == one && pair.moving == other) || (pair.reference == other && pair.moving == one)
        })
    }
}

/// The true joint between two bodies: the ideal one, where the real one bends or has play.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairTruth {
    /// Name of the reference body.
    pub reference: String,
    /// Name of the moving body.
    pub moving: String,
    /// Name of the joint as in results.
    pub joint: String,
    /// The axis in coordinates of the reference body; null for rigid and disconnected pairs.
    pub axis: Option<TrueAxis>,
    /// The joint position at every frame, counted from frame 0, over full turns, radians before metres; null for rigid
    /// and disconnected pairs.
    ///
    /// Cylindrical: angle, slide. Planar: angle, and the displacement of the axis point along two perpendicular
    /// directions of the plane. Spherical: the rotation vector. Universal: the turns about the reference's axis and
    /// about the one carried by the moving body. Elliptical: the turn of the crank, which is the
    /// opposite of the turn of the body.
    pub positions: Option<Positions>,
    /// The joint in the thesis's four classes.
    pub thesis_joint: String,
}

/// The parts of an axis that a joint has; the others are null.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrueAxis {
    /// Metres. Prismatic: the centroid of the moving body's features at frame 0; planar: a point of the plane;
    /// spherical, universal and elliptical: the centre; otherwise a point of the axis.
    pub point: [f64; 3],
    /// Unit length; planar and elliptical: the normal; null for spherical and universal joints.
    pub direction: Option<[f64; 3]>,
    /// Metres per radian; 0 for revolute joints, null for all that have none.
    pub pitch: Option<f64>,
}

/// Joint positions over frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Positions {
    /// One number per frame, radians or metres.
    Single(Vec<f64>),
    /// Several numbers per frame, radians before metres.
    Several(Vec<Vec<f64>>),
}

/// How a body was seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BodyTruth {
    /// Its name.
    pub name: String,
    /// What its observed coordinates were multiplied by, about the camera centre.
    pub scale: f64,
    /// Compression of its depth changes.
    pub depth_gain: f64,
    /// Standard deviation of its samples across the viewing ray, metres.
    pub noise: f64,
    /// Features that move on their own, by number.
    pub outlier_features: Vec<usize>,
}

impl PairTruth {
    /// What a joint between two bodies amounts to when they move like this.
    pub(crate) fn new(
        [reference, moving]: [&str; 2],
        joint: &Joint,
        centroid: Point3<f64>,
        reference_from_moving: impl Iterator<Item = Pose>,
    ) -> Self {
        let kind = joint.kind;
        let positions = match kind {
            JointKind::Rigid | JointKind::Disconnected => None,
            _ => Some(positions(joint, reference_from_moving)),
        };
        Self {
            reference: reference.into(),
            moving: moving.into(),
            joint: kind.name().into(),
            axis: axis(joint, centroid),
            positions,
            thesis_joint: kind.thesis_name().into(),
        }
    }
}

fn axis(joint: &Joint, centroid: Point3<f64>) -> Option<TrueAxis> {
    let point = |point: Point3<f64>| <[f64; 3]>::from(point.coords);
    let (origin, direction) = (point(joint.point()), Some(<[f64; 3]>::from(joint.direction())));
    let axis = |point, direction, pitch| Some(TrueAxis { point, direction, pitch });
    match joint.kind {
        JointKind::Rigid | JointKind::Disconnected => None,
        JointKind::Prismatic => axis(point(centroid), direction, None),
        JointKind::Revolute => axis(origin, direction, Some(0.0)),
        JointKind::Screw { pitch } => axis(origin, direction, Some(pitch)),
        JointKind::Cylindrical | JointKind::Planar | JointKind::Elliptical { .. } => axis(origin, direction, None),
        JointKind::Spherical | JointKind::Universal => axis(origin, None, None),
    }
}

fn positions(joint: &Joint, reference_from_moving: impl Iterator<Item = Pose>) -> Positions {
    let mut previous = vec![];
    let all = reference_from_moving.map(|pose| {
        previous = joint.position(&pose, &previous);
        previous.clone()
    });
    if joint.kind.freedoms() == 1 {
        Positions::Single(all.flatten().collect())
    } else {
        Positions::Several(all.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate;

    #[test]
    fn truth_is_written_in_the_stated_form_and_read_back() {
        let simulation = simulate("cylindrical", &SceneOptions { seed: 9, ..Default::default() }).expect("cylindrical");
        let text = serde_json::to_string(&simulation.truth).expect("serialises");
        let start = r#"{"format":"jointscope-truth","version":1,"scene":"cylindrical","seed":9,"options":{"seed":9},"#;
        assert!(text.starts_with(start), "{text}");
        let value: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let pair = &value["pairs"][0];
        assert_eq!((&pair["reference"], &pair["moving"]), (&"base".into(), &"part".into()));
        assert!(pair["axis"]["pitch"].is_null() && pair["axis"]["direction"][2].is_f64());
        assert_eq!(pair["positions"][0].as_array().map(Vec::len), Some(2));
        // The last digit of a float may change on the way through text; the meaning may not.
        let back: Truth = serde_json::from_str(&text).expect("reads back");
        assert_eq!(back.pairs[0].joint, "cylindrical");
        assert_eq!(back.bodies, simulation.truth.bodies);
    }

    #[test]
    fn a_pair_is_found_from_both_sides() {
        let truth = simulate("rigid", &SceneOptions::default()).expect("rigid").truth;
        assert!(truth.pair("base", "part").is_some() && truth.pair("part", "base").is_some());
        assert!(truth.pair("base", "base").is_none());
    }
}
