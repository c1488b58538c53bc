//! Tests of `replay run --l3` and of `[[level]]` tables.

use parallax_tests::{program, root};
use serde_json::Value;
use std::path::Path;
use std::process::Output;

fn run(arguments: &[&str]) -> Output {
    let mut command = program("replay");
    command.args(arguments);
    command.output().expect("replay starts")
}

fn result(arguments: &[&str]) -> Value {
    let trace = root().join("traces/atrium.textrace");
    let trace = trace.to_str().expect("UTF-8");
    let output = run(&[&["run", trace, "--json"], arguments].concat());
    let messages = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {messages}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn write(folder: &Path, text: &str) -> String {
    let path = folder.join("machine.toml");
    std::fs::write(&path, text).expect("a file");
    path.to_str().expect("UTF-8").to_owned()
}

#[test]
fn a_flag_and_a_table_configure_the_same_l3() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for mode in ["--mode=functional", "--tmu=looping", "--tmu=first-miss"] {
        let flag = result(&[mode, "--l3", "1MiB"]);
        let table = write(
            folder.path(),
            "[[level]]\nsize_bytes = \"8KiB\"\n[[level]]\nsize_bytes = \"128KiB\"\n[[level]]\nsize_bytes = \"1MiB\"\n",
        );
        let table = result(&["--config", &table, mode]);
        assert_eq!(flag["result"], table["result"], "{mode}");
        let levels = flag["result"]["lower_levels"].as_array().expect("levels");
        assert_eq!(levels[0]["name"], "L3");
        let misses = levels[0]["line_misses"].as_u64().expect("a count");
        assert_eq!(flag["result"]["external_bytes"], 16 * misses, "{mode}");
        assert_eq!(
            flag["result"]["l2"]["line_misses"], levels[0]["line_lookups"],
            "{mode}"
        );
    }
}

#[test]
fn each_level_looks_up_the_misses_of_the_level_above() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text = "l3 = {size_bytes = \"64KiB\", line_bytes = 32}\nl4.size_bytes = \"256KiB\"\nl4.line_bytes = 64\nl4.hit_cycles = 120\nl4.replacement = \"srrip\"\n[dram]\n";
    let found = result(&["--config", &write(folder.path(), text)]);
    let levels = found["result"]["lower_levels"].as_array().expect("levels");
    assert_eq!(levels.len(), 2);
    assert_eq!(levels[0]["line_misses"], levels[1]["line_lookups"]);
    let last = levels[1]["line_misses"].as_u64().expect("a count");
    assert_eq!(found["result"]["external_bytes"], 64 * last);
    assert_eq!(found["result"]["dram"]["requests"], last);
}

#[test]
fn levels_that_cannot_be_simulated_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let level = "[[level]]\nsize_bytes = \"1MiB\"\n";
    let trace = root().join("traces/atrium.textrace");
    let trace = trace.to_str().expect("UTF-8");
    let refused = |arguments: &[&str], expected: &str| {
        let output = run(arguments);
        let messages = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {messages}");
        assert!(messages.contains(expected), "{arguments:?}: {messages}");
    };
    for count in [1, 7] {
        let levels = write(folder.path(), &level.repeat(count));
        refused(
            &["run", trace, "--config", &levels],
            "expected 2 to 6 levels, the L1 first",
        );
    }
    let unknown = write(folder.path(), "l3.size_bytes = 4096\nl3.sets = 4\n");
    refused(
        &["run", trace, "--config", &unknown],
        "unknown field `sets`",
    );
    refused(&["locality", trace, "--l3", "1MiB"], "[[level]]");
    refused(&["locality", trace, "--dram", "lpddr4"], "[dram]");
}
