//! Configurations and documents are true.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
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

/// How far a number may differ from the README's, in its own unit: some last digits of the simulation hang on the
/// system's sine and cosine.
const PRINTED: f64 = 0.02;

fn printed_by(arguments: &[&str]) -> String {
    let program = env!("CARGO_BIN_EXE_jointscope-with-common-centre");
    let output = Command::new(program).args(arguments).current_dir(PROJECT).output().expect("the program starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Whether two texts say the same, word by word, with numbers to within [`PRINTED`].
fn say_the_same(one: &str, other: &str) -> bool {
    let same = |(a, b): (&str, &str)| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => (a - b).abs() <= PRINTED,
        _ => a == b,
    };
    one.split_whitespace().count() == other.split_whitespace().count()
        && one.split_whitespace().zip(other.split_whitespace()).all(same)
}

fn table(text: &str, head: &str) -> String {
    text.lines()
        .skip_while(|line| !line.starts_with(head))
        .take_while(|line| line.starts_with('|'))
        .collect::<Vec<_>>()
        .join("\n")
}

#[test]
fn the_readme_shows_what_its_commands_print() {
    let readme = fs::read_to_string(Path::new(PROJECT).join("README.md")).expect("the README");
    let shown =
        readme.split("```text\n").nth(1).and_then(|rest| rest.split("```").next()).expect("the fridge's result");
    let printed = printed_by(&["run", "--config", "configs/fridge.toml"]);
    assert!(say_the_same(shown, &printed), "the fridge: the README shows\n{shown}\nbut it is\n{printed}");
    // That of the experiments takes minutes in a build for tests: continuous integration compares it in a release.
    let (shown, printed) = (table(&readme, "| theta"), table(&printed_by(&["reproduce", "table2"]), "| theta"));
    assert!(
        !printed.is_empty() && say_the_same(&shown, &printed),
        "Table 2: the README shows\n{shown}\nbut it is\n{printed}"
    );
}

#[test]
fn the_model_that_the_page_on_plugins_shows_is_the_one_that_is_tested() {
    let read = |path: &str| fs::read_to_string(Path::new(PROJECT).join(path)).expect("a file");
    let (page, model) = (read("docs/plugins.md"), read("tests/src/gantry.rs"));
    let begins = "```rust\nimpl JointModel for Gantry";
    let shown = page.split(begins).nth(1).and_then(|rest| rest.split("```").next()).expect("the model");
    let whole = model.split("\nimpl JointModel for Gantry").nth(1).expect("the model");
    assert_eq!(shown, whole);
}

#[test]
fn every_link_between_documents_leads_somewhere() {
    /// An example that may be deleted; nothing but links knows of it.
    const EXAMPLE: &str = "examples/gear-coupled";
    let example_is_there = Path::new(PROJECT).join(EXAMPLE).exists();
    let mut checked = 0;
    for document in [
        "README.md",
        "ARCHITECTURE.md",
        "CONTRIBUTING.md",
        "CHANGELOG.md",
        "docs/configuration.md",
        "docs/formats.md",
        "docs/method.md",
        "docs/plugins.md",
        "docs/accuracy.md",
        "docs/real-recordings.md",
        "docs/performance.md",
        "docs/report.md",
        "docs/robots.md",
    ] {
        let path = Path::new(PROJECT).join(document);
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{document}: {error}"));
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let target = path.parent().expect("a folder").join(link.split('#').next().unwrap_or_default());
            if !example_is_there && link.contains(EXAMPLE) {
                continue;
            }
            assert!(target.exists(), "{document} links {link}");
            checked += 1;
        }
    }
    assert!(checked > 10);
}
