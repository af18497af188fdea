//! `simulate`: a recording of a scene, and the truth about it.

use std::{
    fs,
    io::Cursor,
    path::{Path, PathBuf},
};

use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser as _},
};
use jointscope_motion::MotionError;
use jointscope_recordings::{Format, write_csv, write_npz};
use jointscope_report::printable;
use jointscope_scenes::{BodyShape, SceneError, SceneOptions, names, simulate};

use super::{too_fast, unknown_scene};
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
    // Boxed, as commands are moved about.
    #[command(flatten)]
    choices: Box<Choices>,
}

// What is said of it here would be said of the command.
#[derive(Debug, Args)]
struct Choices {
    /// Seed of everything random
    #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
    seed: u64,
    /// Number of frames
    #[arg(long, allow_negative_numbers = true)]
    frames: Option<usize>,
    /// Number of features on every body
    #[arg(long, allow_negative_numbers = true)]
    features: Option<usize>,
    /// Standard deviation of a sample, metres
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    noise: Option<f64>,
    /// Noise along the viewing ray as a multiple of the noise across it
    #[arg(long, value_name = "RATIO", allow_negative_numbers = true)]
    depth_noise: Option<f64>,
    /// Correlation of the noise with that of the frame before
    #[arg(long, value_name = "CORRELATION", allow_negative_numbers = true)]
    drift: Option<f64>,
    /// Share of the samples that are missing
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    dropout: Option<f64>,
    /// Share of every body's features that move on their own
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    outlier_features: Option<f64>,
    /// Share of the samples that are wild
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    outlier_samples: Option<f64>,
    /// Range of the joint's angle, degrees
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    sweep_deg: Option<f64>,
    /// Range of the joint's travel, metres
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    travel: Option<f64>,
    /// Edge of the cubes that hold the bodies' features, metres
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    body_size: Option<f64>,
    /// Where the features of the moving body are
    #[arg(long, value_name = "SHAPE", value_parser = shapes())]
    body_shape: Option<BodyShape>,
    /// Distance of the moving body's centre from the axis, metres
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    axis_distance: Option<f64>,
    /// Distance of the base's centre from the axis, on the other side, metres; 0 if left out
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    base_distance: Option<f64>,
    /// Range of a slow random translation that the joint adds, metres
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    play: Option<f64>,
    /// Share of its travel by which the moving body departs sideways, in a bow
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    bend: Option<f64>,
    /// Standard deviation of the features' smooth wandering on their bodies, metres
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    skin: Option<f64>,
    /// Standard deviation of the low-pass filter that the samples have gone through, frames
    #[arg(long, value_name = "FRAMES", allow_negative_numbers = true)]
    filter: Option<f64>,
    /// See the bodies as poses, not as points
    #[arg(long)]
    poses: bool,
    /// Standard deviation of a pose's orientation, radians
    #[arg(long, value_name = "RADIANS", allow_negative_numbers = true)]
    rotation_noise: Option<f64>,
    /// Share of the frames in which a pose's orientation is flipped
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    flips: Option<f64>,
    /// Let the reference body rest
    #[arg(long)]
    still_base: bool,
    /// Multiply the observed coordinates of moving bodies, about the camera centre
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    scale: Option<f64>,
    /// Compress the depth changes of moving bodies
    #[arg(long, value_name = "GAIN", allow_negative_numbers = true)]
    depth_gain: Option<f64>,
    /// See the thesis's experiments at the scales that a single camera gave them
    #[arg(long)]
    monocular: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let npz = match Format::of_path(&arguments.out) {
        Ok(Format::Csv) => false,
        Ok(Format::Npz) => true,
        _ => {
            let path = arguments.out.display();
            let error = format!("{path}: a scene is written as csv or npz, which the extension does not tell");
            return Err(Failure::usage_with_help(error, "let the name end with `.csv` or `.npz`"));
        }
    };
    let options = options(&arguments.choices);
    let simulation = simulate(&arguments.scene, &options).map_err(refused)?;
    let mut recording = Vec::new();
    if npz {
        write_npz(&simulation.recording, &mut Cursor::new(&mut recording)).map_err(Failure::data)?;
    } else {
        write_csv(&simulation.recording, &mut recording).map_err(Failure::data)?;
    }
    let mut truth = serde_json::to_string_pretty(&simulation.truth).map_err(Failure::data)?;
    truth.push('\n');
    let folder = arguments.out.parent().unwrap_or(Path::new(""));
    output::make_folder_of(&arguments.out)?;
    let beside = folder.join("truth.json");
    let of_another = fs::read(&beside).is_ok_and(|other| other != truth.as_bytes());
    if of_another && !arguments.out.exists() {
        let error = format!("{}: there already, and true of another recording", beside.display());
        return Err(Failure::data_with_help(error, "write this one into a folder of its own"));
    }
    output::write_files(&[(&arguments.out, &recording), (&beside, truth.as_bytes())])?;
    let (bodies, frames) = (simulation.recording.bodies().len(), simulation.recording.frames());
    let [out, beside] = [&arguments.out, &beside].map(|path| printable(&path.display().to_string()));
    output::print(&format!("{out}: {bodies} bodies, {frames} frames; what is true of them: {beside}\n"))
}

/// A scene that cannot be simulated, with the options as they are written on the command line.
fn refused(error: SceneError) -> Failure {
    let typed = |option: &str| format!("--{}", option.replace('_', "-"));
    match error {
        SceneError::UnknownScene { name, .. } => {
            let error = unknown_scene(&name, 0..0);
            Failure::usage_with_help(error.message, &error.help.unwrap_or_default())
        }
        SceneError::OutOfRange { option, expected, found } => {
            Failure::usage(format!("{} must be {expected}, found {found}", typed(option)))
        }
        SceneError::NotApplicable { option, scene } => {
            let option = typed(option);
            Failure::usage_with_help(format!("{option} does not apply to scene `{scene}`"), "leave it out")
        }
        SceneError::NeedsPoints { option } => {
            let error = format!("{} is about tracked features, and poses have none", typed(option));
            Failure::usage_with_help(error, "leave it out, or leave out --poses")
        }
        SceneError::NeedsPoses { option } => {
            Failure::usage_with_help(format!("{} is about tracked poses", typed(option)), "add --poses")
        }
        SceneError::TooFast { body, degrees, .. } => {
            Failure::usage_with_help(too_fast(&body, degrees), "raise --frames or lower --sweep-deg")
        }
        SceneError::Recording(MotionError::NeverSeen { body }) => {
            let help = "lower --dropout, or raise --frames or --features";
            Failure::usage_with_help(format!("body `{body}` lost all its samples"), help)
        }
        _ => Failure::usage(error),
    }
}

fn options(choices: &Choices) -> SceneOptions {
    SceneOptions {
        seed: choices.seed,
        frames: choices.frames,
        features: choices.features,
        noise: choices.noise,
        depth_noise: choices.depth_noise,
        drift: choices.drift,
        dropout: choices.dropout,
        outlier_features: choices.outlier_features,
        outlier_samples: choices.outlier_samples,
        sweep_deg: choices.sweep_deg,
        travel: choices.travel,
        body_size: choices.body_size,
        body_shape: choices.body_shape,
        axis_distance: choices.axis_distance,
        base_distance: choices.base_distance,
        play: choices.play,
        bend: choices.bend,
        skin: choices.skin,
        filter: choices.filter,
        poses: choices.poses,
        rotation_noise: choices.rotation_noise,
        flips: choices.flips,
        still_base: choices.still_base,
        scale: choices.scale,
        depth_gain: choices.depth_gain,
        monocular: choices.monocular,
    }
}

/// Reads a body's shape from its name.
fn shapes() -> impl clap::builder::TypedValueParser<Value = BodyShape> {
    PossibleValuesParser::new(BodyShape::ALL.map(BodyShape::name))
        .try_map(|name| BodyShape::ALL.into_iter().find(|shape| shape.name() == name).ok_or("unknown"))
}

fn scenes_help() -> String {
    let lines = names().into_iter().map(|(name, summary)| format!("  {name:<14} {summary}\n"));
    format!("Scenes:\n{}", lines.collect::<String>())
}
