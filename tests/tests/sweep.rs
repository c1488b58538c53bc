//! Sweeps over many machines: shards, merges, and the remains of a killed worker.

use parallax_tests::repair::crc32;
use parallax_tests::{program, refuse, root, run_ok};
use replay::model_version::MODEL_VERSION;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const EXPERIMENT: &str = "\
[base]
mode = \"functional\"
[axes]
order = [\"morton\", \"z2-sta\"]
l1.size_bytes = [\"4KiB\", \"8KiB\"]
l1.ways = [2, 4]
[one-at-a-time]
mode = [\"timed\"]
l2.replacement = [\"fifo\"]
layout.block_order = [\"morton\"]
seed = [1]
";

/// Number of distinct points of [`EXPERIMENT`]; a seed of 1 is not a change.
const POINTS: usize = 32;

const RESULTS: [&str; 4] = ["results.json", "results.csv", "report.html", "rows.parquet"];

/// An experiment and its folders.
struct Sweep {
    folder: tempfile::TempDir,
}

impl Sweep {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::write(folder.path().join("a.toml"), EXPERIMENT).expect("temporary file");
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `replay sweep` of an experiment into a folder.
    fn command_of(&self, experiment: &str, out: &str, flags: &[&str]) -> Command {
        let mut command = program("replay");
        command.arg("sweep").arg(self.path(experiment));
        command.arg(root().join("traces/atrium-shadows.textrace"));
        command.arg("--out").arg(self.path(out)).args(flags);
        for variable in ["ID", "COUNT", "MIN", "MAX", "STEP"] {
            command.env_remove(format!("SLURM_ARRAY_TASK_{variable}"));
        }
        command
    }

    fn command(&self, out: &str, flags: &[&str]) -> Command {
        self.command_of("a.toml", out, flags)
    }

    /// Runs to the end; returns the output.
    fn results(&self, out: &str, flags: &[&str]) -> Vec<u8> {
        let mut command = self.command(out, flags);
        let rows = self.path(out).join("rows.parquet");
        run_ok(command.arg("--parquet").arg(rows)).stdout
    }

    fn points(&self, out: &str) -> Vec<PathBuf> {
        let folder = fs::read_dir(self.path(out).join("points"));
        let mut files: Vec<PathBuf> = folder
            .map(|entries| entries.flatten().map(|e| e.path()).collect())
            .unwrap_or_default();
        files.sort();
        files
    }

    /// Rows of all files of points.
    fn rows(&self, out: &str) -> Vec<String> {
        let text = |path| fs::read_to_string(path).expect("rows");
        let files: Vec<String> = self.points(out).into_iter().map(text).collect();
        files
            .iter()
            .flat_map(|t| t.lines())
            .map(str::to_owned)
            .collect()
    }
}

fn assert_same_results(a: &Path, b: &Path) {
    for name in RESULTS {
        let [a, b] = [a, b].map(|folder| fs::read(folder.join(name)).expect("a result"));
        assert!(a == b, "{name} differs");
    }
}

#[test]
fn shards_in_any_order_merge_to_the_bytes_of_one_machine() {
    let sweep = Sweep::new();
    let printed = sweep.results("whole", &[]);
    for (out, count, order) in [("two", 2, vec![2, 1]), ("five", 5, vec![3, 5, 1, 2, 4])] {
        for number in order {
            let shard = format!("{number}/{count}");
            let output = run_ok(&mut sweep.command(out, &["--shard", &shard]));
            assert!(output.stdout.is_empty(), "a shard prints no result");
            let entries = fs::read_dir(sweep.path(out)).expect("the folder").count();
            assert_eq!(entries, 1, "a shard writes only points");
        }
        let files = sweep.points(out).len();
        assert!(
            (1..=count).contains(&files),
            "{files} files of {count} shards"
        );
        assert_eq!(sweep.rows(out).len(), POINTS);
        assert_eq!(sweep.results(out, &["--merge-only"]), printed);
        assert_same_results(&sweep.path("whole"), &sweep.path(out));
    }
}

#[test]
fn a_slurm_task_replays_its_shard() {
    let sweep = Sweep::new();
    for task in ["4", "8"] {
        let mut command = sweep.command("out", &["--shard"]);
        command.env("SLURM_ARRAY_TASK_ID", task);
        command.env("SLURM_ARRAY_TASK_MIN", "4");
        command.env("SLURM_ARRAY_TASK_MAX", "8");
        command.env("SLURM_ARRAY_TASK_STEP", "4");
        run_ok(command.env("SLURM_ARRAY_TASK_COUNT", "2"));
    }
    assert_eq!(sweep.rows("out").len(), POINTS);
    for (id, expected) in [
        ("one", "SLURM_ARRAY_TASK_ID: expected a number, found `one`"),
        ("3", "K/N"),
    ] {
        let mut command = sweep.command("out", &["--shard"]);
        command.env("SLURM_ARRAY_TASK_COUNT", "2");
        refuse(command.env("SLURM_ARRAY_TASK_ID", id), &[expected]);
    }
    refuse(
        &mut sweep.command("out", &["--shard"]),
        &["SLURM_ARRAY_TASK_ID is not set"],
    );
}

#[test]
fn results_are_the_same_after_a_worker_was_killed() {
    let sweep = Sweep::new();
    let printed = sweep.results("whole", &[]);
    // One thread, so that the first points are stored long before the last.
    let mut worker = sweep.command("out", &["--shard", "1/2", "--threads", "1"]);
    let mut worker = worker.stderr(Stdio::null()).spawn().expect("replay starts");
    let deadline = Instant::now() + Duration::from_secs(60);
    while sweep.points("out").is_empty() && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(1));
    }
    worker.kill().expect("SIGKILL");
    worker.wait().expect("an end");
    run_ok(&mut sweep.command("out", &["--shard", "2/2"]));
    run_ok(&mut sweep.command("out", &["--shard", "1/2"]));
    assert_eq!(sweep.results("out", &["--merge-only"]), printed);
    assert_same_results(&sweep.path("whole"), &sweep.path("out"));
}

#[test]
fn a_merge_lists_missing_damaged_and_outdated_points() {
    let sweep = Sweep::new();
    refuse(
        &mut sweep.command("out", &["--merge-only"]),
        &[
            &format!("{POINTS} of {POINTS} points are missing"),
            "order=morton",
            ": missing",
        ],
    );
    assert!(!sweep.path("out/results.json").exists());
    sweep.results("out", &[]);
    let whole = fs::read(sweep.path("out/results.json")).expect("results");
    let path = &sweep.points("out")[0];
    let rows = sweep.rows("out");
    let name = path.display().to_string();
    let put = |rows: &[String]| fs::write(path, rows.join("\n")).expect("rows");
    // One row with a changed digit, a missing row, and a truncated last row.
    let mut damaged = rows[1..].to_vec();
    let digit = damaged[1]
        .rfind(|c: char| c.is_ascii_digit())
        .expect("a digit");
    let other = if damaged[1].as_bytes()[digit] == b'7' {
        "8"
    } else {
        "7"
    };
    damaged[1].replace_range(digit..=digit, other);
    let last = damaged.last_mut().expect("a row");
    last.truncate(last.len() / 2);
    put(&damaged);
    let listed = [
        format!("3 of {POINTS} points are missing"),
        ": missing".to_owned(),
        format!("{name}: row 2: expected checksum "),
        ", found \"".to_owned(),
        format!("{name}: row {}: expected", POINTS - 1),
    ];
    let listed: Vec<&str> = listed.iter().map(String::as_str).collect();
    refuse(&mut sweep.command("out", &["--merge-only"]), &listed);
    // Rows of another model version.
    let older = |row: &String| {
        let (_, content) = row.split_once(' ').expect("a checksum");
        let (_, rest) = content.split_once(' ').expect("a version");
        let content = format!("0 {rest}");
        format!("{:08x} {content}", crc32(content.as_bytes()))
    };
    let mut versions: Vec<String> = rows.iter().map(older).collect();
    versions.push(String::new());
    put(&versions);
    refuse(
        &mut sweep.command("out", &["--merge-only"]),
        &[
            &format!("{POINTS} of {POINTS} points are missing"),
            &format!("skipped: {POINTS} rows of model version 0, expected {MODEL_VERSION}"),
        ],
    );
    put(&damaged);
    // The same shards replace them.
    for shard in ["1/3", "2/3", "3/3"] {
        run_ok(&mut sweep.command("out", &["--shard", shard]));
    }
    sweep.results("out", &["--merge-only"]);
    assert_eq!(
        fs::read(sweep.path("out/results.json")).expect("results"),
        whole
    );
}

#[test]
fn two_experiments_in_one_folder_do_not_mix() {
    let sweep = Sweep::new();
    sweep.results("alone", &[]);
    let other = EXPERIMENT.replace("l1.ways = [2, 4]", "l1.ways = [4, 8]");
    fs::write(sweep.path("b.toml"), other).expect("temporary file");
    for (experiment, shard) in [
        ("b.toml", "1/2"),
        ("a.toml", "2/2"),
        ("b.toml", "2/2"),
        ("a.toml", "1/2"),
    ] {
        run_ok(&mut sweep.command_of(experiment, "out", &["--shard", shard]));
    }
    sweep.results("out", &["--merge-only"]);
    assert_same_results(&sweep.path("alone"), &sweep.path("out"));
}

#[test]
fn the_plan_lists_keys_costs_and_finished_points() {
    let sweep = Sweep::new();
    run_ok(&mut sweep.command("out", &["--shard", "2/3"]));
    let plan = |flags: &[&str]| -> Vec<serde_json::Value> {
        let output = run_ok(&mut sweep.command("out", &[&["--plan", "--json"], flags].concat()));
        let plan: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(plan["schema"], "replay.plan/2");
        plan["points"].as_array().expect("points").clone()
    };
    let all = plan(&[]);
    assert_eq!(all.len(), POINTS);
    let of_shards: Vec<_> = ["1/3", "2/3", "3/3"]
        .iter()
        .flat_map(|k| plan(&["--shard", k]))
        .collect();
    assert_eq!(of_shards, all);
    let rows = sweep.rows("out");
    for point in &all {
        let key = point["key"].as_str().expect("a key");
        let is_there = rows.iter().any(|row| row.split(' ').nth(2) == Some(key));
        assert_eq!(point["done"], is_there, "{point}");
        assert!(point["cost"].as_u64() > Some(0), "{point}");
    }
    assert!(
        plan(&["--shard", "2/3"])
            .iter()
            .all(|point| point["done"] == true)
    );
}

#[test]
fn contradicting_flags_and_impossible_shards_are_refused() {
    let sweep = Sweep::new();
    for (flags, expected) in [
        (&["--shard", "0/4"][..], "found `0/4`"),
        (&["--shard", "5/4"], "found `5/4`"),
        (&["--shard", "1/0"], "found `1/0`"),
        (&["--shard", "a.textrace"], "expected K/N"),
        (&["--emit-slurm", "0"], "0 is not in"),
        (&["--shard", "1/2", "--merge-only"], "cannot be used with"),
        (
            &["--shard", "1/2", "--emit-slurm", "2"],
            "cannot be used with",
        ),
        (
            &["--merge-only", "--emit-slurm", "2"],
            "cannot be used with",
        ),
        (&["--merge-only", "--plan"], "cannot be used with"),
        (&["--emit-slurm", "2", "--json"], "cannot be used with"),
        (
            &["--shard", "1/2", "--json"],
            "--merge-only prints the results",
        ),
        (&["--shard", "1/2", "--parquet", "a"], "writes only points"),
        (&["--plan"], "--plan --out"),
    ] {
        refuse(&mut sweep.command("out", flags), &[expected]);
    }
    assert!(
        !sweep.path("out").exists(),
        "refused before anything is written"
    );
}

#[test]
fn bad_plans_and_outputs_are_refused_before_the_work() {
    let sweep = Sweep::new();
    fs::write(
        sweep.path("bad.toml"),
        "[axes]\nl1.size_bytes = [\"6KiB\"]\n",
    )
    .expect("temporary file");
    for flags in [
        &["--shard", "1/2"][..],
        &["--merge-only"],
        &["--emit-slurm", "2"],
        &["--plan", "--json"],
    ] {
        refuse(
            &mut sweep.command_of("bad.toml", "out", flags),
            &["bad.toml", "L1 cache of 6 KiB"],
        );
    }
    // A folder that cannot be created.
    fs::write(sweep.path("file"), "").expect("temporary file");
    for flags in [
        &["--shard", "1/2"][..],
        &["--merge-only"],
        &["--emit-slurm", "2"],
        &[],
    ] {
        refuse(
            &mut sweep.command("file", flags),
            &[
                "cannot write --out",
                "file: expected a folder, found a file",
            ],
        );
    }
    fs::create_dir(sweep.path("taken")).expect("a folder");
    fs::write(sweep.path("taken/points"), "").expect("temporary file");
    refuse(
        &mut sweep.command("taken", &[]),
        &["taken/points: expected a folder, found a file"],
    );
    let mut command = program("replay");
    command.current_dir(sweep.folder.path());
    command.args(["sweep", "a.toml", "--out", "-"]);
    command.arg(root().join("traces/atrium-shadows.textrace"));
    refuse(
        &mut command,
        &["--out -: expected a folder, found the name of standard output"],
    );
    let experiment = sweep.path("a.toml").display().to_string();
    for (path, expected) in [
        ("/dev/null", "found a device"),
        (experiment.as_str(), "would replace the input"),
        (
            &sweep.path("out/results.csv").display().to_string(),
            "the same output twice",
        ),
        (
            &sweep.path("out/points").display().to_string(),
            "found the name of the points' folder",
        ),
    ] {
        refuse(&mut sweep.command("out", &["--parquet", path]), &[expected]);
    }
    assert!(sweep.points("out").is_empty());
}

#[test]
fn a_slurm_script_works_with_any_characters_in_its_paths() {
    let sweep = Sweep::new();
    let out = "it's a \"folder\" $(true) `x`\\";
    let rows = sweep.path(out).join("rows.parquet");
    let mut command = sweep.command(out, &["--emit-slurm", "3", "--threads", "1", "--parquet"]);
    let script = run_ok(command.arg(&rows)).stdout;
    let path = sweep.path("sweep.sh");
    fs::write(&path, script).expect("temporary file");
    // Simulates Slurm: the tasks in any order, then task 0.
    for task in ["2", "3", "1", "0"] {
        run_ok(
            Command::new("sh")
                .arg(&path)
                .env("SLURM_ARRAY_TASK_ID", task),
        );
    }
    sweep.results("whole", &[]);
    assert_same_results(&sweep.path("whole"), &sweep.path(out));
}

#[test]
fn rows_of_different_sweeps_can_be_joined() {
    let sweep = Sweep::new();
    let trace = root().join("traces/atrium-shadows.textrace");
    // The same trace with another name, with another trace, in another experiment.
    let renamed = sweep.path("another name.textrace");
    fs::copy(&trace, &renamed).expect("a copy");
    let experiment = "[base]\nmode = \"functional\"\norder = \"z2-sta\"\nl1.size_bytes = \"4KiB\"\n[one-at-a-time]\nl1.ways = [2, 4]\n";
    fs::write(sweep.path("b.toml"), experiment).expect("temporary file");
    run_ok(&mut sweep.command("a", &[]));
    let mut other = sweep.command_of("b.toml", "b", &[]);
    run_ok(
        other
            .arg(&renamed)
            .arg(root().join("traces/atrium.textrace")),
    );
    let rows = |out: &str| -> Vec<BTreeMap<String, String>> {
        let text = fs::read_to_string(sweep.path(out).join("results.csv")).expect("rows");
        let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned));
        let keys: Vec<String> = lines.next().expect("keys").collect();
        lines
            .map(|line| keys.iter().cloned().zip(line).collect())
            .collect()
    };
    let (a, b) = (rows("a"), rows("b"));
    assert_eq!(
        a[0].keys().collect::<Vec<_>>(),
        b[0].keys().collect::<Vec<_>>()
    );
    let names = [
        "checksum",
        "scene",
        "camera",
        "display",
        "width_px",
        "height_px",
        "model_version",
        "mode",
        "order",
        "seed",
        "l1_size_bytes",
        "l1_ways",
        "l2_replacement",
        "layout_block_order",
    ];
    let of_b = |row: &&BTreeMap<String, String>| {
        row["trace"] == "another name" && row["change_value"] == "2"
    };
    let row = b.iter().find(of_b).expect("a row");
    assert_eq!(
        (row["change_key"].as_str(), row["l1_ways"].as_str()),
        ("l1.ways", "2")
    );
    let same =
        |other: &&BTreeMap<String, String>| names.iter().all(|name| row[*name] == other[*name]);
    let joined: Vec<_> = a.iter().filter(same).collect();
    assert!(!joined.is_empty());
    assert!(
        joined
            .iter()
            .all(|other| other["external_bytes"] == row["external_bytes"])
    );
    // JSON has the same columns.
    let json = fs::read(sweep.path("b/results.json")).expect("results");
    let json: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
    let first = &json["rows"][0];
    assert_eq!(first["checksum"].as_str(), Some(b[0]["checksum"].as_str()));
    assert_eq!(first["l1"]["ways"].to_string(), b[0]["l1_ways"]);
    assert_eq!(first["change"], serde_json::Value::Null);
    assert_eq!(json["rows"][1]["change"]["key"], "l1.ways");
}

#[test]
fn lists_on_the_command_line_are_axes_and_write_no_folder() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let trace = root().join("traces/atrium-shadows.textrace");
    let experiment = folder.path().join("a.toml");
    let axes = "[axes]\norder = [\"morton\", \"z2-sta\"]\ncaches = [\"4/64\", \"8KiB/128KiB\"]\nl2.ways = [4, 16]\n";
    fs::write(&experiment, axes).expect("temporary file");
    let rows = |arguments: &[&str]| {
        let mut command = program("replay");
        command
            .arg("sweep")
            .args(arguments)
            .arg(&trace)
            .arg("--json");
        let output = run_ok(command.current_dir(folder.path()));
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(json["rows"].as_array().map(Vec::len), Some(8));
        json
    };
    let lists = [
        "--orders",
        "morton,z2-sta",
        "--caches",
        "4/64,8KiB/128KiB",
        "--vary",
        "l2.ways=4,16",
    ];
    let of_lists = rows(&lists);
    assert!(!folder.path().join("out").exists());
    assert_eq!(of_lists, rows(&["a.toml"]));
    for (arguments, expected) in [
        (&["--vary", "l2.wyas=4"][..], "l2.wyas"),
        (&["--vary", "cores"], "expected KEY=V1,V2"),
        (&["--caches", "8-128"], "8-128"),
        (&["--caches", "8/128", "--l2", "1MiB"], "use --caches"),
        (&["--orders", "morton", "--order", "z2-sta"], "use --orders"),
        (
            &["--orders", "morton", "--vary", "order=z2-sta"],
            "`order`: expected one list",
        ),
        (
            &["--orders", "morton", "--shard", "1/2"],
            "needs an experiment file",
        ),
        (&["a.toml", "--l2", "1MiB"], "whose [base] sets the machine"),
    ] {
        let mut command = program("replay");
        command.arg("sweep").args(arguments).arg(&trace);
        refuse(command.current_dir(folder.path()), &[expected]);
    }
}
