//! The same input gives the same bytes for any number of threads and in every run.

use parallax_tests::repair::Parts;
use parallax_tests::{program, root, run_ok};
use std::fs;
use std::path::Path;

fn capture(output: &Path, lp_num_threads: Option<&str>) -> Vec<u8> {
    let mut command = program("tracegen");
    command
        .args([
            "raster",
            "atrium-shadows",
            "--size",
            "160x180",
            "--no-plain",
            "-o",
        ])
        .arg(output);
    if let Some(threads) = lp_num_threads {
        command.env("LP_NUM_THREADS", threads);
    }
    run_ok(&mut command);
    fs::read(output).expect("the trace was written")
}

#[test]
fn a_capture_has_the_same_bytes_over_runs_and_driver_threads() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let first = capture(&folder.path().join("first.textrace"), None);
    assert!(
        first == capture(&folder.path().join("second.textrace"), None),
        "two runs differ"
    );
    for threads in ["0", "2"] {
        let path = folder.path().join(format!("lp{threads}.textrace"));
        assert!(
            first == capture(&path, Some(threads)),
            "LP_NUM_THREADS={threads} differs"
        );
    }
}

#[test]
fn fragments_recorded_one_by_one_give_the_same_traces_as_quads() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // Shadow cascades and alpha-masked draws.
    for name in ["atrium-shadows", "jungle"] {
        let recipe = root().join(format!("traces/{name}.recipe"));
        let recipe = fs::read_to_string(recipe).expect("a golden trace has a recipe");
        // Vectors of 128 bits hold one quad, and their ballots are unreliable.
        let capture = |bits: &str| {
            let path = folder.path().join(format!("{name}-{bits}.textrace"));
            let mut command = program("tracegen");
            command.args(recipe.split_whitespace()).arg("-o").arg(&path);
            // tracegen makes the same choice for narrow vectors.
            command.env("GALLIUM_OVERRIDE_CPU_CAPS", "sse4.1");
            let output = run_ok(command.env("LP_NATIVE_VECTOR_WIDTH", bits));
            let has_note = String::from_utf8_lossy(&output.stderr).contains("recorded one by one");
            assert_eq!(has_note, bits == "128");
            let bytes = fs::read(&path).expect("a trace");
            let mut chunks = Parts::of(&bytes).chunks;
            // The description names the driver.
            chunks.retain(|(tag, _)| tag != b"META");
            chunks
        };
        assert!(capture("128") == capture("256"), "{name} differs");
    }
}

#[test]
fn a_replay_prints_the_same_bytes_over_threads() {
    let trace = root().join("traces/jungle.textrace");
    for mode in ["timed", "functional"] {
        let run = |threads: &str| {
            run_ok(program("replay").arg("run").arg(&trace).args([
                "--order",
                "z2-sta",
                "--mode",
                mode,
                "--threads",
                threads,
                "--json",
            ]))
            .stdout
        };
        assert_eq!(run("1"), run("2"), "{mode}");
    }
}

#[test]
fn the_paper_table_has_the_same_bytes_over_threads() {
    let trace = root().join("traces/atrium-shadows.textrace");
    let paper = |threads: &str| {
        run_ok(
            program("replay")
                .arg("paper")
                .arg(&trace)
                .args(["--threads", threads, "--json"]),
        )
        .stdout
    };
    assert_eq!(paper("1"), paper("2"));
}
