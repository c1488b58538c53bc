//! Frames with several layers, from the command line to the replay's counts.

use parallax_tests::{program, refuse, run_ok};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

fn capture(folder: &Path, name: &str, options: &[&str]) -> (Command, PathBuf) {
    let path = folder.join(name);
    let mut command = program("tracegen");
    command.args(["raster", "teapot", "--size", "96x80", "--no-plain", "-o"]);
    command.arg(&path).args(options);
    (command, path)
}

fn captured(folder: &TempDir, name: &str, options: &[&str]) -> PathBuf {
    let (mut command, path) = capture(folder.path(), name, options);
    run_ok(&mut command);
    path
}

fn json(arguments: &[&str], trace: &Path) -> Value {
    let output = run_ok(program("replay").args(arguments).arg(trace));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Number of quads in the dump of a trace: the records of a primitive at one position are one quad.
fn dumped_quads(trace: &Path) -> u64 {
    let output = run_ok(program("replay").arg("dump").arg(trace));
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    let quad = |line: &str| {
        let record: Value = serde_json::from_str(line).expect("JSON");
        let number = |key: &str| record[key].as_u64().expect("a number");
        ["pass", "tile", "primitive", "x", "y"].map(number)
    };
    text.lines().map(quad).collect::<BTreeSet<_>>().len() as u64
}

#[test]
fn every_order_replays_all_quads_of_all_layers() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for kind in ["rings", "multi-resolution", "radial-density"] {
        let options = ["--foveate", kind, "--hidden-area-mask"];
        let trace = captured(&folder, &format!("{kind}.textrace"), &options);
        run_ok(program("replay").arg("validate").arg(&trace));
        let info = json(&["info", "--json"], &trace);
        let passes = info["passes"].as_array().expect("passes");
        let layers = match kind {
            // The visible area of the lens does not extend beyond the last ring, so its rate has no layer.
            "rings" => 8,
            "multi-resolution" => 18,
            _ => 2,
        };
        assert_eq!(passes.len(), layers, "{kind}");
        assert!(passes.iter().all(|pass| pass["kind"] == "layer"), "{info}");
        let quads = dumped_quads(&trace);
        let mut lines = BTreeSet::new();
        for order in [
            "scanline",
            "morton",
            "hilbert",
            "z2-lrta",
            "z2-sta",
            "z2-sta-merge",
            "random",
        ] {
            let run = json(
                &["run", "--json", "--mode", "functional", "--order", order],
                &trace,
            );
            assert_eq!(
                run["result"]["quads"].as_u64(),
                Some(quads),
                "{kind} {order}"
            );
            lines.insert(run["result"]["access_hash"].to_string());
        }
        assert_eq!(
            lines.len(),
            1,
            "{kind}: every order makes the same accesses"
        );
    }
}

#[test]
fn a_masked_trace_has_the_version_and_passes_of_a_whole_one_and_fewer_quads() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let whole = captured(&folder, "whole.textrace", &[]);
    let masked = captured(&folder, "masked.textrace", &["--hidden-area-mask"]);
    let head = |path: &Path| fs::read(path).expect("a trace")[..12].to_vec();
    assert_eq!(head(&whole), head(&masked));
    let passes = |path: &Path| {
        let info = json(&["info", "--json"], path);
        info["passes"].as_array().expect("passes").len()
    };
    assert_eq!(passes(&whole), passes(&masked));
    assert!(dumped_quads(&masked) < dumped_quads(&whole));
    let layers = captured(&folder, "layers.textrace", &["--foveate", "rings"]);
    assert_ne!(head(&whole), head(&layers), "layers need minor version 1");
}

#[test]
fn impossible_settings_are_reported() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let refused = |options: &[&str], expected: &[&str]| {
        let (mut command, path) = capture(folder.path(), "refused.textrace", options);
        refuse(&mut command, expected);
        assert!(!path.exists());
    };
    let rings = ["--foveate", "rings"];
    let with = |more: &[&'static str]| [&rings[..], more].concat();
    refused(
        &with(&["--gaze", "80,0"]),
        &["gaze", "80,0 degrees", "50.0 right"],
    );
    refused(&with(&["--gaze=-5,NaN"]), &["gaze", "NaN"]);
    refused(&with(&["--gaze", "left"]), &["--gaze", "'left'"]);
    refused(&with(&["--gaze", "absent.csv"]), &["absent.csv"]);
    refused(&with(&["--rates", "10,20,15,40"]), &["ascending", "15"]);
    refused(&with(&["--rates", "10,20"]), &["--rates", "acuity"]);
    refused(&["--gaze", "1,2"], &["--foveate"]);
    refused(
        &["--foveate", "multi-resolution", "--rates", "acuity"],
        &["--rates", "multi-resolution"],
    );
    let path = folder.path().join("gaze.csv");
    fs::write(&path, "time_s,x_deg,y_deg\n0,0,0\n1,0,70\n").expect("writable");
    let path = path.to_str().expect("UTF-8");
    let (mut command, _) = capture(
        folder.path(),
        "a.textrace",
        &["--foveate", "rings", "--gaze", path],
    );
    refuse(&mut command, &["gaze", "0,70 degrees"]);
}

#[test]
fn a_gaze_path_moves_the_rings_from_frame_to_frame() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let gaze = folder.path().join("gaze.csv");
    fs::write(&gaze, "time_s,x_deg,y_deg\n0,-35,0\n0.0139,35,0\n").expect("writable");
    let gaze = gaze.to_str().expect("UTF-8");
    let options = ["--foveate", "rings", "--frames", "2", "--gaze", gaze];
    let trace = captured(&folder, "moving.textrace", &options);
    let info = json(&["info", "--json"], &trace);
    let passes = info["passes"].as_array().expect("passes");
    assert_eq!(passes.len(), 20);
    // Columns of the non-empty tiles at full rate, by frame.
    let output = run_ok(program("replay").arg("dump").arg(&trace));
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    let mut columns = [BTreeSet::new(), BTreeSet::new()];
    for line in text.lines() {
        let record: Value = serde_json::from_str(line).expect("JSON");
        let pass = &passes[record["pass"].as_u64().expect("a number") as usize];
        if pass["layer"] == 0 {
            let frame = pass["frame"].as_u64().expect("a number") as usize;
            columns[frame].insert(record["tile"].as_u64().expect("a number") % 6);
        }
    }
    let [left, right] = columns.map(|c| (c.iter().sum::<u64>() as f64) / c.len() as f64);
    assert!(left < 2.0 && right > 3.0, "{left} {right}");
}
