//! `simulate`: a recording of a scene, and the truth about it.

use std::{
    io::Cursor,
    path::{Path, PathBuf},
};

use clap::Args;
use jointscope_recordings::{Format, write_csv, write_npz};
use jointscope_scenes::{SceneOptions, names, simulate};

use crate::{failure::Failure, output};

/// Simulate a scene: writes a recording, and truth.json beside it
#[derive(Debug, Args)]
#[command(after_help = scenes_help())]
pub(crate) struct Arguments {
    /// The scene
    scene: String,
    /// The recording to write, `.csv` or `.npz`
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Seed of everything random
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Number of frames
    #[arg(long)]
    frames: Option<usize>,
    /// Number of features on every body
    #[arg(long)]
    features: Option<usize>,
    /// Standard deviation of a sample, metres
    #[arg(long, value_name = "METRES")]
    noise: Option<f64>,
    /// Noise along the viewing ray as a multiple of the noise across it
    #[arg(long, value_name = "RATIO")]
    depth_noise: Option<f64>,
    /// Share of the samples that are missing
    #[arg(long, value_name = "SHARE")]
    dropout: Option<f64>,
    /// Share of every body's features that move on their own
    #[arg(long, value_name = "SHARE")]
    outlier_features: Option<f64>,
    /// Share of the samples that are wild
    #[arg(long, value_name = "SHARE")]
    outlier_samples: Option<f64>,
    /// Range of the joint's angle, degrees
    #[arg(long, value_name = "DEGREES")]
    sweep_deg: Option<f64>,
    /// Range of the joint's travel, metres
    #[arg(long, value_name = "METRES")]
    travel: Option<f64>,
    /// Let the reference body rest
    #[arg(long)]
    still_base: bool,
    /// Multiply the observed coordinates of moving bodies, about the camera centre
    #[arg(long, value_name = "FACTOR")]
    scale: Option<f64>,
    /// Compress the depth changes of moving bodies
    #[arg(long, value_name = "GAIN")]
    depth_gain: Option<f64>,
    /// See the thesis's experiments at the scales that a single camera gave them
    #[arg(long)]
    monocular: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let format = Format::of_path(&arguments.out).map_err(Failure::usage)?;
    let simulation = simulate(&arguments.scene, &options(arguments)).map_err(Failure::usage)?;
    let mut recording = Vec::new();
    match format {
        Format::Csv => write_csv(&simulation.recording, &mut recording).map_err(Failure::data)?,
        Format::Npz => {
            let mut file = Cursor::new(&mut recording);
            write_npz(&simulation.recording, &mut file).map_err(Failure::data)?;
        }
        Format::Poses => {
            return Err(Failure::usage("a scene is written as `.csv` or `.npz`; choose one of these extensions"));
        }
    }
    let mut truth = serde_json::to_string_pretty(&simulation.truth).map_err(Failure::data)?;
    truth.push('\n');
    let folder = arguments.out.parent().unwrap_or(Path::new(""));
    if !folder.as_os_str().is_empty() {
        output::make_folder(folder)?;
    }
    output::write_file(&arguments.out, &recording)?;
    output::write_file(&folder.join("truth.json"), truth.as_bytes())
}

fn options(arguments: &Arguments) -> SceneOptions {
    SceneOptions {
        seed: arguments.seed,
        frames: arguments.frames,
        features: arguments.features,
        noise: arguments.noise,
        depth_noise: arguments.depth_noise,
        dropout: arguments.dropout,
        outlier_features: arguments.outlier_features,
        outlier_samples: arguments.outlier_samples,
        sweep_deg: arguments.sweep_deg,
        travel: arguments.travel,
        still_base: arguments.still_base,
        scale: arguments.scale,
        depth_gain: arguments.depth_gain,
        monocular: arguments.monocular,
        ..SceneOptions::default()
    }
}

fn scenes_help() -> String {
    let lines = names().into_iter().map(|(name, summary)| format!("  {name:<14} {summary}\n"));
    format!("Scenes:\n{}", lines.collect::<String>())
}
