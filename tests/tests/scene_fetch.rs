//! `make scenes`: converters on a small track that the test writes, and what the command says about sources
//! that it cannot have. Nothing here uses the network.

use parallax_tests::{program, root, run_ok};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Python without byte code files beside the sources; none, with a line on stderr, where it is absent.
fn python() -> Option<Command> {
    let found = Command::new("python3").arg("--version").output();
    if !found.is_ok_and(|output| output.status.success()) {
        parallax_tests::skipped!("python3 is absent");
        return None;
    }
    let mut command = Command::new("python3");
    command.arg("-B").current_dir(root());
    // Nothing listens on the discard port.
    for proxy in ["http_proxy", "https_proxy"] {
        command.env(proxy, "http://127.0.0.1:9");
    }
    Some(command)
}

fn make(folder: &Path, scene: &str) -> Option<Output> {
    let mut command = python()?;
    command.arg("scripts/scenes/make.py").arg(folder).arg(scene);
    Some(command.output().expect("python3 starts"))
}

#[test]
fn a_track_converts_and_loads() {
    let Some(mut command) = python() else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = run_ok(command.arg("tests/scenes/synthetic.py").arg(folder.path()));
    if String::from_utf8_lossy(&output.stdout).contains("images: skipped") {
        parallax_tests::skipped!("images of converted scenes: Pillow is absent");
    }
    let track = folder.path().join("made/track.gltf");
    let output = run_ok(program("tracegen").arg("scenes").arg(track));
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("triangles  8 (8 unique)"), "{text}");
    assert!(text.contains("eye (0.00, 1.00, 5.00)"), "{text}");
}

#[test]
fn an_unreachable_source_is_a_line_and_no_failure() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(output) = make(folder.path(), "utah-teapot") else {
        return;
    };
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}");
    assert!(text.starts_with("skipped: utah-teapot: https://"), "{text}");
    assert_eq!(text.lines().count(), 1, "{text}");
    assert!(!folder.path().join("utah-teapot").exists());
}

fn assert_refused(output: &Output, parts: [&str; 2]) {
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{errors}");
    for part in parts {
        assert!(errors.contains(part), "{errors}");
    }
}

#[test]
fn a_wrong_file_is_named_with_both_checksums() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let source = folder.path().join("downloads/utah-teapot");
    fs::create_dir_all(&source).expect("a folder");
    fs::write(source.join("teapot.bpt"), "32").expect("a file");
    let Some(output) = make(folder.path(), "utah-teapot") else {
        return;
    };
    assert_refused(
        &output,
        [
            "teapot.bpt: expected 7568 bytes, SHA-256 264d37f8",
            "found 2 bytes, e29c9c18",
        ],
    );
    let left = fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(left, 1, "only the downloads are left");
}

#[test]
fn a_scene_that_is_not_in_the_table_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(output) = make(folder.path(), "teapot") else {
        return;
    };
    assert_refused(&output, ["utah-teapot", "found 'teapot'"]);
}
