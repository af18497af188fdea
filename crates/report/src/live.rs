//! The recording as MCAP, a log that viewers of robots play: Foxglove, for one.

use std::{collections::BTreeMap, io::Cursor};

use jointscope_detection::JointKind;
use jointscope_motion::Pose;
use mcap::{McapError, Writer, records::MessageHeader};
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use serde_json::{Value, json};

use crate::{
    Report,
    pair_view::{Trajectory, places, reach},
    picture::style::colours,
    printable,
};

/// Frames a second where times are not known.
const RATE: f64 = 30.0;
/// Coordinates in which all is given.
const ROOT: &str = "recording";

/// The recording as MCAP with messages in JSON: on `/scene` the features of every body and the axes of joints
/// (`foxglove.SceneUpdate`), on `/tf` the bodies' poses (`foxglove.FrameTransforms`), on `/joints` the positions
/// (`jointscope.Positions`).
///
/// *Convention.* Metres, radians, and nanoseconds since the first frame. Every body's coordinates are a frame that hangs
/// on the frame `recording`. A message holds what is seen in its frame, and stays no longer than to the next.
///
/// # Errors
/// [`McapError`], should the log be refused.
pub fn to_mcap(report: &Report<'_>) -> Result<Vec<u8>, McapError> {
    let detection = report.detection;
    // Without compression, which needs libraries of other languages.
    let options = mcap::WriteOptions::new().compression(None).profile("").library("jointscope");
    let mut log = Writer::with_options(Cursor::new(Vec::new()), options)?;
    let mut channel = |name: &str, topic: &str, properties: Value| {
        let schema = json!({"title": name, "type": "object", "properties": properties}).to_string();
        let schema = log.add_schema(name, "jsonschema", schema.as_bytes())?;
        log.add_channel(schema, topic, "json", &BTreeMap::new())
    };
    let list = json!({"type": "array", "items": {"type": "object"}});
    let scene = channel("foxglove.SceneUpdate", "/scene", json!({"deletions": list, "entities": list}))?;
    let transforms = channel("foxglove.FrameTransforms", "/tf", json!({"transforms": list}))?;
    let positions = channel("jointscope.Positions", "/joints", json!({"joints": list}))?;
    let bodies: Vec<Vec<Trajectory>> = detection
        .bodies
        .iter()
        .enumerate()
        .map(|(body, name)| {
            let recorded = report.recording.bodies().iter().find(|recorded| recorded.name() == name);
            recorded.map_or_else(Vec::new, |recorded| places(recorded, &detection.poses[body]))
        })
        .collect();
    let mut next: Vec<Vec<usize>> = bodies.iter().map(|ways| vec![0; ways.len()]).collect();
    let size = bodies.iter().flatten().filter_map(|way| way.first()).map(|(_, point)| *point).collect::<Vec<_>>();
    let size = reach(size.iter()).max(1e-3);
    for frame in 0..detection.frames {
        let seconds = report.recording.times().map_or(frame as f64 / RATE, |times| times[frame] - times[0]);
        let time = nanoseconds(seconds);
        let stamp = json!({"sec": time / 1_000_000_000, "nsec": time % 1_000_000_000});
        let features = bodies.iter().zip(&mut next).enumerate().map(|(body, (ways, next))| {
            let seen = ways.iter().zip(next).filter_map(|(way, next)| {
                while way.get(*next).is_some_and(|(at, _)| *at < frame) {
                    *next += 1;
                }
                way.get(*next).filter(|(at, _)| *at == frame).map(|(_, point)| *point)
            });
            features(report, body, &seen.collect::<Vec<_>>(), &stamp, 0.01 * size)
        });
        let entities: Vec<Value> = features.chain(axes(report, frame, &stamp, size)).collect();
        let moved: Vec<Value> = (0..detection.bodies.len())
            .filter_map(|body| {
                let pose = detection.poses[body][frame]?;
                let placed = placed(&pose);
                Some(json!({
                    "timestamp": stamp, "parent_frame_id": ROOT, "child_frame_id": printable(&detection.bodies[body]),
                    "translation": placed["position"], "rotation": placed["orientation"],
                }))
            })
            .collect();
        let told: Vec<Value> = detection
            .pairs
            .iter()
            .filter_map(|pair| {
                let row = pair.positions.as_ref()?.iter().nth(frame)??.to_vec();
                Some(json!({"reference": printable(&pair.reference), "moving": printable(&pair.moving), "positions": row}))
            })
            .collect();
        let messages = [
            (scene, json!({"deletions": [], "entities": entities})),
            (transforms, json!({"transforms": moved})),
            (positions, json!({"joints": told})),
        ];
        for (channel_id, message) in messages {
            let header = MessageHeader { channel_id, sequence: 0, log_time: time, publish_time: time };
            log.write_to_known_channel(&header, message.to_string().as_bytes())?;
        }
    }
    log.finish()?;
    Ok(log.into_inner().into_inner())
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "times never fall, and casts saturate")]
fn nanoseconds(seconds: f64) -> u64 {
    (seconds.max(0.0) * 1e9).round() as u64
}

fn triple(xyz: &Vector3<f64>) -> Value {
    json!({"x": xyz.x, "y": xyz.y, "z": xyz.z})
}

fn placed(pose: &Pose) -> Value {
    let q = pose.rotation.coords;
    json!({
        "position": triple(&pose.translation.vector),
        "orientation": {"x": q.x, "y": q.y, "z": q.z, "w": q.w},
    })
}

fn rgba(colour: &str, opacity: f64) -> Value {
    let part =
        |k: usize| f64::from(u8::from_str_radix(colour.get(k..k + 2).unwrap_or("80"), 16).unwrap_or(128)) / 255.0;
    json!({"r": part(1), "g": part(3), "b": part(5), "a": opacity})
}

fn entity(id: &str, stamp: &Value, parts: &[(&str, Value)]) -> Value {
    let mut entity = json!({
        "timestamp": stamp, "frame_id": ROOT, "id": id, "lifetime": {"sec": 0, "nsec": 0}, "frame_locked": false,
        "metadata": [], "arrows": [], "cubes": [], "spheres": [], "cylinders": [], "lines": [], "triangles": [],
        "texts": [], "models": [],
    });
    for (name, part) in parts {
        entity[*name] = part.clone();
    }
    entity
}

fn features(report: &Report<'_>, body: usize, seen: &[Point3<f64>], stamp: &Value, radius: f64) -> Value {
    let colour = rgba(colours(report.detection)[body], 1.0);
    let size = triple(&Vector3::repeat(2.0 * radius));
    let sphere = |point: &Point3<f64>| {
        let pose = placed(&Pose::from_parts(point.coords.into(), UnitQuaternion::identity()));
        json!({"pose": pose, "size": size, "color": colour})
    };
    let spheres: Vec<Value> = seen.iter().map(sphere).collect();
    entity(&format!("body {}", printable(&report.detection.bodies[body])), stamp, &[("spheres", json!(spheres))])
}

/// The joints of the tree, where their references are: arrows along axes, balls at centres.
fn axes(report: &Report<'_>, frame: usize, stamp: &Value, size: f64) -> Vec<Value> {
    let detection = report.detection;
    let colour = rgba(crate::picture::style::AXIS, 1.0);
    let tree = detection.structure.branches.iter().filter_map(|branch| branch.pair);
    let joint = |pair: usize| {
        let pair = &detection.pairs[pair];
        let reference = detection.bodies.iter().position(|body| *body == pair.reference)?;
        let axis = pair.axis?.seen_from(&detection.poses[reference][frame]?);
        let id = format!(
            "joint {} - {}: {}",
            printable(&pair.reference),
            printable(&pair.moving),
            printable(&pair.verdict.joint)
        );
        let Some(direction) = axis.direction else {
            let pose = placed(&Pose::from_parts(axis.point.coords.into(), UnitQuaternion::identity()));
            let ball = json!([{"pose": pose, "size": triple(&Vector3::repeat(0.06 * size)), "color": colour}]);
            return Some(entity(&id, stamp, &[("spheres", ball)]));
        };
        // Arrows point along x.
        let turn = UnitQuaternion::rotation_between_axis(&Vector3::x_axis(), &direction);
        let turn = turn.unwrap_or_else(|| {
            UnitQuaternion::from_axis_angle(&Unit::new_normalize(Vector3::z()), std::f64::consts::PI)
        });
        let length = if pair.kind() == JointKind::Prismatic { 0.6 * size } else { 0.8 * size };
        let start = axis.point - direction.into_inner() * (0.5 * length);
        let arrow = json!([{
            "pose": placed(&Pose::from_parts(start.coords.into(), turn)), "color": colour,
            "shaft_length": 0.9 * length, "shaft_diameter": 0.015 * size, "head_length": 0.1 * length, "head_diameter": 0.04 * size,
        }]);
        Some(entity(&id, stamp, &[("arrows", arrow)]))
    };
    tree.filter_map(joint).collect()
}

#[cfg(test)]
mod tests {
    use jointscope_detection::{Configuration, Detector};
    use jointscope_models::Catalog;
    use jointscope_scenes::{SceneOptions, simulate};

    use super::*;

    #[test]
    fn every_frame_has_a_message_on_every_topic() {
        let recording = simulate("revolute", &SceneOptions::default()).expect("a scene").recording;
        let configuration = Configuration::parse("", &Catalog::linked().expect("unique names")).expect("valid");
        let detection = Detector::new(configuration).detect(recording.clone(), None).expect("bodies");
        let log = to_mcap(&Report { detection: &detection, recording: &recording, settings: "" }).expect("written");
        let mut count = BTreeMap::<String, usize>::new();
        for message in mcap::MessageStream::new(&log).expect("a log") {
            let message = message.expect("a message");
            let content: Value = serde_json::from_slice(&message.data).expect("JSON");
            let topic = message.channel.topic.clone();
            match topic.as_str() {
                "/scene" => {
                    let arrows = |entity: &Value| entity["arrows"].as_array().map_or(0, Vec::len);
                    let spheres = |entity: &Value| entity["spheres"].as_array().map_or(0, Vec::len);
                    let entities = content["entities"].as_array().expect("a list");
                    assert_eq!(entities.iter().map(arrows).sum::<usize>(), 1, "one axis");
                    assert!(entities.iter().map(spheres).sum::<usize>() > 10, "features");
                }
                "/tf" => assert_eq!(content["transforms"].as_array().map(Vec::len), Some(2)),
                _ => assert_eq!(content["joints"][0]["positions"].as_array().map(Vec::len), Some(1)),
            }
            *count.entry(topic).or_default() += 1;
        }
        assert_eq!(count.len(), 3);
        assert!(count.values().all(|messages| *messages == detection.frames), "{count:?}");
    }
}
