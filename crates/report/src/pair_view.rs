//! A pair as pictures show it: trajectories, the joint, what remains unexplained.

use jointscope_detection::{Detection, JointKind, PairDetection};
use jointscope_models::Axis;
use jointscope_motion::{Body, Observation, Pose, Recording};
use nalgebra::{Point3, Vector3, distance};

use crate::joint_motion::{JointMotion, larger, median, own_scale};

/// Metres from a tracked pose's origin at which virtual features of its body are drawn.
const VIRTUAL_RADIUS: f64 = 0.1;

/// One feature's places: frame and position, metres.
pub(crate) type Trajectory = Vec<(usize, Point3<f64>)>;

/// The motion of one body of a pair as seen from the other.
pub(crate) struct PairView {
    pub(crate) kind: JointKind,
    /// Whether the reference is seen from the moving body, because it shows no orientation itself.
    pub(crate) swapped: bool,
    /// Of the body that is seen, in the coordinates of the body from which it is seen.
    pub(crate) trajectories: Vec<Trajectory>,
    /// In the same coordinates.
    pub(crate) axis: Option<Axis>,
    /// Noise of the relation, metres per coordinate; 0 if unknown.
    pub(crate) noise: f64,
    pub(crate) joint: Option<JointMotion>,
    /// Root mean square distance of the features from where the joint puts them, metres, by frame.
    pub(crate) residuals: Vec<(usize, f64)>,
}

impl PairView {
    pub(crate) fn of(detection: &Detection, recording: &Recording, pair: &PairDetection) -> Self {
        let index = |name: &String| detection.bodies.iter().position(|body| body == name).unwrap_or(0);
        let (reference, moving) = (index(&pair.reference), index(&pair.moving));
        let posed = |body: usize| detection.poses[body].iter().any(Option::is_some);
        let swapped = !posed(reference) && posed(moving);
        let (viewer, seen) = if swapped { (moving, reference) } else { (reference, moving) };
        let own = own_scale(detection, pair);
        let at_scale = |body: usize| if body == moving { own } else { 1.0 };
        let posed_at_scale = |body: usize| larger(&detection.poses[body], at_scale(body));
        let trajectories = recording.bodies().get(seen).map_or_else(Vec::new, |body| {
            let places = places(&body.scaled(at_scale(seen)), &posed_at_scale(seen));
            seen_from(&posed_at_scale(viewer), &places)
        });
        let opposite = |axis: Axis| Axis { direction: axis.direction.map(|direction| -direction), ..axis };
        let axis =
            if swapped { pair.axis_in_moving.map(|axis| opposite(axis.scaled(at_scale(moving)))) } else { pair.axis };
        let square = |noise: Option<f64>| noise.unwrap_or(0.0).powi(2);
        let noise = (square(pair.noise_reference.position) + square(pair.noise_moving.position)).sqrt();
        let joint = JointMotion::of(detection, pair);
        let kind = pair.kind();
        let mut view = Self { kind, swapped, trajectories, axis, noise, joint, residuals: Vec::new() };
        view.residuals = view.unexplained();
        view
    }

    /// Takes the motion that the joint explains out of the trajectories: what is left of them, and would be one point
    /// for each feature if joint and samples were perfect.
    pub(crate) fn stilled(&self) -> Option<Vec<Trajectory>> {
        let joint = self.joint.as_ref()?;
        let joint = &JointMotion { axis: self.axis.unwrap_or(joint.axis), ..joint.clone() };
        let back = |&(frame, point): &(usize, Point3<f64>)| {
            let q = joint.positions.get(frame)?.as_ref()?;
            (q.len() == joint.kind.freedoms() || joint.kind == JointKind::Universal)
                .then(|| (frame, joint.carried_back(q, &point)))
        };
        Some(self.trajectories.iter().map(|way| way.iter().filter_map(back).collect()).collect())
    }

    fn unexplained(&self) -> Vec<(usize, f64)> {
        let Some(stilled) = self.stilled() else { return Vec::new() };
        let mut squares = std::collections::BTreeMap::<usize, (f64, f64)>::new();
        for way in &stilled {
            let middle = middle(way);
            for (frame, point) in way {
                let (sum, count) = squares.entry(*frame).or_default();
                *sum += (point - middle).norm_squared();
                *count += 1.0;
            }
        }
        squares.into_iter().map(|(frame, (sum, count))| (frame, (sum / count).sqrt())).collect()
    }

    /// All places, of all features.
    pub(crate) fn points(&self) -> impl Iterator<Item = &Point3<f64>> + Clone {
        self.trajectories.iter().flatten().map(|(_, point)| point)
    }

    /// Trajectories thinned to about so many points in all, the longest-lived features first.
    pub(crate) fn thinned(ways: &[Trajectory], most: usize) -> Vec<Trajectory> {
        /// More lines than this hide each other; with fewer points than that, a turn looks like a polygon.
        const LINES: usize = 16;
        const SMOOTH: usize = 250;
        let lines = (most / SMOOTH).clamp(3, LINES);
        let mut order: Vec<usize> = (0..ways.len()).filter(|&way| !ways[way].is_empty()).collect();
        order.sort_by_key(|&way| std::cmp::Reverse(ways[way].len()));
        let chosen: Vec<usize> = jointscope_motion::evenly(order.len(), lines).into_iter().map(|k| order[k]).collect();
        let each = (most / chosen.len().max(1)).max(8);
        let thin = |way: &Trajectory| jointscope_motion::evenly(way.len(), each).into_iter().map(|k| way[k]).collect();
        chosen.into_iter().map(|way| thin(&ways[way])).collect()
    }
}

/// The componentwise median of a trajectory.
pub(crate) fn middle(way: &Trajectory) -> Point3<f64> {
    Point3::from(Vector3::from_fn(|axis, _| median(way.iter().map(|(_, point)| point[axis]).collect())))
}

/// Places of a body's features in the recording: its own, or virtual ones about a tracked pose. The world has none.
pub(crate) fn places(body: &Body, poses: &[Option<Pose>]) -> Vec<Trajectory> {
    match body.observation() {
        Observation::Points { tracks, .. } => {
            let way = |feature| (0..tracks.frames()).filter_map(|t| Some((t, *tracks.get(t, feature)?))).collect();
            (0..tracks.features()).map(way).collect()
        }
        Observation::Poses(tracked) => {
            let Some(origin) = tracked.iter().flatten().next().map(|pose| pose.translation.vector) else {
                return Vec::new();
            };
            let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let way = |corner: [f64; 3]| {
                let place = Point3::from(origin + Vector3::from(corner) * VIRTUAL_RADIUS);
                let at = |(frame, pose): (usize, &Option<Pose>)| Some((frame, (*pose)? * place));
                poses.iter().enumerate().filter_map(at).collect()
            };
            corners.into_iter().map(way).collect()
        }
        Observation::AtRest(_) => Vec::new(),
    }
}

/// Trajectories in the coordinates of a body with these poses, where it is posed.
pub(crate) fn seen_from(viewer: &[Option<Pose>], ways: &[Trajectory]) -> Vec<Trajectory> {
    let see = |&(frame, point): &(usize, Point3<f64>)| Some((frame, viewer.get(frame)?.as_ref()?.inverse() * point));
    ways.iter().map(|way| way.iter().filter_map(see).collect()).collect()
}

/// Largest distance of points from their middle, metres.
pub(crate) fn reach<'p>(points: impl Iterator<Item = &'p Point3<f64>> + Clone) -> f64 {
    let count = points.clone().count().max(1) as f64;
    let centre = Point3::from(points.clone().map(|point| point.coords).sum::<Vector3<f64>>() / count);
    points.map(|point| distance(point, &centre)).fold(0.0, f64::max)
}
