//! Tests of `replay view`: the page's data are those of `replay run`, and it loads nothing.

use parallax_tests::{program, refuse, root, run_ok};
use serde_json::Value;
use std::fs;
use std::path::PathBuf;

/// The data of a page.
fn data(page: &str) -> Value {
    let (_, rest) = page.split_once("id=\"view-data\"").expect("data");
    let (_, rest) = rest.split_once('>').expect("the start tag");
    let (json, _) = rest.split_once("</script>").expect("the end tag");
    serde_json::from_str(json).expect("JSON")
}

fn trace(name: &str) -> PathBuf {
    root().join("traces").join(name)
}

fn sum(list: &Value) -> u64 {
    let numbers = list.as_array().expect("a list").iter();
    numbers
        .map(|number| number.as_u64().expect("a count"))
        .sum()
}

#[test]
fn sums_of_tiles_equal_the_counts_of_a_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, orders) in [
        ("atrium.textrace", "morton,z2-sta"),
        ("atrium-shadows.textrace", "zig-zag+sta+offset"),
        // Two frames.
        ("program.textrace", "z2-lrta"),
    ] {
        let file = folder.path().join("view.html");
        let mut command = program("replay");
        command
            .arg("view")
            .arg(trace(name))
            .args(["--orders", orders, "-o"]);
        run_ok(command.arg(&file));
        let page = fs::read_to_string(&file).expect("the page");
        for forbidden in ["<link", "src=\"http", "@import", "fetch("] {
            assert!(!page.contains(forbidden), "{forbidden}");
        }
        let data = data(&page);
        let frames = data["frames"].as_array().expect("frames");
        let passes: Vec<&Value> = (frames.iter())
            .flat_map(|frame| frame["passes"].as_array().expect("passes"))
            .collect();
        for (number, order) in orders.split(',').enumerate() {
            let output = run_ok(
                program("replay")
                    .arg("run")
                    .arg(trace(name))
                    .args(["--json", "--order", order]),
            );
            let run: Value = serde_json::from_slice(&output.stdout).expect("JSON");
            let result = &run["result"];
            let tiles = |key: &str| {
                passes
                    .iter()
                    .map(|pass| sum(&pass["runs"][number][key]))
                    .sum::<u64>()
            };
            let of_run = &data["runs"][number];
            assert_eq!(of_run["external_bytes"], result["external_bytes"]);
            assert_eq!(of_run["cycles"], result["cycles"]);
            assert_eq!(result["l1"]["footprint_misses"], tiles("l1_misses"));
            assert_eq!(result["l2"]["line_misses"], tiles("l2_misses"));
            let line_bytes = data["line_bytes"].as_u64().expect("bytes");
            assert_eq!(result["external_bytes"], tiles("l2_misses") * line_bytes);
            let footprints: u64 = passes.iter().map(|pass| sum(&pass["footprints"])).sum();
            assert_eq!(result["footprints"], footprints);
            for pass in &passes {
                let times = |key: &str| pass["runs"][number][key].as_array().expect("times").iter();
                assert!(
                    times("start")
                        .zip(times("end"))
                        .all(|(start, end)| start.as_u64() <= end.as_u64())
                );
            }
        }
        let quads: u64 = (passes.iter())
            .flat_map(|pass| pass["draws"].as_array().expect("draws"))
            .flat_map(|draw| draw[1].as_array().expect("a list").chunks(2))
            .map(|pair| pair[1].as_u64().expect("a count"))
            .sum();
        let output = run_ok(program("replay").arg("run").arg(trace(name)).arg("--json"));
        let run: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(run["result"]["quads"], quads);
    }
}

#[test]
fn machines_without_a_timeline_and_too_many_orders_are_refused() {
    for (arguments, expected) in [
        (["--mode", "functional"], "--mode timed"),
        (["--order", "z2-sta"], "use --orders"),
        (["--orders", "all"], "expected at most 4"),
        (["--image", "none.png"], "none.png"),
    ] {
        let mut command = program("replay");
        command
            .arg("view")
            .arg(trace("atrium.textrace"))
            .args(arguments);
        refuse(command.args(["-o", "-"]), &[expected]);
    }
}

#[test]
fn maps_of_a_ray_trace_have_the_shares_that_reproject_prints() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("rays.html");
    let trace = trace("chess-rays.raytrace");
    run_ok(
        program("replay")
            .arg("view")
            .arg(&trace)
            .arg("-o")
            .arg(&file),
    );
    let data = data(&fs::read_to_string(&file).expect("the page"));
    let eyes = &data["frames"][0]["passes"];
    let output = run_ok(program("replay").arg("reproject").arg(&trace).arg("--json"));
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    for (run, key) in ["result", "plain"].into_iter().enumerate() {
        let traced = &eyes[1]["runs"][run]["traced_pct"];
        let tiles = traced.as_array().expect("a list").len() as f64;
        let reuse_pct = found[key]["reuse_pct"].as_f64().expect("a share");
        // All tiles have the same size; their shares are whole percents.
        let shown = 100.0 - sum(traced) as f64 / tiles;
        assert!(
            (shown - reuse_pct).abs() < 0.5,
            "{key}: {shown}, {reuse_pct}"
        );
    }
    let output = run_ok(program("replay").arg("dump").arg(&trace));
    let lines = String::from_utf8(output.stdout).expect("text");
    let rays = sum(&eyes[0]["rays"]) + sum(&eyes[1]["rays"]);
    assert_eq!(rays as usize, lines.matches("\"kind\":\"").count());
    let mut command = program("replay");
    command
        .arg("view")
        .arg(&trace)
        .args(["--orders", "morton", "-o", "-"]);
    refuse(&mut command, &["takes no --orders"]);
}
