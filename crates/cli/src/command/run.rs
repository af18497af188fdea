//! `run`: from a recording to joints.

use std::{
    fs,
    path::{Path, PathBuf},
    str::FromStr,
    time::Duration,
};

use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use jointscope_detection::{Configuration, Detection, Detector, RecordingSettings, SettingsError};
use jointscope_motion::Recording;
use jointscope_recordings::{ReadOptions, Unit};
use jointscope_report::{to_json, to_table};
use jointscope_scenes::{SceneOptions, simulate};

use super::catalog;
use crate::{failure::Failure, output};

/// Find the joints between the bodies of a recording
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The configuration
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// A recording, instead of the configuration's
    #[arg(long, value_name = "PATH", conflicts_with = "scene")]
    input: Option<PathBuf>,
    /// A simulated scene, instead of the configuration's recording
    #[arg(long, value_name = "NAME")]
    scene: Option<String>,
    /// Write detection.json into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// What is printed
    #[arg(long, value_enum, default_value_t = Printed::Table)]
    format: Printed,
    /// Number of threads; 0 means all cores
    #[arg(long, default_value_t = 0, value_name = "N")]
    threads: usize,
    /// No progress bar
    #[arg(long)]
    quiet: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Printed {
    /// A table for people
    Table,
    /// Everything, for programs
    Json,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (text, mut configuration) = read_configuration(&arguments.config)?;
    let settings = overridden(std::mem::take(&mut configuration.recording), arguments);
    let recording = obtain(&settings, &arguments.config, &text)?;
    if let Some(folder) = &arguments.out {
        // Found out now, before the work.
        output::make_folder(folder)?;
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads).build().map_err(Failure::usage)?;
    let detector = Detector::new(configuration);
    let detection = pool.install(|| detect(&detector, recording, &settings, arguments.quiet))?;
    if let Some(folder) = &arguments.out {
        output::write_file(&folder.join("detection.json"), to_json(&detection).as_bytes())?;
    }
    output::print(&match arguments.format {
        Printed::Table => to_table(&detection),
        Printed::Json => to_json(&detection),
    })
}

/// Reads and checks a configuration; also gives its text, for errors that point into it.
fn read_configuration(path: &Path) -> Result<(String, Configuration), Failure> {
    let unread = |error: &dyn std::fmt::Display| {
        Failure::usage(format!("{}: the configuration cannot be read: {error}", path.display()))
    };
    let bytes = fs::read(path).map_err(|error| unread(&error))?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let line = 1 + error.as_bytes()[..error.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count();
        unread(&format!("line {line} is not UTF-8"))
    })?;
    match Configuration::parse(&text, &catalog()?) {
        Ok(configuration) => Ok((text, configuration)),
        Err(error) => Err(Failure::configuration(path, &text, error)),
    }
}

/// The configuration's recording, or the command line's.
fn overridden(settings: RecordingSettings, arguments: &Arguments) -> RecordingSettings {
    let in_place_of = |text: &String| toml_word(text.clone());
    match (&arguments.input, &arguments.scene) {
        // A path on the command line is relative to where the program runs.
        (Some(input), _) => RecordingSettings {
            path: Some(std::path::absolute(input).unwrap_or_else(|_| input.clone())),
            scene: None,
            ..settings
        },
        (None, Some(scene)) => RecordingSettings { path: None, scene: Some(in_place_of(scene)), ..settings },
        (None, None) => settings,
    }
}

fn toml_word(word: String) -> jointscope_models::toml::Spanned<String> {
    jointscope_models::toml::Spanned::new(0..0, word)
}

/// Reads the file or simulates the scene that the settings name.
fn obtain(settings: &RecordingSettings, config: &Path, text: &str) -> Result<Recording, Failure> {
    let recording = match (&settings.path, &settings.scene) {
        (Some(path), _) => {
            let options = ReadOptions {
                format: word(settings.format.as_ref(), config, text)?,
                unit: word::<Unit>(settings.unit.as_ref(), config, text)?,
            };
            let path = config.parent().unwrap_or(Path::new("")).join(path);
            jointscope_recordings::read(&path, &options).map_err(Failure::data)?
        }
        (None, Some(scene)) => {
            let options = SceneOptions {
                seed: settings.seed.unwrap_or(0),
                noise: settings.noise,
                frames: settings.frames,
                ..SceneOptions::default()
            };
            simulate(scene.as_ref(), &options).map_err(Failure::usage)?.recording
        }
        (None, None) => {
            let help = "write `path` or `scene` under [recording], or give --input FILE or --scene NAME";
            return Err(Failure::usage_with_help(format!("{}: no recording is named", config.display()), help));
        }
    };
    match &settings.world {
        Some(name) => recording.with_world(name).map_err(Failure::usage),
        None => Ok(recording),
    }
}

/// A word of the configuration that stands for something.
fn word<T: FromStr<Err: std::fmt::Display>>(
    word: Option<&jointscope_models::toml::Spanned<String>>,
    config: &Path,
    text: &str,
) -> Result<Option<T>, Failure> {
    let parse = |word: &jointscope_models::toml::Spanned<String>| {
        T::from_str(word.as_ref())
            .map_err(|error| Failure::configuration(config, text, SettingsError::at(word.span(), error.to_string())))
    };
    word.map(parse).transpose()
}

fn detect(
    detector: &Detector,
    recording: Recording,
    settings: &RecordingSettings,
    quiet: bool,
) -> Result<Detection, Failure> {
    let bar = if quiet {
        ProgressBar::hidden()
    } else {
        ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10))
    };
    bar.set_style(
        ProgressStyle::with_template("{bar:40} {pos} of {len} pairs, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    /// Work shorter than this shows no bar.
    const PATIENCE: Duration = Duration::from_millis(300);
    let start = std::time::Instant::now();
    let watch = |done: usize, of: usize| {
        if start.elapsed() > PATIENCE {
            bar.set_length(of as u64);
            bar.set_position(done as u64);
        }
    };
    let detection = detector.detect_watched(recording, settings.pairs.as_deref(), &watch);
    bar.finish_and_clear();
    detection.map_err(Failure::usage)
}
