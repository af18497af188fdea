//! Bodies put together with joints in front of a sensor.

use jointscope_motion::Pose;

use crate::options::{check_bend, check_depth_gain, check_scale, within};
use crate::{Joint, SceneError, Sensor};

/// Most samples of one body, so that a slip of a digit does not fill the memory.
pub(crate) const MOST_SAMPLES: f64 = 1e7;

/// Bodies that move on joints in front of a sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Its name.
    pub name: String,
    /// Number of frames.
    pub frames: usize,
    /// Frames per second.
    pub rate: f64,
    /// The bodies, every one after the body it is attached to.
    pub bodies: Vec<SceneBody>,
    /// How well they are seen.
    pub sensor: Sensor,
}

/// One rigid body of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneBody {
    /// Its name.
    pub name: String,
    /// Number of features, drawn at random over the shape.
    pub features: usize,
    /// Where features can be.
    pub shape: Shape,
    /// `recording_from_shape` at frame 0, metres.
    pub placement: Pose,
    /// What it hangs on, and how it moves.
    pub attachment: Attachment,
    /// Multiplies the sensor's noise. At 0 the body is seen exactly, with neither noise nor wild samples nor stray
    /// features, as trackers see what is at rest: constant to the digit. Dropouts remain.
    pub noise_factor: f64,
    /// What its observed coordinates are multiplied by, about the camera centre.
    pub scale: f64,
    /// Compression of its depth changes: z(t) = z(0) + g (Z(t) - Z(0)).
    pub depth_gain: f64,
}

/// Where the features of a body can be, in the shape's coordinates, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// In a box about the origin.
    Box {
        /// Edges along x, y, z.
        size: [f64; 3],
    },
    /// On a rectangle about the origin, in the xy plane.
    Plate {
        /// Edges along x and y.
        size: [f64; 2],
    },
    /// In a ring about the z axis.
    Ring {
        /// Inner radius; 0 makes it a disc.
        inner: f64,
        /// Outer radius.
        outer: f64,
        /// Extent along z; 0 makes it flat.
        width: f64,
    },
}

/// What a body hangs on, and how it moves.
#[derive(Debug, Clone, PartialEq)]
pub struct Attachment {
    /// Index of the body it is attached to; `None` is the world.
    pub parent: Option<usize>,
    /// By which joint.
    pub joint: Joint,
    /// Position of the joint over frames, one series per freedom (see [`crate::JointKind`]), counted from frame 0: what
    /// the series have at frame 0 is subtracted. Empty: at rest.
    pub motion: Vec<Vec<f64>>,
    /// The joint is not ideal: range of a slow random translation in every coordinate, metres.
    pub play: f64,
    /// The joint is not ideal: share of its travel, 0 to 0.5, by which the body departs sideways, as a bow over the
    /// joint's position.
    ///
    /// The departure is a translation of `bend * travel * (b(s) - b(s at frame 0))` with `b(s) = 1 - (2 s - 1)^2`, where
    /// s in [0, 1] is the first coordinate of the position within its range, in a fixed direction of the parent's
    /// coordinates: along the normal of a planar joint; at random for joints about a point and for none; otherwise at
    /// random across the axis. The travel is the largest that one coordinate takes the centre of the shape: the range
    /// of a length, or that of an angle times the centre's distance from the axis or point (of a screw, along the
    /// helix). Rigid joints do not bend.
    pub bend: f64,
}

impl Attachment {
    /// At rest in the recording's coordinates.
    pub fn at_rest() -> Self {
        Self { parent: None, joint: Joint::rigid(), motion: vec![], play: 0.0, bend: 0.0 }
    }

    /// On an ideal joint.
    pub fn new(parent: Option<usize>, joint: Joint, motion: Vec<Vec<f64>>) -> Self {
        Self { parent, joint, motion, play: 0.0, bend: 0.0 }
    }
}

impl Scene {
    /// Checks that the scene can be simulated.
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        within("frames", self.frames as f64, 2.0..=1e6, "2 to 1000000")?;
        within("rate", self.rate, 1e-3..=1e6, "0.001 to 1000000 Hz")?;
        self.sensor.check()?;
        for (number, body) in self.bodies.iter().enumerate() {
            body.check(number, self.frames)?;
        }
        Ok(())
    }
}

impl SceneBody {
    fn check(&self, number: usize, frames: usize) -> Result<(), SceneError> {
        within(
            "features",
            self.features as f64,
            1.0..=MOST_SAMPLES / frames as f64,
            "at least 1, and at most 10 million samples per body",
        )?;
        within("noise_factor", self.noise_factor, 0.0..=1000.0, "0 to 1000")?;
        within("play", self.attachment.play, 0.0..=10.0, "0 to 10 m")?;
        check_bend(self.attachment.bend)?;
        check_scale(self.scale)?;
        check_depth_gain(self.depth_gain)?;
        let wrong = |detail: String| Err(SceneError::Body { body: self.name.clone(), detail });
        let Attachment { parent, joint, motion, .. } = &self.attachment;
        if let Some(parent) = parent.filter(|&parent| parent >= number) {
            return wrong(format!("it must come after the body it is attached to, number {parent}"));
        }
        let freedoms = joint.kind.freedoms();
        if !motion.is_empty() && motion.len() != freedoms {
            return wrong(format!("a {} joint has {freedoms} coordinates, found {}", joint.kind.name(), motion.len()));
        }
        if let Some(series) = motion.iter().find(|series| series.len() != frames) {
            return wrong(format!("its joint needs one position per frame, {frames}, found {}", series.len()));
        }
        if motion.iter().flatten().any(|q| !q.is_finite()) {
            return wrong("its joint has a position that is not a finite number".into());
        }
        let steps = motion.iter().take(joint.kind.angles()).flat_map(|angles| angles.windows(2));
        let fastest = steps.map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        if fastest >= std::f64::consts::PI {
            return Err(SceneError::TooFast { body: self.name.clone(), degrees: fastest.to_degrees() });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{JointKind, SceneOptions, scene};

    fn refused(change: impl Fn(&mut Scene)) -> String {
        let mut scene = scene("cylindrical", &SceneOptions::default()).expect("a scene");
        change(&mut scene);
        scene.simulate(1).expect_err("refused").to_string()
    }

    #[test]
    fn scenes_that_contradict_themselves_are_refused_with_the_body_named() {
        assert!(refused(|s| s.bodies[1].attachment.parent = Some(1)).starts_with("body `part`: it must come after"));
        assert!(
            refused(|s| s.bodies[1].attachment.joint.kind = JointKind::Planar).contains("has 3 coordinates, found 2")
        );
        assert!(refused(|s| s.frames = 51).contains("one position per frame, 51, found 50"));
        assert!(refused(|s| s.bodies[1].attachment.motion[1][3] = f64::NAN).contains("not a finite number"));
        assert!(refused(|s| s.bodies[1].name = "base".into()).contains("two bodies are named `base`"));
        assert!(refused(|s| s.bodies.clear()).contains("at least one body"));
    }

    #[test]
    fn numbers_out_of_range_are_refused_by_name() {
        assert!(refused(|s| s.rate = 0.0).starts_with("option `rate`"));
        assert!(refused(|s| s.bodies[0].scale = f64::NAN).starts_with("option `scale`"));
        assert!(refused(|s| s.bodies[0].depth_gain = -1.0).starts_with("option `depth_gain`"));
        assert!(refused(|s| s.bodies[0].noise_factor = -1.0).starts_with("option `noise_factor`"));
        assert!(refused(|s| s.bodies[0].features = 0).starts_with("option `features`"));
        assert!(refused(|s| s.bodies[0].features = 1_000_000).starts_with("option `features`"));
    }

    #[test]
    fn a_turn_too_fast_to_be_followed_is_refused() {
        let options = SceneOptions { sweep_deg: Some(3600.0), frames: Some(10), ..SceneOptions::default() };
        let error = crate::simulate("revolute", &options).expect_err("too fast");
        assert!(matches!(error, SceneError::TooFast { .. }), "{error}");
    }
}
