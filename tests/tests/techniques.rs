//! Tests of `tracegen techniques`: the folder of a study, continuing after an interruption, the search
//! within a budget, and refusals.

use parallax_tests::{encodings, program, refuse, run_ok};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A small study of a small scene.
fn study(folder: &Path, only: &str) -> Command {
    let mut command = program("tracegen");
    command
        .args(["techniques", "atrium-plain", "--quiet", "--path", "head"])
        .args([
            "--size",
            "64x72",
            "--path-frames",
            "6",
            "--frames",
            "3",
            "--repeats",
            "2",
        ])
        .args(["--only", only])
        .arg("-o")
        .arg(folder);
    command
}

fn json(path: &Path) -> Value {
    let bytes = fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_slice(&bytes).expect("JSON")
}

fn manifest(folder: &Path) -> Value {
    json(&folder.join("manifest.json"))
}

/// Removes values that differ between runs: times and peak memory.
fn without_measurements(value: &mut Value) {
    match value {
        Value::Object(map) => {
            map.retain(|key, _| !(key.ends_with("_s") || key == "peak_memory_bytes"));
            map.values_mut().for_each(without_measurements);
        }
        Value::Array(list) => list.iter_mut().for_each(without_measurements),
        _ => {}
    }
}

/// Every file below a folder except JSON, by its path in the folder.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            let entries = fs::read_dir(&path).expect("a folder");
            open.extend(entries.map(|entry| entry.expect("an entry").path()));
        } else if path.extension().is_none_or(|extension| extension != "json") {
            let name = path
                .strip_prefix(folder)
                .expect("inside")
                .display()
                .to_string();
            found.push((name, fs::read(&path).expect("a file")));
        }
    }
    found.sort();
    found
}

#[test]
fn a_study_reports_draws_pictures_and_times_of_every_technique() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let folder = root.path().join("study");
    let output = run_ok(&mut study(&folder, "superfrustum,round-robin,multiview"));
    let manifest = manifest(&folder);
    // Either the driver's multiview renders the same pictures (see below), or a message says that it is not
    // used.
    let unreliable =
        String::from_utf8_lossy(&output.stderr).contains("multiview cannot be trusted");
    assert_eq!(unreliable, manifest.get("multiview_defect").is_some());
    let replayed = run_ok(program("replay").arg("techniques").arg(&folder)).stdout;
    let timed_separately = String::from_utf8_lossy(&replayed).contains("timed as separate views");
    assert_eq!(timed_separately, unreliable);
    assert_eq!(manifest["schema"], "tracegen.techniques/1");
    assert_eq!(manifest["frames"], serde_json::json!([0, 1, 4]));
    let rows = manifest["rows"].as_array().expect("rows");
    let names: Vec<&Value> = rows.iter().map(|row| &row["technique"]).collect();
    assert_eq!(
        names,
        ["per-eye", "superfrustum", "round-robin", "multiview"]
    );
    let image = |row: &Value, frame: usize, eye: usize| {
        let name = row["frames"][frame]["images"][eye]
            .as_str()
            .expect("a name");
        fs::read(folder.join(name)).expect("a picture")
    };
    for row in rows {
        for (number, frame) in row["frames"].as_array().expect("frames").iter().enumerate() {
            let count = |key: &str| frame[key].as_u64().unwrap_or_else(|| panic!("{key}"));
            for key in ["draws", "draw_calls", "state_changes", "vertices", "quads"] {
                assert!(count(key) > 0, "{key}: {frame}");
            }
            assert!(count("fragments") > count("quads"), "{frame}");
            assert!(count("cull_tests") > 0, "{frame}");
            for key in ["frame_s", "baseline_s"] {
                let times = frame[key].as_array().expect("times");
                assert_eq!(times.len(), 2);
                assert!(times.iter().all(|time| time.as_f64() > Some(0.0)));
            }
            if row["lossless"] == true {
                assert_eq!(frame["false_negatives"], 0, "{frame}");
                for eye in 0..2 {
                    assert!(image(row, number, eye) == image(&rows[0], number, eye));
                }
            }
        }
        let trace = folder.join(row["trace"].as_str().expect("a trace"));
        run_ok(program("replay").arg("validate").arg(trace));
    }
    let tests = |row: &Value| row["frames"][0]["cull_tests"].as_u64();
    assert!(
        tests(&rows[1]) < tests(&rows[0]),
        "one volume is tested less often than two"
    );
}

#[test]
fn at_half_rate_odd_frames_are_the_previous_one_rotated_and_count_its_bytes() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let folder = root.path().join("study");
    run_ok(&mut study(
        &folder,
        "half-rate,lens-matched,half-rate-depth",
    ));
    let manifest = manifest(&folder);
    let rows = manifest["rows"].as_array().expect("rows");
    let image = |row: usize, frame: usize| {
        let name = rows[row]["frames"][frame]["images"][0].as_str();
        fs::read(folder.join(name.expect("a name"))).expect("a picture")
    };
    // Frames 0, 1 and 4, both eyes with 64x72 pixels of four bytes, read and written.
    let bytes = |row: usize, key: &str| -> Vec<u64> {
        let frames = rows[row]["frames"].as_array().expect("frames");
        (frames
            .iter()
            .map(|frame| frame[key].as_u64().expect("a count")))
        .collect()
    };
    assert_eq!(bytes(1, "bytes_reprojected"), [0, 2 * 2 * 64 * 72 * 4, 0]);
    assert_eq!(bytes(3, "bytes_reprojected"), [0, 2 * 3 * 64 * 72 * 4, 0]);
    for key in ["fragments", "draws", "cull_tests", "target_color_bytes"] {
        let (baseline, half) = (bytes(0, key), bytes(1, key));
        assert_eq!(half, [baseline[0], 0, baseline[2]], "{key}");
    }
    for frame in [0, 2] {
        assert!(image(1, frame) == image(0, frame));
    }
    assert!(image(1, 1) != image(0, 1) && image(1, 1) != image(0, 0));
    let (baseline, matched) = (bytes(0, "fragments"), bytes(2, "fragments"));
    assert!(matched[0] < baseline[0] / 2, "{matched:?} {baseline:?}");
    // Colour of both views, but depth of one, because passes follow each other.
    assert_eq!(bytes(0, "target_color_bytes")[0], 2 * 64 * 72 * 4);
    assert_eq!(bytes(0, "target_depth_bytes")[0], 64 * 72 * 4);

    let page = root.path().join("page.html");
    let mut replay = program("replay");
    replay
        .arg("techniques")
        .arg(&folder)
        .arg("--json")
        .arg("--html")
        .arg(&page);
    let found: Value = serde_json::from_slice(&run_ok(&mut replay).stdout).expect("JSON");
    let row = |number: usize| &found["rows"][number];
    assert_eq!(row(0)["flip_mean"], 0.0);
    let error = row(1)["flip_mean"].as_f64().expect("an error");
    assert!(error > 0.0 && error < 0.2, "{error}");
    // The head walks, so depth makes a difference.
    assert_ne!(row(3)["psnr_db"], row(1)["psnr_db"]);
    let figure = |key: &str| row(1)[key].as_f64().unwrap_or_else(|| panic!("{key}"));
    assert!(figure("steps_72hz") >= 1.0 && figure("steps_144hz") >= figure("steps_72hz"));
    assert!((0.0..=100.0).contains(&figure("missed_pct_90hz")));
    let html = fs::read_to_string(&page).expect("the page");
    assert!(html.contains("frusta and cones") && html.contains("superfrustum, apex"));
}

#[test]
fn a_killed_study_continues_and_completes_with_the_same_results() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let [whole, killed] = ["whole", "killed"].map(|name| root.path().join(name));
    let only = "superfrustum,conical,round-robin";
    run_ok(&mut study(&whole, only));
    let mut child = study(&killed, only)
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    let first = killed.join("rows/per-eye.json");
    let start = Instant::now();
    while !first.exists() && start.elapsed() < Duration::from_secs(300) {
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().expect("it runs");
    child.wait().expect("it ends");
    assert!(
        !killed.join("manifest.json").exists(),
        "it was killed too late to show anything"
    );
    let kept = fs::read(&first).expect("the first row");
    run_ok(&mut study(&killed, only));
    assert!(
        fs::read(&first).expect("the first row") == kept,
        "a finished row is not measured again"
    );
    let [mut a, mut b] = [&whole, &killed].map(|folder| manifest(folder));
    without_measurements(&mut a);
    without_measurements(&mut b);
    assert_eq!(a, b);
    assert!(files(&whole) == files(&killed));
}

#[test]
fn truncated_or_swapped_files_of_a_study_are_refused_and_measured_again() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let folder = root.path().join("study");
    let mut measure = study(&folder, "superfrustum,conical");
    run_ok(&mut measure);
    let before = files(&folder);
    let path = |name: &str| folder.join(name);
    let trace = path("traces/conical.textrace");
    let bytes = fs::read(&trace).expect("a trace");
    fs::write(&trace, &bytes[..bytes.len() - 64]).expect("a file");
    let pictures = ["0000-left.png", "0001-right.png"];
    let [first, other] = pictures.map(|name| path("images/superfrustum").join(name));
    fs::copy(&first, &other).expect("a file");
    let read = |expected: &[&str]| {
        refuse(program("replay").arg("techniques").arg(&folder), expected);
    };
    read(&["superfrustum/0001-right.png", "expected the checksum"]);
    // `--quiet` hides the count of kept rows.
    let mut again = program("tracegen");
    again.args(measure.get_args().filter(|argument| *argument != "--quiet"));
    let output = run_ok(&mut again);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(
        message.contains("1 of 3 rows were there already"),
        "{message}"
    );
    assert!(files(&folder) == before);

    // A complete trace of another scene.
    let foreign = parallax_tests::root().join("traces/atrium.textrace");
    fs::copy(foreign, &trace).expect("a file");
    read(&["conical.textrace", "expected the checksum"]);
    // Inputs that would block are refused before any measurement.
    fs::remove_file(&trace).expect("removed");
    run_ok(Command::new("mkfifo").arg(&trace));
    read(&["conical.textrace", "found a pipe"]);
    refuse(&mut measure, &["conical.textrace", "found a pipe"]);
}

#[test]
fn the_traces_of_a_study_have_the_requested_encoding_and_another_encoding_is_another_study() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let folder = root.path().join("study");
    let run = |encoding: &str| {
        run_ok(study(&folder, "superfrustum").args(["--encoding", encoding]));
        assert_eq!(manifest(&folder)["trace_encoding"], encoding);
        for name in ["per-eye", "superfrustum"] {
            let trace = folder.join("traces").join(name).with_extension("textrace");
            assert_eq!(encodings(&trace), [encoding], "{name}");
        }
    };
    run("planes");
    run("delta");
}

#[test]
fn the_search_keeps_its_budget_on_unseen_frames_and_is_as_cheap_as_any_single_technique() {
    let root = tempfile::tempdir().expect("a temporary folder");
    run_ok(study(root.path(), "none").args(["--auto", "flip=0.01", "--objective", "time"]));
    let manifest = manifest(root.path());
    let auto = &manifest["auto"];
    assert_eq!(
        (&auto["budget"], &auto["objective"]),
        (&"flip=0.01".into(), &"time".into())
    );
    assert!(auto["worst_error"].as_f64().expect("an error") <= 0.01);
    let searched = auto["search_frames"].as_array().expect("frames").len();
    let held = auto["held_frames"].as_array().expect("frames").len();
    assert_eq!(searched + held, 6);
    assert!(held >= 3);
    let cost = |key: &str| {
        auto[key]["verdict"]["cost"]["ratio"]
            .as_f64()
            .expect("a ratio")
    };
    // The claim is limited by the quartiles of both.
    let upper = auto["best_single"]["verdict"]["cost"]["spread"]["q3"].as_f64();
    assert!(
        cost("chosen") <= upper.unwrap_or(1.0).max(cost("best_single")),
        "{auto}"
    );
    let rows = manifest["rows"].as_array().expect("rows");
    let last = &rows[rows.len() - 1];
    assert_eq!(last["technique"], "auto-flip-0.01-time");
    assert_eq!(last["settings"], auto["chosen"]["settings"]);
}

#[test]
fn both_eyes_at_once_upload_two_views_and_one_list_of_draws() {
    let root = tempfile::tempdir().expect("a temporary folder");
    run_ok(&mut study(root.path(), "multiview"));
    let manifest = manifest(root.path());
    let of = |row: usize, frame: usize, key: &str| {
        let value = &manifest["rows"][row]["frames"][frame][key];
        value.as_u64().expect("a count")
    };
    for frame in 0..3 {
        // Each list has a number of four bytes per draw; with separate eyes, each is preceded by its
        // length.
        let views = of(0, frame, "bytes_uploaded") - 4 * of(0, frame, "draws") - 2 * 4;
        assert!(views > 0 && of(1, frame, "draws") < of(0, frame, "draws"));
        assert_eq!(
            of(1, frame, "bytes_uploaded"),
            views + 4 * of(1, frame, "draws"),
            "frame {frame}"
        );
    }
}

#[test]
fn choices_by_counts_are_not_dominated_by_any_row_of_the_table() {
    let root = tempfile::tempdir().expect("a temporary folder");
    // Both budgets and every objective; results/auto-choices.csv has all pairs at full size.
    let searches = [
        ("flip=0.003", ["fragments", "bytes"]),
        ("flip=0.05", ["fragments", "energy"]),
    ];
    for (budget, objectives) in searches {
        for objective in objectives {
            let mut command = program("tracegen");
            command
                .args(["techniques", "atrium-plain", "--quiet", "--path", "head"])
                .args(["--size", "96x108", "--path-frames", "4", "--frames", "2"])
                .args(["--repeats", "1", "--auto", budget])
                .args(["--objective", objective, "-o"])
                .arg(root.path());
            run_ok(&mut command);
            let mut command = program("replay");
            let output = run_ok(command.arg("techniques").arg(root.path()).arg("--json"));
            let table: Value = serde_json::from_slice(&output.stdout).expect("JSON");
            let rows = table["rows"].as_array().expect("rows");
            assert!(rows.len() > 20);
            let chosen = rows.last().expect("a row");
            let name = format!("auto-{}-{objective}", budget.replace('=', "-"));
            assert_eq!(chosen["technique"], *name);
            let dominated = chosen["dominated_in"].as_str().expect("objectives");
            assert!(!dominated.contains(objective), "{name}: {chosen:#}");
            let limit: f64 = budget[5..].parse().expect("a number");
            assert!(
                chosen["flip_worst"].as_f64().expect("an error") <= limit,
                "{name}"
            );
        }
    }
}

/// Captures two frames of a scene along the head's path.
fn capture(trace: &Path, arguments: &[&str]) -> String {
    let mut command = program("tracegen");
    command
        .args([
            "raster",
            "atrium-plain",
            "--size",
            "64x72",
            "--path",
            "head",
        ])
        .args(["--frames", "3", "--quiet"])
        .args(arguments)
        .arg("-o")
        .arg(trace);
    String::from_utf8(run_ok(&mut command).stdout).expect("UTF-8")
}

fn info(trace: &Path) -> Value {
    let info = run_ok(program("replay").args(["info", "--json"]).arg(trace)).stdout;
    serde_json::from_slice(&info).expect("JSON")
}

#[test]
fn a_choice_by_counts_has_the_same_bytes_twice_and_can_be_captured_again_by_name() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let [first, second, named] =
        ["first", "second", "named"].map(|name| root.path().join(name).with_extension("textrace"));
    let summary = capture(&first, &["--auto", "flip=0.02"]);
    assert!(summary.contains("--objective energy"), "{summary}");
    capture(&second, &["--auto", "flip=0.02", "--threads", "1"]);
    let [a, b] = [&first, &second].map(|trace| info(trace));
    assert_eq!(a["checksum"], b["checksum"]);
    assert_eq!(a["meta"]["techniques"], b["meta"]["techniques"]);
    capture(&second, &["--auto", "flip=0.02"]);
    assert!(fs::read(&first).expect("a trace") == fs::read(&second).expect("a trace"));

    let techniques = &a["meta"]["techniques"];
    assert_eq!(techniques["choice"]["budget"], "flip=0.02");
    assert_eq!(techniques["choice"]["objective"], "energy");
    let frames = techniques["frames"].as_array().expect("frames");
    assert_eq!(frames.len(), 3);
    let schedule = techniques["schedule"].as_str().expect("a schedule");
    let text = run_ok(program("replay").arg("info").arg(&first)).stdout;
    let text = String::from_utf8(text).expect("UTF-8");
    assert!(
        text.contains(&format!("techniques: {schedule}\n")),
        "{text}"
    );
    let reason = techniques["choice"]["reason"].as_str().expect("a reason");
    assert!(text.contains(reason), "{text}");
    capture(&named, &["--technique", schedule]);
    let again = info(&named);
    assert_eq!(again["checksum"], a["checksum"]);
    assert_eq!(again["meta"]["techniques"]["frames"], techniques["frames"]);
    // Single frames by name.
    let schedule = "superfrustum,1-2:far-field";
    capture(&named, &["--technique", schedule]);
    let again = info(&named);
    assert_eq!(
        again["meta"]["techniques"]["frames"],
        serde_json::json!(["superfrustum", "far-field", "far-field"])
    );
}

#[test]
fn invalid_schedules_are_refused() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let trace = root.path().join("a.textrace");
    let refused = |arguments: &[&str], expected: &[&str]| {
        let mut command = program("tracegen");
        command.args(["raster", "teapot", "--size", "32x32", "--frames", "2", "-o"]);
        refuse(command.arg(&trace).args(arguments), expected);
        assert!(!trace.exists(), "{arguments:?}");
    };
    refused(&["--technique", "octree"], &["'octree'", "superfrustum"]);
    refused(
        &["--technique", "conical,2:superfrustum"],
        &["frames below 2", "found 2"],
    );
    refused(
        &["--technique", "conical", "--cull", "superfrustum"],
        &["--cull"],
    );
    refused(&["--objective", "bytes"], &["--auto"]);
    refused(
        &["--auto", "budget-ms=100", "--objective", "bytes"],
        &["--objective", "expected time", "found bytes"],
    );
    refused(
        &["--technique", "conical", "--hsr", "none"],
        &["--hsr none", "--technique"],
    );
}

#[test]
fn a_capture_with_a_budget_is_a_trace_of_the_path_with_the_chosen_techniques() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let (trace, picture) = (root.path().join("a.textrace"), root.path().join("a.png"));
    let mut command = program("tracegen");
    command
        .args(["raster", "teapot", "--size", "64x72", "--frames", "2"])
        .args(["--auto", "pixels=1", "-o"])
        .arg(&trace)
        .arg("--image")
        .arg(&picture);
    let summary = String::from_utf8(run_ok(&mut command).stdout).expect("UTF-8");
    assert!(
        summary.contains("--auto pixels=1 --objective energy: of ")
            && summary.contains("at most 1 px by construction"),
        "{summary}"
    );
    run_ok(program("replay").arg("validate").arg(&trace));
    let frames = info(&trace)["meta"]["frames"].as_array().map(Vec::len);
    assert_eq!(frames, Some(2));
    assert!(picture.exists());
}

#[test]
fn a_budget_that_no_technique_meets_is_reported() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let mut command = study(root.path(), "none");
    refuse(
        command.args(["--auto", "budget-ms=0.0001"]),
        &[
            "no combination meets --auto budget-ms=0.0001",
            "ms per frame",
            "the baseline",
        ],
    );
}

#[test]
fn invalid_options_are_refused_with_the_reason() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let folder = root.path().join("study");
    let refused = |arguments: &[&str], expected: &[&str]| {
        let mut command = program("tracegen");
        command.args(["techniques", "atrium-plain", "--size", "32x32", "-o"]);
        refuse(command.arg(&folder).args(arguments), expected);
        assert!(!folder.exists(), "{arguments:?}");
    };
    refused(
        &["--only", "conical,octree"],
        &["--only", "'octree'", "superfrustum"],
    );
    refused(
        &["--only", "conical+superfrustum"],
        &["conical and superfrustum exclude each other"],
    );
    refused(&["--frames", "0"], &["--frames", "0"]);
    refused(
        &["--frames", "9", "--path-frames", "8"],
        &["at most 8", "found 9"],
    );
    refused(&["--repeats", "0"], &["--repeats"]);
    let mut tiny = program("tracegen");
    tiny.args(["techniques", "atrium-plain", "--size", "1x1", "-o"]);
    refuse(
        tiny.arg(&folder),
        &["--size", "0.1 to 1000 pixels per degree"],
    );
    refused(
        &["--lens-center", "9,9"],
        &["--lens-center", "shows some of the picture"],
    );
    refused(
        &["--adapter", "no such device"],
        &["'no such device'", "llvmpipe"],
    );
    refused(&["--auto", "flip=nan"], &["flip=ERROR", "'flip=nan'"]);
    refused(&["--auto", "ssim=1"], &["flip=ERROR", "'ssim=1'"]);
    let path = root.path().join("path.csv");
    fs::write(
        &path,
        "time_s,x_m,y_m,z_m,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,nan,0,0,0,0,0,1\n",
    )
    .expect("a file");
    refused(
        &["--path", path.to_str().expect("UTF-8")],
        &["path.csv", "nan"],
    );
}

#[test]
fn a_budget_excludes_naming_techniques() {
    let root = tempfile::tempdir().expect("a temporary folder");
    for technique in [
        "--multiview",
        "--hidden-area-mask",
        "--far-field=1px",
        "--foveate=rings",
    ] {
        let mut command = program("tracegen");
        command.args([
            "raster",
            "atrium-plain",
            "--auto",
            "flip=0.01",
            technique,
            "-o",
        ]);
        let name = technique.split('=').next().expect("a flag");
        refuse(
            command.arg(root.path().join("x.textrace")),
            &["--auto", name],
        );
    }
}

#[test]
fn a_study_replaces_no_other_files() {
    let root = tempfile::tempdir().expect("a temporary folder");
    let file = root.path().join("file");
    fs::write(&file, "kept").expect("a file");
    for (output, expected) in [
        (file.as_path(), "found a file"),
        (root.path(), "found other files"),
    ] {
        refuse(&mut study(output, "none"), &["--output", expected]);
    }
    refuse(&mut study(Path::new("-"), "none"), &["expected a folder"]);
    assert_eq!(fs::read(&file).expect("the file"), b"kept");
}
