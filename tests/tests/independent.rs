//! Compares the readers in `tests/independent/`, written in Python from FORMAT.md only, with `replay dump`
//! and `replay info`: every table and every record of every golden trace and of generated traces.

use parallax_tests::{has_lavapipe, program, root, run_ok, traces};
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};

/// False, with a line on stderr, if there is no Python; `scripts/test.sh` prints it, too.
fn has_python() -> bool {
    let found = Command::new("python3").arg("--version").output();
    let found = found.is_ok_and(|output| output.status.success());
    if !found {
        parallax_tests::skipped!("python3 is absent");
    }
    found
}

fn start(command: &mut Command) -> (Child, BufReader<ChildStdout>) {
    let mut child = command
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let out = child.stdout.take().expect("a pipe was asked for");
    (child, BufReader::new(out))
}

fn parse(line: Option<std::io::Result<String>>) -> Option<Value> {
    let line = line?.expect("the output is readable");
    Some(serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}")))
}

/// Compares the values read by Python and by replay. Additional keys of replay are allowed unless `exact`.
fn compare(place: &str, python: &Value, replay: &Value, exact: bool) {
    match (python, replay) {
        (Value::Object(a), Value::Object(b)) => {
            assert!(!exact || a.len() == b.len(), "{place}: {python}\n{replay}");
            for (key, value) in a {
                let other = b
                    .get(key)
                    .unwrap_or_else(|| panic!("{place}.{key} is missing in {replay}"));
                compare(&format!("{place}.{key}"), value, other, exact);
            }
        }
        // The file has pairs, replay prints an object.
        (Value::Array(pairs), Value::Object(b)) if place.ends_with(".settings") => {
            assert_eq!(pairs.len(), b.len(), "{place}: {python}\n{replay}");
            for pair in pairs {
                let name = pair[0].as_str().expect("a name");
                assert_eq!(b.get(name), Some(&pair[1]), "{place}.{name}");
            }
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{place}: {python}\n{replay}");
            for (index, (value, other)) in a.iter().zip(b).enumerate() {
                compare(&format!("{place}[{index}]"), value, other, exact);
            }
        }
        (Value::Number(a), Value::Number(b)) if a != b => {
            let both = a.as_f64().zip(b.as_f64());
            let (a, b) = both.expect("numbers are finite");
            // Python prints an f32 with all digits of its f64.
            let same = a as f32 == b as f32
                // The only figure whose rounding FORMAT.md does not define.
                || place.contains("geometric_normal") && (a - b).abs() < 1e-6;
            assert!(same, "{place}: {a} and {b}");
        }
        _ => assert_eq!(python, replay, "{place}"),
    }
}

/// Reads a trace with both; returns the number of records.
fn check(path: &Path) -> u64 {
    check_with(path, &[])
}

/// Reads a trace with both, with additional options; returns the number of lines.
fn check_with(path: &Path, options: &[&str]) -> u64 {
    let name = path.display().to_string();
    let kind = path
        .extension()
        .and_then(|extension| extension.to_str())
        .expect("a trace has its kind as extension");
    let script = root().join("tests/independent").join(format!("{kind}.py"));
    let (mut reader, python) = start(
        Command::new("python3")
            .arg("-B")
            .arg(script)
            .arg(path)
            .args(options),
    );
    let (mut dumper, replay) = start(program("replay").arg("dump").arg(path).args(options));
    let (mut python, mut replay) = (python.lines(), replay.lines());
    let tables = parse(python.next()).unwrap_or_else(|| panic!("{name}: Python refuses it"));
    let info = run_ok(program("replay").args(["info", "--json"]).arg(path)).stdout;
    let info: Value = serde_json::from_slice(&info).expect("info prints JSON");
    compare(&format!("{name} tables"), &tables, &info, false);
    let mut records = 0;
    loop {
        match (parse(python.next()), parse(replay.next())) {
            (Some(a), Some(b)) => compare(&format!("{name} record {records}"), &a, &b, true),
            (None, None) => break,
            (a, b) => panic!("{name} record {records}: Python has {a:?}, replay {b:?}"),
        }
        records += 1;
    }
    assert!(reader.wait().expect("Python ends").success(), "{name}");
    assert!(dumper.wait().expect("replay ends").success(), "{name}");
    records
}

fn goldens(extension: &str) -> Vec<PathBuf> {
    let found: Vec<PathBuf> = fs::read_dir(root().join("traces"))
        .expect("traces/ exists")
        .map(|entry| entry.expect("traces/ is readable").path())
        .filter(|path| path.extension().is_some_and(|e| e == extension))
        .collect();
    assert!(!found.is_empty(), "no golden .{extension}");
    found
}

#[test]
fn python_reads_every_golden_texture_trace_as_replay_does() {
    if has_python() {
        for path in goldens("textrace") {
            assert!(check(&path) > 10_000, "{}", path.display());
        }
    }
}

#[test]
fn python_reads_every_golden_ray_trace_as_replay_does() {
    if has_python() {
        for path in goldens("raytrace") {
            assert!(check(&path) > 2000, "{}", path.display());
        }
    }
}

#[test]
fn python_reads_generated_traces_as_replay_does() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, kind, bytes) in traces::all() {
        let path = folder.path().join(&name).with_extension(kind.to_string());
        fs::write(&path, bytes).expect("temporary file");
        assert!(check(&path) > 50, "{}", path.display());
        if name == "vertex-reads" {
            assert!(check_with(&path, &["--vertex-reads"]) == 120);
        }
        if name.starts_with("columns") {
            assert!(check_with(&path, &["--nodes"]) == 60);
            assert!(check_with(&path, &["--slots"]) == 200);
        }
    }
}

#[test]
fn python_reads_a_fresh_capture_in_every_encoding_as_replay_does() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let delta = folder.path().join("delta.textrace");
    let size = ["--size", "56x40", "--frames", "2", "--no-plain", "-o"];
    run_ok(
        program("tracegen")
            .args(["raster", "teapot"])
            .args(size)
            .arg(&delta),
    );
    let records = check(&delta);
    assert!(records > 1000);
    for encoding in ["raw", "planes"] {
        let other = folder.path().join(encoding).with_extension("textrace");
        let encode = ["convert", "--to", "textrace", "--encoding", encoding, "-o"];
        run_ok(program("replay").args(encode).arg(&other).arg(&delta));
        assert_eq!(check(&other), records);
        run_ok(program("replay").arg("diff").args([&delta, &other]));
    }
    let captured = folder.path().join("captured.textrace");
    let encoding = ["raster", "teapot", "--encoding", "planes"];
    run_ok(program("tracegen").args(encoding).args(size).arg(&captured));
    assert_eq!(check(&captured), records);
}

#[test]
fn python_reads_a_captured_program_in_every_encoding_as_replay_does() {
    if !has_python() || !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let delta = folder.path().join("delta.textrace");
    let mut command = program("tracegen");
    command.args(["app", "--frames", "1", "-o"]).arg(&delta);
    command.args([
        "--",
        env!("CARGO_BIN_EXE_vulkan_program"),
        "--size",
        "96x64",
    ]);
    run_ok(&mut command);
    let records = check(&delta);
    assert!(records > 1000);
    for encoding in ["raw", "planes"] {
        let other = folder.path().join(encoding).with_extension("textrace");
        let encode = ["convert", "--to", "textrace", "--encoding", encoding, "-o"];
        run_ok(program("replay").args(encode).arg(&other).arg(&delta));
        assert_eq!(check(&other), records);
    }
}

#[test]
fn python_reads_the_primitive_lists_of_a_fresh_capture_as_replay_does() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let captured = folder.path().join("captured.textrace");
    run_ok(
        program("tracegen")
            .args([
                "raster",
                "atrium",
                "--shadows",
                "--size",
                "56x40",
                "--geometry",
                "--no-plain",
            ])
            .arg("-o")
            .arg(&captured),
    );
    // Two pictures of 4x3 tiles and four shadow maps.
    assert_eq!(check_with(&captured, &["--lists"]), 2 * 12 + 4 * 128 * 128);
    let encoded = folder.path().join("encoded.textrace");
    let encode = ["convert", "--to", "textrace", "--encoding", "planes", "-o"];
    run_ok(program("replay").args(encode).arg(&encoded).arg(&captured));
    assert_eq!(check_with(&encoded, &["--lists"]), 2 * 12 + 4 * 128 * 128);
}

/// Captures rays of a scene.
fn rays(scene: &str, options: &[&str], path: &Path) {
    let mut command = program("tracegen");
    run_ok(
        command
            .args(["rays", scene])
            .args(options)
            .arg("-o")
            .arg(path),
    );
}

#[test]
fn python_reads_fresh_rays_with_visits_and_several_samples_as_replay_does() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (scene, tree) in [("teapot", "bvh2"), ("chess", "bvh8")] {
        let path = folder.path().join(scene).with_extension("raytrace");
        let options = ["--size", "40x24", "--spp", "3", "--visits", "--bvh", tree];
        rays(scene, &options, &path);
        assert_eq!(check(&path), 2 * 40 * 24 * 3);
    }
}

#[test]
fn python_reads_all_columns_of_fresh_rays_as_replay_does() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (scene, tree, samples, treelets) in [
        ("chess", "bvh2", 1, None),
        ("lab", "bvh8", 2, None),
        ("chess", "bvh4", 1, Some("4096")),
        ("chess", "cwbvh8", 1, Some("1024")),
    ] {
        let path = folder.path().join(scene).with_extension("raytrace");
        let spp = samples.to_string();
        let mut options = vec![
            "--size",
            "40x24",
            "--spp",
            &spp,
            "--all-columns",
            "--bvh",
            tree,
        ];
        options.extend(treelets.iter().flat_map(|bytes| ["--treelets", bytes]));
        rays(scene, &options, &path);
        assert_eq!(check(&path), 2 * 40 * 24 * samples);
        assert!(check_with(&path, &["--nodes"]) > 1000);
        assert!(check_with(&path, &["--slots"]) > 10_000);
        run_ok(program("replay").arg("validate").arg(&path));
    }
}

#[test]
fn python_reads_updates_of_the_hierarchy_as_replay_does() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("moving.raytrace");
    for more in [&["rebuild"][..], &["refit", "--instances"]] {
        let options = [
            "--size",
            "40x24",
            "--visits",
            "--frame",
            "9",
            "--bvh-update",
        ];
        rays("plant", &[&options[..], more].concat(), &path);
        assert_eq!(check(&path), 2 * 40 * 24);
        run_ok(program("replay").arg("validate").arg(&path));
    }
}

#[test]
fn python_reads_rays_beyond_whitteds_model_as_replay_does() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("light.raytrace");
    let options = [
        ["--ambient-occlusion", "4", "--sun-radius", "2"],
        ["--bounces", "3", "--light-radius", "0.2"],
    ];
    for (light, samples) in options.into_iter().zip([1, 2]) {
        let spp = samples.to_string();
        let mut options = vec!["--size", "40x24", "--spp", &spp, "--all-columns"];
        options.extend(["--coloured-shadows", "--normal-maps", "--seed", "5"]);
        options.extend(light);
        rays("chess", &options, &path);
        assert_eq!(check(&path), 2 * 40 * 24 * samples);
        run_ok(program("replay").arg("validate").arg(&path));
        if samples == 1 {
            run_ok(program("replay").arg("reproject").arg(&path));
        }
    }
}

#[test]
fn python_refuses_damaged_traces() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, kind, mut bytes) in traces::all() {
        let middle = bytes.len() / 2;
        bytes[middle] ^= 0x10;
        let path = folder.path().join(name).with_extension(kind.to_string());
        fs::write(&path, bytes).expect("temporary file");
        let script = root().join(format!("tests/independent/{kind}.py"));
        let output = Command::new("python3")
            .arg("-B")
            .arg(script)
            .arg(&path)
            .output();
        let output = output.expect("Python starts");
        assert_eq!(output.status.code(), Some(1), "{}", path.display());
    }
}
