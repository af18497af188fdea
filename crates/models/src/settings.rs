//! Settings read from TOML, with errors that point at the text.
//!
//! A settings type says everything once: its fields are the keys, their doc comments the explanation, their schema
//! attributes the range, its `Default` the defaults. From the JSON schema that follows, unknown keys, wrong types and
//! values out of range are found with the place in the text and the nearest spelling.

use std::ops::Range;

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde_json::Value as Json;
use toml::{Spanned, de::DeValue};

/// A TOML value that knows its place in the text.
pub type Value<'i> = Spanned<DeValue<'i>>;

/// Something wrong in a configuration text: what, where, and what would be right.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct SettingsError {
    /// What was expected and what was found.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// Bytes of the text.
    pub span: Range<usize>,
}

impl SettingsError {
    /// An error at a place in the text.
    pub fn at(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { message: message.into(), help: None, span }
    }

    /// Adds what to do about it.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// Reads settings from a TOML value.
///
/// # Errors
/// [`SettingsError`] for an unknown key, a wrong type, an unknown word or a number out of range.
pub fn read<T: DeserializeOwned + JsonSchema>(value: Value<'_>) -> Result<T, SettingsError> {
    let schema = schemars::schema_for!(T);
    check(&value, schema.as_value(), schema.as_value(), "")?;
    let span = value.span();
    serde_path_to_error::deserialize(toml::de::ValueDeserializer::from(value)).map_err(|error| {
        let path = error.path().to_string();
        let error = error.into_inner();
        SettingsError::at(error.span().unwrap_or(span), format!("`{path}`: {}", error.message()))
    })
}

/// An unknown name among known ones: the known names, and the nearest spelling if one is near.
pub fn unknown(what: &str, name: &str, span: Range<usize>, known: &[&str]) -> SettingsError {
    /// Similarity from which a known name is taken for what was meant.
    const NEAR: f64 = 0.75;
    let nearest = known
        .iter()
        .map(|candidate| (strsim::jaro_winkler(name, candidate), candidate))
        .filter(|(similarity, _)| *similarity > NEAR)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let listed = known.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let help = match nearest {
        Some((_, nearest)) => format!("did you mean `{nearest}`? known: {listed}"),
        None if known.is_empty() => "there are none here".to_owned(),
        None => format!("known: {listed}"),
    };
    SettingsError::at(span, format!("unknown {what} `{name}`")).help(help)
}

/// One setting as `models NAME` explains it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// Its key.
    pub key: String,
    /// Its default, as TOML.
    pub default: String,
    /// What values it takes, such as `0 < x <= 1` or `"path", "net"`.
    pub allowed: String,
    /// What it does.
    pub description: String,
    /// Its own keys, if it is a table of settings.
    pub table: Vec<Setting>,
}

/// The settings described by a schema, in the order of their declaration.
pub fn describe(schema: &schemars::Schema, defaults: &toml::Table) -> Vec<Setting> {
    described(schema.as_value(), schema.as_value(), defaults)
}

fn described(schema: &Json, root: &Json, defaults: &toml::Table) -> Vec<Setting> {
    let Some(properties) = schema.get("properties").and_then(Json::as_object) else { return Vec::new() };
    let describe = |(key, property): (&String, &Json)| {
        let resolved = resolve(property, root);
        let description = property.get("description").or_else(|| resolved.get("description"));
        let branches = resolved.get("anyOf").and_then(Json::as_array).into_iter().flatten();
        let of_table = branches.map(|branch| resolve(branch, root)).chain([resolved]);
        let of_table = of_table.into_iter().find(|branch| branch.get("properties").is_some());
        let table = defaults.get(key).and_then(toml::Value::as_table).zip(of_table);
        Setting {
            key: key.clone(),
            default: defaults.get(key).map_or_else(|| "none".into(), ToString::to_string),
            allowed: allowed(resolved, root),
            description: description.and_then(Json::as_str).unwrap_or_default().replace('\n', " "),
            table: table.map_or_else(Vec::new, |(table, schema)| described(schema, root, table)),
        }
    };
    properties.iter().map(describe).collect()
}

fn resolve<'s>(schema: &'s Json, root: &'s Json) -> &'s Json {
    match schema.get("$ref").and_then(Json::as_str).and_then(|path| path.strip_prefix('#')) {
        Some(path) => root.pointer(path).map_or(schema, |schema| resolve(schema, root)),
        None => schema,
    }
}

/// The words that a schema of an enumeration allows.
fn words(schema: &Json) -> Vec<&str> {
    let listed = schema.get("enum").and_then(Json::as_array).into_iter().flatten();
    let described = schema.get("oneOf").and_then(Json::as_array).into_iter().flatten();
    let described = described
        .flat_map(|s| s.get("const").into_iter().chain(s.get("enum").and_then(Json::as_array).into_iter().flatten()));
    listed.chain(described).filter_map(Json::as_str).collect()
}

/// What a schema allows, for people.
fn allowed(schema: &Json, root: &Json) -> String {
    let words = words(schema);
    let branches = schema.get("anyOf").and_then(Json::as_array).into_iter().flatten();
    let branches = branches.filter(|branch| branch.get("type") != Some(&"null".into()));
    let branches: Vec<String> = branches.map(|branch| allowed(resolve(branch, root), root)).collect();
    if !branches.is_empty() {
        branches.join(", or ")
    } else if words.is_empty() {
        range(schema)
    } else {
        words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
    }
}

fn range(schema: &Json) -> String {
    let bound = |key: &str| schema.get(key).and_then(Json::as_f64);
    let least = bound("exclusiveMinimum").map(|b| format!("{b} < ")).or(bound("minimum").map(|b| format!("{b} <= ")));
    let most = bound("exclusiveMaximum").map(|b| format!(" < {b}")).or(bound("maximum").map(|b| format!(" <= {b}")));
    match (least, most) {
        (None, None) => types(schema).into_iter().map(type_words).collect::<Vec<_>>().join(" or "),
        (least, most) => format!("{}x{}", least.unwrap_or_default(), most.unwrap_or_default()),
    }
}

/// The JSON types that a schema names.
fn types(schema: &Json) -> Vec<&str> {
    match schema.get("type") {
        Some(Json::String(name)) => vec![name],
        Some(Json::Array(names)) => names.iter().filter_map(Json::as_str).filter(|name| *name != "null").collect(),
        // Words with a description each carry no type of their own.
        _ if !words(schema).is_empty() => vec!["string"],
        _ => Vec::new(),
    }
}

fn type_words(name: &str) -> &str {
    match name {
        "number" => "a number",
        "integer" => "a whole number",
        "string" => "text in quotes",
        "boolean" => "true or false",
        "array" => "a list",
        "object" => "a table",
        other => other,
    }
}

/// Checks a value against the parts of JSON schema that settings use.
fn check(value: &Value<'_>, schema: &Json, root: &Json, key: &str) -> Result<(), SettingsError> {
    let schema = resolve(schema, root);
    let fail = |message: String| {
        SettingsError::at(value.span(), if key.is_empty() { message } else { format!("`{key}`: {message}") })
    };
    if let Some(branches) = schema.get("anyOf").and_then(Json::as_array) {
        let mut errors = Vec::new();
        for branch in
            branches.iter().filter(|branch| types(branch) != ["null"] && branch.get("type") != Some(&"null".into()))
        {
            match check(value, branch, root, key) {
                Ok(()) => return Ok(()),
                Err(error) => errors.push((fits_type(value.as_ref(), resolve(branch, root)), error)),
            }
        }
        // The branch of the value's own type knows best what is wrong with it, and one that knows what was meant better.
        let meant = |error: &SettingsError| {
            let help = error.help.as_deref().filter(|help| help.starts_with("did you mean"));
            help.and_then(|help| Some(help.split_once('?')?.0.to_owned()))
        };
        errors.sort_by_key(|(fits, error)| (!fits, meant(error).is_none()));
        let several = errors.len() > 1;
        return errors.into_iter().next().map_or(Ok(()), |(_, mut error)| {
            if several && error.message.contains("unknown value") {
                let near = meant(&error).map_or(String::new(), |meant| format!("{meant}? "));
                error.help = Some(format!("{near}allowed: {}", allowed(schema, root)));
            }
            Err(error)
        });
    }
    if !fits_type(value.as_ref(), schema) {
        let expected = types(schema).into_iter().map(type_words).collect::<Vec<_>>().join(" or ");
        return Err(fail(format!("expected {expected}, found {}", found(value.as_ref())))
            .help(format!("allowed: {}", allowed(schema, root))));
    }
    match value.as_ref() {
        DeValue::String(word) => {
            let words = words(schema);
            if !words.is_empty() && !words.contains(&word.as_ref()) {
                let mut error = unknown("value", word, value.span(), &words);
                error.message = format!("`{key}`: {}", error.message);
                return Err(error);
            }
        }
        DeValue::Integer(_) | DeValue::Float(_) => {
            let number = number(value.as_ref());
            let bound = |key: &str| schema.get(key).and_then(Json::as_f64);
            let inside = number.is_finite()
                && bound("minimum").is_none_or(|b| number >= b)
                && bound("maximum").is_none_or(|b| number <= b)
                && bound("exclusiveMinimum").is_none_or(|b| number > b)
                && bound("exclusiveMaximum").is_none_or(|b| number < b);
            if !inside {
                return Err(
                    fail(format!("{number} is out of range")).help(format!("allowed: {}, finite", range(schema)))
                );
            }
        }
        DeValue::Array(items) => {
            let item_schema = schema.get("items").unwrap_or(&Json::Null);
            items.iter().try_for_each(|item| check(item, item_schema, root, key))?;
        }
        DeValue::Table(table) => {
            let known = schema.get("properties").and_then(Json::as_object);
            let others = schema.get("additionalProperties").filter(|others| others.is_object());
            for (name, item) in table {
                match known.and_then(|known| known.get(name.as_ref().as_ref())).or(others) {
                    Some(schema) => check(item, schema, root, name.as_ref())?,
                    None if known.is_some() || schema.get("additionalProperties") == Some(&Json::Bool(false)) => {
                        let keys: Vec<&str> = known.into_iter().flatten().map(|(key, _)| key.as_str()).collect();
                        return Err(unknown("key", name.as_ref(), name.span(), &keys));
                    }
                    None => {}
                }
            }
        }
        _ => {}
    }
    Ok(())
}

fn fits_type(value: &DeValue<'_>, schema: &Json) -> bool {
    let types = types(schema);
    let fits = |name: &&str| match value {
        DeValue::String(_) | DeValue::Datetime(_) => *name == "string",
        DeValue::Integer(_) => *name == "integer" || *name == "number",
        DeValue::Float(_) => *name == "number",
        DeValue::Boolean(_) => *name == "boolean",
        DeValue::Array(_) => *name == "array",
        DeValue::Table(_) => *name == "object",
    };
    types.is_empty() || types.iter().any(fits)
}

fn found(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => format!("the text \"{text}\""),
        DeValue::Integer(_) | DeValue::Float(_) => format!("the number {}", written(value)),
        DeValue::Boolean(value) => format!("{value}"),
        other => format!("a{} {}", if other.type_str().starts_with('a') { "n" } else { "" }, other.type_str()),
    }
}

/// A number as it is written.
fn written<'v>(value: &'v DeValue<'_>) -> &'v str {
    match value {
        DeValue::Integer(n) => n.as_str(),
        DeValue::Float(x) => x.as_str(),
        _ => "",
    }
}

/// The number a TOML value stands for; NaN if it is none or cannot be held.
fn number(value: &DeValue<'_>) -> f64 {
    match value {
        DeValue::Integer(n) => i64::from_str_radix(n.as_str(), n.radix()).map_or(f64::NAN, |n| n as f64),
        DeValue::Float(x) => x.as_str().parse().unwrap_or(f64::NAN),
        _ => f64::NAN,
    }
}
