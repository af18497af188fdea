//! Properties that every joint model must have, checked by one call in a test of the crate that defines it.
//!
//! ```no_run
//! // use my_joints as _;
//! jointscope_models::conformance::check_linked("leash");
//! ```
//!
//! The suite makes its own motions: bodies that are rigidly connected, slide, turn, screw, move in a plane or freely,
//! and rest; seen as points, with and without missing samples, as poses, and as a single point; and inputs that leave
//! nothing to judge. It knows nothing of what a model is for. Checked are
//!
//! * the plugin: name and summary; defaults that can be written as TOML and read back; unknown keys refused; every
//!   setting described, and with a default;
//! * every answer: confidence in [0, 1], no NaN anywhere, unit directions, one row of positions per frame of the
//!   recording, from 0 at the first, and none in frames that do not count; the same answer when asked again;
//! * what an answer says about itself: [`Evidence`] if the model [states](JointModel::states_evidence) it, and only
//!   then, in numbers that a rule can compare; an uncertainty of the axis that is finite;
//! * invariance: the confidence depends neither on the choice of the recording's coordinates, nor on the order of
//!   features, nor, unless the model [counts observations](JointModel::counts_observations), on whether every feature is
//!   there twice; an axis turns with the coordinates;
//! * bad input: few frames, features or motion, or huge coordinates, give an answer or an error, never a panic.
//!
//! *Axes that the motion does not determine.* A hinge is fitted to a slide as well, and an iterative fit ends anywhere in
//! a flat valley. A model that states an [uncertainty](crate::AxisUncertainty) is therefore held to a hundredth of it
//! where that is more than rounding, and not at all where the axis may be wrong by 0.05 rad or 0.1 m, or where bodies
//! that do not move show an axis of their noise; its confidence may then change by 0.05. Where its own evidence says that
//! noise does not explain what is left (`χ²` above 1.3 per degree of freedom), the fit is one of many bad ones, and
//! nothing is compared. A model that states no uncertainty is held to rounding wherever it is sure.

mod inputs;

use std::panic::{AssertUnwindSafe, catch_unwind};

use jointscope_motion::{BodyMotion, MotionSettings, Pose, RelativeMotion};
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use crate::{
    Axis, AxisUncertainty, Catalog, Departure, Evidence, FitError, JointFit, JointModel, JointModelPlugin, Positions,
    settings::{self, SettingsError},
};
use inputs::{Input, bad_inputs, motions};

/// Change of a confidence that rounding may cause: coordinates are rounded to 1e-15 m, and a badly conditioned fit or
/// an iteration that stops early magnifies that. A sample that changes sides would count for 1e-3 or more, but noise
/// keeps the samples of these motions from lying on an edge exactly.
const CONFIDENCE: f64 = 1e-6;
/// Change of an axis, likewise, where the model is sure of it: radians and metres.
const GEOMETRY: f64 = 1e-6;
/// Confidence from which an axis must mean something. Below, it may be ill-conditioned without limit.
const SURE: f64 = 0.5;
/// Change of an axis, as a share of its stated uncertainty, that an iterative fit may leave where it ends.
const UNSETTLED: f64 = 0.01;
/// Uncertainty from which an axis is one of noise, with several places where a fit may end: of its direction, radians,
/// and of its place, metres. Where a motion of the suite shows an axis, it is known ten times as well.
const VAGUE_ANGLE: f64 = 0.05;
const VAGUE_DISTANCE: f64 = 0.1;
/// Change of a confidence where the fit may end in several places that explain the motion nearly alike.
const UNDETERMINED: f64 = 0.05;
/// `χ²` per degree of freedom from which noise does not explain what a model leaves: the suite's motions have a hundred
/// degrees of freedom or more, whose mean has a standard deviation of 0.14 at most.
const UNEXPLAINED: f64 = 1.3;
/// Departure of a direction's length from 1, and of the first position from 0: rounding.
const ROUNDING: f64 = 1e-9;

/// Checks a joint model of a name among all that are linked.
///
/// # Panics
/// If there is no such model, or it lacks a property; the message names the model and the property.
pub fn check_linked(name: &str) {
    let catalog = Catalog::linked().unwrap_or_else(|error| panic!("{error}"));
    let Some(plugin) = catalog.get(name) else {
        panic!("no joint model `{name}` is linked; linked are {:?}", catalog.names().collect::<Vec<_>>())
    };
    check(plugin);
}

/// Checks a joint model.
///
/// # Panics
/// If the model lacks a property; the message names the model, the property, the input and what was found.
pub fn check(plugin: &'static JointModelPlugin) {
    check_plugin(plugin);
    check_settings(plugin);
    let model =
        Suite { plugin, model: build(plugin, "").unwrap_or_else(|e| fail(plugin, "defaults build", &e.message)) };
    for input in motions() {
        let Some(fit) = model.fit(&input) else { fail(plugin, "the suite's own motions are usable", &input.name) };
        model.repeats(&input, &fit);
        model.follows_the_world(&input, &fit);
        model.ignores_order(&input, &fit);
        model.ignores_repetition(&input, &fit);
    }
    for input in bad_inputs() {
        model.fit(&input);
    }
}

fn fail(plugin: &JointModelPlugin, property: &str, detail: &str) -> ! {
    panic!("joint model `{}` violates \"{property}\": {detail}", plugin.name)
}

fn require(plugin: &JointModelPlugin, property: &str, holds: bool, detail: impl FnOnce() -> String) {
    if !holds {
        fail(plugin, property, &detail());
    }
}

fn check_plugin(plugin: &JointModelPlugin) {
    let kebab = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    let name = plugin.name;
    let sound = !name.is_empty() && name.chars().all(kebab) && !name.starts_with('-') && !name.ends_with('-');
    require(plugin, "names are lower-case words joined by hyphens", sound, || format!("found `{name}`"));
    let line = !plugin.summary.trim().is_empty() && !plugin.summary.contains('\n');
    require(plugin, "a summary is one line", line, || format!("found {:?}", plugin.summary));
}

fn build(plugin: &JointModelPlugin, text: &str) -> Result<Box<dyn JointModel>, SettingsError> {
    let table = DeTable::parse(text).map_err(|error| SettingsError::at(0..0, error.message()))?;
    plugin.build(Spanned::new(table.span(), DeValue::Table(table.into_inner())))
}

fn check_settings(plugin: &JointModelPlugin) {
    let defaults = plugin.default_settings();
    let property = "default settings can be written as TOML and read back";
    let text = toml::to_string(&defaults).unwrap_or_else(|error| fail(plugin, property, &error.to_string()));
    let models = ["", &text].map(|text| build(plugin, text).unwrap_or_else(|e| fail(plugin, property, &e.message)));
    let [left_out, written] = models.map(|model| format!("{model:?}"));
    require(plugin, property, left_out == written, || format!("{left_out} became {written}"));

    let property = "unknown settings are refused, pointing at them";
    let extended = format!("no_such_setting = 1\n{text}");
    match build(plugin, &extended) {
        Ok(model) => fail(plugin, property, &format!("`no_such_setting = 1` gave {model:?}")),
        Err(error) => {
            let place = extended.get(error.span.clone());
            let found = || format!("\"{error}\" points at {place:?}");
            require(plugin, property, place.is_some_and(|place| place.contains("no_such_setting")), found);
        }
    }

    let schema = plugin.schema();
    let described = settings::describe(&schema, &defaults);
    for setting in &described {
        let has_words = !setting.description.trim().is_empty();
        require(plugin, "every setting is described", has_words, || format!("`{}` is not", setting.key));
        let optional = schema.as_value()["properties"][&setting.key].to_string().contains("\"null\"");
        let has_default = optional || defaults.contains_key(&setting.key);
        require(plugin, "every setting has a default", has_default, || format!("`{}` has none", setting.key));
    }
    for key in defaults.keys() {
        let known = described.iter().any(|setting| setting.key == *key);
        require(plugin, "every setting is described", known, || format!("`{key}` is not in the schema"));
    }
}

/// A model under test.
struct Suite {
    plugin: &'static JointModelPlugin,
    model: Box<dyn JointModel>,
}

impl Suite {
    /// The model's answer, checked for what every answer must have; `None` where the bodies cannot be related, so that
    /// no model is asked.
    fn fit(&self, input: &Input) -> Option<Result<JointFit, FitError>> {
        let settings = MotionSettings::default();
        let bodies = [input.reference.body("reference"), input.moving.body("moving")];
        let [reference, moving] = [0, 1].map(|i| BodyMotion::of(&bodies[i], &settings));
        let motion = RelativeMotion::between(&reference, &moving).ok()?;
        let Ok(fit) = catch_unwind(AssertUnwindSafe(|| self.model.fit(&motion))) else {
            self.fail("no input makes a model panic", input, "it panicked")
        };
        match &fit {
            Ok(fit) => self.check_answer(input, &motion, fit),
            Err(error @ FitError::NotAConfidence(_)) => {
                self.fail("confidences lie in [0, 1]", input, &error.to_string());
            }
            Err(_) => {}
        }
        Some(fit)
    }

    fn check_answer(&self, input: &Input, motion: &RelativeMotion<'_>, fit: &JointFit) {
        let require = |property: &str, holds: bool, detail: String| {
            if !holds {
                self.fail(property, input, &detail);
            }
        };
        for (name, value) in &fit.parts {
            require("no part is NaN", !value.is_nan(), format!("`{name}` is"));
            let known = self.model.parts();
            require("parts are announced", known.contains(name), format!("`{name}` is not in `parts`: {known:?}"));
        }
        let stated = fit.evidence.is_some();
        let detail = || format!("{stated}, but `states_evidence` says {}", self.model.states_evidence());
        require("evidence is stated as announced", stated == self.model.states_evidence(), detail());
        require("only what states evidence states another", stated || fit.alternatives.is_empty(), String::new());
        for evidence in fit.evidence.iter().chain(&fit.alternatives) {
            require("evidence is sound", is_sound(evidence), format!("{evidence:?}"));
        }
        if let Some(AxisUncertainty { angle, distance }) = fit.axis_uncertainty {
            let sound = angle.into_iter().chain(distance).all(|x| x.is_finite() && x >= 0.0);
            require("an axis's uncertainty is finite", sound, format!("{:?}", fit.axis_uncertainty));
            let axis = fit.joint.axis;
            require("an uncertainty is that of an axis", axis.is_some(), "there is no axis".into());
            let directed = axis.is_some_and(|axis| axis.direction.is_some());
            let says = format!("direction: {directed}, uncertainty {angle:?}");
            require("a direction's uncertainty is that of a direction", directed || angle.is_none(), says);
        }
        let rms = fit.residual_rms.unwrap_or(0.0);
        require("a residual is finite and not negative", rms >= 0.0 && rms.is_finite(), format!("found {rms}"));
        let (here, there) = (fit.joint.axis.is_some(), fit.axis_in_moving.is_some());
        require("an axis in the moving body is that of the joint", here || !there, "the joint has none".into());
        for Axis { point, direction, pitch } in fit.joint.axis.into_iter().chain(fit.axis_in_moving) {
            let finite = point.iter().all(|c| c.is_finite()) && pitch.unwrap_or(0.0).is_finite();
            require("an axis is finite", finite, format!("point {point}, pitch {pitch:?}"));
            let length = direction.map_or(1.0, |direction| direction.norm());
            let says = format!("length {length}, where 1 to within {ROUNDING:e} is needed");
            require("directions are unit vectors", (length - 1.0).abs() <= ROUNDING, says);
        }
        if let Some(positions) = &fit.joint.positions {
            let rows: Vec<_> = positions.iter().collect();
            let expected = motion.recording_frames();
            let property = "positions have one row per frame of the recording";
            require(property, rows.len() == expected, format!("{} rows for {expected} frames", rows.len()));
            let beside = (0..expected).find(|frame| rows[*frame].is_some() && !motion.frames().contains(frame));
            let property = "frames that do not show both bodies have no position";
            require(property, beside.is_none(), format!("frame {} has one", beside.unwrap_or_default()));
            let infinite = rows.iter().flatten().flat_map(|row| row.iter()).find(|q| !q.is_finite());
            require("positions are finite", infinite.is_none(), format!("found {infinite:?}"));
            if let (1, Some(&[first])) = (positions.freedoms(), rows.iter().flatten().next()) {
                let says = format!("the first is {first}, where 0 to within {ROUNDING:e} is needed");
                require("positions start at 0", first.abs() <= ROUNDING, says);
            }
        }
    }

    fn repeats(&self, input: &Input, fit: &Result<JointFit, FitError>) {
        // Positions where nothing is seen are NaN, which equals nothing; its text does.
        let [first, second] = [Some(fit), self.fit(input).as_ref()].map(|fit| format!("{fit:?}"));
        if first != second {
            self.fail("the same input has the same answer", input, &format!("{first}, then {second}"));
        }
    }

    /// Rotates and moves the recording's coordinates.
    fn follows_the_world(&self, input: &Input, fit: &Result<JointFit, FitError>) {
        let property = "the choice of the recording's coordinates does not matter";
        let turn = UnitQuaternion::new(Vector3::new(1.3, -0.8, 1.7));
        let world = Pose::from_parts(Translation3::new(3.0, -2.0, 5.0), turn);
        let moved = self.fit(&input.map(|seen| seen.moved(&world)));
        let Some((before, after)) = self.same_confidence(property, input, fit, moved) else { return };
        if before.confidence.value() < SURE {
            return;
        }
        let Some(allowed) = Allowed::of(input, &before) else { return };
        let rms = [&before, &after].map(|fit| fit.residual_rms.unwrap_or(0.0));
        if (rms[0] - rms[1]).abs() > GEOMETRY {
            let change = format!("the residual of {} m became {} m", rms[0], rms[1]);
            self.fail(property, input, &format!("{change}, where a change of {GEOMETRY:e} m is allowed"));
        }
        let property = "axes turn with the recording's coordinates";
        match (before.joint.axis.map(|axis| axis.seen_from(&world)), after.joint.axis) {
            (None, None) => {}
            (Some(expected), Some(found)) => {
                let off = axes_apart(&expected, &found);
                if !off.is_some_and(|off| off.angle <= allowed.angle && off.distance <= allowed.distance) {
                    let apart = format!("apart by {off:?}, where {allowed:?} is allowed");
                    self.fail(property, input, &format!("{expected:?} expected, {found:?} found, {apart}"));
                }
                // Along the opposite direction the joint moves backwards.
                let along = expected.direction.zip(found.direction).map_or(1.0, |(a, b)| a.dot(&b).signum());
                let allowed = allowed.angle.max(allowed.distance);
                if !positions_agree(before.joint.positions.as_ref(), after.joint.positions.as_ref(), along, allowed) {
                    let says = format!("they changed by more than {allowed:e} rad or m, which is allowed");
                    self.fail("positions do not depend on the recording's coordinates", input, &says);
                }
            }
            (expected, found) => self.fail(property, input, &format!("{expected:?} expected, {found:?} found")),
        }
    }

    fn ignores_order(&self, input: &Input, fit: &Result<JointFit, FitError>) {
        let reversed = self.fit(&input.map(|seen| seen.choose(|features| (0..features).rev().collect())));
        self.same_confidence("the order of features does not matter", input, fit, reversed);
    }

    fn ignores_repetition(&self, input: &Input, fit: &Result<JointFit, FitError>) {
        if fit.is_ok() && self.model.counts_observations() {
            return;
        }
        // A body of one feature stays as it is: a model may treat that apart, and two that coincide are not one.
        let twice = |features| if features == 1 { vec![0] } else { (0..features).chain(0..features).collect() };
        let doubled = self.fit(&input.map(|seen| seen.choose(twice)));
        self.same_confidence("features that are there twice do not matter", input, fit, doubled);
    }

    /// Both fits, if there are any; errors must be of one kind with and without the change.
    fn same_confidence(
        &self,
        property: &str,
        input: &Input,
        before: &Result<JointFit, FitError>,
        after: Option<Result<JointFit, FitError>>,
    ) -> Option<(JointFit, JointFit)> {
        match (before, after) {
            (Ok(before), Some(Ok(after))) => {
                let confidences = [before, &after].map(|fit| fit.confidence.value());
                let fits = [before, &after];
                let allowed = if !fits.iter().all(|fit| explains(fit)) {
                    1.0
                } else if fits.iter().all(|fit| Allowed::of(input, fit).is_some()) {
                    CONFIDENCE
                } else {
                    UNDETERMINED
                };
                if (confidences[0] - confidences[1]).abs() > allowed {
                    let change = format!("the confidence of {} became {}", confidences[0], confidences[1]);
                    let change = format!("{change}, where a change of {allowed:e} is allowed");
                    self.fail(property, input, &format!("{change}; parts {:?} became {:?}", before.parts, after.parts));
                }
                Some((before.clone(), after))
            }
            (Err(_), Some(Err(_))) => None,
            (before, after) => self.fail(property, input, &format!("{before:?} became {after:?}")),
        }
    }

    fn fail(&self, property: &str, input: &Input, detail: &str) -> ! {
        fail(self.plugin, property, &format!("{}: {detail}", input.name))
    }
}

/// Whether a rule can compare evidence: finite numbers, none negative that counts or measures something.
fn is_sound(evidence: &Evidence) -> bool {
    let Evidence { chi_squared, freedom, configuration_cost, prior_cost, observations, correlation_time, .. } =
        *evidence;
    let counts = [chi_squared, freedom, observations].iter().all(|x| x.is_finite() && *x >= 0.0);
    // What is likely beforehand costs less than nothing, and so may positions that hardly vary.
    let costs = configuration_cost.is_finite() && prior_cost.is_finite();
    let departure = evidence.departure.is_none_or(|Departure { squared, per_noise, adequate, .. }| {
        // Where a model leaves nothing over, play absorbs infinitely more than noise.
        squared.is_finite() && squared >= 0.0 && per_noise >= 0.0 && adequate.is_finite() && adequate > 0.0
    });
    counts && costs && departure && correlation_time.is_finite() && correlation_time >= 1.0
}

/// Whether noise explains what the model leaves, as far as it says.
fn explains(fit: &JointFit) -> bool {
    fit.evidence.is_none_or(|evidence| evidence.chi_squared_per_freedom() < UNEXPLAINED)
}

/// How far axes are apart, or may be.
#[derive(Debug, Clone, Copy)]
struct Allowed {
    /// Radians.
    angle: f64,
    /// Metres, or metres per radian.
    distance: f64,
}

impl Allowed {
    /// How far an axis may be apart, by its stated uncertainty; `None` where it means nothing.
    fn of(input: &Input, fit: &JointFit) -> Option<Self> {
        let Some(AxisUncertainty { angle, distance }) = fit.axis_uncertainty else {
            return Some(Self { angle: GEOMETRY, distance: GEOMETRY });
        };
        let (angle, distance) = (angle.unwrap_or(0.0), distance.unwrap_or(0.0));
        let told = input.moves && explains(fit) && angle < VAGUE_ANGLE && distance < VAGUE_DISTANCE;
        let allowed = |uncertainty: f64| GEOMETRY.max(UNSETTLED * uncertainty);
        told.then(|| Self { angle: allowed(angle), distance: allowed(distance) })
    }
}

/// How far two axes are apart; `None` if they are not of one kind. A prismatic joint means a line and a planar one a
/// plane, which both have a direction and no pitch.
fn axes_apart(a: &Axis, b: &Axis) -> Option<Allowed> {
    let between = b.point - a.point;
    match (a.direction, b.direction) {
        (None, None) => Some(Allowed { angle: 0.0, distance: between.norm() }),
        (Some(along), Some(other)) => {
            let (across, down) = (along.cross(&between).norm(), along.dot(&between).abs());
            let distance = match (a.pitch, b.pitch) {
                (None, None) => across.min(down),
                (Some(a), Some(b)) => across.max((a - b).abs()),
                _ => return None,
            };
            Some(Allowed { angle: along.cross(&other).norm(), distance })
        }
        _ => None,
    }
}

/// Whether joints of one freedom have the same positions to within radians or metres, up to `sign`.
fn positions_agree(a: Option<&Positions>, b: Option<&Positions>, sign: f64, allowed: f64) -> bool {
    let (a, b) = match (a, b) {
        (None, None) => return true,
        (Some(a), Some(b)) => (a, b),
        _ => return false,
    };
    if a.freedoms() != 1 || b.freedoms() != 1 {
        return a.freedoms() == b.freedoms();
    }
    let near = |(a, b): (Option<&[f64]>, Option<&[f64]>)| match (a, b) {
        (Some(&[a]), Some(&[b])) => (a - sign * b).abs() <= allowed,
        (a, b) => a.is_none() && b.is_none(),
    };
    a.iter().zip(b.iter()).all(near)
}
