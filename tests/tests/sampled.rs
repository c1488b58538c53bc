//! Plans, lists of frames, and answers from a sample of the frames of a path.

use formats::Trace;
use formats::textrace::Textrace;
use parallax_tests::{has_lavapipe, program, refuse, run_ok, said};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

const SCENE: [&str; 6] = ["raster", "lab", "--size", "64x64", "--path", "head"];

fn tracegen(flags: &[&str], out: &Path) -> Command {
    let mut command = program("tracegen");
    command.args(SCENE).args(flags).arg("-o").arg(out);
    command
}

fn textrace(path: &Path) -> Textrace {
    match Trace::open(path).expect("a trace") {
        Trace::Texture(trace) => *trace,
        Trace::Ray(_) => panic!("a texture trace"),
    }
}

fn frames(trace: &Textrace) -> Vec<u32> {
    trace
        .tables()
        .meta
        .frames
        .iter()
        .map(|views| views.frame)
        .collect()
}

/// A sample that draws every frame of a short path equals the replay of the whole path.
#[test]
fn a_listed_frame_is_the_frame_of_the_whole_path() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name);
    run_ok(&mut tracegen(&["--frames", "8"], &path("all.textrace")));
    run_ok(&mut tracegen(
        &["--frames", "3,6..8"],
        &path("some.textrace"),
    ));
    let (all, some) = (
        textrace(&path("all.textrace")),
        textrace(&path("some.textrace")),
    );
    assert_eq!(frames(&some), [2, 3, 5, 6, 7]);
    assert_eq!(some.tables().meta.warm_frames, [2, 5]);
    let records = |trace: &Textrace, frame: u32| {
        let passes = trace.tables().passes.iter().enumerate();
        let of_frame = passes.filter(|(_, pass)| pass.frame == frame);
        let mut found = Vec::new();
        for (pass, info) in of_frame {
            for index in 0..info.tile_count() as usize {
                let mut tile = formats::textrace::Tile::default();
                trace.decode_tile(pass, index, &mut tile).expect("a tile");
                found.push(tile);
            }
        }
        found
    };
    for frame in [2, 3, 6, 7] {
        assert!(
            records(&all, frame) == records(&some, frame),
            "frame {frame}"
        );
    }
    let notice = said(&run_ok(
        program("replay").arg("info").arg(path("some.textrace")),
    ));
    assert!(
        notice.contains("2 of 5 frames were captured to fill the caches"),
        "{notice}"
    );
}

fn answer(command: &mut Command) -> Value {
    let output = run_ok(command);
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// By hand and by one command: the same frames, the same figures.
#[test]
fn one_command_gives_the_answer_of_its_steps() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name);
    let plan = path("plan.textrace");
    run_ok(&mut tracegen(&["--frames", "24", "--plan-only"], &plan));
    let planned = textrace(&plan);
    assert!(planned.tables().passes.is_empty());
    let counts = planned.tables().meta.plan.as_ref().expect("a plan");
    assert!(counts.len() == 24 && counts[0].new_texels == counts[0].texels);
    refuse(
        program("replay").arg("run").arg(&plan),
        &["expected captured frames, found a plan"],
    );
    let question = [
        "--within", "20points", "--caches", "4/16", "--json", "--seed", "5",
    ];
    let sample = |traces: &[&Path]| {
        let mut command = program("replay");
        command.arg("sample").args(traces).args(question);
        answer(&mut command)
    };
    let missing = sample(&[&plan]);
    let list = missing["capture"].as_str().expect("frames").to_owned();
    assert!(!list.is_empty() && missing["rows"].as_array().is_some_and(Vec::is_empty));
    let part = path("part.textrace");
    run_ok(&mut tracegen(&["--frames", &list], &part));
    let by_hand = sample(&[&plan, &part]);
    assert_eq!(by_hand["capture"], "");
    let mut command = program("replay");
    command
        .arg("sample")
        .args(question)
        .arg("--")
        .arg(parallax_tests::program("tracegen").get_program());
    command.args(SCENE).args(["--frames", "24"]);
    let driven = answer(&mut command);
    assert_eq!(driven, by_hand);
    let row = &driven["rows"][0];
    let end = |key: &str| row["figures"]["value"][key].as_f64().expect(key);
    assert!(
        end("low") <= end("value") && end("value") <= end("high"),
        "{row}"
    );
}

/// A trace of all frames needs no plan: the frames of the sample are replayed, or all of them for a narrow promise.
#[test]
fn a_trace_of_all_frames_is_sampled_without_a_plan() {
    if !has_lavapipe() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name);
    let all = path("all.textrace");
    run_ok(&mut tracegen(&["--frames", "40", "--no-plain"], &all));
    let sample = |within: &str, more: &[&str]| {
        let mut command = program("replay");
        command.arg("sample").arg(&all).args(["--within", within]);
        answer(command.args(["--caches", "1/4", "--json"]).args(more))
    };
    let some = sample("20points", &[]);
    let drawn = |of: &Value| -> u64 {
        let strata = of["strata"].as_array().expect("strata");
        strata
            .iter()
            .filter_map(|stratum| stratum[1].as_u64())
            .sum()
    };
    assert!((2..20).contains(&drawn(&some)), "{some}");
    let values = path("values.csv");
    let narrow = ["--save-values", values.to_str().expect("a name")];
    let every = sample("0.000001points", &narrow);
    assert_eq!((drawn(&every), every["capture"].as_str()), (40, Some("")));
    let figure = |of: &Value, key: &str| of["rows"][0]["figures"]["value"][key].as_f64();
    let whole = figure(&every, "value").expect("a saving");
    let [low, high] = ["low", "high"].map(|end| figure(&some, end).expect(end));
    assert!(low <= whole && whole <= high, "{low} {whole} {high}");
    // All frames in one run: the figure is that of a replay of the trace.
    let mut run = program("replay");
    run.arg("orders")
        .arg(&all)
        .args(["--mode", "functional", "--caches", "1/4"]);
    let rows = answer(run.args(["--orders", "morton,z2-sta", "--json"]));
    let bytes = |at: usize| rows["rows"][at]["external_bytes"].as_f64().expect("bytes");
    let exact = 100.0 * (1.0 - bytes(1) / bytes(0));
    assert!((whole - exact).abs() < 1e-9, "{whole} {exact}");
    // Other commands answer as the sample does.
    let mut orders = program("replay");
    orders
        .arg("orders")
        .arg(&all)
        .args(["--within", "20points", "--caches", "1/4"]);
    assert_eq!(answer(orders.args(["--orders", "z2-sta", "--json"])), some);
    let mut run = program("replay");
    run.arg("run")
        .arg(&all)
        .args(["--within", "0.0001%", "--order", "z2-sta", "--json"]);
    run.args(["--mode", "functional", "--l1", "1KiB", "--l2", "4KiB"]);
    let bytes_per_frame = figure(&answer(&mut run), "value").expect("bytes");
    assert!(
        (bytes_per_frame - bytes(1) / 40.0).abs() < 1e-6,
        "{bytes_per_frame}"
    );
    for (flags, expected) in [
        (
            &["orders", "--within", "1points", "--bounds"][..],
            "expected no --bounds with it",
        ),
        (
            &["orders", "--within", "1points", "--between", "keep,flush"],
            "expected no --between with it",
        ),
        (
            &["run", "--within", "1points"],
            "expected percent, as in 1%,",
        ),
        (
            &["run", "--within", "1%", "--compare-modes"],
            "expected no --compare-modes with it",
        ),
        (&["run", "--of", "bytes"], "--within <WIDTH>"),
    ] {
        let mut command = program("replay");
        command.arg(flags[0]).arg(&all).args(&flags[1..]);
        refuse(&mut command, &[expected]);
    }
    let part = path("part.textrace");
    run_ok(&mut tracegen(&["--frames", "3,17", "--no-plain"], &part));
    refuse(
        program("replay").arg("sample").arg(&part),
        &[
            "part.textrace",
            "expected a plan",
            "or one trace of all frames",
        ],
    );
}

#[test]
fn contradicting_questions_are_refused() {
    let replay = |flags: &[&str]| {
        let mut command = program("replay");
        command.args(["sample", "absent.textrace"]).args(flags);
        command
    };
    for (flags, expected) in [
        (
            &["--within", "1%"][..],
            "--within: expected points, as in 1points, for this figure, found 1%",
        ),
        (
            &["--within", "1points", "--of", "bytes"],
            "expected percent, as in 1%,",
        ),
        (
            &["--within", "0points"],
            "expected more than 0 and at most 100",
        ),
        (&["--confidence", "100"], "expected 50 to 99.99 percent"),
        (
            &["--orders", "morton"],
            "expected an order other than the baseline",
        ),
        (&["--of", "cycles", "--within", "1%"], "absent.textrace"),
    ] {
        refuse(&mut replay(flags), &[expected]);
    }
    let out = tempfile::tempdir().expect("a temporary folder");
    let file = out.path().join("x.textrace");
    for (flags, expected) in [
        (&["--frames", "3,"][..], "expected 1 to"),
        (
            &["--frames", "3,4", "--occlusion"],
            "--occlusion: expected a number of frames, found a list",
        ),
        (
            &["--frames", "3,4", "--auto", "flip=0.01"],
            "--auto: expected a number of frames",
        ),
        (&["--plan-only", "--occlusion"], "cannot be used with"),
    ] {
        refuse(&mut tracegen(flags, &file), &[expected]);
        assert!(!file.exists());
    }
    let mut failing = program("replay");
    failing.args(["sample", "--", "false"]);
    refuse(
        &mut failing,
        &["false: expected to write", "exit status: 1"],
    );
}
