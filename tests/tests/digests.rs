//! Digests of what the commands of `replay` print and write on the golden traces, and of the help of both programs:
//! `commands.digests` lists commands, and below each one its outputs. A change of the code that should change no output
//! changes no digest.
//!
//! `UPDATE_GOLDEN=1` rewrites the digests; review the diff, and say in the commit why an output changed.
//! `KEEP_OUTPUTS=FOLDER` keeps all outputs, so that `diff -r` shows what changed between two versions.

use formats::container::checksum;
use parallax_tests::{program, root};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A command and the outputs that it had when the digests were written.
#[derive(Debug)]
struct Listed {
    /// Program and arguments, separated by spaces.
    command: String,
    /// Name and digest of each output.
    outputs: String,
}

/// The file's comments, and its commands in order.
fn parse(text: &str) -> (String, Vec<Listed>) {
    let mut comments = String::new();
    let mut commands: Vec<Listed> = Vec::new();
    for line in text.lines() {
        if line.starts_with('#') {
            comments += &format!("{line}\n");
        } else if line.starts_with(' ') {
            let listed = commands
                .last_mut()
                .expect("a command stands before its outputs");
            listed.outputs += &format!("{line}\n");
        } else if !line.is_empty() {
            commands.push(Listed {
                command: line.to_owned(),
                outputs: String::new(),
            });
        }
    }
    (comments, commands)
}

/// The inputs of all commands in one folder: the golden traces, their experiment, and a folder of techniques.
fn inputs(folder: &Path) {
    copy(&root().join("traces"), folder, false);
    copy(&root().join("tests/tests/data"), folder, true);
}

fn copy(from: &Path, to: &Path, folders_too: bool) {
    fs::create_dir_all(to).expect("a folder");
    for path in entries(from) {
        let target = to.join(path.file_name().expect("a name"));
        if path.is_file() {
            fs::copy(&path, target).expect("a copy");
        } else if folders_too {
            copy(&path, &target, true);
        }
    }
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    paths
}

/// Every file below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let below = |path: PathBuf| {
        if path.is_dir() {
            files(&path)
        } else {
            vec![path]
        }
    };
    entries(folder).into_iter().flat_map(below).collect()
}

/// Runs a command beside the inputs; it writes into `out/`. Returns a line for each output.
fn outputs(command: &str, inputs: &Path, out: &Path) -> String {
    let _ = fs::remove_dir_all(out);
    fs::create_dir(out).expect("a folder");
    let mut words = command.split(' ');
    let mut process: Command = program(words.next().expect("a program"));
    process
        .args(words)
        .current_dir(inputs)
        .env_remove("COLUMNS")
        .env("NO_COLOR", "1");
    let output = process.output().expect("the program starts");
    let messages = String::from_utf8_lossy(&output.stderr);
    let mut lines = match output.status.code() {
        Some(0) => String::new(),
        Some(1) => "    exit code 1\n".to_owned(),
        _ => panic!("{command}: {:?}: {messages}", output.status),
    };
    fs::write(out.join("standard output"), output.stdout).expect("an output");
    for path in files(out) {
        let bytes = fs::read(&path).expect("an output");
        // Rows of a sweep's points are a log, in the order in which the points ended.
        if bytes.is_empty()
            || path
                .extension()
                .is_some_and(|extension| extension == "rows")
        {
            continue;
        }
        let name = path.strip_prefix(out).expect("below the folder").display();
        writeln!(lines, "    {} {name}", checksum(&bytes)).expect("text");
    }
    lines
}

#[test]
fn every_command_has_the_outputs_that_it_had_before() {
    let path = root().join("traces/commands.digests");
    let text = fs::read_to_string(&path).expect("the list of commands");
    let (mut now, commands) = parse(&text);
    let folder = tempfile::tempdir().expect("a temporary folder");
    inputs(folder.path());
    let out = folder.path().join("out");
    let kept = std::env::var_os("KEEP_OUTPUTS").map(PathBuf::from);
    let mut changed = Vec::new();
    for Listed {
        command,
        outputs: before,
    } in &commands
    {
        let found = outputs(command, folder.path(), &out);
        assert!(!found.is_empty(), "{command}: no output");
        if let Some(kept) = &kept {
            copy(&out, &kept.join(command.replace(['/', ' '], "_")), true);
        }
        if found != *before {
            changed.push(format!("{command}\n  expected\n{before}  found\n{found}"));
        }
        now += &format!("{command}\n{found}");
    }
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        fs::write(&path, now).expect("the list can be written");
        return;
    }
    assert!(
        changed.is_empty(),
        "{} of {} commands have other outputs; KEEP_OUTPUTS=FOLDER keeps them, UPDATE_GOLDEN=1 accepts them:\n{}",
        changed.len(),
        commands.len(),
        changed.join("\n")
    );
}

/// The subcommands that `--help` lists.
fn subcommands(name: &str) -> Vec<String> {
    let help = parallax_tests::run_ok(program(name).arg("--help")).stdout;
    let help = String::from_utf8(help).expect("text");
    let list = help
        .split("Commands:\n")
        .nth(1)
        .and_then(|rest| rest.split("\n\n").next());
    let rows = list.expect("a list of commands").lines();
    let rows = rows.filter(|row| row.starts_with("  ") && !row.starts_with("   "));
    rows.map(|row| row.split_whitespace().next().expect("a name").to_owned())
        .collect()
}

#[test]
fn every_subcommand_is_listed_with_its_help_and_those_of_replay_with_an_output() {
    let text =
        fs::read_to_string(root().join("traces/commands.digests")).expect("the list of commands");
    let (_, commands) = parse(&text);
    for name in ["tracegen", "replay"] {
        for subcommand in subcommands(name) {
            let help = format!("{name} help {subcommand}");
            let has = |start: &str| {
                commands
                    .iter()
                    .any(|listed| listed.command.starts_with(start))
            };
            assert!(subcommand == "help" || has(&help), "`{help}` is missing");
            let run = format!("{name} {subcommand} ");
            assert!(name == "tracegen" || has(&run), "`{run}` is missing");
        }
    }
}
