//! What the memory layout does to the figures of a trace, and what warns of figures that are easily taken for others.

use parallax_tests::{program, root, run_ok};
use std::process::Output;

/// `replay` with arguments on the golden jungle, whose shadow maps are 2048 texels wide.
fn replay(subcommand: &str, arguments: &[&str]) -> Output {
    let trace = root().join("traces/jungle.textrace");
    run_ok(program("replay").arg(subcommand).arg(trace).args(arguments))
}

fn external_bytes(arguments: &[&str]) -> f64 {
    let output = replay("run", &[arguments, &["--json"]].concat());
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let bytes = json["result"]["external_bytes"].as_f64();
    bytes.expect("a number of bytes")
}

#[test]
fn modes_agree_on_bytes_unless_shadow_maps_are_linear() {
    let difference = |layout: &[&str]| {
        let of = |mode| external_bytes(&[layout, &["--mode", mode]].concat());
        of("functional") / of("timed") - 1.0
    };
    let tiled = difference(&[]);
    assert!(tiled.abs() < 0.005, "{tiled}");
    let linear = difference(&["--shadow-map-order", "linear"]);
    assert!(linear > 0.05, "{linear}");
}

#[test]
fn a_linear_shadow_map_is_a_choice_in_the_file_too() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("linear.toml");
    let text = "mode = \"functional\"\nlayout.shadow_map_order = \"linear\"\n";
    std::fs::write(&path, text).expect("the file is written");
    let file = path.to_string_lossy();
    let by_file = external_bytes(&["--config", &file]);
    let functional = ["--mode", "functional"];
    let by_flag = external_bytes(&[&functional[..], &["--shadow-map-order", "linear"]].concat());
    assert_eq!(by_file, by_flag);
    // Every row of such a map falls into the same L1 sets.
    assert!(by_file > 1.5 * external_bytes(&functional));
}

/// Misses in flight that take ways leave fewer to others.
#[test]
fn allocation_on_a_miss_costs_bytes_where_sets_are_crowded() {
    let linear = ["--shadow-map-order", "linear", "--allocation"];
    let of = |allocation| external_bytes(&[&linear[..], &[allocation]].concat());
    assert!(of("on-miss") > 1.02 * of("on-fill"));
}

#[test]
fn bytes_of_the_first_miss_model_come_with_a_warning_outside_the_papers_preset() {
    let stderr = |subcommand, arguments: &[&str]| {
        let output = replay(subcommand, &[arguments, &["-q"]].concat());
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let bare = ["--tmu", "first-miss"];
    let one = ["--caches", "8/128", "--orders", "morton"];
    for warned in [
        stderr("run", &bare),
        stderr("run", &[&bare[..], &["--json"]].concat()),
        stderr("run", &["--preset", "z2-paper", "--loop-cycles", "64"]),
        stderr("paper", &[&bare[..], &one[..]].concat()),
    ] {
        for part in [
            "warning",
            "external bytes count",
            "--tmu looping",
            "--preset z2-paper",
        ] {
            assert!(warned.contains(part), "no {part:?} in {warned:?}");
        }
    }
    for quiet in [
        stderr("run", &["--preset", "z2-paper"]),
        stderr("run", &["--mode", "timed"]),
        stderr("paper", &[&["--preset", "z2-paper"][..], &one[..]].concat()),
    ] {
        assert!(!quiet.contains("first-miss"), "{quiet}");
    }
}
