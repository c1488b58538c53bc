//! Disks that become full at any size of the outputs, or are read-only: exit code 2 and a message, complete
//! files or none, no unfinished files.
//!
//! `make faults` tries every writer at many sizes (`STEPS=n`); `make test` tries a few at some sizes.
#![cfg(unix)]

use parallax_tests::writers::{self, Files, Writer, run_to_completion};
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Number of sizes between nothing and the size of the outputs.
fn steps() -> u64 {
    std::env::var("STEPS").map_or(2, |n| n.parse().expect("STEPS: a number"))
}

fn writers() -> &'static [Writer] {
    match std::env::var_os("STEPS") {
        Some(_) => writers::ALL,
        None => &writers::ALL[..writers::QUICK],
    }
}

/// A file system in memory, which only root can mount.
struct MemoryDisk {
    place: tempfile::TempDir,
}

impl MemoryDisk {
    /// `None`, with a line on stderr, if this user may not mount.
    fn new(size_bytes: u64) -> Option<Self> {
        let place = tempfile::tempdir().expect("a temporary folder");
        let mut command = Command::new("mount");
        command.args(["-t", "tmpfs", "-o", &format!("size={size_bytes}"), "tmpfs"]);
        let status = command.arg(place.path()).stderr(Stdio::null()).status();
        if status.is_ok_and(|status| status.success()) {
            return Some(Self { place });
        }
        parallax_tests::skipped!("a full disk in memory, since mount does not work here");
        None
    }

    fn folder(&self) -> PathBuf {
        let folder = self.place.path().join("out");
        fs::create_dir_all(&folder).expect("a folder");
        folder
    }

    fn make_read_only(&self) {
        let mut command = Command::new("mount");
        command.args(["-o", "remount,ro"]).arg(self.place.path());
        assert!(command.status().expect("mount").success());
    }
}

impl Drop for MemoryDisk {
    fn drop(&mut self) {
        let _left = Command::new("umount").arg(self.place.path()).status();
    }
}

/// Runs a writer that must fail for one of these reasons.
fn fails(mut command: Command, reasons: &[&str], place: &str) {
    let output = command.stdout(Stdio::null()).output().expect("it starts");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{place}: {message}");
    assert!(!message.contains("panicked"), "{place}: {message}");
    let has_reason = reasons.iter().any(|reason| message.contains(reason));
    assert!(has_reason, "{place}: none of {reasons:?} in {message}");
}

/// Checks that a writer that failed left only whole files.
fn check_left(folder: &Path, whole: &Files, writer: &Writer, place: &str) {
    let left = Files::below(folder);
    left.assert_part_of(whole, writer, place);
    assert_eq!(left.unfinished, [""; 0], "{place}");
}

/// The files that each writer writes on a large disk.
fn whole(writer: &Writer, inputs: &Path) -> Files {
    let folder = tempfile::tempdir().expect("a temporary folder");
    run_to_completion((writer.command)(inputs, folder.path()));
    Files::below(folder.path())
}

/// Size of a file in pages of a file system in memory.
fn in_pages(bytes: usize) -> u64 {
    (bytes as u64).next_multiple_of(4096)
}

#[test]
fn a_full_disk_is_reported_at_every_size() {
    let inputs = tempfile::tempdir().expect("a temporary folder");
    writers::write_inputs(inputs.path());
    let mut tries = 0;
    for writer in writers() {
        let whole = whole(writer, inputs.path());
        let needed: u64 = whole.finished.values().map(|b| in_pages(b.len())).sum();
        if needed == 0 {
            continue;
        }
        let steps = steps().min(needed / 4096);
        for step in 0..steps {
            // At least one page for the folder, because a size of 0 means no limit.
            let size = (needed * step / steps).next_multiple_of(4096).max(4096);
            if size >= needed {
                continue;
            }
            let Some(disk) = MemoryDisk::new(size) else {
                return;
            };
            let place = format!("{} on {size} of {needed} bytes", writer.name);
            let folder = disk.folder();
            fails(
                (writer.command)(inputs.path(), &folder),
                &["No space left", "captures failed"],
                &place,
            );
            check_left(&folder, &whole, writer, &place);
            tries += 1;
        }
    }
    println!("{tries} full disks");
}

#[test]
fn files_beyond_a_size_limit_are_reported_at_every_size() {
    let inputs = tempfile::tempdir().expect("a temporary folder");
    writers::write_inputs(inputs.path());
    let mut tries = 0;
    // The driver also keeps its memory in files.
    for writer in writers().iter().filter(|writer| !writer.draws) {
        let whole = whole(writer, inputs.path());
        let largest = whole.finished.values().map(Vec::len).max();
        // A shell counts in blocks of 512 bytes.
        let blocks = largest.unwrap_or_default() as u64 / 512;
        let steps = steps().min(blocks);
        for step in 0..steps {
            let limit = blocks * step / steps;
            let folder = tempfile::tempdir().expect("a temporary folder");
            let command = (writer.command)(inputs.path(), folder.path());
            let mut shell = Command::new("sh");
            let limited = format!("ulimit -f {limit}; exec \"$0\" \"$@\"");
            shell.args(["-c", &limited]).arg(command.get_program());
            shell.args(command.get_args());
            for (key, value) in command.get_envs() {
                match value {
                    Some(value) => shell.env(key, value),
                    None => shell.env_remove(key),
                };
            }
            let place = format!("{} below {limit} blocks", writer.name);
            fails(shell, &["too large", "captures failed"], &place);
            check_left(folder.path(), &whole, writer, &place);
            tries += 1;
        }
    }
    println!("{tries} limits");
}

#[test]
fn an_unwritable_folder_is_reported() {
    let inputs = tempfile::tempdir().expect("a temporary folder");
    writers::write_inputs(inputs.path());
    let folder = tempfile::tempdir().expect("a temporary folder");
    let read_only = fs::Permissions::from_mode(0o555);
    fs::set_permissions(folder.path(), read_only).expect("permissions");
    // Root can write to it, but not to a read-only disk.
    let disk = match fs::write(folder.path().join("try"), "") {
        Err(_) => None,
        Ok(()) => match MemoryDisk::new(1 << 20) {
            Some(disk) => {
                disk.folder();
                disk.make_read_only();
                Some(disk)
            }
            None => return,
        },
    };
    let out = match &disk {
        Some(disk) => disk.place.path().join("out"),
        None => folder.path().to_owned(),
    };
    for writer in writers().iter().filter(|w| w.name != "replay run") {
        fails(
            (writer.command)(inputs.path(), &out),
            &["Read-only file system", "Permission denied"],
            writer.name,
        );
        assert!(Files::below(&out).finished.is_empty(), "{}", writer.name);
    }
}

#[test]
fn a_result_printed_to_a_full_disk_is_an_error() {
    let Ok(full) = fs::OpenOptions::new().write(true).open("/dev/full") else {
        parallax_tests::skipped!("there is no /dev/full");
        return;
    };
    let inputs = tempfile::tempdir().expect("a temporary folder");
    writers::write_inputs(inputs.path());
    for writer in writers::ALL {
        let prints = ["replay run", "replay sweep", "replay reproject"].contains(&writer.name);
        if !prints {
            continue;
        }
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut command = (writer.command)(inputs.path(), folder.path());
        let output = command.stdout(full.try_clone().expect("a handle")).output();
        let output = output.expect("it starts");
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{}: {message}", writer.name);
        assert!(
            message.contains("No space left"),
            "{}: {message}",
            writer.name
        );
        assert_eq!(Files::below(folder.path()).unfinished, [""; 0]);
    }
}
