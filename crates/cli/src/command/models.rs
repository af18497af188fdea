//! `models`: what joint models there are, and what each one's settings mean.

use clap::Args;
use comfy_table::{Table, presets};
use jointscope_models::{JointModelPlugin, settings};

use super::catalog;
use crate::{failure::Failure, output};

/// List the joint models, or explain one with its settings and defaults
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The model to explain; all are listed if left out
    name: Option<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let catalog = catalog()?;
    let Some(name) = &arguments.name else {
        let mut table = Table::new();
        table.load_style(presets::NOTHING).set_header(["model", "states", "from", "what it looks for"]);
        for plugin in catalog.iter() {
            let from = format!("{} {}", plugin.origin.package, plugin.origin.version);
            table.add_row([plugin.name, kind_of_evidence(plugin), from.as_str(), plugin.summary]);
        }
        return output::print(&trimmed(&table));
    };
    let Some(plugin) = catalog.get(name) else {
        let known: Vec<_> = catalog.names().collect();
        let error = settings::unknown("joint model", name, 0..0, &known);
        return Err(Failure::usage_with_help(error.message, &error.help.unwrap_or_default()));
    };
    output::print(&explanation(plugin))
}

/// What rules can use of a model.
fn kind_of_evidence(plugin: &JointModelPlugin) -> &'static str {
    if plugin.default_model().states_evidence() { "evidence" } else { "confidence" }
}

fn explanation(plugin: &JointModelPlugin) -> String {
    let schema = plugin.schema();
    let description = schema.get("description").and_then(|text| text.as_str()).unwrap_or(plugin.summary);
    let mut text = format!(
        "{}: {}\nfrom {} {}\n\n{description}\n\n",
        plugin.name, plugin.summary, plugin.origin.package, plugin.origin.version
    );
    text += match kind_of_evidence(plugin) {
        "evidence" => {
            "States evidence: works with the rules \"likelihood\" and \"expressions\", and with \"cascade\".\n"
        }
        _ => "States a confidence only: works with the rules \"cascade\" and \"expressions\".\n",
    };
    let parts = plugin.default_model().parts();
    if !parts.is_empty() {
        text.extend([format!("Parts, for expressions such as NAME.{}: {}.\n", parts[0], parts.join(", "))]);
    }
    let settings = settings::describe(&schema, &plugin.default_settings());
    if settings.is_empty() {
        return text + "\nThere are no settings.\n";
    }
    text += "\nSettings, with their defaults:\n\n[models.NAME]\n";
    let kind = format!("kind = \"{}\"\n", plugin.name);
    let lines = settings.into_iter().map(|setting| {
        format!("{} = {}    # {}\n    {}\n", setting.key, setting.default, setting.allowed, setting.description)
    });
    text.extend([kind].into_iter().chain(lines));
    text
}

/// A table's lines without the blanks that fill its last column.
pub(super) fn trimmed(table: &Table) -> String {
    table.lines().fold(String::new(), |text, line| text + line.trim_end() + "\n")
}
