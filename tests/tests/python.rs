//! The Python package: its own tests and its notebooks, in a fresh virtual environment.

use parallax_tests::{has_lavapipe, packed, program, root};
use std::path::Path;
use std::process::Command;

#[test]
fn the_package_passes_its_tests_and_the_notebooks_run() {
    if !has_lavapipe() {
        return;
    }
    let replay = program("replay");
    let replay = Path::new(replay.get_program());
    let out = tempfile::tempdir().expect("a temporary folder");
    let Some(wheel) = packed(out.path(), "wheel") else {
        return;
    };
    let output = Command::new(root().join("scripts/notebooks.sh"))
        .env("OUT", out.path())
        .env("PARALLAX_WHEEL", &wheel)
        .env("PARALLAX_REPLAY", replay)
        .env_remove("UPDATE_NOTEBOOKS")
        .output()
        .expect("sh starts");
    let text = String::from_utf8_lossy(&output.stdout);
    if output.status.code() == Some(3) {
        let reason = text.lines().find_map(|line| line.strip_prefix("SKIPPED: "));
        parallax_tests::skipped!("{}", reason.unwrap_or("the Python package"));
        return;
    }
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}\n{errors}");
    if let Some(reason) = text.lines().find_map(|line| line.strip_prefix("SKIPPED: ")) {
        parallax_tests::skipped!("{reason}");
    }
    for expected in [
        " passed",
        "foveation.ipynb: ",
        "what-l2.ipynb: ",
        "where-the-misses-are.ipynb: ",
        "which-order.ipynb: ",
    ] {
        assert!(text.contains(expected), "{text}");
    }
}
