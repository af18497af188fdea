//! The report's page in a browser, where there is one: it runs without errors, draws axes, and its slider moves things.

use std::{
    path::Path,
    process::{Command, Stdio},
};

/// Chromium by the names it goes by; `JOINTSCOPE_BROWSER` names another.
fn browser() -> Option<String> {
    let named = std::env::var("JOINTSCOPE_BROWSER").ok();
    let known = ["chromium", "chromium-browser", "google-chrome", "chrome"].map(String::from);
    let runs = |name: &String| {
        let found = Command::new(name).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        found.is_ok_and(|status| status.success())
    };
    named.into_iter().chain(known).find(runs)
}

/// The page as it is after its scripts ran, and what the browser's console says.
fn open(browser: &str, page: &Path, part: &str, folder: &Path) -> (String, String) {
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"])
        .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
        .args(["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
        .args(["--enable-logging=stderr", "--virtual-time-budget=20000", "--window-size=900,800", "--dump-dom"])
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .arg(format!("file://{}{part}", page.display()))
        .output()
        .expect("the browser starts");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (text(output.stdout), text(output.stderr))
}

fn complaints(console: &str) -> Vec<&str> {
    let complaint = |line: &&str| {
        line.contains("CONSOLE") && ["Uncaught", "Refused", "Error", "violates"].iter().any(|word| line.contains(word))
    };
    console.lines().filter(complaint).collect()
}

/// A number of what the page's own check found.
fn found(page: &str, name: &str) -> f64 {
    let check = page.split("data-check=\"").nth(1).and_then(|rest| rest.split('"').next()).unwrap_or_default();
    let after = check.split(&format!("{name}&quot;:")).nth(1).unwrap_or_default();
    let number: String = after.chars().take_while(|c| c.is_ascii_digit() || *c == '.').collect();
    number.parse().unwrap_or_else(|_| panic!("the page's check does not tell `{name}`: {check}"))
}

#[test]
fn the_page_draws_axes_and_its_slider_moves_the_picture() {
    let Some(browser) = browser() else {
        eprintln!("no browser: the test of the report's page was skipped; install chromium to run it");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    for scene in ["fridge", "prismatic", "spherical"] {
        let page = folder.path().join(format!("{scene}.html"));
        let output = Command::new(env!("CARGO_BIN_EXE_jointscope"))
            .args(["run", "--config", concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs/default.toml")])
            .args(["--scene", scene, "--format", "html"])
            .output()
            .expect("the program starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        std::fs::write(&page, output.stdout).expect("written");
        let (shown, console) = open(&browser, &page, "#check", folder.path());
        assert_eq!(complaints(&console), Vec::<&str>::new(), "{scene}");
        assert!(found(&shown, "joints") >= 1.0, "{scene} has joints");
        assert!(found(&shown, "axes") > 200.0, "{scene}: pixels of axes: {}", found(&shown, "axes"));
        assert!(found(&shown, "moved") > 200.0, "{scene}: pixels that the slider changes: {}", found(&shown, "moved"));
        assert!(shown.contains("class=\"moment\"") && shown.contains("translate(27"), "charts show the last moment");
    }
}
