//! Golden traces: what `replay` prints for each is compared byte for byte with the committed JSON.
//! `UPDATE_GOLDEN=1` rewrites the JSON instead; review the diff.

use parallax_tests::{program, root, run_ok};
use std::fs;
use std::path::{Path, PathBuf};

/// Options of each golden result, with the name of its file.
const TEXTRACE_RUNS: &[(&str, &[&str])] = &[
    ("morton-timed", &["--order", "morton", "--mode", "timed"]),
    ("z2-lrta-timed", &["--order", "z2-lrta", "--mode", "timed"]),
    ("z2-sta-timed", &["--order", "z2-sta", "--mode", "timed"]),
    (
        "z2-sta-merge-functional",
        &["--order", "z2-sta-merge", "--mode", "functional"],
    ),
    (
        "scanline-functional",
        &["--order", "scanline", "--mode", "functional"],
    ),
    (
        "zig-zag-functional-16k",
        &[
            "--order",
            "zig-zag",
            "--mode",
            "functional",
            "--l1",
            "16KiB",
            "--l2",
            "256KiB",
        ],
    ),
    (
        "hilbert-functional",
        &["--order", "hilbert", "--mode", "functional"],
    ),
    (
        "random-functional",
        &["--order", "random", "--mode", "functional"],
    ),
];

/// The same for ray traces.
const RAYTRACE_RUNS: &[(&str, &[&str])] = &[
    ("default", &[]),
    ("plain", &["--rule", "none"]),
    (
        "shadows-reused",
        &["--rule", "row+triangle", "--reuse", "shadow"],
    ),
];

fn golden_traces(extension: &str) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = fs::read_dir(root().join("traces"))
        .expect("traces/ exists")
        .map(|entry| entry.expect("traces/ is readable").path())
        .filter(|path| path.extension().is_some_and(|e| e == extension))
        .collect();
    found.sort();
    found
}

fn compare(golden: &Path, actual: &[u8]) {
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        fs::create_dir_all(golden.parent().expect("a golden file has a folder")).expect("folder");
        fs::write(golden, actual).expect("golden file is writable");
        return;
    }
    let expected = fs::read(golden)
        .unwrap_or_else(|e| panic!("{}: {e}; UPDATE_GOLDEN=1 writes it", golden.display()));
    assert!(
        expected == actual,
        "{} differs; got:\n{}",
        golden.display(),
        String::from_utf8_lossy(actual)
    );
}

/// Replays every golden trace of a kind with each set of options.
fn replay_all(extension: &str, at_least: usize, subcommand: &str, runs: &[(&str, &[&str])]) {
    let traces = golden_traces(extension);
    assert!(
        traces.len() >= at_least,
        "golden traces are missing: {traces:?}"
    );
    for trace in traces {
        for (name, options) in runs {
            let mut command = program("replay");
            command.arg(subcommand).arg(&trace).args(*options);
            let output = run_ok(command.arg("--json"));
            compare(
                &trace.with_extension("golden").join(format!("{name}.json")),
                &without_errors(&output.stdout),
            );
        }
    }
}

/// What is known of the figures' errors was measured elsewhere and comes last: it is cut off.
fn without_errors(json: &[u8]) -> Vec<u8> {
    let text = String::from_utf8_lossy(json);
    match text.split_once(",\n  \"errors\": [") {
        Some((results, _)) => format!("{results}\n}}\n").into_bytes(),
        None => json.to_vec(),
    }
}

#[test]
fn every_golden_texture_trace_replays_to_its_golden_result() {
    replay_all("textrace", 3, "run", TEXTRACE_RUNS);
}

#[test]
fn every_golden_ray_trace_reprojects_to_its_golden_result() {
    replay_all("raytrace", 2, "reproject", RAYTRACE_RUNS);
}

#[test]
fn golden_traces_together_stay_below_ten_megabytes() {
    let bytes: u64 = ["textrace", "raytrace"]
        .into_iter()
        .flat_map(golden_traces)
        .map(|path| fs::metadata(path).expect("a trace has a size").len())
        .sum();
    assert!(bytes < 10_000_000, "{bytes} bytes of golden traces");
}

#[test]
fn every_golden_trace_is_valid_and_has_its_recipe() {
    for trace in golden_traces("textrace")
        .into_iter()
        .chain(golden_traces("raytrace"))
    {
        run_ok(program("replay").arg("validate").arg(&trace));
        let recipe = trace.with_extension("recipe");
        assert!(recipe.exists(), "{} is missing", recipe.display());
    }
}
