//! Signals to captures of programs and pages at random moments: no process and no file is left.
//!
//! `KILLS=n` sets the number of signals; without it, each signal is sent once to each kind of capture.
#![cfg(target_os = "linux")]

use parallax_tests::traces::Random;
use parallax_tests::{has_chromium, has_lavapipe, program, run_ok};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Signals that end a process, and their numbers.
const SIGNALS: [(&str, u32); 12] = [
    ("KILL", 9),
    ("HUP", 1),
    ("INT", 2),
    ("QUIT", 3),
    ("TERM", 15),
    ("USR1", 10),
    ("USR2", 12),
    ("ALRM", 14),
    ("VTALRM", 26),
    ("PROF", 27),
    ("XCPU", 24),
    ("IO", 29),
];

/// The signals that this process does not ignore. Programs that `nohup` or a shell starts in the background ignore
/// some, and so do the programs that they start.
fn signals() -> Vec<&'static str> {
    let status = fs::read_to_string("/proc/self/status").expect("/proc");
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = u64::from_str_radix(ignored.expect("a mask").trim(), 16).expect("a number");
    let taken = SIGNALS
        .iter()
        .filter(|(_, number)| ignored >> (number - 1) & 1 == 0);
    taken.map(|(name, _)| *name).collect()
}

/// Variable by which all processes of a capture are found.
const MARK: &str = "PARALLAX_TEST_CAPTURE";

/// Temporary folder and home of a capture, which must be empty when it has ended.
struct Place {
    folder: tempfile::TempDir,
    mark: String,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for name in ["tmp", "home"] {
            fs::create_dir(folder.path().join(name)).expect("a folder");
        }
        let mark = format!("{MARK}={}", folder.path().display());
        Self { folder, mark }
    }

    fn command(&self) -> Command {
        let mut command = program("tracegen");
        command
            .current_dir(self.folder.path())
            .env(MARK, self.folder.path())
            .env("TMPDIR", self.folder.path().join("tmp"))
            .env("HOME", self.folder.path().join("home"))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        command
    }

    /// Command lines of the running processes of the capture.
    fn processes(&self) -> Vec<String> {
        let mut found = Vec::new();
        for process in fs::read_dir("/proc").expect("/proc").flatten() {
            let read = |name: &str| fs::read(process.path().join(name)).unwrap_or_default();
            let environment = read("environ");
            let mut variables = environment.split(|byte| *byte == 0);
            let of_capture = variables.any(|variable| variable == self.mark.as_bytes());
            // A zombie has no command line.
            let line = String::from_utf8_lossy(&read("cmdline")).replace('\0', " ");
            if of_capture && !line.is_empty() {
                found.push(line);
            }
        }
        found
    }

    /// Files and folders that are left.
    fn files(&self) -> Vec<PathBuf> {
        let mut left = Vec::new();
        for name in ["", "tmp", "home"] {
            let entries = fs::read_dir(self.folder.path().join(name)).expect("a folder");
            left.extend(entries.map(|entry| entry.expect("an entry").path()));
        }
        let own = |path: &Path| {
            ["tmp", "home", "page.html"]
                .iter()
                .any(|n| path.ends_with(n))
        };
        left.retain(|path| !own(path));
        left
    }

    /// Waits until nothing is left; returns what still is after a while.
    fn left_after(&self, while_: Duration) -> (Vec<String>, Vec<PathBuf>) {
        let start = Instant::now();
        loop {
            let left = (self.processes(), self.files());
            if (left.0.is_empty() && left.1.is_empty()) || start.elapsed() > while_ {
                return left;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// Sends signals at moments up to `longest`. Captures end by the signal, and nothing is left.
fn send_signals(kind: &str, longest: Duration, seed: u64, prepare: impl Fn(&mut Command)) {
    let signals = signals();
    let wanted = std::env::var("KILLS").map_or(signals.len(), |n| n.parse().expect("a number"));
    let mut random = Random(seed);
    let (mut sent, mut late, mut slow) = (0, 0, Duration::ZERO);
    while sent < wanted && late < 20 + sent {
        let signal = signals[(sent + late) % signals.len()];
        let moment = longest.mul_f64(f64::from(random.below(1000)) / 1000.0);
        let place = Place::new();
        fs::write(place.folder.path().join("page.html"), PAGE).expect("writable");
        let mut command = place.command();
        prepare(&mut command);
        let mut child = command.spawn().expect("starts");
        std::thread::sleep(moment);
        if child.try_wait().expect("a child").is_some() {
            late += 1;
            continue;
        }
        let kill = format!("kill -{signal} {}", child.id());
        run_ok(Command::new("sh").args(["-c", &kill]));
        let start = Instant::now();
        let status = child.wait().expect("ends");
        slow = slow.max(start.elapsed());
        assert!(!status.success(), "{kind}: SIG{signal} after {moment:?}");
        // Only SIGKILL leaves the work to another process.
        let patience = Duration::from_secs(if signal == "KILL" { 10 } else { 0 });
        let (processes, files) = place.left_after(patience);
        let what = format!("{kind}: SIG{signal} after {moment:?}");
        assert!(processes.is_empty(), "{what}: {processes:#?} are running");
        // Nobody removes the small folder of a capture that is killed before its supervisor runs.
        let is_bare = |path: &PathBuf| {
            !path.join("supervisor-ended").exists() && !path.join("profile").exists()
        };
        let excused = signal == "KILL" && files.iter().all(is_bare);
        assert!(files.is_empty() || excused, "{what}: {files:?} are left");
        sent += 1;
    }
    println!(
        "{kind}: {sent} signals, {late} too late; nothing left; the slowest end took {slow:?}"
    );
    assert!(sent >= wanted, "{kind}: {late} signals came too late");
}

/// A page that draws without end.
const PAGE: &str = "<!doctype html><canvas id=c></canvas><script>
    const gl = document.getElementById('c').getContext('webgl2');
    const frame = () => { gl.clear(16640); requestAnimationFrame(frame); };
    requestAnimationFrame(frame);</script>";

#[test]
fn signals_to_a_capture_of_a_program_leave_no_process_and_no_file() {
    if !has_lavapipe() {
        return;
    }
    // Processes in the background and in another session, one of which ignores requests to end.
    let script =
        "setsid sh -c 'trap \"\" TERM; sleep 100; sleep 100' & sleep 100 & sleep 100; wait";
    send_signals("app", Duration::from_millis(600), 5, |command| {
        command.args(["app", "-o", "o.textrace", "--", "sh", "-c", script]);
    });
}

#[test]
fn signals_to_a_capture_of_a_page_leave_no_process_and_no_file() {
    if !has_chromium() {
        return;
    }
    send_signals("page", Duration::from_secs(3), 6, |command| {
        command.args([
            "page",
            "-o",
            "o.textrace",
            "--frames",
            "100000",
            "page.html",
        ]);
    });
}

#[test]
fn a_program_in_a_session_of_its_own_is_waited_for_and_ended() {
    if !has_lavapipe() {
        return;
    }
    let place = Place::new();
    let mut command = place.command();
    command.args([
        "app",
        "-o",
        "o.textrace",
        "--timeout",
        "1",
        "--",
        "setsid",
        "sleep",
        "100",
    ]);
    let start = Instant::now();
    let status = command.status().expect("starts");
    assert_eq!(status.code(), Some(2));
    assert!(
        start.elapsed() > Duration::from_secs(1),
        "it was not waited for"
    );
    assert_eq!(place.left_after(Duration::ZERO), (Vec::new(), Vec::new()));
}

#[test]
fn a_folder_of_a_capture_is_its_owners() {
    use std::os::unix::fs::PermissionsExt;
    if !has_lavapipe() {
        return;
    }
    let place = Place::new();
    let list = "for f in \"$TMPDIR\"/.scratch-*; do stat -c %a \"$f\" > modes; done";
    let mut shell = Command::new("sh");
    let tracegen = place.command();
    shell
        .args(["-c", "umask 0; exec \"$0\" \"$@\""])
        .arg(tracegen.get_program());
    shell.args(["app", "-o", "o.textrace", "--", "sh", "-c", list]);
    shell.current_dir(place.folder.path());
    shell.env("TMPDIR", place.folder.path().join("tmp"));
    let output = shell.output().expect("starts");
    let modes = fs::read_to_string(place.folder.path().join("modes"));
    assert_eq!(modes.expect("a mode"), "700\n", "{output:?}");
    let folder = fs::metadata(place.folder.path()).expect("a folder");
    assert!(folder.permissions().mode() & 0o700 == 0o700);
}

#[test]
fn a_program_that_cannot_run_is_refused_before_the_capture() {
    let place = Place::new();
    for arguments in [
        &["--", "./none"][..],
        &["--", "no-such-program"],
        &["--timeout", "18446744073709551615", "--", "sh"],
        &["--timeout", "nan", "--", "sh"],
    ] {
        let mut command = place.command();
        command.stderr(Stdio::piped());
        command.args(["app", "-o", "o.textrace"]).args(arguments);
        let output = command.output().expect("starts");
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains("expected"), "{text}");
        assert_eq!(place.left_after(Duration::ZERO), (Vec::new(), Vec::new()));
    }
}

#[test]
fn processes_of_a_capture_are_found() {
    let place = Place::new();
    let mut shell = Command::new("sh");
    let mut child = shell
        .args(["-c", "exec sleep 5"])
        .env(MARK, place.folder.path())
        .spawn()
        .expect("starts");
    std::thread::sleep(Duration::from_millis(100));
    assert!(!place.processes().is_empty());
    child.kill().expect("running");
    child.wait().expect("ends");
}
