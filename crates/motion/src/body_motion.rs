//! The motion of one body: its pose in every frame, its shape, its noise.

mod certainty;
mod rest;
mod scaled;

use std::sync::{Arc, OnceLock};

use nalgebra::{Matrix6, Point3, SymmetricEigen, Vector3};

use scaled::AtScale;

use crate::columns::{Maps, RowsAsSeen, rows_as_seen};
use crate::line::{Line, is_line};
use crate::noise::{Deformation, Noisy, Spread, Trust, believed_drift, lag_one};
use crate::poses::{Shape, chained, chained_from_the_best, rebase_to, settle, spread};
use crate::relative_motion::Path;
use crate::robust::{Registered, register_robustly};
use crate::settled::{self, Settled, settled};
use crate::start::first_pose;
use crate::tracks::SeenAtScale;
use crate::{
    Body, FrameByFrame, MotionSettings, NoiseSetting, Observation, Play, Pose, Registration, RegistrationError, Tracks,
    depth, noise,
    tracked::{Mended, without_jumps},
};

/// Rounds of alternating between poses and shape; each shrinks the error by about the noise over the size.
const SHAPE_ROUNDS: usize = 50;
/// Uncertainty of the turn about the features' line above which that turn counts as unobserved, radians.
const VAGUE_TURN: f64 = 0.3;
/// Distance, in standard deviations of a coordinate, that noise does not explain: of a million Gaussian samples not one
/// is beyond 6.
const WILD: f64 = 10.0;
/// Distance, as a share of the body's size, that rounding explains. It has no direction, and drifts in no way.
const ROUNDING: f64 = 1e-9;

/// The motion of one body over the frames of a recording.
///
/// # Convention
/// Poses are `recording_from_body`; the body's coordinates coincide with the recording's at its first posed frame, so
/// that pose is the identity (also for bodies given as poses). Robust registration tells by the frames that follow where
/// the body was then; that pose is the identity up to the noise of one frame. A frame in which the body cannot be posed
/// is `None`.
#[derive(Debug, Clone)]
pub struct BodyMotion<'r> {
    name: &'r str,
    tracks: AtScale<'r, Tracks>,
    poses: AtScale<'r, Vec<Option<Pose>>>,
    unposed: Option<String>,
    noise: Noise,
    outlier: Option<Outlier>,
    registered: Option<AtScale<'r, Registered>>,
    spread: Spread,
    /// Found when somebody asks, where poses do not depend on it.
    drift: OnceLock<f64>,
    line: Option<AtScale<'r, Line>>,
    /// Of a body given as poses: without jumps.
    tracked: Option<AtScale<'r, Mended>>,
    pose_radius: f64,
    play: Play,
    at_rest: bool,
    covariances: OnceLock<AtScale<'static, Vec<Matrix6<f64>>>>,
    path: OnceLock<Path>,
    rows: OnceLock<Option<RowsAsSeen>>,
    maps: OnceLock<Maps>,
    posed: OnceLock<Arc<[usize]>>,
    always_seen: OnceLock<bool>,
    start_covariance: Option<Matrix6<f64>>,
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
    fn found(settled: &Settled, tracks: &Tracks) -> Option<Self> {
        let noise = settled.noisy.typical?;
        let least = (WILD * noise).max(rounding(&settled.shape));
        let (frame, feature, distance) = settled.worst_beyond(tracks, least)?;
        Some(Self { frame, feature, distance, noise })
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
                at_rest: true,
                ..Self::of_poses(body.name(), &vec![Some(Pose::identity()); *frames], settings)
            },
        }
    }

    /// As [`BodyMotion::of`], without registering again what `poses` has registered frame by frame in the same way.
    ///
    /// A registration to the body's shape needs all frames, and one to the first frame comes with the noise in one visit:
    /// these are repeated.
    pub fn of_registered(body: &'r Body, poses: &FrameByFrame, settings: &MotionSettings) -> Self {
        let Observation::Points { tracks, .. } = body.observation() else { return Self::of(body, settings) };
        let known = settings.registration == Registration::Chained
            && settings.registration == poses.registration()
            && poses.poses().len() == tracks.frames()
            && poses.poses().iter().any(Option::is_some);
        if !known {
            return Self::of(body, settings);
        }
        let registered = Registered::plain(tracks, poses.poses().to_vec());
        Self::of_points_registered(body.name(), tracks, Ok((registered, None)), settings)
    }

    fn of_points(name: &'r str, tracks: &'r Tracks, settings: &MotionSettings) -> Self {
        let alone = |poses| (Registered::plain(tracks, poses), None);
        let registered = match settings.registration {
            Registration::Shape if settings.robust => register_robustly(tracks).map(|registered| (registered, None)),
            Registration::Shape => {
                chained_from_the_best(tracks).map(|poses| alone(settle(tracks, poses, SHAPE_ROUNDS).0))
            }
            Registration::Chained => chained(tracks).map(alone),
            Registration::First => {
                settled::first(tracks).map(|(poses, settled)| (Registered::to_the_first(tracks, poses), Some(settled)))
            }
        };
        Self::of_points_registered(name, tracks, registered, settings)
    }

    fn of_points_registered(
        name: &'r str,
        tracks: &'r Tracks,
        registered: Result<(Registered, Option<Settled>), RegistrationError>,
        settings: &MotionSettings,
    ) -> Self {
        let mut motion = Self::unseen(name, tracks.into(), settings);
        match registered {
            Ok((registered, _)) if settings.robust && settings.registration == Registration::Shape => {
                motion.take_robust(registered, tracks, settings);
            }
            Ok((registered, settled)) => motion.take(registered, settled, tracks, settings),
            Err(reason) => motion.unposed = Some(reason.to_string()),
        }
        if motion.unposed.is_some() {
            let found = std::mem::replace(motion.poses.as_seen_mut(), vec![None; tracks.frames()]);
            if let Some(registered) = &mut motion.registered {
                registered.as_seen_mut().poses = found;
            }
            motion.line = Line::of(tracks, |_, _| true).map(AtScale::from);
            let of_line = motion.line.as_ref().and_then(|line| line.noise);
            motion.noise.position = motion.noise.position.or(of_line).or_else(|| noise::of_single_points(tracks));
        } else if let Some(registered) = &motion.registered
            && is_line(&registered.shape, motion.spread.mean())
        {
            motion.line = Line::of(tracks, |frame, feature| registered.uses(frame, feature)).map(AtScale::from);
        }
        if let NoiseSetting::Known(sigma) = settings.noise {
            motion.noise.position = Some(sigma);
        }
        if let Some(line) = &motion.line {
            let sigma = motion.noise.position.or(line.noise).unwrap_or(0.0);
            motion.spread = Spread { across: sigma, along: sigma };
        } else if settings.robust && settings.registration == Registration::Shape {
            motion.settle_start();
        }
        if let Some(reason) = &mut motion.unposed {
            reason.insert_str(0, "its orientation is not observed: ");
        }
        motion
    }

    fn unseen(name: &'r str, tracks: AtScale<'r, Tracks>, settings: &MotionSettings) -> Self {
        Self {
            name,
            poses: vec![None; tracks.frames()].into(),
            tracks,
            unposed: None,
            noise: Noise::default(),
            outlier: None,
            registered: None,
            spread: Spread { across: 0.0, along: 0.0 },
            drift: OnceLock::new(),
            line: None,
            tracked: None,
            pose_radius: settings.pose_radius,
            play: settings.play,
            at_rest: false,
            covariances: OnceLock::new(),
            path: OnceLock::new(),
            rows: OnceLock::new(),
            maps: OnceLock::new(),
            posed: OnceLock::new(),
            always_seen: OnceLock::new(),
            start_covariance: None,
        }
    }

    /// Takes over poses of a registration, and noise and shape, which thesis registrations do not fit: these are settled
    /// on the side.
    fn take(
        &mut self,
        mut registered: Registered,
        settled_beside: Option<Settled>,
        tracks: &Tracks,
        settings: &MotionSettings,
    ) {
        let settled = settled_beside.unwrap_or_else(|| settled(tracks, &registered.poses));
        if let Some(way) = settled.way {
            self.path = OnceLock::from(Path::of_all(tracks, way, tracks.frames() - 1));
        }
        let sigma = match settings.noise {
            NoiseSetting::Known(sigma) => Some(sigma),
            NoiseSetting::Estimate => settled.noisy.sigma,
        };
        self.spread = Spread { across: sigma.unwrap_or(0.0), along: sigma.unwrap_or(0.0) };
        self.noise.position = settled.noisy.sigma;
        self.outlier = Outlier::found(&settled, tracks);
        self.unposed = vague_turn(&settled.shape, settled.noisy.typical);
        registered.shape = settled.shape;
        self.poses = std::mem::take(&mut registered.poses).into();
        self.registered = Some(registered.into());
    }

    /// Takes over poses, noise and shape of a registration to the body's shape that left out what is wild.
    fn take_robust(&mut self, mut registered: Registered, tracks: &Tracks, settings: &MotionSettings) {
        let counts = |t, f| registered.uses(t, f);
        let found = Noisy::of_residuals(tracks, &registered.poses, &registered.shape, counts);
        let estimate = settings.noise == NoiseSetting::Estimate;
        let sigma = match settings.noise {
            NoiseSetting::Known(sigma) => Some(sigma),
            NoiseSetting::Estimate => found.sigma,
        };
        let noisy = found.sigma.is_some_and(|sigma| sigma > rounding(&registered.shape));
        let equal = Spread { across: sigma.unwrap_or(0.0), along: sigma.unwrap_or(0.0) };
        self.spread = match sigma {
            Some(sigma) if estimate && noisy => depth::refine(tracks, &mut registered, sigma),
            _ => equal,
        };
        self.noise.position = if self.spread == equal { found.sigma } else { Some(self.spread.mean()) };
        let uses = |t, f| registered.uses(t, f);
        let drift = if noisy { lag_one(tracks, &registered.poses, &registered.shape, uses) } else { 0.0 };
        self.drift = OnceLock::from(drift);
        if estimate && believed_drift(drift, tracks.frames()) > 0.0 {
            let factor = noise::hidden_by_drift(drift, tracks, registered.used.as_deref().unwrap_or_default());
            self.spread = Spread { across: factor * self.spread.across, along: factor * self.spread.along };
            self.noise.position = self.noise.position.map(|sigma| factor * sigma);
        }
        self.unposed = vague_turn(&registered.shape, found.typical);
        self.poses = std::mem::take(&mut registered.poses).into();
        self.registered = Some(registered.into());
    }

    /// Lets the body's coordinates be the recording's where the body was at its first frame, as far as all frames tell,
    /// not where that one frame's noise puts it.
    fn settle_start(&mut self) {
        /// Noise, as a share of the body's size, that matters to nobody.
        const QUIET: f64 = 1e-5;
        if self.spread.mean() < QUIET * self.size() {
            return;
        }
        let (centre, drift) = (self.centre(), believed_drift(self.drift(), self.poses.len()));
        let covariances = self.pose_covariances().to_vec();
        let Some(first) = first_pose(&self.poses, &covariances, &centre, (1.0 + drift) / (1.0 - drift)) else { return };
        if let Some(registered) = &mut self.registered {
            rebase_to(&first.pose, self.poses.as_seen_mut(), &mut registered.as_seen_mut().shape);
            self.start_covariance = Some(first.covariance);
        }
    }

    fn of_poses(name: &'r str, tracked: &[Option<Pose>], settings: &MotionSettings) -> Self {
        let start = tracked.iter().flatten().next().copied().unwrap_or_default();
        let from_start = |poses: &[Option<Pose>]| -> Vec<Option<Pose>> {
            poses.iter().map(|pose| Some(pose.as_ref()? * start.inverse())).collect()
        };
        let quiet = [noise::of_positions(tracked, Trust::Quiet), noise::of_rotations(tracked, Trust::Quiet)];
        let [position, rotation] = quiet.map(Option::unwrap_or_default);
        let mended = without_jumps(tracked, position, rotation);
        // Noise is that of what is left; where jumps leave gaps everywhere, that of all.
        let estimate = |of: fn(&[Option<Pose>], Trust) -> Option<f64>| {
            of(&mended.poses, Trust::Most).or_else(|| of(tracked, Trust::Most))
        };
        let position = match settings.noise {
            NoiseSetting::Known(sigma) => Some(sigma),
            NoiseSetting::Estimate => estimate(noise::of_positions),
        };
        let rotation = estimate(noise::of_rotations);
        let tracks = virtual_features(tracked, settings.pose_radius);
        Self {
            poses: from_start(tracked).into(),
            noise: Noise { position, rotation },
            tracked: Some(Mended { poses: from_start(&mended.poses), ..mended }.into()),
            ..Self::unseen(name, tracks.into(), settings)
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

    /// Number of its features.
    pub fn features(&self) -> usize {
        self.seen().tracks.features()
    }

    /// Its features as the recording has them: what is seen, and how many there are, is the same at any scale.
    pub(crate) fn seen(&self) -> SeenAtScale<'_> {
        SeenAtScale { tracks: self.tracks.as_seen(), factor: self.tracks.factor() }
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

    /// Correlation of the samples' errors with those of the frame before, from -1 to 1; 0 where nothing tells.
    pub fn drift(&self) -> f64 {
        let noisy = |shape: &Shape| self.noise.position.is_some_and(|sigma| sigma > rounding(shape));
        let found = |registered: &AtScale<'_, Registered>| {
            if noisy(&registered.shape) { settled::drift(&self.tracks, &registered.shape) } else { 0.0 }
        };
        *self.drift.get_or_init(|| self.registered.as_ref().map_or(0.0, found))
    }

    /// How far its features slowly depart from a rigid body's; `None` where poses are given or nothing tells.
    pub fn deformation(&self) -> Option<Deformation> {
        let registered = self.registered.as_ref()?;
        let counts = |feature: usize| !registered.strays.contains(&feature);
        Deformation::of(&self.tracks, self.found_poses(registered), &registered.shape, counts)
    }

    /// The poses of a registration, also where they are not believed.
    fn found_poses<'s>(&'s self, registered: &'s Registered) -> &'s [Option<Pose>] {
        if self.unposed.is_some() { &registered.poses } else { &self.poses }
    }

    /// Features that disagree with the rest of the body and were left out of its registration.
    pub fn strays(&self) -> &[usize] {
        self.registered.as_ref().map_or(&[], |registered| &registered.as_seen().strays)
    }

    /// Number of single wild samples that were left out of the registration.
    pub fn wild_samples(&self) -> usize {
        self.registered.as_ref().map_or(0, |registered| registered.as_seen().wild)
    }

    /// Number of frames whose tracked rotation, or whose whole pose, left its surroundings in time and was not used.
    pub fn jumps(&self) -> usize {
        self.tracked.as_ref().map_or(0, |mended| {
            let dropped = self.poses.iter().zip(&mended.poses).filter(|(pose, kept)| pose.is_some() && kept.is_none());
            dropped.count() + mended.replaced.iter().filter(|replaced| **replaced).count()
        })
    }

    /// Share of the frames in which the tracked body's turning changes abruptly, even where wrong rotations were
    /// replaced, if it is so large that nobody knows which are wrong.
    pub fn restless(&self) -> Option<f64> {
        self.tracked.as_ref()?.as_seen().restless
    }

    /// Whether successive errors of the body's tracked poses are alike, which hides how large they are.
    pub fn is_smooth(&self) -> bool {
        self.tracked.as_ref().is_some_and(|mended| mended.as_seen().smooth)
    }

    /// Direction of the line on which all features of the body lie, in the body's coordinates, if they do: the turn
    /// about it is not seen.
    pub fn line(&self) -> Option<Vector3<f64>> {
        self.line.as_ref().map(|line| line.as_seen().direction)
    }

    /// Noise along the viewing ray over noise across it, where the data show a difference; else 1.
    pub fn depth_noise(&self) -> f64 {
        if self.spread.across > 0.0 { self.spread.along / self.spread.across } else { 1.0 }
    }

    /// `recording_from_body` for every frame as likelihoods use it: for a body given as poses without their jumps, for
    /// one on a line with the least turn about it. Empty of poses for one feature.
    ///
    /// How well each is known says [`BodyMotion::pose_covariances`].
    pub fn likely_poses(&self) -> &[Option<Pose>] {
        match (&self.line, &self.tracked) {
            (Some(line), _) => &line.poses,
            (None, Some(mended)) => &mended.poses,
            (None, None) => &self.poses,
        }
    }

    /// Mean of the features in the body's coordinates, or where a tracker's pose starts, metres.
    pub fn centre(&self) -> Point3<f64> {
        if self.tracked.is_some() {
            let corners: Vec<_> = self.first_seen_frame().map_or(&[][..], |t| self.tracks.frame(t)).to_vec();
            return Point3::from(corners.iter().map(|p| p.coords).sum::<Vector3<f64>>() / corners.len().max(1) as f64);
        }
        let points = || self.shape().filter_map(|place| *place);
        let count = points().count().max(1) as f64;
        Point3::from(points().map(|p| p.coords).sum::<Vector3<f64>>() / count)
    }

    fn shape(&self) -> impl Iterator<Item = &Option<Point3<f64>>> {
        let shape: &[Option<Point3<f64>>] = match (&self.line, &self.registered) {
            (Some(line), _) => &line.shape,
            (None, Some(registered)) => &registered.shape,
            (None, None) => &[],
        };
        let strays = self.strays();
        shape.iter().enumerate().filter(|(feature, _)| !strays.contains(feature)).map(|(_, place)| place)
    }

    /// The features that count, relative to the body's [centre](BodyMotion::centre), metres; virtual ones for a body
    /// given as poses.
    pub fn features_about_centre(&self) -> Vec<Vector3<f64>> {
        let centre = self.centre();
        if self.tracked.is_some() {
            let corners = self.first_seen_frame().map_or(&[][..], |frame| self.tracks.frame(frame));
            return corners.iter().map(|corner| corner - centre).collect();
        }
        self.shape().flatten().map(|place| place - centre).collect()
    }

    /// How far joints of the body may depart from ideal ones.
    pub fn play(&self) -> &Play {
        &self.play
    }

    /// Diameter of the body about its centre, metres; `pose_radius` for one given as poses.
    pub fn size(&self) -> f64 {
        if self.tracked.is_some() {
            return self.pose_radius;
        }
        2.0 * self.features_about_centre().iter().map(Vector3::norm).fold(0.0, f64::max)
    }

    /// Whether this is the world: a body that rests by definition.
    pub fn is_at_rest(&self) -> bool {
        self.at_rest
    }

    /// Whether the body's poses were given by a tracker rather than found from features.
    pub fn is_tracked(&self) -> bool {
        self.tracked.is_some()
    }

    /// The way that its features travelled through all frames.
    pub(crate) fn path(&self) -> Path {
        *self.path.get_or_init(|| Path::observed(&self.tracks, &(0..self.tracks.frames()).collect::<Vec<_>>()))
    }

    /// Its features' positions in the recording's coordinates, in rows; `None` where one is missing, or for very many.
    pub(crate) fn rows_as_seen(&self) -> Option<&RowsAsSeen> {
        self.rows.get_or_init(|| Some(rows_as_seen(self.tracks.as_seen())?.scaled(self.tracks.factor()))).as_ref()
    }

    /// `body_from_recording` of all frames, all of which must be posed.
    pub(crate) fn maps_from_recording(&self) -> &Maps {
        let inverse = |frame: usize| self.poses[frame].unwrap_or_default().inverse();
        self.maps.get_or_init(|| Maps::of(&(0..self.poses.len()).collect::<Vec<_>>(), inverse))
    }

    /// The frames in which the body has a pose, increasing.
    pub(crate) fn posed_frames(&self) -> &Arc<[usize]> {
        let poses = self.poses.as_seen();
        self.posed.get_or_init(|| (0..poses.len()).filter(|&frame| poses[frame].is_some()).collect())
    }

    /// Whether every frame shows a feature.
    pub(crate) fn is_always_seen(&self) -> bool {
        let tracks = self.tracks.as_seen();
        *self.always_seen.get_or_init(|| (0..tracks.frames()).all(|frame| tracks.seen_count(frame) > 0))
    }

    /// The first frame in which the body has a pose: there its coordinates are the recording's.
    pub fn first_posed_frame(&self) -> Option<usize> {
        self.poses.as_seen().iter().position(Option::is_some)
    }

    /// The first frame in which any feature of the body is seen.
    pub fn first_seen_frame(&self) -> Option<usize> {
        let tracks = self.tracks.as_seen();
        (0..tracks.frames()).find(|&frame| tracks.seen_count(frame) > 0)
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

/// The most that rounding moves a sample, metres.
fn rounding(shape: &Shape) -> f64 {
    ROUNDING * spread(shape).trace().sqrt()
}

/// Says so if noise of `sigma` metres leaves the turn about the features' line unknown.
fn vague_turn(shape: &Shape, sigma: Option<f64>) -> Option<String> {
    let mut values: Vec<f64> = SymmetricEigen::new(spread(shape)).eigenvalues.iter().copied().collect();
    values.sort_by(f64::total_cmp);
    let off_line = (values[0].max(0.0) + values[1].max(0.0)).sqrt();
    let turn = sigma? / off_line;
    (turn > VAGUE_TURN).then(|| {
        let told = if turn > std::f64::consts::PI {
            "not seen".into()
        } else {
            format!("uncertain by {:.0} degrees", turn.to_degrees())
        };
        format!("the features are collinear up to their noise: the turn about their line is {told}")
    })
}

#[cfg(test)]
mod tests;
