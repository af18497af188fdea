//! `run`: from a recording to joints.

use std::{
    borrow::Cow,
    collections::BTreeSet,
    fmt::Display,
    fs,
    io::ErrorKind,
    ops::Range,
    path::{Path, PathBuf},
    str::FromStr,
    time::Duration,
};

use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use jointscope_detection::{
    Bodies, Configuration, Detection, DetectionError, Detector, OutputSettings, RecordingSettings, RuleKind,
    SettingsError,
};
use jointscope_models::{settings, toml::Spanned};
use jointscope_motion::Recording;
use jointscope_recordings::{BodyPatterns, Format, Grouping, ReadOptions, RecordingError, Unit, join, read_with_notes};
use jointscope_report::{
    Report, pairs_to_svg, to_explanation, to_html, to_json, to_mjcf, to_styled_table, to_svg, to_urdf,
};
use jointscope_scenes::{SceneError, SceneOptions, simulate};

use super::{catalog, explain, too_fast, unknown_scene};
use crate::{failure::Failure, output, place, terminal};

/// Find the joints between the bodies of a recording
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The configuration; the default one, configs/default.toml, if left out
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// A recording, instead of the configuration's; several files, each with bodies of its own, if given several times
    #[arg(long, value_name = "PATH", conflicts_with = "scene")]
    input: Vec<PathBuf>,
    /// Format of the files of --input, if neither their content nor their extension tells
    #[arg(long, value_name = "FORMAT", requires = "input", conflicts_with = "scene", value_parser = super::named::<Format>)]
    input_format: Option<Format>,
    /// Unit of the lengths in the files of --input: m, cm, mm or in
    #[arg(long, requires = "input", conflicts_with = "scene", value_parser = super::named::<Unit>)]
    unit: Option<Unit>,
    /// A simulated scene, instead of the configuration's recording
    #[arg(long, value_name = "NAME")]
    scene: Option<String>,
    /// Write detection.json, and what [output] asks for, into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// What is printed
    #[arg(long, value_enum, default_value_t = Printed::Table)]
    format: Printed,
    /// Explain the verdict about a pair, such as "base,lid", step by step; may be given several times
    #[arg(long, value_name = "PAIR")]
    explain: Vec<String>,
    /// Number of threads, up to 1024; 0 means all cores
    #[arg(long, default_value_t = 0, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u16).range(..=1024))]
    threads: u16,
    /// No progress bar, and no remarks about the recording and the configuration
    #[arg(long)]
    quiet: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Printed {
    /// A table for people
    Table,
    /// Everything, for programs
    Json,
    /// A page with everything in pictures, for a browser
    Html,
    /// A picture of the recording with its joints
    Svg,
    /// The mechanism as a robot description
    Urdf,
    /// The mechanism as MJCF
    Mjcf,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (file, mut configuration) = match &arguments.config {
        Some(path) => read_configuration(path)?,
        None if arguments.input.is_empty() && arguments.scene.is_none() => {
            let help = "give --input PATH or --scene NAME, or --config FILE with a configuration that names one";
            return Err(Failure::usage_with_help("no recording is named", help));
        }
        None => default_configuration()?,
    };
    check_output(&configuration.output, &file)?;
    if !arguments.quiet {
        advise(&configuration, &file);
        if arguments.out.is_none() {
            advise_on_files(&configuration.output, &file);
        }
    }
    let settings = std::mem::take(&mut configuration.recording);
    let threads = usize::from(arguments.threads);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(Failure::usage)?;
    let recording = pool.install(|| obtain(&settings, arguments, &file))?;
    let recording = with_world(recording, &settings, &file)?;
    let pairs = settings.pairs.as_deref();
    Detector::check(&recording, pairs).map_err(|error| refused(&error, &file))?;
    let named = Detector::pairs(&recording, pairs).map_err(|error| refused(&error, &file))?;
    let explained = arguments.explain.iter().map(|pair| explain::find(pair, &named));
    let explained = explained.collect::<Result<BTreeSet<usize>, _>>()?;
    if let Some(folder) = &arguments.out {
        // Found out now, before the work.
        output::make_folder(folder)?;
    }
    let wanted = configuration.output.clone();
    let detector = Detector::new(configuration);
    detector.check_base(&recording).map_err(|error| refused(&error, &file))?;
    let mut detection = pool
        .install(|| detect(&detector, &recording, pairs, arguments.quiet))
        .map_err(|error| refused(&error, &file))?;
    for &index in &explained {
        detection.pairs[index].explanation = Some(detector.explain(&detection.pairs[index]));
    }
    let shown = detection.repaired.as_ref().unwrap_or(&recording);
    let report = Report { detection: &detection, recording: shown, settings: &file.text };
    if let Some(folder) = &arguments.out {
        #[cfg_attr(not(feature = "mcap"), allow(unused_mut))]
        let mut files = files(&report, &wanted);
        #[cfg(feature = "mcap")]
        if wanted.mcap {
            let log = jointscope_report::to_mcap(&report).map_err(Failure::data)?;
            files.push(("recording.mcap".into(), log));
        }
        let paths: Vec<PathBuf> = files.iter().map(|(name, _)| folder.join(name)).collect();
        let files: Vec<(&Path, &[u8])> =
            paths.iter().map(PathBuf::as_path).zip(files.iter().map(|(_, content)| content.as_slice())).collect();
        output::write_files(&files)?;
    }
    output::print(&match arguments.format {
        Printed::Table => explained.iter().fold(to_styled_table(&detection, terminal::style()), |text, &index| {
            text + "\n" + &to_explanation(&detection.pairs[index])
        }),
        Printed::Json => to_json(&detection),
        Printed::Html => to_html(&report),
        Printed::Svg => to_svg(&report),
        Printed::Urdf => to_urdf(&report),
        Printed::Mjcf => to_mjcf(&report),
    })
}

/// The files that `--out` writes, by their names.
fn files(report: &Report<'_>, wanted: &OutputSettings) -> Vec<(String, Vec<u8>)> {
    let mut files = vec![("detection.json".to_owned(), to_json(report.detection).into_bytes())];
    if wanted.html {
        files.push(("report.html".into(), to_html(report).into_bytes()));
    }
    if wanted.svg {
        files.push(("report.svg".into(), to_svg(report).into_bytes()));
        let pairs = pairs_to_svg(report).into_iter().enumerate();
        files.extend(pairs.map(|(number, svg)| (format!("pair-{}.svg", number + 1), svg.into_bytes())));
    }
    if wanted.urdf {
        files.push(("mechanism.urdf".into(), to_urdf(report).into_bytes()));
    }
    if wanted.mjcf {
        files.push(("mechanism.xml".into(), to_mjcf(report).into_bytes()));
    }
    files
}

/// A configuration's file, for errors that point into it.
pub(super) struct ConfigurationFile<'a> {
    pub(super) path: &'a Path,
    text: String,
}

impl ConfigurationFile<'_> {
    pub(super) fn failure(&self, error: SettingsError) -> Failure {
        Failure::configuration(self.path, &self.text, error)
    }

    /// Something wrong with a word under `[recording]`.
    fn wrong(&self, key: &str, word: &str, message: String, help: &str) -> Failure {
        let place = place::of_word(&self.text, "recording", key, word);
        self.failure(SettingsError::at(place, message).help(help))
    }
}

/// The default configuration, which is an empty one.
fn default_configuration() -> Result<(ConfigurationFile<'static>, Configuration), Failure> {
    let file = ConfigurationFile {
        path: Path::new("the default configuration"),
        text: "# The default configuration\n".into(),
    };
    let configuration = Configuration::parse(&file.text, &catalog()?).map_err(|error| file.failure(error))?;
    Ok((file, configuration))
}

/// Remarks on what is allowed, but hardly meant.
pub(super) fn advise(configuration: &Configuration, file: &ConfigurationFile<'_>) {
    let anything = configuration.models.iter().any(|named| named.kind == "free");
    if configuration.rule.kind() == RuleKind::Likelihood && !anything {
        output::remark(
            file.path,
            "no model is of the kind `free`: every motion will be one of the joints named, and no pair disconnected; \
             to change that, add [models.disconnected] with kind = \"free\"",
        );
    }
}

/// A remark on files that are asked for, where nothing says in which folder.
fn advise_on_files(wanted: &OutputSettings, file: &ConfigurationFile<'_>) {
    let OutputSettings { base: _, html, svg, urdf, mjcf, mcap } = wanted;
    let switches = [("html", html), ("svg", svg), ("urdf", urdf), ("mjcf", mjcf), ("mcap", mcap)];
    let asked: Vec<String> = switches.iter().filter(|(_, on)| **on).map(|(key, _)| format!("`{key}`")).collect();
    if !asked.is_empty() {
        let text = format!("[output] asks for {}, which is written only with --out DIR", asked.join(", "));
        output::remark(file.path, &text);
    }
}

/// Refuses files that this program cannot write.
pub(super) fn check_output(wanted: &OutputSettings, file: &ConfigurationFile<'_>) -> Result<(), Failure> {
    if wanted.mcap && cfg!(not(feature = "mcap")) {
        let place = place::of_word(&file.text, "output", "mcap", "");
        let error = SettingsError::at(place, "this program was built without the feature `mcap`");
        return Err(file.failure(error.help("build it with `--features mcap`, or take `mcap` out")));
    }
    Ok(())
}

/// Reads and checks a configuration.
pub(super) fn read_configuration(path: &Path) -> Result<(ConfigurationFile<'_>, Configuration), Failure> {
    let bytes = fs::read(path).map_err(|error| {
        let advice = match error.kind() {
            ErrorKind::IsADirectory => "name a file in it",
            ErrorKind::PermissionDenied => "check the permissions of the file and its folders",
            _ => "check the path",
        };
        Failure::usage(format!("{}: the configuration cannot be read: {error}; {advice}", path.display()))
    })?;
    let mut text = String::from_utf8(bytes).map_err(|error| {
        let sound = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..sound].split(|byte| *byte == b'\n').count();
        Failure::usage(format!(
            "{}, line {line}: needed UTF-8 text, but byte {sound} of the file is not; save the file as UTF-8",
            path.display()
        ))
    })?;
    // A byte order mark would count as a column.
    if text.starts_with('\u{feff}') {
        text.remove(0);
    }
    let file = ConfigurationFile { path, text };
    match Configuration::parse(&file.text, &catalog()?) {
        Ok(configuration) => Ok((file, configuration)),
        Err(error) => Err(file.failure(error)),
    }
}

/// Reads the file or simulates the scene that the command line names, or else the configuration.
fn obtain(
    settings: &RecordingSettings,
    arguments: &Arguments,
    file: &ConfigurationFile<'_>,
) -> Result<Recording, Failure> {
    let read = |paths: &[PathBuf]| read(paths, settings, arguments, file);
    if !arguments.input.is_empty() {
        read(&arguments.input)
    } else if let Some(scene) = &arguments.scene {
        simulated(scene, 0..0, settings)
            .map_err(|error| Failure::usage_with_help(error.message, &error.help.unwrap_or_default()))
    } else if let Some(paths) = settings.files() {
        let folder = file.path.parent().unwrap_or(Path::new(""));
        read(&paths.iter().map(|path| folder.join(path)).collect::<Vec<_>>())
    } else if let Some(scene) = &settings.scene {
        simulated(scene.as_ref(), scene.span(), settings).map_err(|error| file.failure(error))
    } else {
        let help = "write `path` or `scene` under [recording], or give --input PATH or --scene NAME";
        Err(Failure::usage_with_help(format!("{}: no recording is named", file.path.display()), help))
    }
}

/// Reads one file, or several as one recording, with its markers put together to bodies as the settings say.
fn read(
    paths: &[PathBuf],
    settings: &RecordingSettings,
    arguments: &Arguments,
    file: &ConfigurationFile<'_>,
) -> Result<Recording, Failure> {
    let grouping = match &settings.bodies {
        None => Grouping::Own,
        Some(Bodies::Suggest) => Grouping::Suggested,
        Some(Bodies::Patterns(bodies)) => {
            let body = |(name, patterns): &(String, Vec<String>)| BodyPatterns {
                name: name.clone(),
                patterns: patterns.clone(),
            };
            Grouping::Patterns(bodies.iter().map(body).collect())
        }
    };
    let options = ReadOptions {
        format: arguments.input_format.or(word(settings.format.as_ref(), file)?),
        unit: arguments.unit.or(word(settings.unit.as_ref(), file)?),
        grouping,
    };
    let read = |path: &PathBuf| {
        let (recording, notes) = read_with_notes(path, &options).map_err(|error| unread(error, file))?;
        if !arguments.quiet {
            for note in &notes {
                output::remark(path, note);
            }
        }
        Ok((path.clone(), recording))
    };
    let mut recordings = paths.iter().map(read).collect::<Result<Vec<_>, Failure>>()?;
    match recordings.pop() {
        Some((_, recording)) if recordings.is_empty() => Ok(recording),
        last => join(recordings.into_iter().chain(last).collect()).map_err(Failure::data),
    }
}

fn unread(error: RecordingError, file: &ConfigurationFile<'_>) -> Failure {
    match error {
        RecordingError::Pattern { path, body, pattern, problem, help } => {
            let message = format!("{}: body `{body}`: {problem}: `{pattern}`", path.display());
            file.wrong("bodies", &pattern, message, &help)
        }
        RecordingError::Ungrouped { .. } => {
            let help = "say which under [recording], for example bodies.wheel = [\"W1\", \"W2\", \"W3\"]; \
                        `inspect FILE --suggest-bodies` writes a configuration to start from, and \
                        bodies = \"suggest\" takes its suggestion";
            Failure::data_with_help(error, help)
        }
        RecordingError::UnknownExtension { .. } => {
            let help =
                "give, for example, --input-format csv with --input, or write format = \"csv\" under [recording]";
            Failure::data_with_help(error, help)
        }
        _ => Failure::data(error),
    }
}

/// A word of the configuration that stands for something.
pub(super) fn word<T: FromStr<Err: Display>>(
    word: Option<&Spanned<String>>,
    file: &ConfigurationFile<'_>,
) -> Result<Option<T>, Failure> {
    let parse = |word: &Spanned<String>| {
        T::from_str(word.as_ref()).map_err(|error| file.failure(SettingsError::at(word.span(), error.to_string())))
    };
    word.map(parse).transpose()
}

/// The recording of a scene that is named at a place of the configuration.
fn simulated(scene: &str, place: Range<usize>, settings: &RecordingSettings) -> Result<Recording, SettingsError> {
    let options = SceneOptions {
        seed: settings.seed.unwrap_or(0),
        noise: settings.noise,
        frames: settings.frames,
        ..SceneOptions::default()
    };
    match simulate(scene, &options) {
        Ok(simulation) => Ok(simulation.recording),
        Err(SceneError::UnknownScene { name, .. }) => Err(unknown_scene(&name, place)),
        Err(SceneError::TooFast { body, degrees, .. }) => {
            Err(SettingsError::at(place, too_fast(&body, degrees)).help("raise `frames` under [recording]"))
        }
        Err(error) => Err(SettingsError::at(place, error.to_string())),
    }
}

/// Adds the body at rest that the settings name.
fn with_world(
    recording: Recording,
    settings: &RecordingSettings,
    file: &ConfigurationFile<'_>,
) -> Result<Recording, Failure> {
    let Some(name) = &settings.world else { return Ok(recording) };
    recording.with_world(name).map_err(|_| {
        let message = format!("the recording has a body `{name}` of its own");
        file.wrong("world", name, message, "give the world a name that no body has")
    })
}

/// A recording that cannot be analysed as the configuration says.
fn refused(error: &DetectionError, file: &ConfigurationFile<'_>) -> Failure {
    match error {
        DetectionError::UnknownBody { name, known } => {
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            let help = settings::unknown("body", name, 0..0, &known).help.unwrap_or_default();
            file.wrong("pairs", name, format!("the recording has no body `{name}`"), &help)
        }
        DetectionError::UnknownBase { name, known } => {
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            let help = settings::unknown("body", name, 0..0, &known).help.unwrap_or_default();
            let place = place::of_word(&file.text, "output", "base", name);
            let message = format!("the recording has no body `{name}` to be the base");
            file.failure(SettingsError::at(place, message).help(help))
        }
        DetectionError::PairOfOne { name } => {
            file.wrong("pairs", name, error.to_string(), "name two bodies, the reference first")
        }
        DetectionError::Rule { reference, moving, error } => {
            let error = jointscope_detection::place::in_text(&file.text, (**error).clone());
            let message = format!("{reference} - {moving}: {}", error.message);
            file.failure(SettingsError { message, ..error })
        }
        _ => Failure::usage(error),
    }
}

fn detect(
    detector: &Detector,
    recording: &Recording,
    pairs: Option<&[[String; 2]]>,
    quiet: bool,
) -> Result<Detection, DetectionError> {
    /// Work shorter than this shows no bar.
    const PATIENCE: Duration = Duration::from_millis(300);

    let bar = if quiet {
        ProgressBar::hidden()
    } else {
        ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10))
    };
    bar.set_style(
        ProgressStyle::with_template("{bar:40} {pos} of {len} pairs, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    let start = std::time::Instant::now();
    let watch = |done: usize, of: usize| {
        if start.elapsed() > PATIENCE {
            bar.set_length(of as u64);
            bar.set_position(done as u64);
        }
    };
    let detection = detector.detect_watched(Cow::Borrowed(recording), pairs, &watch);
    bar.finish_and_clear();
    detection
}
