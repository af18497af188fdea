//! The JSON schema of a whole configuration, with the models that are linked.

use jointscope_models::{Catalog, JointModelPlugin};
use jointscope_motion::MotionSettings;
use jointscope_scoring::ScoringSettings;
use schemars::{JsonSchema, Schema, schema_for};
use serde::Serialize;
use serde_json::{Map, Value as Json, json};

use crate::{OutputSettings, RecordingSettings, ScaleSettings};

/// One table of a configuration, but for the models: its settings and their defaults.
#[derive(Debug, Clone)]
pub struct Table {
    /// Its name.
    pub name: &'static str,
    /// JSON schema of its settings.
    pub schema: Schema,
    /// Every setting that has a default.
    pub defaults: toml::Table,
}

impl Table {
    fn of<T: JsonSchema + Serialize + Default>(name: &'static str) -> Self {
        let defaults = toml::Table::try_from(T::default());
        Self {
            name,
            schema: schema_for!(T),
            defaults: defaults.expect("settings are numbers, words, lists and tables"),
        }
    }
}

/// The tables of a configuration in their usual order; the models stand before the rule.
pub fn tables() -> Vec<Table> {
    let recording = Table {
        name: "recording",
        schema: schema_for!(RecordingSettings),
        // Nothing is analysed unless it is named.
        defaults: toml::Table::new(),
    };
    vec![
        recording,
        Table::of::<MotionSettings>("motion"),
        Table::of::<ScaleSettings>("scale"),
        Table::of::<ScoringSettings>("scoring"),
        Table::of::<OutputSettings>("output"),
    ]
}

/// The schema of configurations, JSON Schema draft 7, by which editors complete and check TOML.
///
/// `[models.NAME]` has the settings of its `kind`, which is NAME if left out. What only reading can tell, whether a
/// rule fits the models, is not in it.
pub fn of_configuration(catalog: &Catalog) -> Json {
    let mut definitions = Map::new();
    let mut properties = Map::new();
    for Table { name, schema, defaults } in tables() {
        properties.insert(name.into(), hoisted(schema.to_value(), name, &defaults, &mut definitions));
    }
    for plugin in catalog.iter() {
        define(plugin, &mut definitions);
    }
    let names: Vec<&str> = catalog.names().collect();
    let kinds = |kinds: Vec<Json>| json!({ "anyOf": kinds });
    let kind_of = |name: &&str| reference(&format!("kind-{name}"));
    let of_name = |name: &&str| {
        let others = names.iter().filter(|other| other != &name).map(kind_of);
        ((*name).to_owned(), kinds([reference(&format!("model-{name}"))].into_iter().chain(others).collect()))
    };
    let models = json!({
        "description": "The joint models that are tried. The key is the name that rules and results use.",
        "type": "object",
        "properties": names.iter().map(of_name).collect::<Map<_, _>>(),
        "additionalProperties": kinds(names.iter().map(kind_of).collect()),
    });
    properties.insert("models".into(), models);
    json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "Jointscope configuration",
        "description": "What is analysed, with which joint models, and how the verdict is reached.",
        "type": "object",
        "properties": properties,
        "additionalProperties": false,
        "definitions": definitions,
    })
}

fn reference(definition: &str) -> Json {
    json!({ "$ref": format!("#/definitions/{definition}") })
}

/// Defines a model's settings, once with an optional kind, once with a required one.
fn define(plugin: &JointModelPlugin, definitions: &mut Map<String, Json>) {
    let model = format!("model-{}", plugin.name);
    let mut schema = hoisted(plugin.schema().to_value(), &model, &plugin.default_settings(), definitions);
    let summary = format!("{} ({} {})", plugin.summary, plugin.origin.package, plugin.origin.version);
    let kind = json!({ "description": summary, "const": plugin.name, "type": "string" });
    if let Some(schema) = schema.as_object_mut() {
        let properties = schema.entry("properties").or_insert_with(|| json!({}));
        if let Some(properties) = properties.as_object_mut() {
            properties.insert("kind".into(), kind);
        }
    }
    let named = json!({ "allOf": [reference(&model), { "required": ["kind"] }] });
    definitions.insert(model, schema);
    definitions.insert(format!("kind-{}", plugin.name), named);
}

/// A schema whose own definitions are moved to those of the whole, under its name, and whose properties tell defaults.
fn hoisted(mut schema: Json, name: &str, defaults: &toml::Table, definitions: &mut Map<String, Json>) -> Json {
    let Some(root) = schema.as_object_mut() else { return schema };
    root.remove("$schema");
    let own = root.remove("$defs");
    if let Some(properties) = root.get_mut("properties").and_then(Json::as_object_mut) {
        for (key, property) in properties.iter_mut().filter_map(|(key, p)| Some((key, p.as_object_mut()?))) {
            if let Some(default) = defaults.get(key).and_then(|default| serde_json::to_value(default).ok()) {
                property.insert("default".into(), default);
            }
        }
    }
    for (key, mut definition) in own.as_ref().and_then(Json::as_object).cloned().into_iter().flatten() {
        rename(&mut definition, name);
        definitions.insert(format!("{name}-{key}"), definition);
    }
    rename(&mut schema, name);
    schema
}

/// Lets references point at the definitions of the whole. In draft 7 nothing may stand beside a reference.
fn rename(schema: &mut Json, name: &str) {
    match schema {
        Json::Object(object) => {
            object.values_mut().for_each(|value| rename(value, name));
            let Some(target) = object.get("$ref").and_then(Json::as_str).and_then(|r| r.strip_prefix("#/$defs/"))
            else {
                return;
            };
            let target = reference(&format!("{name}-{target}"));
            object.remove("$ref");
            if object.is_empty() {
                *schema = target;
            } else {
                object.insert("allOf".into(), json!([target]));
            }
        }
        Json::Array(items) => items.iter_mut().for_each(|item| rename(item, name)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::configuration::TABLES;

    #[test]
    fn the_schema_has_every_table_and_every_model() {
        let catalog = Catalog::linked().expect("unique names");
        let schema = of_configuration(&catalog);
        let keys = |value: &Json| value.as_object().expect("an object").keys().cloned().collect::<Vec<_>>();
        let mut tables = keys(&schema["properties"]);
        tables.sort();
        let mut expected = TABLES;
        expected.sort_unstable();
        assert_eq!(tables, expected);
        assert_eq!(keys(&schema["properties"]["models"]["properties"]), catalog.names().collect::<Vec<_>>());
        for plugin in catalog.iter() {
            let properties = &schema["definitions"][format!("model-{}", plugin.name)]["properties"];
            for key in plugin.default_settings().keys() {
                assert!(!properties[key]["default"].is_null(), "{}: {key} has no default", plugin.name);
                assert!(properties[key]["description"].is_string(), "{}: {key} has no description", plugin.name);
            }
        }
    }

    #[test]
    fn every_reference_has_a_definition() {
        fn references(schema: &Json, found: &mut Vec<String>) {
            match schema {
                Json::Object(object) => {
                    found.extend(object.get("$ref").and_then(Json::as_str).map(String::from));
                    object.values().for_each(|value| references(value, found));
                }
                Json::Array(items) => items.iter().for_each(|item| references(item, found)),
                _ => {}
            }
        }
        let schema = of_configuration(&Catalog::linked().expect("unique names"));
        let mut found = Vec::new();
        references(&schema, &mut found);
        assert!(found.len() > 50, "{}", found.len());
        for reference in found {
            let defined = reference.strip_prefix('#').and_then(|pointer| schema.pointer(pointer));
            assert!(defined.is_some(), "{reference}");
        }
    }
}
