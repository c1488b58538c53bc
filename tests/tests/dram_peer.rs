//! The DRAM model beside Ramulator (`tests/peers/ramulator`), which cmake builds in about three minutes: with PARALLAX_PEERS=1.

use parallax_tests::{root, skipped};
use std::process::Command;

fn succeeds(command: &mut Command) -> bool {
    command.output().is_ok_and(|output| output.status.success())
}

#[test]
fn row_hits_and_latencies_are_ramulators() {
    if std::env::var_os("PARALLAX_PEERS").is_none() {
        skipped!("no comparison with Ramulator: PARALLAX_PEERS is not set");
        return;
    }
    if !succeeds(Command::new("cmake").arg("--version")) {
        skipped!("cmake is missing, which Ramulator is built with");
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
    let mut run = cargo("run");
    run.arg("--release")
        .arg("--target-dir")
        .arg(target.join("peers"));
    let output = run.output().expect("cargo starts");
    let text = String::from_utf8_lossy(&output.stdout);
    let messages = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}{messages}");
    assert_eq!(text.lines().count(), 1 + 7, "{text}");
}
