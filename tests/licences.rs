//! Every dependency carries a licence that goes with MIT OR Apache-2.0.

use std::process::Command;

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
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--offline", "--locked", "--all-features"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    assert!(packages.len() > 50, "the dependencies are listed");
    let refused: Vec<String> = packages.iter().filter_map(refusal).collect();
    assert!(refused.is_empty(), "not allowed:\n{}", refused.join("\n"));
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
