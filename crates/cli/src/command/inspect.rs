//! `inspect`: what a recording holds, and a configuration to start from.

use std::{
    fmt::Write,
    path::{Path, PathBuf},
};

use clap::{Args, ValueEnum};
use comfy_table::{CellAlignment, Table, presets};
use jointscope_models::toml::Value;
use jointscope_recordings::{Format, Group, Inspection, Presence, ReadOptions, Unit, inspect, read_markers};
use jointscope_report::printable;
use serde_json::json;

use super::models::trimmed;
use crate::{failure::Failure, output};

/// Show what a recording holds: markers, gaps, bodies; and a configuration to start from
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The recording
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Put markers together that keep their distances, whatever bodies the file tells
    #[arg(long)]
    suggest_bodies: bool,
    /// Write a configuration to start from into this file, instead of printing it
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// What is printed
    #[arg(long, value_enum, default_value_t = Printed::Table)]
    format: Printed,
    /// Format of the file, if neither its content nor its extension tells
    #[arg(long, value_name = "FORMAT", value_parser = super::named::<Format>)]
    input_format: Option<Format>,
    /// Unit of the lengths in the file: m, cm, mm or in; the one that the file states, or m, if left out
    #[arg(long, value_parser = super::named::<Unit>)]
    unit: Option<Unit>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Printed {
    /// Tables for people
    Table,
    /// Everything, for programs
    Json,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let options = ReadOptions { format: arguments.input_format, unit: arguments.unit, ..ReadOptions::default() };
    let markers = read_markers(&arguments.file, &options).map_err(super::unread)?;
    let inspection = inspect(&markers, &arguments.file, arguments.suggest_bodies);
    if let Some(path) = &arguments.write {
        if path.exists() {
            let error = format!("{}: there already, and not overwritten", path.display());
            return Err(Failure::data_with_help(error, "give --write the name of a new file"));
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let configuration = configuration(&inspection, &seen_from(&arguments.file, folder), &options);
        output::make_folder_of(path)?;
        output::write_files(&[(path, configuration.as_bytes())])?;
    }
    output::print(&match arguments.format {
        Printed::Table => {
            let text = table(&inspection);
            if arguments.write.is_some() {
                text
            } else {
                text + "\nA configuration to start from:\n\n" + &configuration(&inspection, &arguments.file, &options)
            }
        }
        Printed::Json => to_json(&inspection)?,
    })
}

/// The path of a recording as a configuration in a folder names it.
fn seen_from(file: &Path, folder: &Path) -> PathBuf {
    if folder.as_os_str().is_empty() || file.is_absolute() {
        return file.into();
    }
    file.strip_prefix(folder).map(Path::to_owned).or_else(|_| std::path::absolute(file)).unwrap_or_else(|_| file.into())
}

fn to_json(inspection: &Inspection) -> Result<String, Failure> {
    let mut value = json!({ "format": "jointscope-inspection", "version": 1 });
    let mut content = serde_json::to_value(inspection).map_err(Failure::data)?;
    if let (Some(value), Some(content)) = (value.as_object_mut(), content.as_object_mut()) {
        let format = content.remove("format").unwrap_or_default();
        value.insert("recording_format".into(), format);
        value.append(content);
    }
    serde_json::to_string_pretty(&value).map(|text| text + "\n").map_err(Failure::data)
}

fn table(inspection: &Inspection) -> String {
    let mut text = summary(inspection);
    let seen: Vec<&Presence> = inspection.markers.iter().chain(&inspection.poses).collect();
    let mut table = rows(["marker", "body", "missing", "gaps", "longest", "outside"]);
    for of in &seen {
        table.add_row([
            printable(&of.name),
            printable(of.body.as_deref().unwrap_or("-")),
            format!("{:.1} %", 100. * of.missing),
            of.gaps.to_string(),
            of.longest_gap.to_string(),
            of.outside.to_string(),
        ]);
    }
    let _ = write!(text, "\n{}", trimmed(&table));
    if !inspection.bodies.is_empty() {
        let mut table = rows(["body", "markers", "variation", "residual"]);
        for body in &inspection.bodies {
            let millimetres =
                |length: Option<f64>| length.map_or("-".into(), |length| format!("{:.2} mm", 1e3 * length));
            let markers = if body.markers.is_empty() { "poses".into() } else { body.markers.len().to_string() };
            table.add_row([printable(&body.name), markers, millimetres(body.variation), millimetres(body.residual)]);
        }
        let from = match inspection.bodies_from {
            "file" => "as the file tells them",
            _ => "suggested, as markers keep their distances",
        };
        let _ = write!(text, "\nBodies, {from}:\n\n{}", trimmed(&table));
    }
    for (names, what) in [
        (
            &inspection.ambiguous,
            "In no body, as they keep their distances to more than one (too little moves between them to tell)",
        ),
        (&inspection.alone, "In no body"),
    ] {
        if !names.is_empty() {
            let _ = write!(text, "\n{what}: {}\n", printable(&names.join(", ")));
        }
    }
    for note in &inspection.notes {
        let _ = write!(text, "\nnote: {}\n", printable(note));
    }
    text
}

fn summary(inspection: &Inspection) -> String {
    let Inspection { format, unit, frames, frame_numbers: [first, last], .. } = inspection;
    let stated = if inspection.unit_stated { "stated" } else { "not stated" };
    let times = match (inspection.rate, inspection.duration) {
        (Some(rate), Some(duration)) => format!(", {rate:.2} per second, {duration:.2} s"),
        _ => ", times unknown".into(),
    };
    let poses = match inspection.poses.len() {
        0 => String::new(),
        1 => ", 1 body as poses".into(),
        count => format!(", {count} bodies as poses"),
    };
    let (markers, path) = (inspection.markers.len(), printable(&inspection.path.display().to_string()));
    format!(
        "{path}: {format}, unit {unit} ({stated})\n{frames} frames ({first} to {last}){times}\n{markers} markers{poses}\n"
    )
}

fn rows<const N: usize>(header: [&str; N]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(header);
    for column in table.column_iter_mut().skip(if N > 4 { 2 } else { 1 }) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// A configuration to start from.
fn configuration(inspection: &Inspection, path: &Path, options: &ReadOptions) -> String {
    let quoted = |text: &str| Value::from(text).to_string();
    let mut text = format!("[recording]\npath = {}\n", quoted(&path.to_string_lossy()));
    if let Some(format) = options.format {
        let _ = writeln!(text, "format = \"{format}\"");
    }
    if options.unit.is_some() {
        let _ = writeln!(text, "unit = \"{}\"", inspection.unit);
    } else if !inspection.unit_stated {
        let _ = writeln!(text, "# unit = \"{}\"    # of the file, which does not state it", inspection.unit);
    }
    let bodies: Vec<&Group> = inspection.bodies.iter().filter(|body| !body.markers.is_empty()).collect();
    let has_bodies =
        matches!(inspection.format, Format::Csv | Format::Poses | Format::Npz | Format::Euroc | Format::Parquet);
    if has_bodies && inspection.bodies_from == "file" {
        return text + "# world = \"world\"    # judges every body against the world, too\n";
    }
    let poses: Vec<&Group> = inspection.bodies.iter().filter(|body| body.markers.is_empty()).collect();
    text += "\n# All markers of a body must be fixed to it; * stands for any letters.\n[recording.bodies]\n";
    if inspection.bodies.is_empty() {
        text +=
            "# No markers were found to belong together. Name those of each body:\n# door = [\"D1\", \"D2\", \"D3\"]\n";
    }
    if !inspection.together.is_empty() {
        let markers: Vec<String> = inspection.together.iter().map(|marker| quoted(marker)).collect();
        text += "# These keep their distances to each other, and to more than one body: if they are all at rest, they are one, the\n\
                 # base.\n";
        let _ = writeln!(text, "# base = [{}]", markers.join(", "));
    }
    for body in bodies.into_iter().chain(poses) {
        let markers = match &body.pattern {
            Some(pattern) => vec![quoted(pattern)],
            None if body.markers.is_empty() => vec![quoted(&body.name)],
            None => body.markers.iter().map(|marker| quoted(marker)).collect(),
        };
        let _ = writeln!(text, "{} = [{}]", key(&body.name), markers.join(", "));
    }
    text
}

/// A key of TOML, in quotes if it needs them.
fn key(name: &str) -> String {
    let bare = !name.is_empty() && name.chars().all(|letter| letter.is_ascii_alphanumeric() || "-_".contains(letter));
    if bare { name.into() } else { Value::from(name).to_string() }
}
