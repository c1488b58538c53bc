//! Compares the DRAM model with Ramulator (`tests/peers/ramulator`). Runs with PARALLAX_PEERS=1, because
//! its build takes some minutes.

use parallax_tests::{root, skipped};
use std::process::Command;

fn succeeds(command: &mut Command) -> bool {
    command.output().is_ok_and(|output| output.status.success())
}

#[test]
fn row_hits_latencies_and_frame_times_match_those_of_ramulator() {
    if std::env::var_os("PARALLAX_PEERS").is_none() {
        skipped!("no comparison with Ramulator: PARALLAX_PEERS is not set");
        return;
    }
    if !succeeds(Command::new("c++").arg("--version")) {
        skipped!("c++ is missing, which Ramulator is built with");
        return;
    }
    let manifest = root().join("tests/peers/ramulator/Cargo.toml");
    let cargo = |subcommand: &str| {
        let mut command = Command::new(env!("CARGO"));
        command.arg(subcommand).arg("--locked");
        command.arg("--manifest-path").arg(&manifest);
        command
    };
    if !succeeds(&mut cargo("fetch")) {
        skipped!("Ramulator cannot be fetched");
        return;
    }
    let target = parallax_tests::program("replay").get_program().to_owned();
    let target = std::path::Path::new(&target)
        .parent()
        .and_then(|p| p.parent())
        .expect("a folder");
    let traces = ["atrium", "jungle"].map(|name| root().join(format!("traces/{name}.textrace")));
    // Streams of requests; then the closed loop: two traces and two schedulers; three memories with three settings
    // of the peer, one with six, two with one.
    for (traces, rows) in [(&traces[..0], 7), (&traces[..], 2 * 2 * (3 * 3 + 6 + 2))] {
        let mut run = cargo("run");
        run.arg("--release").arg("--target-dir");
        run.arg(target.join("peers")).arg("--").args(traces);
        let output = run.output().expect("cargo starts");
        let text = String::from_utf8_lossy(&output.stdout);
        let messages = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{text}{messages}");
        assert_eq!(text.lines().count(), 1 + rows, "{text}");
    }
}
