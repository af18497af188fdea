//! A body as it would be seen at another scale.

use std::borrow::Cow;
use std::ops::Deref;
use std::sync::OnceLock;

use nalgebra::{Matrix6, Vector6};

use super::{BodyMotion, Outlier};
use crate::line::Line;
use crate::noise::Spread;
use crate::poses::Shape;
use crate::robust::Registered;
use crate::tracked::Mended;
use crate::{Pose, Tracks, scaled_pose};

impl BodyMotion<'_> {
    /// The same body with all its positions multiplied by `factor` about the origin of the recording, which is where a
    /// single camera stands: what a registration of the multiplied positions would find, without another registration.
    ///
    /// Rotations stay; translations, shape and noise are multiplied.
    ///
    /// # Panics
    /// If `factor` is not a positive number.
    ///
    /// # References
    /// Thesis section 5.5; docs/method.md, "One camera".
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        assert!(factor > 0.0 && factor.is_finite(), "a scale is a positive number");
        let units = Vector6::new(1.0, 1.0, 1.0, factor, factor, factor);
        let units = units * units.transpose();
        let carried = |covariance: &Matrix6<f64>| covariance.component_mul(&units);
        let poses =
            |poses: &[Option<Pose>]| poses.iter().map(|pose| pose.map(|pose| scaled_pose(&pose, factor))).collect();
        Self {
            name: self.name,
            tracks: self.tracks.scaled(factor),
            poses: poses(&self.poses),
            unposed: self.unposed.clone(),
            noise: super::Noise { position: self.noise.position.map(|sigma| factor * sigma), ..self.noise },
            outlier: self.outlier.map(|outlier| Outlier {
                distance: factor * outlier.distance,
                noise: factor * outlier.noise,
                ..outlier
            }),
            registered: self.registered.as_ref().map(|registered| Registered {
                poses: poses(&registered.poses),
                shape: larger_shape(&registered.shape, factor),
                ..registered.clone()
            }),
            spread: Spread { across: factor * self.spread.across, along: factor * self.spread.along },
            drift: self.drift.clone(),
            line: self.line.as_ref().map(|line| Line {
                poses: poses(&line.poses),
                shape: larger_shape(&line.shape, factor),
                noise: line.noise.map(|sigma| factor * sigma),
                ..line.clone()
            }),
            tracked: self.tracked.as_ref().map(|mended| Mended { poses: poses(&mended.poses), ..mended.clone() }),
            pose_radius: factor * self.pose_radius,
            play: self.play,
            at_rest: self.at_rest,
            covariances: self
                .covariances
                .get()
                .map_or_else(OnceLock::new, |known| OnceLock::from(known.iter().map(carried).collect::<Vec<_>>())),
            path: OnceLock::from(self.path().scaled(factor)),
            rows: self
                .rows
                .get()
                .map_or_else(OnceLock::new, |known| OnceLock::from(known.as_ref().map(|rows| rows.scaled(factor)))),
            maps: OnceLock::new(),
            posed: self.posed.clone(),
            always_seen: self.always_seen.clone(),
            start_covariance: self.start_covariance.as_ref().map(carried),
        }
    }
}

/// A body's tracks multiplied by a factor, which is done as soon as someone looks: poses are at hand without.
#[derive(Debug, Clone)]
pub(super) struct TracksAtScale<'r> {
    as_seen: Cow<'r, Tracks>,
    factor: f64,
    scaled: OnceLock<Tracks>,
}

impl<'r> From<Cow<'r, Tracks>> for TracksAtScale<'r> {
    fn from(as_seen: Cow<'r, Tracks>) -> Self {
        Self { as_seen, factor: 1.0, scaled: OnceLock::new() }
    }
}

impl TracksAtScale<'_> {
    fn scaled(&self, factor: f64) -> Self {
        Self { as_seen: self.as_seen.clone(), factor: factor * self.factor, scaled: OnceLock::new() }
    }
}

impl Deref for TracksAtScale<'_> {
    type Target = Tracks;

    fn deref(&self) -> &Tracks {
        if self.factor == 1.0 {
            return &self.as_seen;
        }
        self.scaled.get_or_init(|| self.as_seen.scaled(self.factor))
    }
}

fn larger_shape(shape: &Shape, factor: f64) -> Shape {
    shape.iter().map(|place| place.map(|place| place * factor)).collect()
}
