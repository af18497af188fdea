//! `reproduce`: the thesis's tables, beside what is measured here.

use std::path::Path;

use clap::{Args, Subcommand};
use comfy_table::{CellAlignment, Table, presets};
use jointscope_detection::{Configuration, Detection, Detector};
use jointscope_scenes::{EXPERIMENTS, Experiment, SceneOptions, simulate};
use rayon::prelude::*;

use super::{catalog, models::trimmed};
use crate::{failure::Failure, output};

/// The thesis's own profile.
const THESIS: &str = include_str!("../../../../configs/thesis.toml");
/// Noise of Table 2 as a share of the travel, and the printed mean confidence of a prismatic joint.
const TABLE_2: [(u32, f64, f64); 4] =
    [(10, 0.0038, 0.992), (25, 0.0095, 0.961), (50, 0.019, 0.769), (100, 0.038, 0.236)];
/// Travel of the simulated slide, metres. Scores do not depend on it.
const TRAVEL: f64 = 0.5;

/// Reproduce a table of the thesis: the printed values beside ours
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    table: Reproduced,
}

#[derive(Debug, Subcommand)]
enum Reproduced {
    /// Table 2: mean confidence of a prismatic joint under noise
    Table2 {
        /// Simulated runs for each noise
        #[arg(long, default_value_t = 200, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..))]
        runs: u32,
        /// Seed of the first run
        #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
        seed: u64,
    },
    /// The ten experiments of Appendix A to J, simulated
    Experiments {
        /// Seed of the simulation
        #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
        seed: u64,
    },
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let configuration = Configuration::parse(THESIS, &catalog()?)
        .map_err(|error| Failure::configuration(Path::new("thesis.toml"), THESIS, error))?;
    let detector = Detector::new(configuration);
    output::print(&match arguments.table {
        Reproduced::Table2 { runs, seed } => table2(&detector, runs, seed)?,
        Reproduced::Experiments { seed } => experiments(&detector, seed)?,
    })
}

fn table2(detector: &Detector, runs: u32, seed: u64) -> Result<String, Failure> {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header(["theta", "noise [% of travel]", "printed", "measured", "standard error"]);
    for (theta, noise, printed) in TABLE_2 {
        let confidence = |run: u32| -> Result<f64, Failure> {
            let options = SceneOptions {
                seed: seed.wrapping_add(u64::from(run)),
                noise: Some(noise * TRAVEL),
                travel: Some(TRAVEL),
                ..SceneOptions::default()
            };
            let detection = detect(detector, "table2", &options, None)?;
            Ok(confidences(&detection, 0)[1])
        };
        let scores = (0..runs).into_par_iter().map(confidence).collect::<Result<Vec<_>, _>>()?;
        let count = f64::from(runs);
        let mean = scores.iter().sum::<f64>() / count;
        let variance = scores.iter().map(|score| (score - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        let error = (variance / count).sqrt();
        table.add_row([
            theta.to_string(),
            format!("{:.2}", 100.0 * noise),
            format!("{printed:.3}"),
            format!("{mean:.3}"),
            format!("{error:.3}"),
        ]);
    }
    right(&mut table, 0..5);
    Ok(format!("Table 2: mean confidence of a prismatic joint, {runs} runs each\n\n{}", trimmed(&table)))
}

fn experiments(detector: &Detector, seed: u64) -> Result<String, Failure> {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header([
        "experiment",
        "pair",
        "expected",
        "printed",
        "ours",
        "rigid",
        "prismatic",
        "revolute",
        "disconnected",
    ]);
    let (mut pairs, mut printed_right, mut ours_right) = (0, 0, 0);
    for experiment in &EXPERIMENTS {
        let options = SceneOptions { seed, ..SceneOptions::default() };
        let asked: Vec<[String; 2]> =
            experiment.pairs.iter().map(|pair| [pair.reference.into(), pair.moving.into()]).collect();
        let detection = detect(detector, experiment.scene, &options, Some(&asked))?;
        for (index, pair) in experiment.pairs.iter().enumerate() {
            let (ours, theirs) = (confidences(&detection, index), pair.confidences);
            let (our_joint, their_joint) = (best(ours), best(theirs));
            pairs += 1;
            printed_right += usize::from(their_joint == pair.joint);
            ours_right += usize::from(our_joint == pair.joint);
            let both = (0..4).map(|k| format!("{:.3} / {:.3}", theirs[k], ours[k]));
            let title = if index == 0 { title(experiment) } else { String::new() };
            let names = [
                title,
                format!("{} - {}", pair.reference, pair.moving),
                pair.joint.into(),
                their_joint.into(),
                our_joint.into(),
            ];
            table.add_row(names.into_iter().chain(both));
        }
    }
    right(&mut table, 5..9);
    Ok(format!(
        "The ten experiments, simulated (seed {seed}); confidences printed / ours\n\n{}\n\
         as expected: printed {printed_right} of {pairs}, ours {ours_right} of {pairs}\n",
        trimmed(&table)
    ))
}

fn title(experiment: &Experiment) -> String {
    format!("{} {}", experiment.letter, experiment.title)
}

fn detect(
    detector: &Detector,
    scene: &str,
    options: &SceneOptions,
    pairs: Option<&[[String; 2]]>,
) -> Result<Detection, Failure> {
    let simulation = simulate(scene, options).map_err(Failure::usage)?;
    detector.detect(simulation.recording, pairs).map_err(Failure::usage)
}

/// Rigid, prismatic, revolute, disconnected.
fn confidences(detection: &Detection, pair: usize) -> [f64; 4] {
    let confidences = &detection.pairs[pair].verdict.confidences;
    [0, 1, 2, 3].map(|k| confidences[k].1)
}

fn best(confidences: [f64; 4]) -> &'static str {
    let names = ["rigid", "prismatic", "revolute", "disconnected"];
    let best = (1..4).fold(0, |best, k| if confidences[k] > confidences[best] { k } else { best });
    names[best]
}

fn right(table: &mut Table, columns: std::ops::Range<usize>) {
    for column in columns {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}
