//! Configurations to start from, with every key, its default, its range and what it does.

use std::fmt::Write;

use jointscope_models::{
    Catalog, JointModelPlugin,
    settings::{Setting, describe},
};
use jointscope_scoring::{RuleKind, ScoringSettings};

use crate::{
    ScaleSettings,
    configuration::DEFAULT_MODELS,
    schema::{Table, tables},
};

/// A choice of models and settings that has a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Profile {
    /// Its name.
    pub name: &'static str,
    /// What it is for, in one line.
    pub summary: &'static str,
    /// What differs from the defaults, as TOML. What this program does not know is left out.
    differences: &'static str,
    /// Whether its models are those of an empty configuration.
    default_models: bool,
}

/// The profiles there are.
pub const PROFILES: [Profile; 3] = [
    Profile {
        name: "default",
        summary: "what an empty configuration means: lower pairs compared by likelihood",
        differences: "",
        default_models: true,
    },
    Profile {
        name: "thesis",
        summary: "the thesis exactly: its registration, its three models, its rule",
        differences: "
            [motion]
            registration = 'chained'
            [models.rigid]
            kind = 'thesis-rigid'
            [models.prismatic]
            kind = 'thesis-prismatic'
            [models.revolute]
            kind = 'thesis-revolute'
            [scoring]
            rule = 'cascade'
        ",
        default_models: false,
    },
    Profile {
        name: "monocular",
        summary: "bodies tracked by a single camera, whose depth is not known",
        differences: "
            [motion]
            depth_gain = 'estimate'
            [scale]
            search = 'closed-form'
        ",
        default_models: true,
    },
];

/// Width of comments.
const WIDTH: usize = 100;

/// The text of a configuration of a profile.
///
/// # Panics
/// If a profile of this crate is not TOML, which tests rule out.
pub fn text(profile: &Profile, catalog: &Catalog) -> String {
    let parse = |text: &str| text.parse::<toml::Table>().expect("profiles are TOML");
    let differences = parse(profile.differences);
    let of = |table: &str| differences.get(table).and_then(toml::Value::as_table).cloned().unwrap_or_default();
    let models = if profile.default_models { parse(DEFAULT_MODELS) } else { of("models") };

    let mut text = comment(&format!("Profile {}: {}.", profile.name, profile.summary));
    text += &comment("Every key stands here with its default; what you leave out has it too.");
    for table in tables() {
        if table.name == "scoring" {
            text += &models_text(&models, catalog);
            text += &scoring_text(table, of("scoring"));
            continue;
        }
        if table.name == "scale" {
            text += &scale_text(table, of("scale"));
            continue;
        }
        let Table { name, schema, mut defaults } = table;
        let known = describe(&schema, &defaults);
        let changed = of(name).into_iter().filter(|(key, _)| known.iter().any(|setting| setting.key == *key));
        defaults.extend(changed);
        text += &heading(name, schema.get("description").and_then(|text| text.as_str()).unwrap_or_default());
        text += &lines(name, &describe(&schema, &defaults));
    }
    text
}

/// The table of a model with its defaults.
pub fn model_text(name: &str, plugin: &JointModelPlugin) -> String {
    let heading = heading(&format!("models.{}", key(name)), plugin.summary);
    let kind = if name == plugin.name { String::new() } else { format!("kind = \"{}\"\n", plugin.name) };
    heading + &kind + &lines(&format!("models.{}", key(name)), &describe(&plugin.schema(), &plugin.default_settings()))
}

/// A key as TOML writes it.
fn key(name: &str) -> String {
    let bare = !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-_".contains(&byte));
    if bare { name.to_owned() } else { toml::Value::from(name).to_string() }
}

fn models_text(models: &toml::Table, catalog: &Catalog) -> String {
    let linked = models.iter().filter_map(|(name, settings)| {
        let kind = settings.get("kind").and_then(toml::Value::as_str).unwrap_or(name);
        Some((name, catalog.get(kind)?))
    });
    let mut linked: Vec<_> = linked.collect();
    // Free motion last, as in results.
    linked.sort_by_key(|(name, _)| (name.as_str() == "disconnected", catalog_place(name)));
    let about = comment(
        "The joint models that are tried. The key is the name that rules and results use; `kind` is the model, if it differs.",
    );
    linked.into_iter().fold(format!("\n{about}"), |text, (name, plugin)| text + &model_text(name, plugin))
}

/// The place of a model in the default, then all others by name.
fn catalog_place(name: &str) -> (usize, String) {
    let place = DEFAULT_MODELS.find(&format!("[{name}]")).unwrap_or(usize::MAX);
    (place, name.to_owned())
}

fn scoring_text(mut table: Table, changed: toml::Table) -> String {
    table.defaults.extend(changed);
    let chosen = table.defaults.clone().try_into::<ScoringSettings>();
    let rule = chosen.map_or(RuleKind::Likelihood, |settings| settings.rule);
    chosen_text(&table, "rule", rule.keys(), "rules")
}

fn scale_text(mut table: Table, changed: toml::Table) -> String {
    table.defaults.extend(changed);
    let search = table.defaults.clone().try_into::<ScaleSettings>().unwrap_or_default().search;
    chosen_text(&table, "search", search.keys(), "searches")
}

/// A key that chooses, with the keys of what is chosen, and those of others as comments: they would be refused.
fn chosen_text(table: &Table, key: &str, keys: &[&str], others_are: &str) -> String {
    let Table { name, schema, defaults } = table;
    let settings = describe(schema, defaults);
    let (own, others): (Vec<Setting>, Vec<Setting>) =
        settings.into_iter().partition(|setting| setting.key == key || keys.contains(&setting.key.as_str()));
    let mut text = heading(name, schema.get("description").and_then(|text| text.as_str()).unwrap_or_default());
    text += &lines(name, &own);
    let _ = write!(text, "\n# For the other {others_are}:\n");
    text.extend(
        others
            .into_iter()
            .map(|Setting { key, default, description, .. }| format!("{}# {key} = {default}\n", comment(&description))),
    );
    text
}

fn heading(name: &str, about: &str) -> String {
    let first = about.split("\n\n").next().unwrap_or_default().replace('\n', " ");
    format!("\n{}[{name}]\n", comment(&first))
}

/// Settings as lines, those without a default as comments, tables behind all others.
fn lines(path: &str, settings: &[Setting]) -> String {
    let line = |Setting { key, default, allowed, description, .. }: &Setting| {
        let about = comment(description);
        if default == "none" {
            format!("{about}# {key} =    # {allowed}; none by default\n")
        } else {
            format!("{about}{key} = {default}    # {allowed}\n")
        }
    };
    let mut text: String = settings.iter().filter(|setting| setting.table.is_empty()).map(line).collect();
    for setting in settings.iter().filter(|setting| !setting.table.is_empty()) {
        let path = format!("{path}.{}", setting.key);
        text += &heading(&path, &setting.description);
        text += &lines(&path, &setting.table);
    }
    text
}

/// Words as comments, wrapped.
fn comment(words: &str) -> String {
    let mut text = String::new();
    let mut line = String::from("#");
    for word in words.split_whitespace() {
        if line.chars().count() + 1 + word.chars().count() > WIDTH {
            text += &line;
            text.push('\n');
            line = String::from("#");
        }
        line.push(' ');
        line += word;
    }
    if line.len() > 1 { text + &line + "\n" } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Configuration;

    fn catalog() -> Catalog {
        Catalog::linked().expect("unique names")
    }

    fn read(text: &str) -> Configuration {
        let read = Configuration::parse(text, &catalog());
        read.unwrap_or_else(|error| panic!("{error:?}: {:?}\n{text}", &text[error.span.clone()]))
    }

    fn parsed(text: &str) -> String {
        format!("{:?}", read(text))
    }

    fn profile(name: &str) -> &'static Profile {
        PROFILES.iter().find(|profile| profile.name == name).expect("a profile")
    }

    #[test]
    fn the_default_means_what_nothing_means() {
        assert_eq!(parsed(&text(profile("default"), &catalog())), parsed(""));
    }

    #[test]
    fn the_thesis_means_what_its_configuration_means() {
        let thesis = include_str!("../../../configs/thesis.toml");
        assert_eq!(parsed(&text(profile("thesis"), &catalog())), parsed(thesis));
    }

    #[test]
    fn one_camera_means_what_its_profile_means() {
        let changed = read("").for_one_camera();
        assert_eq!(parsed(&text(profile("monocular"), &catalog())), format!("{changed:?}"));
    }

    #[test]
    fn every_profile_can_be_read() {
        for profile in &PROFILES {
            parsed(&text(profile, &catalog()));
        }
    }

    #[test]
    fn every_key_stands_in_every_profile() {
        for profile in &PROFILES {
            let text = text(profile, &catalog());
            for Table { name, schema, defaults } in tables() {
                for setting in describe(&schema, &defaults) {
                    let key = format!("{} =", setting.key);
                    let found = text.lines().any(|line| line.trim_start_matches("# ").starts_with(&key));
                    let table = text.contains(&format!("[{name}.{}]", setting.key));
                    assert!(found || table, "{}: [{name}] {}", profile.name, setting.key);
                }
            }
        }
    }

    #[test]
    fn the_settings_of_every_model_read_back_as_its_defaults() {
        for plugin in catalog().iter() {
            let rule = "[scoring]\nrule = 'expressions'\nexpressions.x = 'x'\n";
            let [all, none] = [model_text("x", plugin), format!("[models.x]\nkind = '{}'", plugin.name)];
            assert_eq!(parsed(&(all + rule)), parsed(&(none + "\n" + rule)), "{}", plugin.name);
        }
    }
}
