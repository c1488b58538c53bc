//! Tests of `replay run --timeline`: a file that Perfetto opens, and refusals.

use parallax_tests::{program, root};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Output;

fn run(arguments: &[&str]) -> Output {
    let mut command = program("replay");
    command.arg("run").args(arguments);
    command.output().expect("replay starts")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

#[test]
fn the_file_holds_every_item_and_does_not_depend_on_threads() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let trace = root().join("traces/atrium.textrace");
    let [one, two] = ["1", "2"].map(|threads| {
        let file = folder.path().join(threads);
        let arguments = ["--order", "z2-sta", "--threads", threads, "--timeline"];
        let arguments = [&[text(&trace)], &arguments[..], &[text(&file)]].concat();
        let output = run(&arguments);
        assert!(output.status.success(), "{output:?}");
        assert!(!output.stdout.is_empty());
        fs::read_to_string(file).expect("a file")
    });
    assert_eq!(one, two);
    let found: Value = serde_json::from_str(&one).expect("JSON");
    let events = found["traceEvents"].as_array().expect("events");
    let slices = events.iter().filter(|event| event["ph"] == "X");
    let pairs = slices.filter(|event| {
        let name = event["name"].as_str().expect("a name");
        name.contains("left") && name.contains(" + ") && name.contains("right")
    });
    assert!(pairs.count() > 100);

    // The file can replace the result on standard output.
    let output = run(&[text(&trace), "--order", "z2-sta", "--timeline", "-"]);
    assert_eq!(String::from_utf8_lossy(&output.stdout), one);
}

#[test]
fn timelines_that_cannot_be_recorded_or_written_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let trace = folder.path().join("a.textrace");
    fs::copy(root().join("traces/atrium.textrace"), &trace).expect("a copy");
    let machine = folder.path().join("machine.toml");
    fs::write(&machine, "order = \"z2-sta\"\n").expect("a file");
    let file = folder.path().join("timeline.json");
    let before = fs::read(&trace).expect("a file");
    let (trace_text, machine_text, file_text) = (text(&trace), text(&machine), text(&file));
    for (arguments, expected) in [
        (
            vec![trace_text, "--mode", "functional", "--timeline", file_text],
            "--mode timed",
        ),
        (
            vec![trace_text, "--timeline", trace_text],
            "would replace the input",
        ),
        (
            vec![
                trace_text,
                "--config",
                machine_text,
                "--timeline",
                machine_text,
            ],
            "would replace the input",
        ),
        (
            vec![trace_text, "--json", "--timeline", "-"],
            "the same output twice",
        ),
        (
            vec![trace_text, "--compare-modes", "--timeline", file_text],
            "cannot be used with",
        ),
    ] {
        let output = run(&arguments);
        let messages = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {messages}");
        assert!(messages.contains(expected), "{arguments:?}: {messages}");
    }
    assert_eq!(fs::read(&trace).expect("a file"), before);
    assert!(!file.exists());
}
