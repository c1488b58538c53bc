//! Tests of the built program: version, help and exit codes.

use std::process::{Command, Output};

fn replay(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_replay"))
        .args(arguments)
        .output()
        .expect("the program starts")
}

#[test]
fn version_names_the_program() {
    let output = replay(&["--version"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&output.stdout).starts_with("replay "));
}

#[test]
fn wrong_usage_exits_with_code_2_and_empty_stdout() {
    for arguments in [
        &["no-such-command"][..],
        &["run"],
        &["run", "--no-such-flag"],
    ] {
        let output = replay(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        assert!(!output.stderr.is_empty(), "{arguments:?}");
    }
}

/// The error message of a wrong use of the program.
fn refusal(arguments: &[&str]) -> String {
    let output = replay(arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_page_and_a_table_with_the_same_path_are_refused_before_any_work() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (csv, html) = (path("x.csv"), path("x.html"));
    let text = refusal(&["paper", "no.textrace", "--csv", &csv, "--html", &html]);
    assert!(text.contains("the same output twice"), "{text}");
}

#[test]
fn an_impossible_point_is_refused_before_a_trace_is_opened() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("x.toml");
    let text = "[axes]\nl1.ways = [3]\nl1.size_bytes = [\"6KiB\"]\nl1.replacement = [\"lru\", \"tree-plru\"]\n";
    std::fs::write(&file, text).expect("written");
    let text = refusal(&["sweep", &file.display().to_string(), "no.textrace"]);
    assert!(text.contains("x.toml: point l1.ways=3"), "{text}");
    assert!(text.contains("tree-plru: expected 1, 2, 4"), "{text}");
}

#[cfg(unix)]
#[test]
fn a_settings_file_without_end_is_refused() {
    let text = refusal(&["run", "no.textrace", "--config", "/dev/zero"]);
    assert!(text.contains("expected at most 4 MiB of TOML"), "{text}");
}
