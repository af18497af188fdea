//! The trait of joint models and the record by which they join the catalog.

use std::fmt::Debug;

use jointscope_motion::RelativeMotion;
use schemars::{JsonSchema, Schema};
use serde::{Serialize, de::DeserializeOwned};

use crate::{
    FitError, JointFit,
    lower_pair::Mechanism,
    settings::{self, SettingsError, Value},
};

/// A hypothesis about how one body may move relative to another, with its settings.
///
/// Two kinds of models take part in different rules. One that states [`Evidence`](crate::Evidence) is compared by the
/// rule `likelihood`, which is the default; one that states a confidence alone takes part in `cascade` and
/// `expressions` only, and a configuration that names it needs one of these. A [mechanism](crate::lower_pair) has evidence
/// for nothing.
///
/// Answers must not depend on the choice of coordinates, on which body is called the reference, on the order of
/// features; [`conformance`](crate::conformance) checks it.
pub trait JointModel: Debug + Send + Sync {
    /// Fits the joint to a relative motion and says how well it explains it.
    ///
    /// A model that does not apply answers with confidence 0, and so does one that sees no motion; only a motion that
    /// it cannot judge at all, by too few frames say, is an error.
    ///
    /// # Errors
    /// [`FitError`], which becomes a note beside a confidence of 0.
    fn fit(&self, motion: &RelativeMotion<'_>) -> Result<JointFit, FitError>;

    /// The mechanism whose fit to the poses of a pair its evidence is of, if it is one: such a fit can be
    /// [followed](crate::lower_pair::Followed) where poses change a little, which spares fits of every scale anew.
    fn mechanism(&self) -> Option<&dyn Mechanism> {
        None
    }

    /// Whether its fits state [`Evidence`](crate::Evidence), which rules that compare likelihoods need.
    fn states_evidence(&self) -> bool {
        false
    }

    /// Whether its confidence grows with the number of observations, so that features that are there twice matter: by
    /// default that of models that state evidence.
    fn counts_observations(&self) -> bool {
        self.states_evidence()
    }

    /// Names of the parts that its fits may have, which rules can refer to; by default those that
    /// [`judge`](crate::lower_pair::judge) gives, for models that state evidence.
    fn parts(&self) -> &'static [&'static str] {
        if self.states_evidence() { &crate::lower_pair::PARTS } else { &[] }
    }
}

/// The crate that a model comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Origin {
    /// Package name.
    pub package: &'static str,
    /// Package version.
    pub version: &'static str,
}

/// A joint model in the catalog: its name, where it comes from, and how to build it from settings.
#[derive(Debug, Clone, Copy)]
pub struct JointModelPlugin {
    /// The model's `kind` in configurations.
    pub name: &'static str,
    /// One line about it.
    pub summary: &'static str,
    /// The crate it comes from.
    pub origin: Origin,
    build: for<'i> fn(Value<'i>) -> Result<Box<dyn JointModel>, SettingsError>,
    defaults: fn() -> toml::Table,
    schema: fn() -> Schema,
}

impl JointModelPlugin {
    /// The record of a model; written by [`joint_model!`](crate::joint_model).
    pub const fn of<M>(name: &'static str, summary: &'static str, origin: Origin) -> Self
    where
        M: JointModel + Default + Serialize + DeserializeOwned + JsonSchema + 'static,
    {
        Self { name, summary, origin, build: build::<M>, defaults: defaults::<M>, schema: schema::<M> }
    }

    /// Builds the model from its settings, a TOML table; keys left out take their defaults.
    ///
    /// # Errors
    /// [`SettingsError`] with the place in the text: unknown keys, wrong types, values out of range.
    pub fn build(&self, settings: Value<'_>) -> Result<Box<dyn JointModel>, SettingsError> {
        (self.build)(settings)
    }

    /// The model with its defaults.
    ///
    /// # Panics
    /// If the model refuses its own defaults, which conformance rules out.
    pub fn default_model(&self) -> Box<dyn JointModel> {
        let nothing = toml::Spanned::new(0..0, toml::de::DeValue::Table(toml::de::DeTable::new()));
        self.build(nothing).expect("a model accepts its own defaults")
    }

    /// Every setting with its default.
    pub fn default_settings(&self) -> toml::Table {
        (self.defaults)()
    }

    /// JSON schema of the settings.
    pub fn schema(&self) -> Schema {
        (self.schema)()
    }
}

fn build<M: JointModel + DeserializeOwned + JsonSchema + 'static>(
    value: Value<'_>,
) -> Result<Box<dyn JointModel>, SettingsError> {
    Ok(Box::new(settings::read::<M>(value)?))
}

fn defaults<M: Default + Serialize>() -> toml::Table {
    toml::Table::try_from(M::default()).expect("settings are numbers, words and lists, which TOML can write")
}

fn schema<M: JsonSchema>() -> Schema {
    schemars::schema_for!(M)
}

inventory::collect!(JointModelPlugin);

/// Registers a joint model: `joint_model!(Revolute, "revolute", "rotation about one fixed axis");`.
///
/// The type is its own settings: it implements [`JointModel`](crate::JointModel), `Default`, serde's `Serialize` and
/// `Deserialize` (with `default` and `deny_unknown_fields`), and schemars' `JsonSchema`, whose descriptions and ranges
/// come from the doc comments and attributes of its fields.
#[macro_export]
macro_rules! joint_model {
    ($model:ty, $name:literal, $summary:literal) => {
        $crate::inventory::submit! {
            $crate::JointModelPlugin::of::<$model>(
                $name,
                $summary,
                $crate::Origin { package: env!("CARGO_PKG_NAME"), version: env!("CARGO_PKG_VERSION") },
            )
        }
    };
}
