//! Predictions of what orders save at a size that was not captured.

use parallax_tests::{has_lavapipe, program, refuse, root, run_ok};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

const QUESTION: [&str; 8] = [
    "--to",
    "960x1080",
    "--caches",
    "8/128,8/8192",
    "--orders",
    "z2-sta",
    "--json",
    "--quiet",
];

fn capture(scene: &str, size: &str, out: &Path) {
    let mut command = program("tracegen");
    command.args(["raster", scene, "--no-plain", "--size", size]);
    run_ok(command.arg("-o").arg(out));
}

fn answer(command: &mut Command) -> Value {
    serde_json::from_slice(&run_ok(command).stdout).expect("JSON")
}

/// A captured trace and one that the command captures give the same figures, which come near those at full size.
#[test]
fn a_prediction_comes_near_the_measured_saving() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name);
    let [half, whole] = ["480x540", "960x1080"].map(|size| {
        let file = path(size).with_extension("textrace");
        capture("lab", size, &file);
        file
    });
    let mut predict = program("replay");
    let by_hand = answer(predict.arg("predict").arg(&half).args(QUESTION));
    let mut driven = program("replay");
    driven.arg("predict").args(QUESTION).arg("--");
    driven.arg(program("tracegen").get_program());
    driven.args(["raster", "lab", "--no-plain", "--size", "480x540"]);
    assert_eq!(answer(&mut driven), by_hand);
    assert_eq!(by_hand["sizes_px"][1], serde_json::json!([960, 1080]));
    let machine = path("machine.toml");
    std::fs::write(&machine, "l2.ways = 16\nl2.set_index = \"xor\"\n").expect("a file");
    let mut measured = program("replay");
    measured
        .arg("orders")
        .arg(&whole)
        .arg("--config")
        .arg(&machine);
    measured.args([
        "--mode",
        "functional",
        "--caches",
        "8/128,8/8192",
        "--orders",
        "morton,z2-sta",
        "--json",
    ]);
    let measured = answer(&mut measured);
    let bytes = |order: &str, l2_kib: f64| {
        let rows = measured["rows"].as_array().expect("rows");
        let row = rows
            .iter()
            .find(|row| row["order"] == order && row["l2_kib"] == l2_kib);
        row.and_then(|row| row["external_bytes"].as_f64())
            .expect("bytes")
    };
    let rows = by_hand["rows"].as_array().expect("rows");
    assert_eq!(rows.len(), 2);
    for (row, l2_kib) in rows.iter().zip([128.0, 8192.0]) {
        let true_pct = 100.0 * (1.0 - bytes("z2-sta", l2_kib) / bytes("morton", l2_kib));
        let found_pct = row["stretched_pct"].as_f64().expect("a saving");
        assert!((found_pct - true_pct).abs() < 5.0, "{true_pct}: {row}");
        if row["answer"] == "interval" {
            let end = |key: &str| row["figures"]["saving_pct"][key].as_f64().expect(key);
            assert!(end("low") < true_pct && true_pct < end("high"), "{row}");
        }
    }
    assert!(bytes("z2-sta", 128.0) < 0.8 * bytes("morton", 128.0));
    assert_eq!(rows[0]["answer"], "interval");
    assert_eq!(
        rows[1]["answer"],
        "no interval: an L2 outside 128 KiB to 2 MiB"
    );

    for (flags, expected) in [
        (
            &["--to", "100x112"][..],
            "--to: expected a size of at least the trace's 480x540",
        ),
        (&["--to", "1920x1080"], "and of its shape, found 1920x1080"),
        (
            &["--to", "256"],
            "expected a size as in 1920x2160, found '256'",
        ),
        (
            &["--to", "960x1080", "--replacement", "fifo"],
            "l2.replacement: expected lru",
        ),
        (
            &["--to", "960x1080", "--orders", "morton"],
            "expected an order other than the baseline",
        ),
        (
            &["--to", "960x1080", "--l2", "8KiB", "--caches", "8/128"],
            "use --caches",
        ),
    ] {
        let mut command = program("replay");
        refuse(command.arg("predict").arg(&half).args(flags), &[expected]);
    }
    let far = run_ok(program("replay").arg("predict").arg(&half).args([
        "--to",
        "1920x2160",
        "--caches",
        "8/128",
    ]));
    let far = String::from_utf8_lossy(&far.stdout).into_owned();
    assert!(
        far.contains("no interval: more than three times the width"),
        "{far}"
    );
    // A preset has caches and lines of its own.
    let mut preset = program("replay");
    preset
        .arg("predict")
        .arg(&half)
        .args(["--to", "960x1080", "--preset", "adreno-740", "--json"]);
    let preset = answer(&mut preset);
    let of_preset = |key: &str| {
        preset["rows"]
            .as_array()
            .is_some_and(|rows| rows.iter().all(|row| row[key].is_string()))
    };
    assert_eq!(preset["rows"][0]["caches"], "2/1024");
    assert!(
        of_preset("answer") && preset["config"]["line_bytes"] == 64,
        "{preset}"
    );
}

/// The interval is the largest error of the results files.
#[test]
fn the_interval_is_the_largest_measured_error() {
    let largest = |file: &str| {
        let path = root().join("results").join(file);
        let text = std::fs::read_to_string(&path).expect("a results file");
        let lines = text.lines().filter(|line| !line.starts_with('#'));
        let text = lines.collect::<Vec<_>>().join("\n");
        let mut rows = csv::Reader::from_reader(text.as_bytes());
        let heading = rows.headers().expect("a heading").clone();
        let column =
            (heading.iter()).position(|name| name == "largest error outside knees, points");
        let column = column.expect("a column of errors");
        let errors = rows.records().map(|row| {
            let row = row.expect("a row");
            row[column].parse::<f64>().expect("an error")
        });
        errors.fold(0.0, f64::max)
    };
    let files = [
        "sizes-coverage.csv",
        "single-frame-summary.csv",
        "single-frame-machines.csv",
    ];
    let largest = files.into_iter().map(largest).fold(0.0, f64::max);
    let source = root().join("replay/studies/src/predict.rs");
    let source = std::fs::read_to_string(source).expect("the source");
    let expected = format!("LARGEST_ERROR_POINTS: f64 = {largest:.1};");
    assert!(source.contains(&expected), "{expected}");
}
