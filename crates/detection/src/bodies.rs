//! `[recording.bodies]`: which markers make which body.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{
    Deserialize, Deserializer,
    de::{Error, MapAccess, Visitor},
};
use toml::Spanned;

/// Which markers of a file make which body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Bodies {
    /// Names of bodies and patterns of their markers' names, in the order in which the configuration has them.
    Patterns(Vec<(String, Vec<String>)>),
    /// Markers that keep their distances to each other.
    Suggest,
}

/// How bodies are written, for the schema.
#[derive(JsonSchema)]
#[schemars(untagged)]
#[expect(dead_code, reason = "only its schema is used")]
pub(crate) enum Written {
    /// "suggest".
    Word(Word),
    /// Patterns by body.
    Table(BTreeMap<String, Patterns>),
}

#[derive(JsonSchema)]
#[schemars(rename_all = "kebab-case")]
#[expect(dead_code, reason = "only its schema is used")]
pub(crate) enum Word {
    Suggest,
}

/// One pattern, or several.
#[derive(Deserialize, JsonSchema)]
#[serde(untagged)]
pub(crate) enum Patterns {
    One(String),
    Several(Vec<String>),
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Bodies>, D::Error> {
    deserializer.deserialize_any(Reader).map(Some)
}

struct Reader;

impl<'de> Visitor<'de> for Reader {
    type Value = Bodies;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a table of patterns by body, or \"suggest\"")
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<Bodies, E> {
        if word == "suggest" { Ok(Bodies::Suggest) } else { Err(E::custom("expected \"suggest\" or a table")) }
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Bodies, A::Error> {
        let mut bodies = Vec::new();
        // A table comes sorted by name; where the values are tells how it was written.
        while let Some((name, patterns)) = map.next_entry::<String, Spanned<Patterns>>()? {
            let place = patterns.span().start;
            let patterns = match patterns.into_inner() {
                Patterns::One(pattern) => vec![pattern],
                Patterns::Several(patterns) => patterns,
            };
            bodies.push((place, name, patterns));
        }
        bodies.sort();
        Ok(Bodies::Patterns(bodies.into_iter().map(|(_, name, patterns)| (name, patterns)).collect()))
    }
}
