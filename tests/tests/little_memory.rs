//! Too little address space (`ulimit -v`): a message and exit code 2, and no file under its final name.

use parallax_tests::{program, root};
use std::fs;
use std::path::Path;
use std::process::Command;

/// The command with a limit in MiB.
fn limited(command: &Command, limit_mib: u32) -> Command {
    let mut shell = Command::new("sh");
    let script = format!("ulimit -v {}; exec \"$@\"", limit_mib * 1024);
    shell.args(["-c", &script, "sh"]).arg(command.get_program());
    shell.args(command.get_args());
    shell.env("PARALLAX_CACHE_SIZE", "0");
    shell
}

/// Names in a folder without temporary files, which an abort leaves like SIGKILL.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder").flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    names.filter(|name| !name.ends_with(".part")).collect()
}

/// Runs a command that writes into the folder with each limit; returns whether one of them was too low.
fn fails_with_message(command: &Command, folder: &Path, limits_mib: &[u32]) -> bool {
    let mut refused = false;
    for limit_mib in limits_mib {
        let output = limited(command, *limit_mib).output().expect("sh starts");
        let message = String::from_utf8_lossy(&output.stderr);
        let place = format!("{command:?} below {limit_mib} MiB:\n{message}");
        match output.status.code() {
            Some(0) => {}
            Some(2) => {
                refused = true;
                assert!(message.contains("error: "), "{place}");
                assert!(!message.contains("panicked"), "{place}");
                assert!(!message.contains("no lavapipe"), "{place}");
                assert_eq!(names(folder), [""; 0], "{place}");
            }
            other => panic!("{other:?}: {place}"),
        }
        for name in names(folder) {
            fs::remove_file(folder.join(name)).expect("removed");
        }
    }
    refused
}

#[test]
fn a_replay_without_memory_ends_with_a_message() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let trace = root().join("traces/atrium.textrace");
    // Near the size of the program's file it cannot even start its threads.
    let size = fs::metadata(program("replay").get_program()).expect("the program");
    let size_mib = size.len().div_ceil(1 << 20) as u32;
    let limits_mib = [4, 8, 12, 20, 26].map(|more| size_mib + more);
    for name in ["run", "paper", "report", "locality"] {
        let mut command = program("replay");
        command.arg(name).arg(&trace);
        match name {
            "paper" => command.arg("--html").arg(folder.path().join("p.html")),
            "report" => command.arg("-o").arg(folder.path().join("r.html")),
            _ => &mut command,
        };
        let refused = fails_with_message(&command, folder.path(), &limits_mib);
        assert!(refused, "{name}");
    }
}

#[test]
fn a_capture_without_memory_ends_with_a_message() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, scene, limits_mib) in [
        ("rays", "teapot", &[40, 50, 60][..]),
        ("raster", "atrium-plain", &[40, 60, 80, 120, 240, 480]),
        ("verify", "atrium-plain", &[40, 60, 120, 240, 480]),
    ] {
        let mut command = program("tracegen");
        command.args([name, scene, "--size", "64x64"]);
        if name != "verify" {
            command.arg("-o").arg(folder.path().join("trace"));
        }
        assert!(
            fails_with_message(&command, folder.path(), limits_mib),
            "{name}"
        );
    }
}
