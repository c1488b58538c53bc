//! Tests of `info`, `dump`, `diff` and `convert` with ray traces, and of commands reading from pipes.

use formats::raytrace::TraversalKind;
use parallax_tests::{program, root, run_ok, traces};
use serde_json::Value;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};

fn write_generated_trace(folder: &tempfile::TempDir, name: &str, seed: u64) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, traces::ray_trace(1, true, seed)).expect("temporary file");
    path
}

fn text(output: Output) -> String {
    String::from_utf8(output.stdout).expect("text")
}

/// Runs replay with a golden trace as its standard input, a pipe.
fn piped(arguments: &[&str], bytes: &[u8]) -> Output {
    let mut child = program("replay")
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("replay starts");
    let mut input = child.stdin.take().expect("a pipe was asked for");
    let bytes = bytes.to_vec();
    let writer = std::thread::spawn(move || {
        // A reader that refuses early closes the pipe.
        let _closed = input.write_all(&bytes);
    });
    let output = child.wait_with_output().expect("replay ends");
    writer.join().expect("the writer ends");
    output
}

#[test]
fn info_prints_the_hierarchy_and_the_rays_by_kind() {
    let golden = root().join("traces/chess-rays.raytrace");
    let shown = text(run_ok(program("replay").arg("info").arg(&golden)));
    for part in [
        "128x128 px",
        "SAH cost 12.96",
        "8731 nodes",
        "shadow",
        "reflection",
    ] {
        assert!(shown.contains(part), "no {part:?} in:\n{shown}");
    }
    let json = text(run_ok(
        program("replay").args(["info", "--json"]).arg(&golden),
    ));
    let info: Value = serde_json::from_str(&json).expect("JSON");
    let rays = |eye: &str| {
        let kinds = info["totals"][eye]["rays"].as_object().expect("kinds");
        kinds.values().filter_map(Value::as_u64).sum::<u64>()
    };
    assert_eq!(info["totals"]["left"]["samples"], 128 * 128);
    assert_eq!(rays("left") + rays("right"), 112_637, "as validate counts");
}

#[test]
fn the_first_different_sample_of_two_ray_traces_is_shown() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (a, b) = (
        write_generated_trace(&folder, "a.raytrace", 7),
        write_generated_trace(&folder, "b.raytrace", 8),
    );
    run_ok(program("replay").arg("diff").args([&a, &a]));
    let output = program("replay").arg("diff").args([&a, &b]).output();
    let output = output.expect("replay starts");
    assert_eq!(output.status.code(), Some(1));
    let shown = text(output);
    assert!(
        shown.starts_with("left eye tile 0 sample 0 differs\n< {"),
        "{shown}"
    );
}

#[test]
fn a_ray_trace_encoded_again_has_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let again = folder.path().join("again.raytrace");
    for name in ["chess-rays.raytrace", "teapot-rays.raytrace"] {
        let golden = root().join("traces").join(name);
        let to = ["convert", "--to", "raytrace", "-o"];
        run_ok(program("replay").args(to).arg(&again).arg(&golden));
        assert!(
            fs::read(&again).expect("written") == fs::read(&golden).expect("golden"),
            "{name}"
        );
    }
}

#[test]
fn visits_are_converted_to_addresses_in_every_text_format() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = write_generated_trace(&folder, "a.raytrace", 7);
    let dumped = text(run_ok(program("replay").arg("dump").arg(&path)));
    let mut addresses = Vec::new();
    for line in dumped.lines() {
        let sample: Value = serde_json::from_str(line).expect("JSON");
        for ray in sample["rays"].as_array().expect("rays") {
            let visits = ray["visits"].as_array().expect("visits");
            addresses.extend(visits.iter().filter_map(|visit| visit["address"].as_u64()));
        }
    }
    assert!(addresses.len() > 1000);
    let convert = |to: &str, granularity: &str| {
        let options = ["convert", "--to", to, "--granularity", granularity];
        text(run_ok(program("replay").args(options).arg(&path)))
    };
    let hexadecimal = |digits: &str| u64::from_str_radix(digits, 16).expect("hexadecimal");
    let din = convert("din", "texel");
    let din = din
        .lines()
        .map(|line| hexadecimal(line.strip_prefix("0 ").expect("a read")));
    assert!(din.eq(addresses.iter().copied()));
    let csv = convert("csv", "texel");
    let csv = csv.lines().skip(1).map(|line| {
        let address = line.split(',').next().expect("a field");
        hexadecimal(address.strip_prefix("0x").expect("0x"))
    });
    assert!(csv.eq(addresses.iter().copied()));
    assert_eq!(convert("jsonl", "texel").lines().count(), addresses.len());
    // Nodes have 64 bytes and triangles 40, so a visit has several lines of 16 bytes.
    assert!(convert("din", "line").lines().count() > 2 * addresses.len());
}

#[test]
fn a_ray_trace_without_visits_has_no_addresses_and_is_refused() {
    let golden = root().join("traces/teapot-rays.raytrace");
    let output = program("replay")
        .args(["convert", "--to", "din"])
        .arg(golden)
        .output();
    let output = output.expect("replay starts");
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("has no visits"), "{message}");
}

#[test]
fn traces_are_read_from_pipes() {
    for (name, commands) in [
        (
            "atrium-shadows.textrace",
            &["info", "validate", "dump", "run"][..],
        ),
        (
            "teapot-rays.raytrace",
            &["info", "validate", "dump", "reproject"][..],
        ),
    ] {
        let path = root().join("traces").join(name);
        let bytes = fs::read(&path).expect("golden trace");
        for command in commands {
            let output = piped(&[command, "/dev/stdin"], &bytes);
            let message = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(0), "{command} {name}: {message}");
        }
        for refused in [
            &bytes[..bytes.len() - 1],
            &[&bytes[..], &[0]].concat(),
            b"PNG",
            b"",
        ] {
            assert_eq!(
                piped(&["info", "/dev/stdin"], refused).status.code(),
                Some(2)
            );
        }
    }
    let endless = program("replay").args(["info", "/dev/zero"]).output();
    assert_eq!(endless.expect("replay starts").status.code(), Some(2));
}

/// `-` is standard input for every command that reads a trace.
#[test]
fn a_dash_is_standard_input_for_every_command() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let page = folder.path().join("page.html");
    let page = page.to_str().expect("a name");
    let path = |name: &str| root().join("traces").join(name);
    let (textures, rays) = (path("atrium.textrace"), path("teapot-rays.raytrace"));
    let [of_textures, of_rays] = [&textures, &rays].map(|path| path.to_str().expect("a name"));
    let small = ["--caches", "4/16"];
    let cases: [(&Path, Vec<&str>); 17] = [
        (&textures, vec!["info", "-"]),
        (&textures, vec!["validate", "-"]),
        (&textures, vec!["dump", "-"]),
        (&textures, vec!["run", "-"]),
        (&textures, vec!["convert", "-", "--to", "din"]),
        (&textures, vec!["diff", "-", of_textures]),
        (
            &textures,
            vec!["compare", of_textures, "-", "--orders", "morton"],
        ),
        (&textures, vec!["locality", "-", "--orders", "morton"]),
        (
            &textures,
            [&["orders", "-", "--orders", "morton"][..], &small].concat(),
        ),
        (
            &textures,
            [&["paper", "-", "--orders", "morton"][..], &small].concat(),
        ),
        (
            &textures,
            [
                &["report", "-", "--orders", "morton", "-o", page][..],
                &small,
            ]
            .concat(),
        ),
        (&rays, vec!["info", "-"]),
        (&rays, vec!["validate", "-"]),
        (&rays, vec!["dump", "-"]),
        (&rays, vec!["convert", "-", "--to", "raytrace", "-o", page]),
        (&rays, vec!["diff", of_rays, "-"]),
        (&rays, vec!["reproject", "-"]),
    ];
    for (path, arguments) in cases {
        let bytes = fs::read(path).expect("golden trace");
        let output = piped(&arguments, &bytes);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {message}");
    }
    // A redirected file is mapped, and a damaged one is named.
    let file = fs::File::open(&textures).expect("golden trace");
    run_ok(program("replay").args(["info", "-"]).stdin(file));
    let output = piped(&["info", "-"], b"PNG");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    assert!(message.contains("standard input: header"), "{message}");
    let twice = piped(
        &["diff", "-", "-"],
        &fs::read(&textures).expect("golden trace"),
    );
    let message = String::from_utf8_lossy(&twice.stderr);
    assert_eq!(twice.status.code(), Some(2));
    assert!(
        message.contains("standard input was read already"),
        "{message}"
    );
}

#[test]
fn settings_of_textures_are_refused_for_rays() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rays = write_generated_trace(&folder, "r.raytrace", 3);
    let config = folder.path().join("machine.toml");
    fs::write(&config, "order = \"hilbert\"\n").expect("a file");
    let config = config.to_str().expect("a name");
    for (setting, expected) in [
        (
            ["--order", "z2-sta-merge"],
            "--order: eyes part: expected sv, lrta, sta or halves",
        ),
        (
            ["--tile-px", "8"],
            "--tile-px: it has no effect on a ray trace",
        ),
        (
            ["--config", config],
            "machine.toml: order hilbert has no effect on a ray trace",
        ),
    ] {
        for form in ["din", "csv", "npy"] {
            let output = folder.path().join("accesses");
            let mut command = program("replay");
            command
                .arg("convert")
                .arg(&rays)
                .args(["--to", form])
                .args(setting);
            parallax_tests::refuse(command.arg("-o").arg(&output), &[expected]);
            assert!(!output.exists());
        }
    }
    run_ok(
        program("replay")
            .arg("convert")
            .arg(&rays)
            .args(["--to", "din", "--line", "64"]),
    );
}

/// Captures a small frame with all optional columns.
fn capture_columns(path: &Path) {
    let options = ["rays", "chess", "--size", "40x24", "--all-columns", "-o"];
    run_ok(program("tracegen").args(options).arg(path));
}

#[test]
fn columns_do_not_change_the_records_and_survive_a_new_encoding() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    let (all, plain, again) = (
        at("all.raytrace"),
        at("plain.raytrace"),
        at("again.raytrace"),
    );
    capture_columns(&all);
    let options = ["rays", "chess", "--size", "40x24", "-o"];
    run_ok(program("tracegen").args(options).arg(&plain));
    run_ok(
        program("replay")
            .args(["convert", "--to", "raytrace", "-o"])
            .args([&again, &all]),
    );
    assert!(fs::read(&again).expect("written") == fs::read(&all).expect("written"));
    run_ok(program("replay").arg("diff").args([&again, &all]));
    let dumped = |path: &Path| text(run_ok(program("replay").arg("dump").arg(path)));
    for (a, b) in dumped(&plain).lines().zip(dumped(&all).lines()) {
        let [a, mut b] = [a, b].map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
        for ray in b["rays"].as_array_mut().expect("rays") {
            let ray = ray.as_object_mut().expect("a ray");
            let columns = "visits origin direction t_min t_max t slot stack_depth";
            for column in columns.split(' ') {
                assert!(ray.remove(column).is_some(), "{column}");
            }
        }
        assert_eq!(a, b);
    }
}

#[test]
fn columns_are_written_in_every_form_with_the_same_names() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("all.raytrace");
    capture_columns(&path);
    let convert = |to: &str, rows: &str| {
        let options = ["convert", "--to", to, "--granularity", rows];
        run_ok(program("replay").args(options).arg(&path)).stdout
    };
    for (rows, column) in [
        ("record", "stack_depth"),
        ("node", "max_z"),
        ("slot", "v2_z"),
    ] {
        let csv = String::from_utf8(convert("csv", rows)).expect("text");
        let names: Vec<&str> = csv.lines().next().expect("names").split(',').collect();
        assert!(names.contains(&column), "{names:?}");
        let jsonl = String::from_utf8(convert("jsonl", rows)).expect("text");
        assert_eq!(jsonl.lines().count(), csv.lines().count() - 1);
        for (json, csv) in jsonl.lines().zip(csv.lines().skip(1)) {
            let json: Value = serde_json::from_str(json).expect("JSON");
            for (name, text) in names.iter().zip(csv.split(',')) {
                let same = match &json[name] {
                    Value::Null => text == "NaN",
                    Value::String(code) => code == text,
                    value => value.as_f64() == text.parse().ok(),
                };
                assert!(same, "{name}: {text} and {}", json[name]);
            }
        }
        let npy = convert("npy", rows);
        let header = String::from_utf8_lossy(&npy[..npy.len().min(4000)]).into_owned();
        for name in names {
            assert!(header.contains(&format!("('{name}', ")), "{name}: {header}");
        }
    }
    let dumped = text(run_ok(
        program("replay").args(["dump", "--slots"]).arg(&path),
    ));
    assert_eq!(dumped.lines().count(), 42_468);
}

#[test]
fn columns_that_do_not_belong_together_are_found_by_validate() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("made-up.raytrace");
    // Each column is sound, but the visits are no walk of the tree.
    fs::write(
        &path,
        parallax_tests::columns::column_trace(TraversalKind::Bvh2, 7),
    )
    .expect("room");
    let output = program("replay").arg("validate").arg(&path).output();
    let output = output.expect("replay starts");
    assert_eq!(output.status.code(), Some(1));
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        message.contains("left eye tile 0, ray 0 of sample"),
        "{message}"
    );
    assert!(message.contains("of nodes visited before"), "{message}");
}

#[test]
fn columns_that_a_trace_lacks_are_refused() {
    let golden = root().join("traces/teapot-rays.raytrace");
    let missing = "expected a trace with the content of its hierarchy (captured with `tracegen rays --hierarchy`), found none";
    let texture = root().join("traces/atrium.textrace");
    for (options, path, expected) in [
        (vec!["dump", "--nodes"], &golden, missing),
        (vec!["dump", "--slots"], &golden, missing),
        (
            vec!["convert", "--to", "npy", "--granularity", "node"],
            &golden,
            missing,
        ),
        (
            vec!["dump", "--nodes"],
            &texture,
            "--nodes: expected a ray trace",
        ),
        (
            vec!["convert", "--to", "csv", "--granularity", "slot"],
            &texture,
            "a texture trace has no hierarchy",
        ),
    ] {
        let output = program("replay").args(&options).arg(path).output();
        let output = output.expect("replay starts");
        assert_eq!(output.status.code(), Some(2), "{options:?}");
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(message.contains(expected), "{options:?}: {message}");
    }
}

/// Closest-hit rays that visit all of their stacks use every line that `ttp` fetches, if caches keep all lines.
#[test]
fn stacks_of_a_captured_trace_hold_what_its_rays_visit() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [path, machine] = ["all.raytrace", "machine.toml"].map(|name| folder.path().join(name));
    capture_columns(&path);
    let all_lines = "cache.node_l1_bytes = 67108864\ncache.triangle_l1_bytes = 67108864\n\
                     cycles.l1_mshrs = 100000\ncycles.l2_mshrs = 100000\n\
                     cycles.prefetch = { stack_entries = 8, visits_dropped = true }\n";
    fs::write(&machine, all_lines).expect("temporary file");
    let left = |options: &[&str]| -> Value {
        let mut command = program("replay");
        let fixed = [
            "reproject",
            "--timing",
            "cycle",
            "--rays",
            "primary,reflection",
        ];
        command.args(fixed).arg("--json").args(options).arg(&path);
        let report: Value = serde_json::from_str(&text(run_ok(&mut command))).expect("JSON");
        report["result"]["cycles"]["left"].clone()
    };
    let machine = machine.to_str().expect("text");
    let ttp = left(&["--config", machine, "--prefetch", "ttp"]);
    let [issued, used] = ["issued", "useful"].map(|key| ttp["prefetch"][key].as_u64());
    assert!(issued > Some(20), "{ttp}");
    assert_eq!(
        used.zip(ttp["prefetch"]["late"].as_u64())
            .map(|(a, b)| a + b),
        issued
    );
    // Dropped entries are visited in addition; without a prefetcher nothing else changes.
    let all = left(&["--config", machine]);
    assert_eq!(all["requests"], ttp["requests"]);
    let plain = left(&[]);
    assert!(plain["requests"].as_u64() < all["requests"].as_u64());
    assert_eq!(plain, left(&["--prefetch", "none"]));
    let treelet = left(&["--prefetch", "treelet"]);
    assert_eq!(treelet["requests"], plain["requests"]);
    assert!(treelet["l1_misses"].as_u64() < plain["l1_misses"].as_u64());
}
