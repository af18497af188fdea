//! What can be extended is explained, and the steps to extend it are true.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use jointscope_detection::{Configuration, schema, starter};
use jointscope_models::Catalog;
use jointscope_tests as _;

const PROJECT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

fn program(arguments: &[&str], folder: &Path) -> Output {
    let program = env!("CARGO_BIN_EXE_jointscope-with-common-centre");
    Command::new(program).args(arguments).current_dir(folder).output().expect("the program starts")
}

fn printed(arguments: &[&str], folder: &Path) -> String {
    let output = program(arguments, folder);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

#[test]
fn every_model_is_explained_and_in_the_schema_and_its_settings_read_back() {
    let catalog = Catalog::linked().expect("unique names");
    let schema = schema::of_configuration(&catalog);
    assert!(catalog.get("common-centre").is_some(), "the model of this crate is linked");
    for plugin in catalog.iter() {
        let name = plugin.name;
        let page = printed(&["models", name], Path::new(PROJECT));
        for needed in ["`", "References: ", "States ", "from jointscope-"] {
            assert!(page.contains(needed), "`models {name}` lacks {needed:?}:\n{page}");
        }
        let thesis = name.starts_with("thesis-");
        assert!(thesis || page.contains("Convention: "), "`models {name}` lacks its conventions:\n{page}");
        let in_schema = &schema["definitions"][format!("model-{name}")]["properties"]["kind"]["const"];
        assert_eq!(in_schema, name);
        assert!(schema["properties"]["models"]["properties"][name].is_object(), "{name}");

        let rule = "[scoring]\nrule = 'expressions'\n[scoring.expressions]\njoint = 'it'\n";
        let read = |settings: &str| {
            let text = format!("{settings}\n{rule}");
            format!("{:?}", Configuration::parse(&text, &catalog).unwrap_or_else(|error| panic!("{error}: {text}")))
        };
        let defaults = format!("[models.it]\nkind = '{name}'");
        assert_eq!(read(&starter::model_text("it", plugin)), read(&defaults), "{name}");
    }
}

/// The blocks of a section of a document, each with its kind.
fn blocks(document: &str, heading: &str) -> Vec<(String, String)> {
    let text = fs::read_to_string(Path::new(PROJECT).join(document)).expect("the document");
    let section = text.split(&format!("\n## {heading}\n")).nth(1).expect("the section");
    let section = section.split("\n## ").next().unwrap_or(section);
    let mut blocks: Vec<(String, String)> = Vec::new();
    let mut open = false;
    for line in section.lines() {
        match (line.trim().strip_prefix("```"), open) {
            (Some(kind), false) => {
                blocks.push((kind.to_owned(), String::new()));
                open = true;
            }
            (Some(_), true) => open = false,
            (None, true) => {
                let block = &mut blocks.last_mut().expect("a block").1;
                *block += line.trim_start();
                block.push('\n');
            }
            (None, false) => {}
        }
    }
    blocks
}

#[test]
fn the_steps_to_add_a_rule_end_with_its_arithmetic() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let blocks = blocks("CONTRIBUTING.md", "Add a rule");
    let rules: Vec<_> = blocks.iter().filter(|(kind, _)| kind == "toml").collect();
    let [(_, rule)] = rules[..] else { panic!("one rule") };
    fs::write(folder.path().join("my-rule.toml"), rule).expect("written");
    let commands: Vec<&str> =
        blocks.iter().filter(|(kind, _)| kind == "sh").flat_map(|(_, block)| block.lines()).collect();
    assert_eq!(commands.len(), 2);
    let mut last = String::new();
    for command in commands {
        let arguments: Vec<&str> = command.strip_prefix("cargo cli ").expect("the program").split(' ').collect();
        last = printed(&arguments, folder.path());
    }
    assert!(last.contains("base - part: revolute, determined"), "{last}");
    assert!(last.contains("revolute.likelihood * (0.1 + circles.circle_fit) = "), "{last}");
}

#[test]
fn the_expressions_of_the_cascade_reach_the_thesis_verdicts() {
    let verdicts = |config: &str| {
        let config = format!("configs/{config}.toml");
        let json = printed(&["run", "--config", &config, "--scene", "fridge", "--format", "json"], Path::new(PROJECT));
        let detection: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        detection["pairs"].as_array().expect("pairs").iter().map(|pair| pair["confidences"].clone()).collect::<Vec<_>>()
    };
    let (ours, thesis) = (verdicts("expressions"), verdicts("thesis"));
    assert_eq!(ours.len(), 3);
    for (ours, thesis) in ours.iter().zip(&thesis) {
        for (joint, confidence) in thesis.as_object().expect("confidences") {
            let [a, b] = [&ours[joint], confidence].map(|value| value.as_f64().expect("a number"));
            assert!((a - b).abs() <= 1e-15, "{joint}: {a} {b}");
        }
    }
}

#[test]
fn a_mixed_rule_finds_joints_and_explains_both_families() {
    for (scene, joint) in [("prismatic", "prismatic"), ("revolute", "revolute"), ("disconnected", "disconnected")] {
        let arguments = ["run", "--config", "configs/mixed.toml", "--scene", scene, "--explain", "base,part"];
        let json = printed(&[&arguments[..], &["--format", "json"]].concat(), Path::new(PROJECT));
        let detection: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        let pair = &detection["pairs"][0];
        assert_eq!(pair["joint"], joint, "{pair}");
        let explanation = &pair["explanation"];
        assert_eq!(explanation["rule"], "expressions");
        let accounts = explanation["joints"].as_array().expect("joints");
        let of_joint = accounts.iter().find(|account| account["joint"] == joint).expect("its account");
        assert_eq!(of_joint["values"]["confidence"], pair["confidence"]);
        let evidence = explanation["by_evidence"]["joints"].as_array().expect("the evidence");
        assert!(evidence.iter().all(|account| account["values"]["cost"].is_f64()), "{explanation}");
        let text = explanation.to_string();
        assert!(!text.contains(r"\n") && !text.contains("-0.0"), "one line each, and no negative zero: {text}");
        assert!(of_joint["arithmetic"].as_str().expect("words").contains(".likelihood"), "{of_joint}");
        assert_eq!(printed(&arguments, Path::new(PROJECT)).lines().filter(|line| *line == "Why").count(), 1);
    }
}
