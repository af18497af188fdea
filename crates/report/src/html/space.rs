//! What the page moves in space, packed: positions as 16-bit steps within their bounds, poses as 32-bit floats.

use base64::{Engine, engine::general_purpose::STANDARD};
use jointscope_detection::{Detection, JointKind};
use jointscope_models::Positions;
use jointscope_motion::{Pose, evenly};
use nalgebra::{Point3, Vector3, distance};
use serde_json::{Value, json};

use crate::{
    Report,
    joint_motion::median,
    outlook::Outlook,
    pair_view::{PairView, Trajectory, middle, places, reach},
    printable,
};

/// Samples of all bodies together: six bytes each.
const SAMPLES: usize = 330_000;
/// Frames that can be told apart on a slider.
const FRAMES: usize = 1200;
/// Features of all bodies together.
const FEATURES: usize = 1500;
/// Paths of a body.
const TRAILS: usize = 8;
/// What is missing.
const MISSING: i16 = i16::MIN;

/// The data as JSON that is safe within a page.
pub(super) fn data(report: &Report<'_>, views: &[PairView], colours: &[&'static str]) -> String {
    let detection = report.detection;
    let ways: Vec<Vec<Trajectory>> = (0..detection.bodies.len()).map(|body| features_of(report, body)).collect();
    let features: usize = ways.iter().map(Vec::len).sum::<usize>().max(1);
    let frames = evenly(detection.frames, (SAMPLES / features).clamp(60, FRAMES));
    let outlook = Outlook::of(ways.iter().flatten().flatten().map(|(_, point)| point));
    let times: Vec<f64> = frames.iter().map(|&frame| time(report, frame)).collect();
    let numbers: Vec<u64> = frames.iter().map(|&frame| report.recording.frame_numbers()[frame]).collect();
    let bodies: Vec<Value> = ways
        .iter()
        .enumerate()
        .map(|(body, ways)| {
            let packed = Packed::of(ways, &frames);
            json!({
                "name": printable(&detection.bodies[body]),
                "colour": colours[body],
                "count": ways.len(),
                "steps": packed.steps,
                "origin": packed.origin,
                "step": packed.step,
                "poses": poses(&detection.poses[body], &frames),
                "edges": edges(ways),
                "trail": trail(ways),
            })
        })
        .collect();
    let tree = detection.structure.branches.iter().filter_map(|branch| branch.pair);
    let loops = detection.structure.indirect.iter().filter(|pair| pair.closes_loop).map(|indirect| indirect.pair);
    let joints: Vec<Value> =
        tree.chain(loops).filter_map(|pair| joint(detection, pair, &views[pair], &frames)).collect();
    let data = json!({
        "frames": numbers,
        "times": times,
        "seconds": report.recording.times().is_some(),
        "size": outlook.size,
        "up": outlook.up.as_slice(),
        "eye": outlook.eye.as_slice(),
        "ball": ball(&ways),
        "base": detection.structure.base,
        "bodies": bodies,
        "joints": joints,
    });
    // In a page, `</script>` and `<!--` have a meaning even within text.
    data.to_string().replace('<', "\\u003c")
}

fn time(report: &Report<'_>, frame: usize) -> f64 {
    report.recording.times().map_or(frame as f64, |times| times[frame] - times[0])
}

fn features_of(report: &Report<'_>, body: usize) -> Vec<Trajectory> {
    let detection = report.detection;
    let recorded = report.recording.bodies().iter().find(|recorded| recorded.name() == detection.bodies[body]);
    let ways = recorded.map_or_else(Vec::new, |recorded| places(recorded, &detection.poses[body]));
    let most = (FEATURES / detection.bodies.len()).clamp(4, 300);
    let seen: Vec<Trajectory> = ways.into_iter().filter(|way| !way.is_empty()).collect();
    evenly(seen.len(), most).into_iter().map(|feature| seen[feature].clone()).collect()
}

struct Packed {
    steps: String,
    origin: [f64; 3],
    step: f64,
}

impl Packed {
    /// Frame by frame, feature by feature, x, y and z.
    fn of(ways: &[Trajectory], frames: &[usize]) -> Self {
        let all = || ways.iter().flatten().map(|(_, point)| point.coords);
        let low = all().fold(Vector3::repeat(f64::INFINITY), |low, point| low.inf(&point));
        let high = all().fold(Vector3::repeat(f64::NEG_INFINITY), |high, point| high.sup(&point));
        if ways.is_empty() {
            return Self { steps: String::new(), origin: [0.0; 3], step: 0.0 };
        }
        let origin = (low + high) / 2.0;
        let step = ((high - low).max() / 65_000.0).max(f64::MIN_POSITIVE);
        let mut bytes = Vec::with_capacity(6 * ways.len() * frames.len());
        let mut next: Vec<usize> = vec![0; ways.len()];
        for &frame in frames {
            for (way, next) in ways.iter().zip(&mut next) {
                while way.get(*next).is_some_and(|(at, _)| *at < frame) {
                    *next += 1;
                }
                let sample = way.get(*next).filter(|(at, _)| *at == frame);
                for axis in 0..3 {
                    let value = sample.map_or(MISSING, |(_, point)| rounded((point[axis] - origin[axis]) / step));
                    bytes.extend(value.to_le_bytes());
                }
            }
        }
        Self { steps: STANDARD.encode(bytes), origin: origin.into(), step }
    }
}

/// The nearest of the steps, which are within ±32500 by construction.
#[allow(clippy::cast_possible_truncation, reason = "within bounds by construction, and clamped")]
fn rounded(steps: f64) -> i16 {
    steps.round().clamp(-32_767.0, 32_767.0) as i16
}

#[allow(clippy::cast_possible_truncation, reason = "a screen shows no more than single precision")]
fn floats(values: impl Iterator<Item = f64>) -> String {
    STANDARD.encode(values.flat_map(|value| (value as f32).to_le_bytes()).collect::<Vec<u8>>())
}

/// `recording_from_body`: x, y, z, and the quaternion x, y, z, w.
fn poses(poses: &[Option<Pose>], frames: &[usize]) -> String {
    let numbers = |frame: &usize| {
        poses[*frame].map_or([f64::NAN; 7], |pose| {
            let (t, q) = (pose.translation.vector, pose.rotation.coords);
            [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
        })
    };
    floats(frames.iter().flat_map(numbers))
}

/// Neighbours, so that a body looks like one: the shortest tree that joins all features, as they are seen together.
fn edges(ways: &[Trajectory]) -> Vec<[usize; 2]> {
    /// More rods than these hide what they join.
    const MOST: usize = 120;
    if ways.len() < 2 || ways.len() > MOST {
        return Vec::new();
    }
    let mut counts = std::collections::BTreeMap::<usize, usize>::new();
    for (frame, _) in ways.iter().flatten() {
        *counts.entry(*frame).or_default() += 1;
    }
    let Some((&frame, _)) = counts.iter().max_by_key(|(frame, count)| (**count, std::cmp::Reverse(**frame))) else {
        return Vec::new();
    };
    let places: Vec<(usize, Point3<f64>)> = ways
        .iter()
        .enumerate()
        .filter_map(|(feature, way)| Some((feature, way.iter().find(|(at, _)| *at == frame)?.1)))
        .collect();
    let mut joined = vec![0];
    let mut edges = Vec::new();
    while joined.len() < places.len() {
        let outside = (0..places.len()).filter(|k| !joined.contains(k));
        let length = |(a, b): &(usize, usize)| distance(&places[*a].1, &places[*b].1);
        let ways_in = outside.flat_map(|k| joined.iter().map(move |&j| (j, k)));
        let Some((a, b)) = ways_in.min_by(|one, other| length(one).total_cmp(&length(other))) else { break };
        edges.push([places[a].0, places[b].0]);
        joined.push(b);
    }
    // Few features are a plate, or a pyramid: all of its edges are shown.
    if (3..=4).contains(&places.len()) {
        let all = (0..places.len()).flat_map(|a| (a + 1..places.len()).map(move |b| (a, b)));
        return all.map(|(a, b)| [places[a].0, places[b].0]).collect();
    }
    edges
}

/// The features whose paths are drawn: those seen longest, no more than a few.
fn trail(ways: &[Trajectory]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..ways.len()).collect();
    order.sort_by_key(|&way| std::cmp::Reverse(ways[way].len()));
    let mut chosen: Vec<usize> = evenly(order.len(), TRAILS).into_iter().map(|k| order[k]).collect();
    chosen.sort_unstable();
    chosen
}

/// Radius of a ball for a feature, small beside its body, metres; 0 where no body has two.
fn ball(ways: &[Vec<Trajectory>]) -> f64 {
    let of_body = |ways: &Vec<Trajectory>| {
        let first: Vec<Point3<f64>> = ways.iter().map(|way| way[0].1).collect();
        (first.len() > 1).then(|| reach(first.iter()))
    };
    0.05 * median(ways.iter().filter_map(of_body).collect())
}

fn joint(detection: &Detection, index: usize, view: &PairView, frames: &[usize]) -> Option<Value> {
    let pair = &detection.pairs[index];
    let axis = pair.axis?;
    let body = |name: &String| detection.bodies.iter().position(|body| body == name);
    // Where the moving body is in the joint's zero, as seen from the axis.
    let rest = view.stilled().unwrap_or_else(|| view.trajectories.clone());
    let homes: Vec<Point3<f64>> = rest.iter().filter(|way| !way.is_empty()).map(middle).collect();
    let count = homes.len().max(1) as f64;
    let home = Point3::from(homes.iter().map(|home| home.coords).sum::<Vector3<f64>>() / count);
    let arm = if view.swapped || homes.is_empty() { Vector3::zeros() } else { home - axis.point };
    let across = axis.direction.map_or(arm, |z| arm - z.into_inner() * z.dot(&arm));
    let size = reach(homes.iter()).max(1e-3);
    let ranges = pair.positions.as_ref().and_then(Positions::ranges).unwrap_or_default();
    let travel = ranges.first().map_or(0.0, |[least, most]| most - least);
    let half = match pair.kind() {
        JointKind::Prismatic => (0.5 * travel).max(0.4 * size) + 0.35 * size,
        _ => (1.2 * size).max(0.45 * across.norm()),
    };
    let freedoms = pair.positions.as_ref().map_or(0, Positions::freedoms);
    let rows: Vec<Option<&[f64]>> = pair.positions.as_ref().map_or_else(Vec::new, |rows| rows.iter().collect());
    let row = |frame: &usize| (0..freedoms).map(|k| rows[*frame].map_or(f64::NAN, |row| row[k])).collect::<Vec<_>>();
    let kind = match pair.kind() {
        JointKind::Rigid | JointKind::Disconnected => return None,
        JointKind::Prismatic => "prismatic",
        JointKind::Revolute | JointKind::Elliptical { .. } => "revolute",
        JointKind::Screw { .. } => "screw",
        JointKind::Cylindrical => "cylindrical",
        JointKind::Planar => "planar",
        JointKind::Spherical => "spherical",
        JointKind::Universal => "universal",
    };
    // A slide's rail is where the body is half way.
    let middle = ranges.first().map_or(0.0, |[least, most]| (least + most) / 2.0);
    let point = match (pair.kind(), axis.direction) {
        (JointKind::Prismatic, Some(z)) => axis.point + z.into_inner() * middle,
        _ => axis.point,
    };
    Some(json!({
        "pair": index,
        "name": printable(&pair.verdict.joint),
        "kind": kind,
        "reference": body(&pair.reference)?,
        "moving": body(&pair.moving)?,
        "point": point.coords.as_slice(),
        "direction": axis.direction.map(|direction| <[f64; 3]>::from(direction.into_inner())),
        "pitch": axis.pitch,
        "start": across.as_slice(),
        "half": half,
        "radius": (0.55 * across.norm()).max(0.35 * size),
        "angle": pair.axis_uncertainty.and_then(|known| known.angle),
        "distance": pair.axis_uncertainty.and_then(|known| known.distance),
        "freedoms": freedoms,
        "range": ranges,
        "positions": floats(frames.iter().flat_map(row)),
    }))
}
