//! `reproduce`: the thesis's tables, beside what is measured here.

use std::path::Path;

use clap::{Args, Subcommand};
use comfy_table::{CellAlignment, Table, presets};
use jointscope_detection::{Configuration, Detection, Detector};
use jointscope_models::Catalog;
use jointscope_scenes::{EXPERIMENTS, Experiment, PrintedPair, SceneOptions, simulate};
use rayon::prelude::*;

use super::{catalog, models::trimmed};
use crate::{failure::Failure, output};

/// Name and text of a configuration.
type Profile = (&'static str, &'static str);
const THESIS: Profile = ("thesis.toml", include_str!("../../../../configs/thesis.toml"));
/// The thesis's models with ellipses, over all scales.
const ONE_CAMERA: Profile = ("scale.toml", include_str!("../../../../configs/scale.toml"));
const DEFAULT: Profile = ("default.toml", include_str!("../../../../configs/default.toml"));
/// Noise of Table 2 as a share of the travel, and the printed mean confidence of a prismatic joint.
const TABLE_2: [(u32, f64, f64); 4] =
    [(10, 0.0038, 0.992), (25, 0.0095, 0.961), (50, 0.019, 0.769), (100, 0.038, 0.236)];
/// Noise of a single camera along the ray, as a multiple of that across it.
const DEPTH_NOISE: f64 = 2.0;
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
    /// The ten experiments of Appendix A to J, simulated as a single camera saw them: as the thesis, with its remedies,
    /// and by likelihood with what the camera did undone
    Experiments {
        /// Seed of the simulation
        #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
        seed: u64,
    },
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let catalog = catalog()?;
    output::print(&match arguments.table {
        Reproduced::Table2 { runs, seed } => table2(&Detector::new(parsed(&catalog, THESIS)?), runs, seed)?,
        Reproduced::Experiments { seed } => experiments(&catalog, seed)?,
    })
}

fn parsed(catalog: &Catalog, (name, text): Profile) -> Result<Configuration, Failure> {
    Configuration::parse(text, catalog).map_err(|error| Failure::configuration(Path::new(name), text, error))
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

fn experiments(catalog: &Catalog, seed: u64) -> Result<String, Failure> {
    let columns = [
        ("thesis", parsed(catalog, THESIS)?),
        ("with scale and ellipses", parsed(catalog, ONE_CAMERA)?),
        ("likelihood, repaired", parsed(catalog, DEFAULT)?.for_one_camera()),
    ];
    let detectors = columns.map(|(name, configuration)| (name, Detector::new(configuration)));
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    let heads = ["experiment", "pair", "expected", "printed"];
    table.set_header(heads.into_iter().chain(detectors.iter().map(|(name, _)| *name)));
    let mut pairs = 0;
    let mut right = [0; 4];
    let judged = |experiment: &Experiment| -> Result<Vec<Detection>, Failure> {
        let options = SceneOptions { seed, monocular: true, depth_noise: Some(DEPTH_NOISE), ..SceneOptions::default() };
        let asked: Vec<[String; 2]> =
            experiment.pairs.iter().map(|pair| [pair.reference.into(), pair.moving.into()]).collect();
        detectors.iter().map(|(_, detector)| detect(detector, experiment.scene, &options, Some(&asked))).collect()
    };
    let judged: Vec<Vec<Detection>> = EXPERIMENTS.par_iter().map(judged).collect::<Result<_, _>>()?;
    for (experiment, detections) in EXPERIMENTS.iter().zip(&judged) {
        for (index, pair) in experiment.pairs.iter().enumerate() {
            let printed = pair.printed_joint();
            let confidence = pair.confidences.iter().copied().fold(0.0, f64::max);
            let verdicts = detections.iter().map(|detection| &detection.pairs[index].verdict);
            let found: Vec<(&str, f64)> = std::iter::once((printed, confidence))
                .chain(verdicts.map(|verdict| (class(&verdict.joint), verdict.confidence)))
                .collect();
            pairs += 1;
            for (right, (joint, _)) in right.iter_mut().zip(&found) {
                *right += usize::from(*joint == pair.joint);
            }
            let title = if index == 0 { title(experiment) } else { String::new() };
            let names = [title, format!("{} - {}", pair.reference, pair.moving), pair.joint.into()];
            table.add_row(names.into_iter().chain(found.iter().map(|(joint, sure)| format!("{joint} {sure:.3}"))));
        }
    }
    let [printed, thesis, searched, repaired] = right;
    Ok(format!(
        "The ten experiments, simulated as a single camera saw them (seed {seed})\n\n{}\n\
         as expected, of {pairs}: printed {printed}, thesis {thesis}, with scale and ellipses {searched}, likelihood, \
         repaired {repaired}\n",
        trimmed(&table)
    ))
}

/// The thesis's name for a joint: what it does not know is disconnected to it.
fn class(joint: &str) -> &str {
    let known = PrintedPair::CLASSES.contains(&joint) || joint == "elliptical";
    if known { joint } else { "disconnected" }
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

fn right(table: &mut Table, columns: std::ops::Range<usize>) {
    for column in columns {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}
