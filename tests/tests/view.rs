//! Tests of `replay view`: the page's data are those of `replay run`, and it loads nothing. `view_content.rs` counts
//! the data of the L2 and of the texels that are read anew.

use parallax_tests::{program, refuse, root, run_ok};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// The data of a page.
pub(crate) fn data(page: &str) -> Value {
    let (_, rest) = page.split_once("id=\"view-data\"").expect("data");
    let (_, rest) = rest.split_once('>').expect("the start tag");
    let (json, _) = rest.split_once("</script>").expect("the end tag");
    serde_json::from_str(json).expect("JSON")
}

/// The six bits of each character of a packed list.
pub(crate) fn digits(list: &Value) -> impl Iterator<Item = u64> {
    const CHARACTERS: &str = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
    let text = list.as_str().expect("a packed list").chars();
    text.map(|c| CHARACTERS.find(c).expect("a digit") as u64)
}

/// The numbers of a list, packed or not.
pub(crate) fn numbers(list: &Value) -> Vec<u64> {
    if let Some(list) = list.as_array() {
        return list
            .iter()
            .map(|of| of.as_u64().expect("a count"))
            .collect();
    }
    let (mut out, mut number, mut shift) = (Vec::new(), 0, 0);
    for digit in digits(list) {
        number |= (digit & 31) << shift;
        shift += 5;
        if digit < 32 {
            out.push(number);
            (number, shift) = (0, 0);
        }
    }
    out
}

/// The page's data for a trace, with more arguments.
pub(crate) fn view(trace: &Path, arguments: &[&str]) -> Value {
    let mut command = program("replay");
    let output = run_ok(
        command
            .arg("view")
            .arg(trace)
            .args(arguments)
            .args(["-o", "-"]),
    );
    data(&String::from_utf8(output.stdout).expect("text"))
}

/// The result of `replay run`.
pub(crate) fn run(trace: &Path, arguments: &[&str]) -> Value {
    let mut command = program("replay");
    let output = run_ok(command.arg("run").arg(trace).arg("--json").args(arguments));
    let run: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    run["result"].clone()
}

pub(crate) fn trace(name: &str) -> PathBuf {
    root().join("traces").join(name)
}

fn sum(list: &Value) -> u64 {
    numbers(list).iter().sum()
}

/// The counts of a part in a list of them: `parts` of the page.
fn of_kind<'a>(data: &'a Value, kind: &str) -> &'a Value {
    let mut parts = data["parts"].as_array().expect("parts").iter();
    parts.find(|of| of["kind"] == kind).expect("the kind")
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
            let result = run(&trace(name), &["--order", order]);
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
            // Each tile ends within the order's time.
            for pass in &passes {
                let times = |key: &str| numbers(&pass["runs"][number][key]).into_iter();
                let ends = times("start")
                    .zip(times("cycles"))
                    .map(|(start, of)| start + of);
                assert!(ends.max() <= result["cycles"].as_u64());
            }
            // Without prefetches, what enters the L2 has missed.
            let entered = frames
                .iter()
                .map(|frame| sum(&frame["l2"][number]["entered"]));
            assert_eq!(result["l2"]["line_misses"], entered.sum::<u64>());
            let by_draw = run(&trace(name), &["--order", order, "--count-by", "draw"]);
            for (kind, parts) in [
                ("eye", &result["by_view"]),
                ("mip level", &result["by_level"]),
                ("texture", &result["by_texture"]),
                ("draw", &by_draw["by_draw"]),
            ] {
                let found = of_kind(&data, kind);
                let parts = parts.as_array().expect("parts");
                let list = |level: &str, key: &str| -> Vec<u64> {
                    let values = parts.iter().map(|part| part[level][key].as_u64());
                    values.map(|value| value.expect("a count")).collect()
                };
                let misses = &found["runs"][number];
                assert_eq!(
                    numbers(&misses["l1_misses"]),
                    list("l1", "footprint_misses"),
                    "{kind}"
                );
                assert_eq!(
                    numbers(&misses["l2_misses"]),
                    list("l2", "line_misses"),
                    "{kind}"
                );
                assert_eq!(
                    numbers(&found["footprints"]),
                    list("l1", "footprints"),
                    "{kind}"
                );
            }
        }
        let quads: u64 = (passes.iter())
            .flat_map(|pass| pass["draws"].as_array().expect("draws"))
            .map(|draw| numbers(&draw[1]).iter().skip(1).step_by(2).sum::<u64>())
            .sum();
        assert_eq!(run(&trace(name), &[])["quads"], quads);
    }
}

#[test]
fn bars_of_whole_frames_have_the_figures_of_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("view.html");
    let trace = folder.path().join("atrium.textrace");
    let mut command = program("tracegen");
    command.args([
        "raster",
        "atrium",
        "--size",
        "96x96",
        "--geometry",
        "--no-plain",
        "-o",
    ]);
    run_ok(command.arg(&trace));
    let frame = ["--frame", "tile-based"];
    let mut command = program("replay");
    run_ok(
        command
            .arg("view")
            .arg(&trace)
            .args(frame)
            .arg("-o")
            .arg(&file),
    );
    let page = fs::read_to_string(&file).expect("the page");
    assert!(page.contains("Traffic by client"));
    for order in ["morton", "z2-sta"] {
        let result = run(&trace, &["--order", order, frame[0], frame[1]]);
        let clients = result["clients"].as_array().expect("clients").iter();
        let bytes = clients.map(|of| [&of["read_bytes"], &of["write_bytes"]].map(Value::as_u64));
        let sum: u64 = bytes.flatten().map(|of| of.expect("bytes")).sum();
        let mb = format!("{:.2}", sum as f64 / 1e6);
        assert!(page.contains(&mb), "{order}: {mb}");
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
