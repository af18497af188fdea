//! A joint in a sentence.

use jointscope_detection::{Coupling, Detection, Indirect, JointKind, PairDetection};
use jointscope_models::Positions;

/// What the moving body does, without its name and the reference's: "turns by 81.8 degrees".
pub(crate) fn deed(pair: &PairDetection) -> String {
    let ranges = pair.positions.as_ref().and_then(Positions::ranges).unwrap_or_default();
    let size = |freedom: usize| ranges.get(freedom).map(|[least, most]| most - least);
    let angle = |freedom: usize| size(freedom).map_or(String::new(), |range| format!(" by {}", degrees(range)));
    let length = |freedom: usize| size(freedom).map_or(String::new(), |range| format!(" by {}", metres(range)));
    match pair.kind() {
        JointKind::Rigid => "is fixed".into(),
        JointKind::Prismatic => format!("slides{}", length(0)),
        JointKind::Revolute => format!("turns{}", angle(0)),
        JointKind::Elliptical { .. } => format!("runs on ellipses{}", angle(0)),
        JointKind::Screw { pitch } => {
            format!("screws{}, {} a turn", angle(0), metres(pitch.abs() * std::f64::consts::TAU))
        }
        JointKind::Cylindrical => format!("turns{} and slides{}", angle(0), length(1)),
        JointKind::Planar => format!("moves in a plane, turning{}", angle(0)),
        JointKind::Spherical => "swivels about a point".into(),
        JointKind::Universal => "tilts about two axes".into(),
        JointKind::Disconnected => "moves freely".into(),
    }
}

/// The whole sentence: "door2 turns by 81.8 degrees on background".
pub(crate) fn sentence(pair: &PairDetection) -> String {
    sentence_with(pair, String::clone)
}

/// The same, with bodies under names as there is room for them.
pub(crate) fn sentence_with(pair: &PairDetection, name: impl Fn(&String) -> String) -> String {
    let (reference, moving) = (name(&pair.reference), name(&pair.moving));
    match pair.kind() {
        JointKind::Rigid => format!("{moving} is fixed to {reference}"),
        JointKind::Disconnected => format!("{moving} is not connected to {reference}"),
        _ => format!("{moving} {} on {reference}", deed(pair)),
    }
}

/// How well the axis is known; empty if nobody says.
pub(crate) fn knowledge(pair: &PairDetection) -> String {
    let Some(uncertainty) = pair.axis_uncertainty else { return String::new() };
    let angle = uncertainty.angle.map(degrees);
    let distance = uncertainty.distance.map(metres);
    match (angle, distance) {
        (Some(angle), Some(distance)) => format!("axis known to {angle} and {distance}"),
        (Some(only), None) => format!("direction known to {only}"),
        (None, Some(only)) => format!("centre known to {only}"),
        (None, None) => String::new(),
    }
}

pub(crate) fn degrees(angle: f64) -> String {
    let angle = angle.abs().to_degrees();
    match angle {
        angle if angle > 720.0 => format!("{:.1} turns", angle / 360.0),
        angle if angle < 9.95 => format!("{angle:.2}°"),
        angle => format!("{angle:.1}°"),
    }
}

pub(crate) fn metres(length: f64) -> String {
    match length.abs() {
        length if length < 0.01 => format!("{:.2} mm", 1e3 * length),
        length if length < 1.0 => format!("{:.0} mm", 1e3 * length),
        length => format!("{length:.2} m"),
    }
}

/// How a pair beside the tree is explained; `None` where there is nothing to explain: no joints lead from one body to
/// the other.
pub(crate) fn follows(detection: &Detection, indirect: &Indirect) -> Option<String> {
    let name = |pair: &PairDetection| format!("{} - {}", pair.reference, pair.moving);
    let pair = &detection.pairs[indirect.pair];
    let way: Vec<String> = indirect.way.iter().map(|&other| name(&detection.pairs[other])).collect();
    let (last, before) = way.split_last()?;
    let way = if before.is_empty() { last.clone() } else { format!("{} and {last}", before.join(", ")) };
    Some(if indirect.closes_loop {
        format!("{} ({}) closes a loop: it allows less than {way}", name(pair), pair.verdict.joint)
    } else {
        format!("{} ({}) follows from {way}", name(pair), pair.verdict.joint)
    })
}

/// That two joints moved in proportion.
pub(crate) fn coupled(detection: &Detection, coupling: &Coupling) -> String {
    let name = |pair: usize| format!("{} - {}", detection.pairs[pair].reference, detection.pairs[pair].moving);
    format!("{} moved {:.4} times as {}", name(coupling.pair), coupling.ratio, name(coupling.of))
}
