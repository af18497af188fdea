//! Every model that is linked conforms, and the suite sees what does not.

use std::{
    panic::catch_unwind,
    sync::atomic::{AtomicU32, Ordering},
};

use jointscope_models::{
    Axis, AxisUncertainty, Catalog, Confidence, Evidence, FitError, Joint, JointFit, JointModel, JointModelPlugin,
    Mobility, Origin, Positions, conformance,
};
use jointscope_motion::RelativeMotion;
use nalgebra::{Unit, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

#[test]
fn every_linked_model_conforms() {
    let catalog = Catalog::linked().expect("unique names");
    // All complaints at once, not the first only.
    let complaints: Vec<String> = catalog
        .iter()
        .filter_map(|plugin| catch_unwind(|| conformance::check(plugin)).err())
        .map(|panic| panic.downcast_ref::<String>().expect("a message").clone())
        .collect();
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
    assert!(catalog.names().count() >= 12, "the thesis's models and the mechanisms are linked");
    conformance::check_linked("thesis-rigid");
}

/// The suite's complaint about a model.
fn complaint(plugin: &'static JointModelPlugin) -> String {
    let panic = catch_unwind(|| conformance::check(plugin)).expect_err("a violation");
    panic.downcast_ref::<String>().expect("a message").clone()
}

const HERE: Origin = Origin { package: "test", version: "0" };

/// Declares a model by the answer it gives, and checks that the suite complains about it.
macro_rules! refused {
    ($test:ident, $property:literal, |$motion:ident| $answer:expr) => {
        refused!($test, $property, states_evidence: false, |$motion| $answer);
    };
    ($test:ident, $property:literal, states_evidence: $states:literal, |$motion:ident| $answer:expr) => {
        #[test]
        fn $test() {
            /// A model with a fault.
            #[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
            #[serde(default, deny_unknown_fields)]
            struct Faulty {}
            impl JointModel for Faulty {
                fn fit(&self, $motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
                    $answer
                }

                fn states_evidence(&self) -> bool {
                    $states
                }

                fn parts(&self) -> &'static [&'static str] {
                    &["ratio", "times"]
                }
            }
            static PLUGIN: JointModelPlugin = JointModelPlugin::of::<Faulty>("faulty", "has a fault", HERE);
            let message = complaint(&PLUGIN);
            let expected = concat!("joint model `faulty` violates \"", $property, "\": ");
            assert!(message.starts_with(expected), "{message}");
        }
    };
}

fn sure() -> JointFit {
    JointFit::new(Confidence::ONE, Joint::default())
}

fn with_axis(direction: Unit<Vector3<f64>>, positions: Option<Positions>, motion: &RelativeMotion<'_>) -> JointFit {
    let axis = Axis { point: motion.first_centroid(), direction: Some(direction), pitch: None };
    JointFit::new(Confidence::ONE, Joint { axis: Some(axis), positions })
}

refused!(a_part_that_is_not_announced_is_found, "parts are announced", |_motion| Ok(sure().with_part("odd", 1.0)));

refused!(a_nan_part_is_found, "no part is NaN", |_motion| Ok(sure().with_part("ratio", f64::NAN)));

refused!(
    a_score_that_depends_on_the_world_is_found,
    "the choice of the recording's coordinates does not matter",
    |motion| {
        let confidence = if motion.first_centroid().x > 2.0 { Confidence::ONE } else { Confidence::ZERO };
        Ok(JointFit::new(confidence, Joint::default()))
    }
);

refused!(an_axis_that_does_not_turn_is_found, "axes turn with the recording's coordinates", |motion| Ok(with_axis(
    Vector3::z_axis(),
    None,
    motion
)));

refused!(a_score_by_the_order_of_features_is_found, "the order of features does not matter", |motion| {
    let first = motion.trajectories().get(0).points;
    let distance = first.iter().map(|p| (p - motion.first_centroid()).norm()).sum::<f64>();
    Ok(JointFit::new(Confidence::new((-distance).exp())?, Joint::default()))
});

refused!(a_score_by_the_number_of_features_is_found, "features that are there twice do not matter", |motion| {
    Ok(JointFit::new(Confidence::new(1.0 / motion.trajectories().len() as f64)?, Joint::default()))
});

refused!(a_panic_is_found, "no input makes a model panic", |motion| {
    assert!(motion.frames().len() > 1, "a motion");
    Ok(sure())
});

refused!(a_confidence_above_one_is_found, "confidences lie in [0, 1]", |_motion| Ok(JointFit::new(
    Confidence::new(1.5)?,
    Joint::default()
)));

refused!(a_negative_residual_is_found, "a residual is finite and not negative", |_motion| Ok(
    sure().with_residual(-1.0)
));

refused!(a_direction_that_is_no_unit_vector_is_found, "directions are unit vectors", |motion| Ok(with_axis(
    Unit::new_unchecked(Vector3::new(1.0, 1.0, 0.0)),
    None,
    motion
)));

refused!(positions_of_used_frames_only_are_found, "positions have one row per frame of the recording", |motion| {
    let rows = motion.frames().iter().map(|_| Some(0.0));
    Ok(JointFit::new(Confidence::ONE, Joint { axis: None, positions: Some(Positions::of_one_freedom(rows)) }))
});

refused!(positions_where_nothing_is_seen_are_found, "frames that do not show both bodies have no position", |motion| {
    let rows = (0..motion.recording_frames()).map(|_| Some(0.0));
    Ok(JointFit::new(Confidence::ONE, Joint { axis: None, positions: Some(Positions::of_one_freedom(rows)) }))
});

refused!(positions_that_start_anywhere_are_found, "positions start at 0", |motion| {
    let rows = (0..motion.recording_frames()).map(|frame| motion.frames().contains(&frame).then_some(0.5));
    Ok(JointFit::new(Confidence::ONE, Joint { axis: None, positions: Some(Positions::of_one_freedom(rows)) }))
});

/// Evidence of a model that is right about everything.
const SOUND: Evidence = Evidence {
    chi_squared: 100.0,
    freedom: 100.0,
    configuration_cost: -1.0,
    prior_cost: -1.0,
    mobility: Mobility { turns: 0, slides: 0, parameters: 6, advances: false, roams: false },
    observations: 288.0,
    correlation_time: 1.0,
    departure: None,
};

fn stating(evidence: Evidence) -> JointFit {
    let mut fit = sure();
    fit.evidence = Some(evidence);
    fit
}

fn with_uncertainty(mut fit: JointFit, angle: Option<f64>, distance: Option<f64>) -> JointFit {
    fit.axis_uncertainty = Some(AxisUncertainty { angle, distance });
    fit
}

refused!(evidence_that_was_not_announced_is_found, "evidence is stated as announced", |_motion| Ok(stating(SOUND)));

refused!(
    evidence_that_is_announced_and_not_stated_is_found,
    "evidence is stated as announced",
    states_evidence: true,
    |_motion| Ok(sure())
);

refused!(negative_evidence_is_found, "evidence is sound", states_evidence: true, |_motion| {
    Ok(stating(Evidence { chi_squared: -1e-3, ..SOUND }))
});

refused!(evidence_that_is_no_number_is_found, "evidence is sound", states_evidence: true, |_motion| {
    Ok(stating(Evidence { configuration_cost: f64::NAN, ..SOUND }))
});

refused!(unsound_evidence_of_another_explanation_is_found, "evidence is sound", states_evidence: true, |_motion| {
    let mut fit = stating(SOUND);
    fit.alternatives.push(Evidence { prior_cost: f64::INFINITY, ..SOUND });
    Ok(fit)
});

refused!(an_uncertainty_without_end_is_found, "an axis's uncertainty is finite", |motion| {
    Ok(with_uncertainty(with_axis(Vector3::z_axis(), None, motion), Some(0.1), Some(f64::INFINITY)))
});

refused!(an_uncertainty_of_no_axis_is_found, "an uncertainty is that of an axis", |_motion| Ok(with_uncertainty(
    sure(),
    None,
    Some(0.1)
)));

refused!(an_uncertainty_of_no_direction_is_found, "a direction's uncertainty is that of a direction", |motion| {
    let centre = Axis { point: motion.first_centroid(), direction: None, pitch: None };
    let fit = JointFit::new(Confidence::ONE, Joint { axis: Some(centre), positions: None });
    Ok(with_uncertainty(fit, Some(0.1), Some(0.1)))
});

refused!(
    an_axis_that_does_not_turn_as_surely_as_it_says_is_found,
    "axes turn with the recording's coordinates",
    |motion| Ok(with_uncertainty(with_axis(Vector3::z_axis(), None, motion), Some(0.01), None))
);

#[test]
fn an_axis_that_says_it_is_unknown_may_be_anywhere() {
    /// A model that knows nothing of its axis, and says so.
    #[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
    #[serde(default, deny_unknown_fields)]
    struct Vague {}
    impl JointModel for Vague {
        fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
            Ok(with_uncertainty(with_axis(Vector3::z_axis(), None, motion), Some(1.0), None))
        }
    }
    static PLUGIN: JointModelPlugin = JointModelPlugin::of::<Vague>("vague", "knows no axis", HERE);
    conformance::check(&PLUGIN);
}

static ASKED: AtomicU32 = AtomicU32::new(0);

refused!(an_answer_that_changes_is_found, "the same input has the same answer", |_motion| {
    let times = ASKED.fetch_add(1, Ordering::Relaxed);
    Ok(sure().with_part("times", f64::from(times)))
});

/// A model whose settings are not described.
#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Undescribed {
    reach: f64,
}

impl JointModel for Undescribed {
    fn fit(&self, _motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        Ok(sure())
    }
}

#[test]
fn settings_without_words_are_found() {
    static PLUGIN: JointModelPlugin = JointModelPlugin::of::<Undescribed>("undescribed", "says nothing", HERE);
    let message = complaint(&PLUGIN);
    assert_eq!(message, "joint model `undescribed` violates \"every setting is described\": `reach` is not");
}

/// A model whose settings do not come back from text.
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Forgetful {
    /// Never written, so that the default is all there is.
    #[serde(skip_serializing)]
    hidden: f64,
    /// Written as something else.
    #[serde(serialize_with = "twice")]
    reach: f64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn twice<S: serde::Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(2.0 * value)
}

impl Default for Forgetful {
    fn default() -> Self {
        Self { hidden: 1.0, reach: 1.0 }
    }
}

impl JointModel for Forgetful {
    fn fit(&self, _motion: &RelativeMotion<'_>) -> Result<JointFit, FitError> {
        Ok(sure())
    }
}

#[test]
fn settings_that_do_not_come_back_are_found() {
    static PLUGIN: JointModelPlugin = JointModelPlugin::of::<Forgetful>("forgetful", "forgets", HERE);
    let message = complaint(&PLUGIN);
    assert!(message.contains("\"default settings can be written as TOML and read back\""), "{message}");
}

#[test]
fn names_and_summaries_must_be_fit_to_print() {
    static NAME: JointModelPlugin = JointModelPlugin::of::<Forgetful>("My Joint", "a joint", HERE);
    static SUMMARY: JointModelPlugin = JointModelPlugin::of::<Forgetful>("my-joint", "two\nlines", HERE);
    assert!(complaint(&NAME).contains("names are lower-case words joined by hyphens"));
    assert!(complaint(&SUMMARY).contains("a summary is one line"));
}

#[test]
fn an_unknown_name_lists_what_is_linked() {
    let panic = catch_unwind(|| conformance::check_linked("hinge")).expect_err("unknown");
    let message = panic.downcast_ref::<String>().expect("a message");
    assert!(message.contains("`hinge`") && message.contains("thesis-revolute"), "{message}");
}
