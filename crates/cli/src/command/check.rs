//! `check`: whether a configuration can be used, without using it.

use std::path::{Path, PathBuf};

use clap::Args;
use jointscope_detection::Configuration;
use jointscope_recordings::{Format, Unit};
use jointscope_report::printable;
use jointscope_scenes::names;

use super::{
    run::{ConfigurationFile, advise, check_output, read_configuration, word},
    unknown_scene,
};
use crate::{failure::Failure, output};

/// Check a configuration without running it
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The configuration
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (file, configuration) = read_configuration(&arguments.config)?;
    let recording = recording(&configuration, &file)?;
    check_output(&configuration.output, &file)?;
    advise(&configuration, &file);
    let models: Vec<String> = configuration.models.iter().map(|model| printable(&model.name)).collect();
    output::print(&format!(
        "{}: sound\n  recording  {recording}\n  models     {}\n  rule       {}\n",
        printable(&file.path.display().to_string()),
        models.join(", "),
        configuration.rule.kind().word(),
    ))
}

/// What will be analysed; its words are checked, and that a file is there.
fn recording(configuration: &Configuration, file: &ConfigurationFile<'_>) -> Result<String, Failure> {
    let settings = &configuration.recording;
    word::<Format>(settings.format.as_ref(), file)?;
    word::<Unit>(settings.unit.as_ref(), file)?;
    if let Some(scene) = &settings.scene {
        let known = names().iter().any(|(name, _)| name == scene.as_ref());
        let unknown = || file.failure(unknown_scene(scene.as_ref(), scene.span()));
        return known.then(|| format!("the scene {}", printable(scene.as_ref()))).ok_or_else(unknown);
    }
    let Some(paths) = settings.files() else { return Ok("none; give --input PATH or --scene NAME to `run`".into()) };
    let folder = file.path.parent().unwrap_or(Path::new(""));
    let there = |path: &PathBuf| {
        let path = folder.join(path);
        let shown = printable(&path.display().to_string());
        match path.try_exists() {
            Ok(true) => Ok(shown),
            _ => Err(Failure::data_with_help(
                format!("{shown}: the recording that the configuration names is not there"),
                "paths are relative to the configuration's folder; `run --input PATH` takes another one",
            )),
        }
    };
    let files = paths.iter().map(there).collect::<Result<Vec<_>, _>>()?.join(", ");
    Ok(format!("{files} (there, but not read: `inspect` and `run` do that)"))
}
