//! The result as JSON, format `jointscope-detection`.

use std::collections::BTreeMap;

use jointscope_detection::{Detection, Explanation, ModelFinding, PairDetection, PairScale, ScaleCurve};
use jointscope_models::motion::DepthGain;
use jointscope_models::{Axis, Positions};
use nalgebra::Vector3;
use serde::{Serialize, Serializer, ser::SerializeMap};

/// The detection as JSON text, ending with a newline.
///
/// *Convention.* Metres, seconds, radians. Keys that do not apply are null, never missing; numbers that are not finite
/// are null. Keys stand in a fixed order, so that equal detections give equal bytes.
///
/// # Panics
/// Never: all keys are strings, and every number has a text.
pub fn to_json(detection: &Detection) -> String {
    let result = Result {
        format: "jointscope-detection",
        version: 1,
        recording: Recording {
            bodies: &detection.bodies,
            frames: detection.frames,
            duration: detection.duration,
            scales: detection.scales.as_deref(),
        },
        pairs: detection.pairs.iter().map(Pair::of).collect(),
        structure: Structure::of(detection),
    };
    let mut text = serde_json::to_string_pretty(&result).expect("keys are strings, and non-finite numbers become null");
    text.push('\n');
    text
}

#[derive(Serialize)]
struct Result<'d> {
    format: &'static str,
    version: u32,
    recording: Recording<'d>,
    pairs: Vec<Pair<'d>>,
    structure: Structure<'d>,
}

#[derive(Serialize)]
struct Recording<'d> {
    bodies: &'d [String],
    frames: usize,
    duration: Option<f64>,
    scales: Option<&'d [f64]>,
}

#[derive(Serialize)]
struct Pair<'d> {
    reference: &'d str,
    moving: &'d str,
    joint: &'d str,
    confidence: f64,
    determined: bool,
    confidences: InOrder<'d>,
    axis: Option<AxisParts>,
    axis_uncertainty: Option<AxisUncertainty>,
    positions: Option<Vec<Option<Coordinates>>>,
    position_range: Option<Ranges>,
    axis_in_moving: Option<AxisParts>,
    scale: Option<Scale<'d>>,
    depth_gain: Option<Gains>,
    noise: Noise,
    frames_used: usize,
    models: BTreeMap<&'d str, Model<'d>>,
    notes: &'d [String],
    explanation: Option<Explained<'d>>,
}

#[derive(Serialize)]
struct Explained<'d> {
    rule: &'static str,
    quantities: Vec<Quantity>,
    joints: Vec<Account<'d>>,
    reasons: &'d [String],
    by_evidence: Option<Box<Self>>,
}

#[derive(Serialize)]
struct Quantity {
    name: &'static str,
    meaning: &'static str,
}

#[derive(Serialize)]
struct Account<'d> {
    joint: &'d str,
    values: Values<'d>,
    arithmetic: &'d str,
}

/// Quantities by name, in their order.
struct Values<'d>(&'d [jointscope_detection::Quantity], &'d [Option<f64>]);

impl Serialize for Values<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        self.0.iter().zip(self.1).try_for_each(|(quantity, value)| map.serialize_entry(quantity.name, value))?;
        map.end()
    }
}

impl<'d> Explained<'d> {
    fn of(explanation: &'d Explanation) -> Self {
        let Explanation { rule, quantities, accounts, reasons, by_evidence } = explanation;
        let account = |account: &'d jointscope_detection::Account| Account {
            joint: &account.joint,
            values: Values(quantities, &account.values),
            arithmetic: &account.arithmetic,
        };
        Self {
            rule: rule.word(),
            quantities: quantities.iter().map(|q| Quantity { name: q.name, meaning: q.meaning }).collect(),
            joints: accounts.iter().map(account).collect(),
            reasons,
            by_evidence: by_evidence.as_deref().map(|explanation| Box::new(Self::of(explanation))),
        }
    }
}

#[derive(Serialize)]
struct AxisParts {
    point: [f64; 3],
    direction: Option<[f64; 3]>,
    pitch: Option<f64>,
}

#[derive(Serialize)]
struct AxisUncertainty {
    angle_deg: Option<f64>,
    distance: Option<f64>,
}

#[derive(Serialize)]
struct Scale<'d> {
    factor: Option<f64>,
    standard_error: Option<f64>,
    observable: bool,
    signal: Option<f64>,
    closure_error: Option<f64>,
    curve: Option<Curve<'d>>,
}

#[derive(Serialize)]
struct Curve<'d> {
    body: &'d str,
    factors: &'d [f64],
    scores: &'d BTreeMap<String, Vec<f64>>,
}

impl<'d> Scale<'d> {
    fn of(scale: &'d PairScale) -> Self {
        let curve = |curve: &'d ScaleCurve| Curve { body: &curve.body, factors: &curve.factors, scores: &curve.scores };
        Self {
            factor: scale.factor,
            standard_error: scale.standard_error,
            observable: scale.observable,
            signal: scale.signal,
            closure_error: scale.closure_error,
            curve: scale.curve.as_ref().map(curve),
        }
    }
}

#[derive(Serialize)]
struct Gains {
    reference: f64,
    moving: f64,
    standard_error: OfBoth<Option<f64>>,
    observable: OfBoth<bool>,
}

#[derive(Serialize)]
struct OfBoth<T> {
    reference: T,
    moving: T,
}

#[derive(Serialize)]
struct Noise {
    reference: Option<f64>,
    moving: Option<f64>,
}

#[derive(Serialize)]
struct Model<'d> {
    confidence: f64,
    parts: BTreeMap<&'static str, f64>,
    axis: Option<AxisParts>,
    position_range: Option<Ranges>,
    residual_rms: Option<f64>,
    parameters: Option<usize>,
    log_evidence: Option<f64>,
    error: Option<String>,
    notes: &'d [String],
}

#[derive(Serialize)]
struct Structure<'d> {
    base: &'d str,
    links: Vec<Vec<&'d str>>,
    joints: Vec<Branch<'d>>,
    indirect: Vec<Indirect<'d>>,
    couplings: Vec<Coupling<'d>>,
}

#[derive(Serialize)]
struct Branch<'d> {
    parent: &'d str,
    child: &'d str,
    joint: Option<&'d str>,
    pair: Option<[&'d str; 2]>,
}

#[derive(Serialize)]
struct Indirect<'d> {
    pair: [&'d str; 2],
    way: Vec<[&'d str; 2]>,
    closes_loop: bool,
}

#[derive(Serialize)]
struct Coupling<'d> {
    pair: [&'d str; 2],
    of: [&'d str; 2],
    ratio: f64,
    offset: f64,
}

impl<'d> Structure<'d> {
    fn of(detection: &'d Detection) -> Self {
        let structure = &detection.structure;
        let name = |body: usize| detection.bodies[body].as_str();
        let ends = |pair: usize| [detection.pairs[pair].reference.as_str(), detection.pairs[pair].moving.as_str()];
        let branch = |branch: &jointscope_detection::Branch| Branch {
            parent: name(branch.parent),
            child: name(branch.child),
            joint: branch.pair.map(|pair| detection.pairs[pair].verdict.joint.as_str()),
            pair: branch.pair.map(ends),
        };
        let indirect = |indirect: &jointscope_detection::Indirect| Indirect {
            pair: ends(indirect.pair),
            way: indirect.way.iter().map(|&pair| ends(pair)).collect(),
            closes_loop: indirect.closes_loop,
        };
        let coupling = |coupling: &jointscope_detection::Coupling| Coupling {
            pair: ends(coupling.pair),
            of: ends(coupling.of),
            ratio: coupling.ratio,
            offset: coupling.offset,
        };
        Self {
            base: name(structure.base),
            links: structure
                .links(&detection.pairs)
                .iter()
                .map(|link| link.iter().map(|&body| name(body)).collect())
                .collect(),
            joints: structure.branches.iter().map(branch).collect(),
            indirect: structure.indirect.iter().map(indirect).collect(),
            couplings: structure.couplings.iter().map(coupling).collect(),
        }
    }
}

/// One degree of freedom is a number, several are an array.
#[derive(Serialize)]
#[serde(untagged)]
enum Coordinates {
    One(f64),
    Several(Vec<f64>),
}

#[derive(Serialize)]
#[serde(untagged)]
enum Ranges {
    One([f64; 2]),
    Several(Vec<[f64; 2]>),
}

/// A map that keeps its order.
struct InOrder<'d>(&'d [(String, f64)]);

impl Serialize for InOrder<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        self.0.iter().try_for_each(|(key, value)| map.serialize_entry(key, value))?;
        map.end()
    }
}

impl<'d> Pair<'d> {
    fn of(pair: &'d PairDetection) -> Self {
        Self {
            reference: &pair.reference,
            moving: &pair.moving,
            joint: &pair.verdict.joint,
            confidence: pair.verdict.confidence,
            determined: pair.determined,
            confidences: InOrder(&pair.verdict.confidences),
            axis: pair.axis.map(axis_parts),
            axis_uncertainty: pair.axis_uncertainty.map(|uncertainty| AxisUncertainty {
                angle_deg: uncertainty.angle.map(f64::to_degrees),
                distance: uncertainty.distance,
            }),
            positions: pair.positions.as_ref().map(coordinates),
            position_range: pair.positions.as_ref().and_then(ranges),
            axis_in_moving: pair.axis_in_moving.map(axis_parts),
            scale: pair.scale.as_ref().map(Scale::of),
            depth_gain: pair.depth_gain.map(gains),
            noise: Noise { reference: pair.noise_reference.position, moving: pair.noise_moving.position },
            frames_used: pair.frames_used,
            models: pair.models.iter().map(|(name, finding)| (name.as_str(), Model::of(finding))).collect(),
            notes: &pair.notes,
            explanation: pair.explanation.as_ref().map(Explained::of),
        }
    }
}

impl<'d> Model<'d> {
    fn of(finding: &'d ModelFinding) -> Self {
        match finding {
            Ok(fit) => Self {
                confidence: fit.confidence.value(),
                parts: fit.parts.clone(),
                axis: fit.joint.axis.map(axis_parts),
                position_range: fit.joint.positions.as_ref().and_then(ranges),
                residual_rms: fit.residual_rms,
                parameters: fit.evidence.map(|evidence| evidence.mobility.parameters),
                log_evidence: fit.evidence.map(|e| -0.5 * e.noise_cost()),
                error: None,
                notes: &fit.notes,
            },
            Err(error) => Self {
                confidence: 0.0,
                parts: BTreeMap::new(),
                axis: None,
                position_range: None,
                residual_rms: None,
                parameters: None,
                log_evidence: None,
                error: Some(error.to_string()),
                notes: &[],
            },
        }
    }
}

fn gains([reference, moving]: [DepthGain; 2]) -> Gains {
    Gains {
        reference: reference.gain,
        moving: moving.gain,
        standard_error: OfBoth { reference: reference.standard_error, moving: moving.standard_error },
        observable: OfBoth { reference: reference.observable, moving: moving.observable },
    }
}

fn axis_parts(axis: Axis) -> AxisParts {
    // Adding 0 takes the sign off a zero.
    let coordinates = |xyz: Vector3<f64>| xyz.map(|x| x + 0.0).into();
    AxisParts {
        point: coordinates(axis.point.coords),
        direction: axis.direction.map(|direction| coordinates(direction.into_inner())),
        pitch: axis.pitch,
    }
}

fn coordinates(positions: &Positions) -> Vec<Option<Coordinates>> {
    let one_or_several = |row: &[f64]| match row {
        &[one] => Coordinates::One(one),
        several => Coordinates::Several(several.to_vec()),
    };
    positions.iter().map(|row| row.map(one_or_several)).collect()
}

fn ranges(positions: &Positions) -> Option<Ranges> {
    let ranges = positions.ranges()?;
    Some(if let &[one] = ranges.as_slice() { Ranges::One(one) } else { Ranges::Several(ranges) })
}
