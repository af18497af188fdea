//! A configuration made in code, without TOML.

use std::sync::Arc;

use jointscope_models::JointModel;
use jointscope_motion::MotionSettings;
use jointscope_scoring::{RuleError, ScoringSettings};

use crate::{Configuration, NamedModel, OutputSettings, RecordingSettings, ScaleSettings, configuration::rule};

/// Makes a [`Configuration`] from models and settings in code.
///
/// ```
/// use jointscope_detection::{Configuration, Detector, ScoringSettings};
/// use jointscope_models::lower_pair::{Free, Prismatic, Revolute};
///
/// let configuration = Configuration::builder()
///     .model("slide", Prismatic::default())
///     .model("hinge", Revolute { sweep: 20.0 })
///     .model("disconnected", Free::default())
///     .scoring(ScoringSettings { lead: 10.0, ..ScoringSettings::default() })
///     .build()?;
/// let detector = Detector::new(configuration);
/// # Ok::<(), jointscope_detection::RuleError>(())
/// ```
#[derive(Debug, Default)]
pub struct ConfigurationBuilder {
    motion: MotionSettings,
    scale: ScaleSettings,
    models: Vec<NamedModel>,
    scoring: ScoringSettings,
}

impl Configuration {
    /// Begins a configuration with default settings and no models.
    pub fn builder() -> ConfigurationBuilder {
        ConfigurationBuilder::default()
    }
}

impl ConfigurationBuilder {
    /// Sets how motion is recovered.
    #[must_use]
    pub fn motion(mut self, motion: MotionSettings) -> Self {
        self.motion = motion;
        self
    }

    /// Sets how unknown scales are treated. The search in closed form needs models that state evidence; joints of others
    /// are judged as they are seen.
    #[must_use]
    pub fn scale(mut self, scale: ScaleSettings) -> Self {
        self.scale = scale;
        self
    }

    /// Adds a model under the name that the rule and results use; one of the same name is replaced.
    #[must_use]
    pub fn model(mut self, name: impl Into<String>, model: impl JointModel + 'static) -> Self {
        let name = name.into();
        self.models.retain(|other| other.name != name);
        self.models.push(NamedModel { kind: name.clone(), name, model: Arc::new(model) });
        self
    }

    /// Sets the rule.
    #[must_use]
    pub fn scoring(mut self, scoring: ScoringSettings) -> Self {
        self.scoring = scoring;
        self
    }

    /// Checks the rule against the models.
    ///
    /// # Errors
    /// [`RuleError`] if they do not fit.
    pub fn build(mut self) -> Result<Configuration, RuleError> {
        self.models.sort_by(|a, b| a.name.cmp(&b.name));
        let rule = rule(&self.scoring, &self.models)?;
        Ok(Configuration {
            recording: RecordingSettings::default(),
            motion: self.motion,
            scale: self.scale,
            models: self.models,
            rule,
            output: OutputSettings::default(),
        })
    }
}
