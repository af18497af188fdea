//! The motion of one body: its pose in every frame, its shape, its noise.

use std::borrow::Cow;

use nalgebra::{Point3, SymmetricEigen};

use crate::poses::{Shape, chained, chained_from_the_best, first, settle, spread};
use crate::{Body, MotionSettings, NoiseSetting, Observation, Pose, Registration, Tracks, noise, noise::Residuals};

/// Rounds of alternating between poses and shape; each shrinks the error by about the noise over the size.
const SHAPE_ROUNDS: usize = 50;
/// Rounds that bring the shape behind `chained` and `first` poses close enough to measure noise.
const NOISE_ROUNDS: usize = 3;
/// Uncertainty of the turn about the features' line above which that turn counts as unobserved, radians.
const VAGUE_TURN: f64 = 0.3;
/// Distance, in standard deviations of a coordinate, that noise does not explain: of a million Gaussian samples not one
/// is beyond 6.
const WILD: f64 = 10.0;
/// Distance, as a share of the body's size, that rounding explains.
const ROUNDING: f64 = 1e-9;

/// The motion of one body over the frames of a recording.
///
/// # Convention
/// Poses are `recording_from_body`; the body's coordinates coincide with the recording's at its first posed frame, so
/// that pose is the identity (also for bodies given as poses). A frame in which the body cannot be posed is `None`.
#[derive(Debug, Clone)]
pub struct BodyMotion<'r> {
    name: &'r str,
    tracks: Cow<'r, Tracks>,
    poses: Vec<Option<Pose>>,
    unposed: Option<String>,
    noise: Noise,
    outlier: Option<Outlier>,
}

/// Estimated or given noise of a body's observations.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Noise {
    /// Standard deviation of one coordinate of a position, metres; `None` where the data do not tell.
    pub position: Option<f64>,
    /// Standard deviation of one coordinate of a rotation vector, radians; only for bodies given as poses.
    pub rotation: Option<f64>,
}

/// A sample that noise does not explain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlier {
    /// Its frame.
    pub frame: usize,
    /// Its feature.
    pub feature: usize,
    /// How far it is from where the rest of the body puts it, metres.
    pub distance: f64,
    /// Noise of a coordinate in a typical frame, metres.
    pub noise: f64,
}

impl Outlier {
    fn among(residuals: &Residuals, shape: &Shape) -> Option<Self> {
        let ((frame, feature, distance), noise) = residuals.worst.zip(residuals.typical)?;
        let wild = distance > (WILD * noise).max(ROUNDING * spread(shape).trace().sqrt());
        wild.then_some(Self { frame, feature, distance, noise })
    }
}

impl<'r> BodyMotion<'r> {
    /// Recovers the motion of a body.
    ///
    /// A body whose orientation is not observed (one or two features, collinear ones, features that lie on a line up
    /// to their noise) has no poses, and [`BodyMotion::unposed`] says why; its positions still serve as a moving body.
    pub fn of(body: &'r Body, settings: &MotionSettings) -> Self {
        match body.observation() {
            Observation::Points { tracks, .. } => Self::of_points(body.name(), tracks, settings),
            Observation::Poses(poses) => Self::of_poses(body.name(), poses, settings),
            Observation::AtRest(frames) => Self {
                noise: Noise { position: Some(0.0), rotation: Some(0.0) },
                ..Self::of_poses(body.name(), &vec![Some(Pose::identity()); *frames], settings)
            },
        }
    }

    fn of_points(name: &'r str, tracks: &'r Tracks, settings: &MotionSettings) -> Self {
        let registered = match settings.registration {
            Registration::Chained => chained(tracks),
            Registration::First => first(tracks),
            Registration::Shape => chained_from_the_best(tracks).map(|poses| settle(tracks, poses, SHAPE_ROUNDS).0),
        };
        let mut outlier = None;
        let (mut poses, mut unposed, mut position) = match registered {
            Ok(poses) => {
                let (settled, shape) = settle(tracks, poses.clone(), NOISE_ROUNDS);
                let residuals = Residuals::of(tracks, &settled, &shape);
                outlier = Outlier::among(&residuals, &shape);
                (poses, vague_turn(&shape, residuals.typical), residuals.sigma)
            }
            Err(reason) => (vec![None; tracks.frames()], Some(reason.to_string()), None),
        };
        if unposed.is_some() {
            poses.fill(None);
            position = position.or_else(|| noise::of_single_points(tracks));
        }
        if let NoiseSetting::Known(sigma) = settings.noise {
            position = Some(sigma);
        }
        if let Some(reason) = &mut unposed {
            reason.insert_str(0, "its orientation is not observed: ");
        }
        Self { name, tracks: Cow::Borrowed(tracks), poses, unposed, noise: Noise { position, rotation: None }, outlier }
    }

    fn of_poses(name: &'r str, tracked: &[Option<Pose>], settings: &MotionSettings) -> Self {
        let start = tracked.iter().flatten().next().copied().unwrap_or_default();
        let position = match settings.noise {
            NoiseSetting::Known(sigma) => Some(sigma),
            NoiseSetting::Estimate => noise::of_positions(tracked),
        };
        Self {
            name,
            tracks: Cow::Owned(virtual_features(tracked, settings.pose_radius)),
            poses: tracked.iter().map(|pose| Some(pose.as_ref()? * start.inverse())).collect(),
            unposed: None,
            noise: Noise { position, rotation: noise::of_rotations(tracked) },
            outlier: None,
        }
    }

    /// The body's name.
    pub fn name(&self) -> &str {
        self.name
    }

    /// Its features in the recording's coordinates, metres; four virtual ones for a body given as poses.
    pub fn tracks(&self) -> &Tracks {
        &self.tracks
    }

    /// `recording_from_body` for every frame.
    pub fn poses(&self) -> &[Option<Pose>] {
        &self.poses
    }

    /// Why the body has no poses at all, if so.
    pub fn unposed(&self) -> Option<&str> {
        self.unposed.as_deref()
    }

    /// Noise of its observations.
    pub fn noise(&self) -> Noise {
        self.noise
    }

    /// The wildest sample, if it is so far from the rest of the body that noise cannot explain it.
    ///
    /// Least squares bends the frame's pose towards such a sample, and verdicts and axes with it.
    pub fn outlier(&self) -> Option<Outlier> {
        self.outlier
    }

    /// The first frame in which the body has a pose: there its coordinates are the recording's.
    pub fn first_posed_frame(&self) -> Option<usize> {
        self.poses.iter().position(Option::is_some)
    }

    /// The first frame in which any feature of the body is seen.
    pub fn first_seen_frame(&self) -> Option<usize> {
        (0..self.tracks.frames()).find(|&frame| self.tracks.seen_count(frame) > 0)
    }
}

/// Four virtual features, the corners of a regular tetrahedron at `radius` metres from the tracked origin.
fn virtual_features(tracked: &[Option<Pose>], radius: f64) -> Tracks {
    let r = radius / 3_f64.sqrt();
    let corners = [[r, r, r], [r, -r, -r], [-r, r, -r], [-r, -r, r]].map(Point3::from);
    let missing = [Point3::from([f64::NAN; 3]); 4];
    let positions = tracked.iter().flat_map(|pose| pose.map_or(missing, |pose| corners.map(|corner| pose * corner)));
    Tracks::new(4, positions.collect()).expect("four positions per frame")
}

/// Says so if noise of `sigma` metres leaves the turn about the features' line unknown.
fn vague_turn(shape: &Shape, sigma: Option<f64>) -> Option<String> {
    let mut values: Vec<f64> = SymmetricEigen::new(spread(shape)).eigenvalues.iter().copied().collect();
    values.sort_by(f64::total_cmp);
    let off_line = (values[0].max(0.0) + values[1].max(0.0)).sqrt();
    let turn = sigma? / off_line;
    (turn > VAGUE_TURN).then(|| {
        format!(
            "the features are collinear up to their noise: the turn about their line is uncertain by {:.0} degrees",
            turn.to_degrees()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, Vector3};

    fn settings(registration: Registration) -> MotionSettings {
        MotionSettings { registration, ..MotionSettings::default() }
    }

    fn truth(frame: usize) -> Pose {
        let s = frame as f64 * 0.11;
        Pose::new(Vector3::new(s.sin(), 0.3 * s, 1.0), Vector3::new(0.4 * s, -0.2 * s, s.cos()))
    }

    fn body(features: &[Point3<f64>], frames: usize, seen: impl Fn(usize, usize) -> bool) -> Body {
        let mut positions = Vec::new();
        for frame in 0..frames {
            for (feature, p) in features.iter().enumerate() {
                let missing = Point3::from([f64::NAN; 3]);
                positions.push(if seen(frame, feature) { truth(frame) * p } else { missing });
            }
        }
        let labels = (0..features.len()).map(|f| f.to_string()).collect();
        Body::from_points("thing", labels, Tracks::new(features.len(), positions).expect("full")).expect("seen")
    }

    fn box_corners() -> Vec<Point3<f64>> {
        (0..8)
            .map(|i| Point3::new(f64::from(i & 1), f64::from(i >> 1 & 1) * 0.5, f64::from(i >> 2) * 0.3) * 0.2)
            .collect()
    }

    fn largest_error(motion: &BodyMotion<'_>) -> f64 {
        let start = motion.first_posed_frame().expect("posed");
        let errors = motion.poses().iter().enumerate().filter_map(|(frame, pose)| {
            let expected = truth(frame) * truth(start).inverse();
            let off = pose.as_ref()?.inverse() * expected;
            Some(off.rotation.angle().max(off.translation.vector.norm()))
        });
        errors.fold(0.0, f64::max)
    }

    #[test]
    fn all_registrations_recover_exact_motion_with_missing_samples() {
        // Every frame misses other features, the first and one in the middle miss nearly all of them.
        let seen = |frame: usize, feature: usize| match frame {
            0 | 9 => feature < 2,
            1 => feature != 3,
            _ => !(frame + 3 * feature).is_multiple_of(4),
        };
        let body = body(&box_corners(), 20, seen);
        for registration in [Registration::Chained, Registration::First, Registration::Shape] {
            let motion = BodyMotion::of(&body, &settings(registration));
            assert_eq!(motion.first_posed_frame(), Some(1), "{registration:?}");
            assert!(motion.poses()[9].is_none());
            assert_eq!(motion.poses().iter().flatten().count(), 18, "{registration:?}");
            assert!(motion.poses()[1].is_some_and(|pose| (pose.inverse() * Pose::identity()).rotation.angle() < 1e-9));
            let error = largest_error(&motion);
            assert!(error < 1e-9, "{registration:?} is off by {error:e}");
            assert!(motion.noise().position.expect("estimated") < 1e-9);
        }
    }

    #[test]
    fn a_poor_first_frame_does_not_cut_off_the_rest() {
        // Frame 0 shows three features that never appear again with others; the best frame is in the middle.
        let seen = |frame: usize, feature: usize| match frame {
            0 => feature < 3,
            5 => feature > 0,
            _ => feature > 2 && !(frame + feature).is_multiple_of(5),
        };
        let body = body(&box_corners(), 12, seen);
        let motion = BodyMotion::of(&body, &MotionSettings::default());
        assert_eq!(motion.poses()[1..].iter().flatten().count(), 11);
        let start = motion.first_posed_frame().expect("posed");
        assert!(
            largest_error(&motion) < 1e-9 && motion.poses()[start].is_some_and(|pose| pose.rotation.angle() < 1e-9)
        );
    }

    #[test]
    fn collinear_single_and_double_features_have_no_poses_and_say_why() {
        let line: Vec<_> = (0..4).map(|i| Point3::new(f64::from(i) * 0.1, 0.0, 0.0)).collect();
        for (features, word) in [(&line[..], "collinear"), (&line[..2], "found 2"), (&line[..1], "found 1")] {
            let body = body(features, 12, |_, _| true);
            let motion = BodyMotion::of(&body, &MotionSettings::default());
            assert!(motion.poses().iter().all(Option::is_none));
            let reason = motion.unposed().expect("a reason");
            assert!(reason.contains("orientation is not observed") && reason.contains(word), "{reason}");
        }
    }

    #[test]
    fn bodies_given_as_poses_start_at_the_identity_and_show_four_features() {
        let tracked: Vec<_> = (0..10).map(|frame| (frame != 0 && frame != 4).then(|| truth(frame))).collect();
        let body = Body::from_poses("tag", tracked).expect("seen");
        let motion = BodyMotion::of(&body, &MotionSettings::default());
        assert_eq!(motion.first_posed_frame(), Some(1));
        assert!(largest_error(&motion) < 1e-12);
        assert_eq!(motion.tracks().seen_count(1), 4);
        assert_eq!(motion.tracks().seen_count(4), 0);
        let origin = Point3::from(truth(3).translation.vector);
        assert!((nalgebra::distance(&origin, &motion.tracks().frame(3)[2]) - 0.1).abs() < 1e-12);
    }

    #[test]
    fn a_wild_sample_is_found_and_does_not_make_a_body_collinear() {
        let seen = body(&box_corners(), 30, |_, _| true);
        let Observation::Points { labels, tracks } = seen.observation() else { panic!("points") };
        assert_eq!(BodyMotion::of(&seen, &MotionSettings::default()).outlier(), None);
        let mut positions: Vec<_> = (0..30).flat_map(|frame| tracks.frame(frame).to_vec()).collect();
        positions[8 * 17 + 5].z += 5.0;
        let tracks = Tracks::new(8, positions).expect("full");
        let wild = Body::from_points("wild", labels.clone(), tracks).expect("seen");
        let motion = BodyMotion::of(&wild, &MotionSettings::default());
        let outlier = motion.outlier().expect("found");
        assert_eq!((outlier.frame, outlier.feature, motion.unposed()), (17, 5, None));
        assert!(outlier.distance > 1.0, "{outlier:?}");
    }

    #[test]
    fn the_world_rests() {
        let world = Body::at_rest("world", 5);
        let motion = BodyMotion::of(&world, &MotionSettings::default());
        assert!(motion.poses().iter().all(
            |pose| *pose == Some(Pose::from_parts(Translation3::identity(), nalgebra::UnitQuaternion::identity()))
        ));
        assert_eq!(motion.noise(), Noise { position: Some(0.0), rotation: Some(0.0) });
    }
}
