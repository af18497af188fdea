//! The mechanism as a robot: links, and joints of one freedom between them, for the formats of robot descriptions.

mod mjcf;
mod urdf;

use std::collections::BTreeSet;

use jointscope_detection::{Branch, JointKind};
use jointscope_motion::{Pose, evenly, quantile};
use nalgebra::{Point3, UnitQuaternion, Vector3};

pub use mjcf::to_mjcf;
pub use urdf::to_urdf;

use crate::{
    Report,
    joint_motion::{JointMotion, own_scale, relative},
    pair_view::{middle, places, reach, seen_from},
    picture::style::colours,
    printable,
};

/// Features by which a link is shown.
const SHOWN: usize = 24;
/// Least range between limits, metres or radians, for a joint that never moved.
const LEAST_RANGE: f64 = 1e-6;

/// A tree of links: the base first, parents before their children.
pub(crate) struct Robot {
    pub(crate) links: Vec<Link>,
    pub(crate) joints: Vec<RobotJoint>,
}

/// A body, or a stage of a joint with several freedoms, which has no features.
///
/// Coordinates of a link are those of the joint by which it hangs on its parent: origin on the axis, `z` along it. Those
/// of the base, and of links that hang freely, are the body's own.
pub(crate) struct Link {
    pub(crate) name: String,
    /// Index of the body.
    pub(crate) body: Option<usize>,
    /// Where features are, metres, in the link's coordinates.
    pub(crate) features: Vec<Point3<f64>>,
    /// Radius by which they are shown, metres.
    pub(crate) radius: f64,
    pub(crate) colour: &'static str,
    /// `body_from_link`.
    pub(crate) place: Pose,
}

/// How a joint of a robot moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Move {
    Fixed,
    Turn,
    Slide,
    Floating,
}

pub(crate) struct RobotJoint {
    pub(crate) name: String,
    pub(crate) moves: Move,
    /// Unit vector in the joint's coordinates: one of its axes.
    pub(crate) axis: [f64; 3],
    /// Indices of links; that of the joint's child is one more than its own.
    pub(crate) parent: usize,
    /// `parent_from_child` at position 0.
    pub(crate) origin: Pose,
    /// Least and greatest position, metres or radians; `None` for a wheel that turned all round.
    pub(crate) limits: Option<[f64; 2]>,
    /// Greatest speed, metres or radians a second; `None` without times.
    pub(crate) speed: Option<f64>,
    /// The joint whose position this one follows, ratio, offset.
    pub(crate) mimic: Option<(usize, f64, f64)>,
    /// Positions of the recording, frame by frame.
    #[cfg_attr(not(test), allow(dead_code, reason = "tests compare them with the recording"))]
    pub(crate) positions: Vec<Option<f64>>,
}

impl Robot {
    pub(crate) fn of(report: &Report<'_>) -> Self {
        let structure = &report.detection.structure;
        let mut robot = Self { links: Vec::new(), joints: Vec::new() };
        let mut names = BTreeSet::new();
        let base = unique(&printable(&report.detection.bodies[structure.base]), &mut names);
        robot.links.push(link(report, base, structure.base, Pose::identity(), 1.0));
        // The joint of every pair, for those that follow it.
        let mut joint_of_pair: Vec<(usize, usize)> = Vec::new();
        for branch in &structure.branches {
            let Some(parent) = robot.links.iter().position(|link| link.body == Some(branch.parent)) else { continue };
            let joint = robot.joints.len();
            robot.hang(report, branch, parent, &mut names);
            joint_of_pair.extend(branch.pair.map(|pair| (pair, joint)));
        }
        for coupling in &structure.couplings {
            let joint = |pair: usize| joint_of_pair.iter().find(|(of, _)| *of == pair).map(|(_, joint)| *joint);
            if let (Some(joint), Some(of)) = (joint(coupling.pair), joint(coupling.of)) {
                robot.joints[joint].mimic = Some((of, coupling.ratio, coupling.offset));
            }
        }
        robot
    }

    /// Hangs a body on its parent, with as many stages between them as the joint has freedoms.
    fn hang(&mut self, report: &Report<'_>, branch: &Branch, parent: usize, names: &mut BTreeSet<String>) {
        let detection = report.detection;
        let name = unique(&printable(&detection.bodies[branch.child]), names);
        let base_of_joint = format!("{}-{name}", self.links[parent].name);
        let found = branch.pair.and_then(|pair| Placed::of(report, pair, branch.child));
        let Some(placed) = found else {
            self.joints.push(RobotJoint {
                name: unique(&base_of_joint, names),
                moves: Move::Floating,
                axis: [0.0, 0.0, 1.0],
                parent,
                origin: self.links[parent].place.inverse() * hanging(report, branch),
                limits: None,
                speed: None,
                mimic: None,
                positions: Vec::new(),
            });
            self.links.push(link(report, name, branch.child, Pose::identity(), 1.0));
            return;
        };
        let stages = placed.stages();
        let origin = self.links[parent].place.inverse() * placed.parent_from_joint;
        let last = stages.len() - 1;
        let mut on = parent;
        let first_joint = self.joints.len();
        for (number, stage) in stages.into_iter().enumerate() {
            let joint_name = if last == 0 { base_of_joint.clone() } else { format!("{base_of_joint}.{}", stage.word) };
            let (limits, speed) = bounds(report, &stage);
            self.joints.push(RobotJoint {
                name: unique(&joint_name, names),
                moves: stage.moves,
                axis: stage.axis,
                parent: on,
                origin: if number == 0 { origin } else { Pose::identity() },
                limits,
                speed,
                mimic: stage.follows.map(|pitch| (first_joint, pitch, 0.0)),
                positions: stage.positions,
            });
            on = self.links.len();
            self.links.push(if number == last {
                link(report, name.clone(), branch.child, placed.child_from_joint, placed.factor)
            } else {
                Link {
                    name: unique(&format!("{name}.{}", stage.word), names),
                    body: None,
                    features: Vec::new(),
                    radius: 0.0,
                    colour: "#000000",
                    place: Pose::identity(),
                }
            });
        }
    }
}

/// A joint between a parent and a child, whichever of them is the pair's reference.
struct Placed {
    kind: JointKind,
    parent_from_joint: Pose,
    child_from_joint: Pose,
    /// `joint_from_joint`: what the positions of a frame do.
    motions: Vec<Option<Pose>>,
    /// Of a joint with one freedom.
    positions: Vec<Option<f64>>,
    /// By which the child is multiplied to be in the parent's scale.
    factor: f64,
}

/// A freedom of a joint.
struct Stage {
    word: &'static str,
    moves: Move,
    axis: [f64; 3],
    /// Of a screw's slide: metres per radian of its turn.
    follows: Option<f64>,
    positions: Vec<Option<f64>>,
}

impl Placed {
    fn of(report: &Report<'_>, pair: usize, child: usize) -> Option<Self> {
        let detection = report.detection;
        let pair = &detection.pairs[pair];
        let joint = JointMotion::of(detection, pair)?;
        let home = joint.home.or_else(|| home_of_points(report, pair, &joint))?;
        let coordinates = joint.coordinates();
        let reversed = detection.bodies[child] == pair.reference;
        let own = |q: &Option<Vec<f64>>| {
            let own = coordinates.inverse() * joint.motion(q.as_ref()?) * coordinates;
            Some(if reversed { flip().inverse() * own.inverse() * flip() } else { own })
        };
        // Seen from the other body a joint moves backwards: the same positions along the opposite direction.
        let (in_reference, in_moving) = (coordinates, home.inverse() * coordinates);
        let (parent_from_joint, child_from_joint) =
            if reversed { (in_moving * flip(), in_reference * flip()) } else { (in_reference, in_moving) };
        let one = |q: &Option<Vec<f64>>| q.as_ref().and_then(|q| q.first().copied());
        Some(Self {
            kind: joint.kind,
            parent_from_joint,
            child_from_joint,
            motions: joint.positions.iter().map(own).collect(),
            positions: joint.positions.iter().map(one).collect(),
            factor: if reversed { 1.0 } else { own_scale(detection, pair) },
        })
    }

    fn stages(&self) -> Vec<Stage> {
        const X: [f64; 3] = [1.0, 0.0, 0.0];
        const Y: [f64; 3] = [0.0, 1.0, 0.0];
        const Z: [f64; 3] = [0.0, 0.0, 1.0];
        let stage = |word, moves, axis, positions| Stage { word, moves, axis, follows: None, positions };
        let told = |tell: &dyn Fn(&Pose) -> f64| self.motions.iter().map(|pose| pose.as_ref().map(tell)).collect();
        let about_z = |pose: &Pose| 2.0 * pose.rotation.coords.z.atan2(pose.rotation.coords.w);
        let place = |axis: usize| move |pose: &Pose| pose.translation.vector[axis];
        match self.kind {
            JointKind::Rigid | JointKind::Disconnected => vec![stage("fixed", Move::Fixed, Z, Vec::new())],
            // No body of a robot runs on ellipses by turning: its eccentric angle is taken for a turn.
            JointKind::Revolute | JointKind::Elliptical { .. } => {
                vec![stage("turn", Move::Turn, Z, self.positions.clone())]
            }
            JointKind::Prismatic => vec![stage("slide", Move::Slide, Z, self.positions.clone())],
            JointKind::Screw { pitch } => {
                let slide = self.positions.iter().map(|q| q.map(|q| pitch * q)).collect();
                let turn = stage("turn", Move::Turn, Z, self.positions.clone());
                vec![turn, Stage { follows: Some(pitch), ..stage("slide", Move::Slide, Z, slide) }]
            }
            JointKind::Cylindrical => {
                let slide = stage("slide", Move::Slide, Z, told(&place(2)));
                vec![slide, stage("turn", Move::Turn, Z, self.positions.clone())]
            }
            JointKind::Planar => vec![
                stage("x", Move::Slide, X, told(&place(0))),
                stage("y", Move::Slide, Y, told(&place(1))),
                stage("turn", Move::Turn, Z, unwrapped(told(&about_z))),
            ],
            JointKind::Spherical | JointKind::Universal => {
                let angle = |axis: usize| move |pose: &Pose| turns(&pose.rotation)[axis];
                let axes = [("x", X), ("y", Y), ("z", Z)].into_iter().enumerate();
                axes.map(|(k, (word, axis))| stage(word, Move::Turn, axis, unwrapped(told(&angle(k))))).collect()
            }
        }
    }
}

/// Angles that turn about x, the turned y, and the twice turned z: `R = Rx · Ry · Rz`.
fn turns(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let r = rotation.to_rotation_matrix();
    [(-r[(1, 2)]).atan2(r[(2, 2)]), r[(0, 2)].clamp(-1.0, 1.0).asin(), (-r[(0, 1)]).atan2(r[(0, 0)])]
}

fn unwrapped(angles: Vec<Option<f64>>) -> Vec<Option<f64>> {
    let mut before = 0.0;
    let near = |angle: f64| {
        before = angle + std::f64::consts::TAU * ((before - angle) / std::f64::consts::TAU).round();
        before
    };
    let mut near = near;
    angles.into_iter().map(|angle| angle.map(&mut near)).collect()
}

/// Half a turn about x, which turns z round.
fn flip() -> Pose {
    Pose::from_parts(Vector3::zeros().into(), UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}

/// Home of a body without orientation: it keeps that of the recording at the first frame that shows it.
fn home_of_points(
    report: &Report<'_>,
    pair: &jointscope_detection::PairDetection,
    joint: &JointMotion,
) -> Option<Pose> {
    let detection = report.detection;
    let index = |name: &String| detection.bodies.iter().position(|body| body == name);
    let (reference, moving) = (index(&pair.reference)?, index(&pair.moving)?);
    let first_seen = |body: usize| {
        let recorded = report.recording.bodies().iter().find(|other| other.name() == detection.bodies[body])?;
        let ways = places(recorded, &detection.poses[body]);
        ways.iter().flatten().map(|(frame, _)| *frame).min()
    };
    let posed = |body: usize| detection.poses[body].iter().any(Option::is_some);
    let (frame, measured) = if posed(reference) {
        let frame = first_seen(moving)?;
        (frame, detection.poses[reference][frame]?.inverse())
    } else {
        let frame = first_seen(reference)?;
        (frame, detection.poses[moving][frame]?)
    };
    Some(joint.motion(joint.positions.get(frame)?.as_ref()?).inverse() * measured)
}

/// Where a body that hangs freely is at first, as seen from its parent.
fn hanging(report: &Report<'_>, branch: &Branch) -> Pose {
    let poses = &report.detection.poses;
    relative(&poses[branch.parent], &poses[branch.child]).into_iter().flatten().next().unwrap_or_default()
}

/// Limits and speed of a freedom.
fn bounds(report: &Report<'_>, stage: &Stage) -> (Option<[f64; 2]>, Option<f64>) {
    /// Share of the steps whose speed counts: single ones may be wild.
    const USUAL: f64 = 0.98;
    let known = || stage.positions.iter().flatten();
    if matches!(stage.moves, Move::Fixed | Move::Floating) || known().next().is_none() {
        return (None, None);
    }
    let least = known().copied().fold(f64::INFINITY, f64::min);
    let most = known().copied().fold(f64::NEG_INFINITY, f64::max).max(least + LEAST_RANGE);
    let all_round = stage.moves == Move::Turn && most - least >= std::f64::consts::TAU;
    let speed = report.recording.times().and_then(|times| {
        let seen: Vec<(f64, f64)> =
            times.iter().zip(&stage.positions).filter_map(|(time, q)| Some((*time, (*q)?))).collect();
        let steps = seen.windows(2).filter(|pair| pair[1].0 > pair[0].0);
        let mut speeds: Vec<f64> =
            steps.map(|pair| ((pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0)).abs()).collect();
        (!speeds.is_empty()).then(|| quantile(&mut speeds, USUAL))
    });
    ((!all_round).then_some([least, most]), speed)
}

/// A body as a link, with its features where most frames see them, multiplied by a factor.
fn link(report: &Report<'_>, name: String, body: usize, place: Pose, factor: f64) -> Link {
    let detection = report.detection;
    let poses = &detection.poses[body];
    let recorded = report.recording.bodies().iter().find(|recorded| recorded.name() == detection.bodies[body]);
    let ways = recorded.map_or_else(Vec::new, |recorded| places(recorded, poses));
    let own = if poses.iter().any(Option::is_some) {
        seen_from(poses, &ways)
    } else {
        // Without orientation, only the first frame tells.
        ways.into_iter().map(|way| way.into_iter().take(1).collect()).collect()
    };
    let seen: Vec<_> = own.iter().filter(|way| !way.is_empty()).collect();
    let features: Vec<Point3<f64>> =
        evenly(seen.len(), SHOWN).into_iter().map(|way| place.inverse() * (middle(seen[way]) * factor)).collect();
    let radius = (0.05 * reach(features.iter())).max(0.003);
    Link { name, body: Some(body), features, radius, colour: colours(detection)[body], place }
}

/// The name, or the first with a number behind it that is still free.
fn unique(name: &str, names: &mut BTreeSet<String>) -> String {
    let mut free = name.to_owned();
    let mut number = 2;
    while !names.insert(free.clone()) {
        free = format!("{name}_{number}");
        number += 1;
    }
    free
}

/// Roll, pitch and yaw about fixed axes, as robot descriptions have them: `R = Rz(yaw) · Ry(pitch) · Rx(roll)`.
pub(crate) fn roll_pitch_yaw(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let (roll, pitch, yaw) = rotation.euler_angles();
    [roll, pitch, yaw]
}

/// A number of a robot description: to a nanometre or a nanoradian, never a negative zero.
pub(crate) fn number(x: f64) -> String {
    let x = (x * 1e9).round() / 1e9 + 0.0;
    format!("{x}")
}

pub(crate) fn numbers(values: impl IntoIterator<Item = f64>) -> String {
    values.into_iter().map(number).collect::<Vec<_>>().join(" ")
}

/// Red, green, blue and opacity, 0 to 1, of a colour of six hexadecimal digits.
pub(crate) fn rgba(colour: &str) -> String {
    let part = |k: usize| u8::from_str_radix(colour.get(k..k + 2).unwrap_or("80"), 16).unwrap_or(128);
    numbers([1, 3, 5].map(|k| (f64::from(part(k)) / 255.0 * 1e3).round() / 1e3).into_iter().chain([1.0]))
}

#[cfg(test)]
mod tests;
