//! A body as it would be seen at another scale.

use std::borrow::Cow;
use std::ops::Deref;
use std::sync::{Arc, OnceLock};

use nalgebra::{Matrix6, Vector6};

use super::{BodyMotion, Outlier};
use crate::columns::RowsAsSeen;
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
        let known = |rows: &Option<RowsAsSeen>| rows.as_ref().map(|rows| rows.scaled(factor));
        Self {
            name: self.name,
            tracks: self.tracks.times(factor),
            poses: self.poses.times(factor),
            unposed: self.unposed.clone(),
            noise: super::Noise { position: self.noise.position.map(|sigma| factor * sigma), ..self.noise },
            outlier: self.outlier.map(|outlier| Outlier {
                distance: factor * outlier.distance,
                noise: factor * outlier.noise,
                ..outlier
            }),
            registered: self.registered.as_ref().map(|registered| registered.times(factor)),
            spread: Spread { across: factor * self.spread.across, along: factor * self.spread.along },
            drift: self.drift.clone(),
            line: self.line.as_ref().map(|line| line.times(factor)),
            tracked: self.tracked.as_ref().map(|mended| mended.times(factor)),
            pose_radius: factor * self.pose_radius,
            play: self.play,
            at_rest: self.at_rest,
            covariances: of_known(&self.covariances, |known| known.times(factor)),
            path: OnceLock::from(self.path().scaled(factor)),
            rows: of_known(&self.rows, known),
            maps: OnceLock::new(),
            posed: self.posed.clone(),
            always_seen: self.always_seen.clone(),
            start_covariance: self
                .start_covariance
                .as_ref()
                .map(|covariance| covariance.component_mul(&of_twists(factor))),
        }
    }
}

fn of_known<T>(known: &OnceLock<T>, of: impl FnOnce(&T) -> T) -> OnceLock<T> {
    known.get().map_or_else(OnceLock::new, |known| OnceLock::from(of(known)))
}

/// What grows with the scale at which a body is seen.
pub(super) trait Grows: Clone {
    /// The same where all positions are multiplied by a factor.
    #[must_use]
    fn larger(&self, factor: f64) -> Self;
}

/// Something at a scale, multiplied as soon as someone looks: of most scales that are tried, few things are looked at.
#[derive(Debug, Clone)]
pub(super) struct AtScale<'r, T: Clone> {
    as_seen: Arc<Cow<'r, T>>,
    factor: f64,
    larger: OnceLock<T>,
}

impl<T: Grows> AtScale<'_, T> {
    /// The same at a scale that is `factor` times this one.
    pub(super) fn times(&self, factor: f64) -> Self {
        Self { as_seen: self.as_seen.clone(), factor: factor * self.factor, larger: OnceLock::new() }
    }

    /// As the recording has it: what a scale does not change may be asked of this.
    pub(super) fn as_seen(&self) -> &T {
        &self.as_seen
    }

    /// To be changed before any scale is looked at.
    pub(super) fn as_seen_mut(&mut self) -> &mut T {
        Arc::make_mut(&mut self.as_seen).to_mut()
    }

    /// By which all lengths in it as it was seen are to be multiplied.
    pub(super) fn factor(&self) -> f64 {
        self.factor
    }
}

impl<T: Grows> Deref for AtScale<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        if self.factor == 1.0 {
            return self.as_seen();
        }
        self.larger.get_or_init(|| self.as_seen().larger(self.factor))
    }
}

impl<T: Clone> From<T> for AtScale<'_, T> {
    fn from(seen: T) -> Self {
        Self { as_seen: Arc::new(Cow::Owned(seen)), factor: 1.0, larger: OnceLock::new() }
    }
}

impl<'r, T: Clone> From<&'r T> for AtScale<'r, T> {
    fn from(seen: &'r T) -> Self {
        Self { as_seen: Arc::new(Cow::Borrowed(seen)), factor: 1.0, larger: OnceLock::new() }
    }
}

impl Grows for Tracks {
    fn larger(&self, factor: f64) -> Self {
        self.scaled(factor)
    }
}

impl Grows for Vec<Option<Pose>> {
    fn larger(&self, factor: f64) -> Self {
        self.iter().map(|pose| pose.map(|pose| scaled_pose(&pose, factor))).collect()
    }
}

impl Grows for Vec<Matrix6<f64>> {
    fn larger(&self, factor: f64) -> Self {
        let larger = of_twists(factor);
        self.iter().map(|covariance| covariance.component_mul(&larger)).collect()
    }
}

impl Grows for Shape {
    fn larger(&self, factor: f64) -> Self {
        self.iter().map(|place| place.map(|place| place * factor)).collect()
    }
}

impl Grows for Registered {
    fn larger(&self, factor: f64) -> Self {
        Self { poses: self.poses.larger(factor), shape: self.shape.larger(factor), ..self.clone() }
    }
}

impl Grows for Line {
    fn larger(&self, factor: f64) -> Self {
        Self {
            poses: self.poses.larger(factor),
            shape: self.shape.larger(factor),
            noise: self.noise.map(|sigma| factor * sigma),
            ..self.clone()
        }
    }
}

impl Grows for Mended {
    fn larger(&self, factor: f64) -> Self {
        Self { poses: self.poses.larger(factor), ..self.clone() }
    }
}

/// By which covariances of twists are multiplied, element by element, where positions are by a factor.
fn of_twists(factor: f64) -> Matrix6<f64> {
    let units = Vector6::new(1.0, 1.0, 1.0, factor, factor, factor);
    units * units.transpose()
}
