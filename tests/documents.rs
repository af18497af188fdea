//! Configurations and documents are true.

use std::{
    fs,
    path::{Path, PathBuf},
};

use jointscope_detection::Configuration;
use jointscope_models::Catalog;
use jointscope_scenes::EXPERIMENTS;

const PROJECT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

fn configurations() -> Vec<(PathBuf, Configuration)> {
    let catalog = Catalog::linked().expect("unique names");
    let listed = fs::read_dir(Path::new(PROJECT).join("configs")).expect("the folder");
    let mut paths: Vec<PathBuf> = listed.map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    let parse = |path: PathBuf| {
        let text = fs::read_to_string(&path).expect("text");
        match Configuration::parse(&text, &catalog) {
            Ok(configuration) => (path, configuration),
            Err(error) => panic!("{}: {error}", path.display()),
        }
    };
    paths.into_iter().map(parse).collect()
}

#[test]
fn every_configuration_is_valid_and_its_recording_exists() {
    let names = jointscope_scenes::names();
    for (path, configuration) in configurations() {
        let folder = path.parent().expect("a folder");
        if let Some(recording) = &configuration.recording.path {
            assert!(folder.join(recording).is_file(), "{}: {}", path.display(), recording.display());
        }
        if let Some(scene) = &configuration.recording.scene {
            assert!(
                names.iter().any(|(name, _)| name == scene.as_ref()),
                "{}: scene {}",
                path.display(),
                scene.as_ref()
            );
        }
    }
}

#[test]
fn every_experiment_has_a_configuration_with_the_thesis_pairs() {
    let configurations = configurations();
    for experiment in &EXPERIMENTS {
        let of_it =
            |(path, _): &&(PathBuf, Configuration)| path.file_stem().is_some_and(|stem| stem == experiment.scene);
        let (_, configuration) = configurations.iter().find(of_it).expect("a configuration named as the scene");
        let pairs: Vec<[&str; 2]> = experiment.pairs.iter().map(|pair| [pair.reference, pair.moving]).collect();
        let configured = configuration.recording.pairs.as_ref().expect("pairs");
        assert_eq!(configured, &pairs, "{}", experiment.scene);
    }
}

#[test]
fn the_default_configuration_is_what_an_empty_one_means() {
    let text = fs::read_to_string(Path::new(PROJECT).join("configs/default.toml")).expect("the default");
    let catalog = Catalog::linked().expect("unique names");
    let stated = Configuration::parse(&text, &catalog).expect("valid");
    let implied = Configuration::parse("", &catalog).expect("valid");
    assert_eq!(format!("{stated:?}"), format!("{implied:?}"));
}
