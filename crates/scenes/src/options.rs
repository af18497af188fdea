//! What a caller can choose about a named scene.

use std::ops::RangeBounds;

use serde::{Deserialize, Serialize};

use crate::scene::MOST_SAMPLES;
use crate::{SceneError, Sensor, Shape};

/// Rotation noise of tracked poses where the options say nothing of it, radians.
const ROTATION_NOISE: f64 = 0.01;

/// Choices about a named scene; everything left out is as the scene's description says.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneOptions {
    /// Seed of everything random.
    pub seed: u64,
    /// Number of frames, at least 2.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<usize>,
    /// Number of features on every body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub features: Option<usize>,
    /// Standard deviation of a sample across the viewing ray, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<f64>,
    /// Standard deviation along the viewing ray as a multiple of `noise`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth_noise: Option<f64>,
    /// Correlation of a sample's noise with that of the frame before (AR(1)), in [0, 1); the size of the noise stays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drift: Option<f64>,
    /// Share of the samples that are missing, in [0, 1).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dropout: Option<f64>,
    /// Share of a body's features that move on their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outlier_features: Option<f64>,
    /// Share of the samples that are wild.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outlier_samples: Option<f64>,
    /// Range of every angle of the joint, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sweep_deg: Option<f64>,
    /// Range of every length of the joint, metres; left out, the arc that the sweep makes at 15 cm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub travel: Option<f64>,
    /// Edge of the cubes that hold the bodies' features, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body_size: Option<f64>,
    /// Distance of the moving body's centre from the axis, metres; 0 centres it on the axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis_distance: Option<f64>,
    /// Distance of the base's centre from the axis, on the other side, metres; left out, 0: the base surrounds the joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_distance: Option<f64>,
    /// The joint is not ideal: a slow random translation of this range in every coordinate is added, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub play: Option<f64>,
    /// The reference body rests in the recording's coordinates; it is still seen with noise.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub still_base: bool,
    /// What the observed coordinates of the moving bodies are multiplied by, about the camera centre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Compression of the moving bodies' depth changes: z(t) = z(0) + g (Z(t) - Z(0)).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth_gain: Option<f64>,
    /// Bodies of the thesis's experiments appear at the different scales that a single camera gave them.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub monocular: bool,
    /// The rail or hinge is not ideal: share of its travel by which the moving body departs sideways, as a bow over the
    /// joint's position (see [`crate::Attachment::bend`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bend: Option<f64>,
    /// Markers on skin: every feature wanders smoothly about its place on the body, with this standard deviation of
    /// every coordinate over the frames, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skin: Option<f64>,
    /// Standard deviation of the Gaussian with which noisy tracks are low-pass filtered, frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filter: Option<f64>,
    /// Bodies are seen as poses by a tracker, not as points.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub poses: bool,
    /// Standard deviation of every coordinate of the rotation by which a tracked pose is off, radians; left out, 0.01.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation_noise: Option<f64>,
    /// Share of the frames in which a tracked orientation is flipped, in bursts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flips: Option<f64>,
    /// Where the features of the moving body are; left out, in a box.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body_shape: Option<BodyShape>,
}

/// Where the features of a nominal scene's moving body are; all but the box have a random orientation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BodyShape {
    /// In a cube.
    Box,
    /// On a square plate.
    Flat,
    /// On one line.
    Line,
    /// About one line, in a rod of 0.2 % of its length in thickness.
    NearLine,
}

impl BodyShape {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Box, Self::Flat, Self::Line, Self::NearLine];

    /// Its name, as in options.
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Flat => "flat",
            Self::Line => "line",
            Self::NearLine => "near-line",
        }
    }

    /// The shape whose edges are of this length, metres.
    pub(crate) fn of_size(self, edge: f64) -> Shape {
        /// Thickness of a rod as a share of its length.
        const THICKNESS: f64 = 0.002;
        match self {
            Self::Box => Shape::Box { size: [edge; 3] },
            Self::Flat => Shape::Plate { size: [edge; 2] },
            Self::Line => Shape::Box { size: [0.0, 0.0, edge] },
            Self::NearLine => Shape::Box { size: [THICKNESS * edge, THICKNESS * edge, edge] },
        }
    }
}

impl SceneOptions {
    /// Checks every option against its range, and that none asks for what another one rules out.
    ///
    /// # Errors
    /// [`SceneError::OutOfRange`], [`SceneError::NeedsPoints`], [`SceneError::NeedsPoses`], naming the option.
    pub fn check(&self) -> Result<(), SceneError> {
        let count = |option, value: Option<usize>, range: std::ops::RangeInclusive<f64>, expected| {
            value.map_or(Ok(()), |value| within(option, value as f64, range, expected))
        };
        count("frames", self.frames, 2.0..=1e6, "2 to 1000000")?;
        count("features", self.features, 1.0..=1e4, "1 to 10000")?;
        // Both may be in range, and their product still more than memory holds.
        let most = MOST_SAMPLES / self.frames.unwrap_or(1) as f64;
        count("features", self.features, 1.0..=most, "at least 1, and at most 10 million samples per body")?;
        let metres = |option, value: Option<f64>, least: f64, expected| {
            value.map_or(Ok(()), |value| within(option, value, least..=10.0, expected))
        };
        metres("travel", self.travel, 1e-6, "0.000001 to 10 m")?;
        metres("body_size", self.body_size, 1e-6, "0.000001 to 10 m")?;
        metres("axis_distance", self.axis_distance, 0.0, "0 to 10 m")?;
        metres("base_distance", self.base_distance, 0.0, "0 to 10 m")?;
        metres("play", self.play, 0.0, "0 to 10 m")?;
        if let Some(sweep) = self.sweep_deg {
            within("sweep_deg", sweep, 1e-6..=36_000.0, "0.000001 to 36000 degrees")?;
        }
        check_scale(self.scale.unwrap_or(1.0))?;
        check_depth_gain(self.depth_gain.unwrap_or(1.0))?;
        check_bend(self.bend.unwrap_or(0.0))?;
        self.sensor(0.0).check()?;
        self.check_observation()
    }

    /// Refuses what bodies seen as poses do not have, and what only they have.
    fn check_observation(&self) -> Result<(), SceneError> {
        let of_points = [
            ("features", self.features.is_some()),
            ("depth_noise", self.depth_noise.is_some()),
            ("outlier_features", self.outlier_features.is_some()),
            ("scale", self.scale.is_some()),
            ("depth_gain", self.depth_gain.is_some()),
            ("skin", self.skin.is_some()),
            ("body_shape", self.body_shape.is_some()),
        ];
        let of_poses = [("rotation_noise", self.rotation_noise.is_some()), ("flips", self.flips.is_some())];
        let first = |options: &[(&'static str, bool)]| options.iter().find(|(_, given)| *given).map(|given| given.0);
        match (self.poses, first(&of_points), first(&of_poses)) {
            (true, Some(option), _) => Err(SceneError::NeedsPoints { option }),
            (false, _, Some(option)) => Err(SceneError::NeedsPoses { option }),
            _ => Ok(()),
        }
    }

    /// The sensor these options ask for, where `noise` is the scene's own, metres.
    pub(crate) fn sensor(&self, noise: f64) -> Sensor {
        Sensor {
            noise: self.noise.unwrap_or(noise),
            depth_noise: self.depth_noise.unwrap_or(1.0),
            drift: self.drift.unwrap_or(0.0),
            dropout: self.dropout.unwrap_or(0.0),
            outlier_features: self.outlier_features.unwrap_or(0.0),
            outlier_samples: self.outlier_samples.unwrap_or(0.0),
            skin: self.skin.unwrap_or(0.0),
            filter: self.filter.unwrap_or(0.0),
            poses: self.poses,
            rotation_noise: self.rotation_noise.unwrap_or(if self.poses { ROTATION_NOISE } else { 0.0 }),
            flips: self.flips.unwrap_or(0.0),
        }
    }

    /// Refuses options that a scene has no use for, rather than ignoring them.
    pub(crate) fn refuse(&self, scene: &str, useless: &[&'static str]) -> Result<(), SceneError> {
        let given = [
            ("sweep_deg", self.sweep_deg.is_some()),
            ("travel", self.travel.is_some()),
            ("body_size", self.body_size.is_some()),
            ("axis_distance", self.axis_distance.is_some()),
            ("base_distance", self.base_distance.is_some()),
            ("still_base", self.still_base),
            ("monocular", self.monocular),
            ("bend", self.bend.is_some()),
            ("poses", self.poses),
            ("body_shape", self.body_shape.is_some()),
        ];
        let clash = given.iter().find(|(option, given)| *given && useless.contains(option));
        clash.map_or(Ok(()), |&(option, _)| Err(SceneError::NotApplicable { option, scene: scene.into() }))
    }
}

/// Checks one number against its range; NaN lies in none.
pub(crate) fn within(
    option: &'static str,
    value: f64,
    range: impl RangeBounds<f64>,
    expected: &'static str,
) -> Result<(), SceneError> {
    if range.contains(&value) { Ok(()) } else { Err(SceneError::OutOfRange { option, expected, found: value }) }
}

pub(crate) fn check_bend(bend: f64) -> Result<(), SceneError> {
    within("bend", bend, 0.0..=0.5, "0 to 0.5")
}

pub(crate) fn check_scale(scale: f64) -> Result<(), SceneError> {
    within("scale", scale, 0.01..=100.0, "0.01 to 100")
}

pub(crate) fn check_depth_gain(gain: f64) -> Result<(), SceneError> {
    within("depth_gain", gain, 0.01..=100.0, "0.01 to 100")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{names, simulate};

    fn parsed(text: &str) -> Result<SceneOptions, serde_json::Error> {
        serde_json::from_str(text)
    }

    #[test]
    fn every_option_out_of_range_is_an_error_that_names_it() {
        let wrong = [
            ("frames", "0"),
            ("frames", "1"),
            ("frames", "1000001"),
            ("features", "0"),
            ("features", "10001"),
            ("noise", "-0.001"),
            ("noise", "1e9"),
            ("depth_noise", "-1"),
            ("drift", "1"),
            ("drift", "-0.1"),
            ("dropout", "1"),
            ("dropout", "-0.1"),
            ("outlier_features", "1.1"),
            ("outlier_samples", "-0.1"),
            ("sweep_deg", "0"),
            ("sweep_deg", "-45"),
            ("travel", "0"),
            ("travel", "11"),
            ("body_size", "0"),
            ("axis_distance", "-0.1"),
            ("base_distance", "-0.1"),
            ("play", "-1"),
            ("scale", "0"),
            ("depth_gain", "-0.6"),
            ("bend", "-0.1"),
            ("bend", "0.6"),
            ("skin", "-0.001"),
            ("skin", "11"),
            ("filter", "-1"),
            ("filter", "1001"),
            ("rotation_noise", "-0.1"),
            ("rotation_noise", "3.1"),
            ("flips", "-0.1"),
            ("flips", "1.1"),
        ];
        for (option, value) in wrong {
            let options = parsed(&format!("{{\"{option}\": {value}}}")).expect("valid JSON");
            for (scene, _) in names() {
                let error = simulate(scene, &options).expect_err(option).to_string();
                assert!(error.starts_with(&format!("option `{option}` must be")), "{scene}: {error}");
            }
        }
    }

    #[test]
    fn options_that_are_not_numbers_are_errors() {
        for options in [
            SceneOptions { noise: Some(f64::NAN), ..SceneOptions::default() },
            SceneOptions { scale: Some(f64::INFINITY), ..SceneOptions::default() },
            SceneOptions { sweep_deg: Some(f64::NAN), ..SceneOptions::default() },
            SceneOptions { bend: Some(f64::NAN), ..SceneOptions::default() },
            SceneOptions { filter: Some(f64::INFINITY), ..SceneOptions::default() },
        ] {
            assert!(matches!(options.check(), Err(SceneError::OutOfRange { .. })));
        }
    }

    #[test]
    fn unknown_options_are_refused_and_left_out_ones_have_defaults() {
        assert_eq!(parsed("{}").expect("empty"), SceneOptions::default());
        assert!(parsed("{\"nois\": 1}").is_err());
        let options = SceneOptions { seed: 3, noise: Some(0.25), still_base: true, ..SceneOptions::default() };
        let text = serde_json::to_string(&options).expect("serialises");
        assert_eq!(text, r#"{"seed":3,"noise":0.25,"still_base":true}"#);
        assert_eq!(parsed(&text).expect("its own output"), options);
    }

    #[test]
    fn options_without_use_are_refused_rather_than_ignored() {
        let error = simulate("fridge", &SceneOptions { sweep_deg: Some(30.0), ..SceneOptions::default() });
        assert_eq!(error.expect_err("no use").to_string(), "option `sweep_deg` does not apply to scene `fridge`");
        let monocular = SceneOptions { monocular: true, ..SceneOptions::default() };
        assert!(simulate("revolute", &monocular).is_err() && simulate("laptop", &monocular).is_ok());
        let [poses, flat, bend] = [r#"{"poses": true}"#, r#"{"body_shape": "flat"}"#, r#"{"bend": 0.1}"#].map(|text| {
            let options = parsed(text).expect("valid JSON");
            ["revolute", "turntable", "table2", "fridge"].map(|scene| simulate(scene, &options).is_ok())
        });
        assert_eq!(poses, [true, true, false, false]);
        assert_eq!(flat, [true, false, false, false]);
        assert_eq!(bend, [true, false, true, true]);
    }

    #[test]
    fn options_of_points_and_options_of_poses_exclude_each_other() {
        for given in [
            r#""features": 4"#,
            r#""depth_noise": 2"#,
            r#""outlier_features": 0.1"#,
            r#""scale": 2"#,
            r#""depth_gain": 0.5"#,
            r#""skin": 0.01"#,
            r#""body_shape": "box""#,
        ] {
            assert!(parsed(&format!("{{{given}}}")).expect("valid JSON").check().is_ok());
            let error = parsed(&format!(r#"{{"poses": true, {given}}}"#)).expect("valid JSON").check();
            assert!(matches!(error, Err(SceneError::NeedsPoints { option }) if given.contains(option)), "{given}");
        }
        for given in [r#""rotation_noise": 0.1"#, r#""flips": 0.1"#] {
            assert!(parsed(&format!(r#"{{"poses": true, {given}}}"#)).expect("valid JSON").check().is_ok());
            let error = parsed(&format!("{{{given}}}")).expect("valid JSON").check();
            assert!(matches!(error, Err(SceneError::NeedsPoses { option }) if given.contains(option)), "{given}");
        }
    }

    #[test]
    fn shapes_are_written_by_their_names() {
        for shape in BodyShape::ALL {
            assert_eq!(serde_json::to_value(shape).expect("serialises"), shape.name());
        }
        assert!(parsed(r#"{"body_shape": "round"}"#).is_err());
    }
}
