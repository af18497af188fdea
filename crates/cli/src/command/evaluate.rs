//! `evaluate`: how well joints are found under simulated conditions.

use std::{
    fs,
    path::{Path, PathBuf},
};

use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use jointscope_detection::Configuration;
use jointscope_evaluation::{
    Column, Plan, Row, evaluate, list, picture, row, rows, to_json, to_markdown, to_svg, to_text,
};
use jointscope_models::settings;
use jointscope_report::printable;

use super::catalog;
use crate::{failure::Failure, output};

/// What is compared unless configurations are given: the default one, and the thesis's.
const DEFAULT: [(&str, &str); 2] = [
    ("likelihood", include_str!("../../../../configs/default.toml")),
    ("thesis", include_str!("../../../../configs/thesis.toml")),
];

/// Measure how well joints are found under simulated conditions
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The rows to evaluate, such as A1 or P; all if left out
    #[arg(value_name = "ROW")]
    rows: Vec<String>,
    /// Simulated runs of every condition
    #[arg(long, value_name = "N", default_value_t = 30, allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(1..=100_000))]
    seeds: u32,
    /// Seed of the first run
    #[arg(long, value_name = "SEED", default_value_t = 1, allow_negative_numbers = true)]
    first_seed: u64,
    /// A configuration to evaluate, instead of the default and the thesis's; may be given several times
    #[arg(long, value_name = "FILE")]
    config: Vec<PathBuf>,
    /// What is printed
    #[arg(long, value_enum, default_value_t = Printed::Text)]
    format: Printed,
    /// Number of threads, up to 1024; 0 means all cores
    #[arg(long, default_value_t = 0, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u16).range(..=1024))]
    threads: u16,
    /// Leave out times, which differ from run to run
    #[arg(long)]
    no_times: bool,
    /// List the rows, and evaluate nothing
    #[arg(long)]
    list: bool,
    /// No progress bar
    #[arg(long)]
    quiet: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Printed {
    /// Tables for people
    Text,
    /// Everything, for programs
    Json,
    /// A page with the same tables
    Markdown,
    /// A picture: accuracy against noise, at conditions of its own
    Svg,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let rows = if arguments.format == Printed::Svg && arguments.rows.is_empty() {
        vec![picture()]
    } else {
        chosen(&arguments.rows)?
    };
    if arguments.list {
        return output::print(&list(&rows, arguments.seeds));
    }
    if arguments.format == Printed::Svg && !arguments.rows.is_empty() {
        let help = "leave the rows out, or choose another format";
        return Err(Failure::usage_with_help("the picture has conditions of its own, it shows no rows", help));
    }
    // Some conditions are simulated four times as often.
    if arguments.first_seed.checked_add(4 * u64::from(arguments.seeds)).is_none() {
        let error = format!("--first-seed {} leaves no room for {} seeds", arguments.first_seed, arguments.seeds);
        return Err(Failure::usage_with_help(error, "give a smaller one"));
    }
    let columns = columns(&arguments.config)?;
    let plan = Plan {
        seeds: arguments.seeds,
        first_seed: arguments.first_seed,
        threads: usize::from(arguments.threads),
        times: !arguments.no_times,
    };
    let bar = progress(arguments.quiet);
    let watch = |done: usize, of: usize| {
        bar.set_length(of as u64);
        bar.set_position(done as u64);
    };
    let evaluation = evaluate(&plan, &columns, &rows, &watch).map_err(Failure::data);
    bar.finish_and_clear();
    let evaluation = evaluation?;
    output::print(&match arguments.format {
        Printed::Text => to_text(&evaluation),
        Printed::Json => to_json(&evaluation),
        Printed::Markdown => to_markdown(&evaluation, &command(arguments, "markdown"), &command(arguments, "svg")),
        Printed::Svg => to_svg(&evaluation).map_err(Failure::data)?,
    })
}

/// The rows of these names, or all.
fn chosen(names: &[String]) -> Result<Vec<Row>, Failure> {
    if names.is_empty() {
        return Ok(rows());
    }
    let find = |name: &String| {
        row(name).ok_or_else(|| {
            let known: Vec<&str> = rows().into_iter().map(|row| row.name).collect();
            let error = settings::unknown("row", name, 0..0, &known);
            Failure::usage_with_help(error.message, &error.help.unwrap_or_default())
        })
    };
    let mut chosen: Vec<Row> = Vec::new();
    for row in names.iter().map(find) {
        let row = row?;
        if !chosen.iter().any(|other| other.name == row.name) {
            chosen.push(row);
        }
    }
    Ok(chosen)
}

fn columns(files: &[PathBuf]) -> Result<Vec<Column>, Failure> {
    if files.is_empty() {
        let column = |(name, text): (&str, &str)| {
            let file = if name == "thesis" { "thesis.toml" } else { "default.toml" };
            column(name, Path::new(file), text)
        };
        return DEFAULT.into_iter().map(column).collect();
    }
    let stems: Vec<String> = files.iter().map(|file| stem(file)).collect();
    let named = |(index, file): (usize, &PathBuf)| {
        let alone = stems.iter().filter(|stem| **stem == stems[index]).count() == 1;
        let name = if alone { stems[index].clone() } else { file.display().to_string() };
        let text = fs::read_to_string(file).map_err(|error| {
            let message = format!("{}: the configuration cannot be read: {error}; check the path", file.display());
            Failure::usage(message)
        })?;
        column(&name, file, &text)
    };
    files.iter().enumerate().map(named).collect()
}

fn stem(file: &Path) -> String {
    file.file_stem().map_or_else(|| file.display().to_string(), |stem| stem.to_string_lossy().into_owned())
}

fn column(name: &str, file: &Path, text: &str) -> Result<Column, Failure> {
    let configuration =
        Configuration::parse(text, &catalog()?).map_err(|error| Failure::configuration(file, text, error))?;
    // Names stand in tables, where a bar would end a cell.
    Ok(Column::new(printable(name).replace('|', "/"), configuration))
}

/// The command that gives this evaluation in a format; the picture has no rows and no times.
fn command(arguments: &Arguments, format: &str) -> String {
    let page = format != "svg";
    let mut words = vec!["jointscope evaluate".to_owned()];
    words.extend(arguments.rows.iter().filter(|_| page).cloned());
    words.push(format!("--seeds {} --first-seed {}", arguments.seeds, arguments.first_seed));
    words.extend(arguments.config.iter().map(|file| format!("--config {}", file.display())));
    words.extend((page && arguments.no_times).then(|| "--no-times".to_owned()));
    words.push(format!("--format {format}"));
    words.join(" ")
}

fn progress(quiet: bool) -> ProgressBar {
    let bar = if quiet {
        ProgressBar::hidden()
    } else {
        ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10))
    };
    bar.set_style(
        ProgressStyle::with_template("{bar:40} {pos} of {len} recordings, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    bar
}
