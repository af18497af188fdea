//! Every dependency carries a licence that goes with MIT OR Apache-2.0.

use std::process::{Command, Output};

use spdx::{Expression, LicenseReq};

/// Licences that neither restrict users of the project nor those who build on it.
const ALLOWED: [&str; 12] = [
    "MIT",
    "MIT-0",
    "Apache-2.0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "ISC",
    "Zlib",
    "0BSD",
    "CC0-1.0",
    "Unicode-3.0",
    "Unlicense",
    "BSL-1.0",
];

#[test]
fn every_dependency_carries_an_allowed_licence() {
    // Without network only what was downloaded can be asked for: on a fresh machine, what this platform builds.
    let output = match metadata(&["--all-features"]) {
        output if output.status.success() => output,
        _ => metadata(&["--filter-platform", &host()]),
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    assert!(packages.len() > 50, "the dependencies are listed");
    let refused: Vec<String> = packages.iter().filter_map(refusal).collect();
    assert!(refused.is_empty(), "not allowed:\n{}", refused.join("\n"));
}

fn metadata(selection: &[&str]) -> Output {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--offline", "--locked"])
        .args(selection)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo starts")
}

/// The platform's name.
fn host() -> String {
    let output = Command::new("rustc").arg("-vV").output().expect("rustc starts");
    let text = String::from_utf8(output.stdout).expect("text");
    text.lines().find_map(|line| line.strip_prefix("host: ")).expect("rustc names its host").to_owned()
}

fn refusal(package: &serde_json::Value) -> Option<String> {
    let name = format!("{} {}", package["name"].as_str()?, package["version"].as_str()?);
    let Some(licence) = package["license"].as_str() else { return Some(format!("{name}: no licence stated")) };
    // Old crates separate alternatives by a slash.
    let Ok(expression) = Expression::parse(&licence.replace('/', " OR ")) else {
        return Some(format!("{name}: `{licence}` cannot be understood"));
    };
    let allowed = |requirement: &LicenseReq| {
        requirement.addition.is_none() && requirement.license.id().is_some_and(|id| ALLOWED.contains(&id.name))
            || requirement.to_string() == "Apache-2.0 WITH LLVM-exception"
    };
    (!expression.evaluate(allowed)).then(|| format!("{name}: {licence}"))
}
