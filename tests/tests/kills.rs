//! Programs killed at random moments: no incomplete file under a final name, and another run completes with
//! the bytes of an undisturbed run.
//!
//! `make faults` kills 200 times; `KILLS=n` sets the number. A kill counts only if the program was still
//! running.
#![cfg(unix)]

use parallax_tests::traces::Random;
use parallax_tests::writers::{self, Files, Writer, run_to_completion};
use std::fs;
use std::io::Read;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Number of kills without `KILLS`, with the quick writers only.
const FEW: u32 = 6;

fn kills() -> Option<u32> {
    let kills = std::env::var("KILLS").ok()?;
    Some(kills.parse().expect("KILLS: a number"))
}

/// Starts a program with its own process group, which includes its children.
fn start(mut command: Command) -> Child {
    let quiet = command.stdout(Stdio::null()).stderr(Stdio::null());
    quiet.process_group(0).spawn().expect("the program starts")
}

/// Waits and sends a signal to a program and its children, as terminals and clusters do; `None` if it has
/// already ended.
fn signal_after(child: &mut Child, moment: Duration, signal: &str) -> Option<ExitStatus> {
    std::thread::sleep(moment);
    if child.try_wait().expect("a child").is_some() {
        return None;
    }
    let kill = format!("kill -{signal} -{}", child.id());
    let sent = Command::new("sh").args(["-c", &kill]).status();
    let status = child.wait().expect("it ends");
    // It may have ended between the two.
    (sent.expect("a shell").success() && !status.success()).then_some(status)
}

/// A writer, its undisturbed output, and its run time.
struct Undisturbed<'a> {
    writer: &'a Writer,
    files: Files,
    /// Adapted to the current speed of the machine, so that one kill in six comes too late.
    time: Duration,
}

impl<'a> Undisturbed<'a> {
    fn of(writer: &'a Writer, inputs: &Path) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let start = Instant::now();
        run_to_completion((writer.command)(inputs, folder.path()));
        let time = start.elapsed();
        let files = Files::below(folder.path());
        assert_eq!(files.unfinished, [""; 0], "{}", writer.name);
        Self {
            writer,
            files,
            time,
        }
    }
}

#[test]
fn killed_writers_leave_nothing_incomplete_and_complete_with_the_same_bytes_the_next_time() {
    let inputs = tempfile::tempdir().expect("a temporary folder");
    writers::write_inputs(inputs.path());
    let wanted = kills();
    let writers = match wanted {
        Some(_) => writers::ALL,
        None => &writers::ALL[..writers::QUICK],
    };
    let mut whole: Vec<Undisturbed> = (writers.iter())
        .map(|writer| Undisturbed::of(writer, inputs.path()))
        .collect();
    let mut random = Random(2012);
    let (mut killed, mut finished, mut late) = (0, 0, 0);
    'all: loop {
        for Undisturbed {
            writer,
            files,
            time,
        } in &mut whole
        {
            let folder = tempfile::tempdir().expect("a temporary folder");
            // The second kill finds the remains of the first one.
            for round in 0..2 {
                let signal = ["KILL", "TERM", "QUIT"][random.below(3) as usize];
                let moment = time.mul_f64(f64::from(random.below(1000)) / 1000.0);
                let mut child = start((writer.command)(inputs.path(), folder.path()));
                let status = signal_after(&mut child, moment, signal);
                let place = format!(
                    "{}, kill {round}, SIG{signal} after {moment:?}",
                    writer.name
                );
                let left = Files::below(folder.path());
                left.assert_part_of(files, writer, &place);
                finished += left.finished.len();
                match status {
                    None => {
                        late += 1;
                        *time = time.mul_f64(0.9);
                    }
                    Some(_) => {
                        killed += 1;
                        *time = time.mul_f64(1.02);
                    }
                }
                if signal != "KILL" && round == 0 {
                    assert_eq!(left.unfinished, [""; 0], "{place}");
                }
            }
            run_to_completion((writer.command)(inputs.path(), folder.path()));
            let end = Files::below(folder.path());
            end.assert_part_of(files, writer, writer.name);
            let names = |files: &Files| files.finished.keys().cloned().collect::<Vec<_>>();
            assert_eq!(names(&end), names(files), "{}", writer.name);
            println!("{}: {killed} kills so far", writer.name);
            if killed >= wanted.unwrap_or(FEW) || late > 20 + killed {
                break 'all;
            }
        }
    }
    println!("{killed} kills, {late} too late; {finished} whole files found, none incomplete");
    assert!(
        killed >= wanted.unwrap_or(FEW),
        "{late} of the kills came too late"
    );
}

#[test]
fn a_sharded_sweep_with_a_killed_worker_merges_to_the_bytes_of_one_machine() {
    let inputs = tempfile::tempdir().expect("a temporary folder");
    writers::write_inputs(inputs.path());
    let sweep = |folder: &Path, flags: &[&str]| {
        let mut command = writers::sweep(inputs.path(), folder);
        command.args(flags);
        command
    };
    let whole = tempfile::tempdir().expect("a temporary folder");
    let start_of_whole = Instant::now();
    run_to_completion(sweep(whole.path(), &[]));
    let time = start_of_whole.elapsed();
    let whole = Files::below(whole.path());
    let mut random = Random(7);
    let rounds = kills().map_or(1, |kills| kills.div_ceil(20));
    let mut killed = 0;
    for _ in 0..rounds {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let shards = ["1/3", "2/3", "3/3"];
        let mut workers = shards.map(|shard| start(sweep(folder.path(), &["--shard", shard])));
        let victim = random.below(3) as usize;
        let moment = time.mul_f64(f64::from(random.below(700)) / 1000.0);
        killed += u32::from(signal_after(&mut workers[victim], moment, "KILL").is_some());
        for (number, worker) in workers.iter_mut().enumerate() {
            let status = worker.wait().expect("it ends");
            assert!(status.success() || number == victim, "worker {number}");
        }
        run_to_completion(sweep(folder.path(), &["--shard", shards[victim]]));
        run_to_completion(sweep(folder.path(), &["--merge-only"]));
        let merged = Files::below(folder.path());
        assert!(merged.finished == whole.finished, "the merge differs");
        fs::remove_dir_all(folder.path()).expect("removable");
    }
    println!("{killed} workers of {rounds} sweeps killed in time");
}

/// Signals only the process itself, as `kill` and `timeout` do.
#[test]
fn a_signal_to_only_the_sweep_of_captures_ends_the_running_capture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let manifest = folder.path().join("captures.toml");
    let out = folder.path().join("out");
    // Would take minutes if it were not ended.
    let long = "[[captures]]\ncommand = \"rays\"\nscene = \"atrium\"\nsize = \"4096x4096\"\n";
    fs::write(&manifest, long).expect("writable");
    let mut sweep = parallax_tests::program("tracegen");
    sweep.arg("sweep").arg(&manifest).arg("--output").arg(&out);
    sweep.stdout(Stdio::null()).stderr(Stdio::piped());
    let mut sweep = sweep.spawn().expect("the program starts");
    let unfinished = || Files::below(folder.path()).unfinished;
    let start = Instant::now();
    while unfinished().is_empty() {
        assert!(
            start.elapsed() < Duration::from_secs(60),
            "nothing is captured"
        );
        std::thread::sleep(Duration::from_millis(50));
    }
    let kill = format!("kill -TERM {}", sweep.id());
    let sent = Command::new("sh").args(["-c", &kill]).status();
    assert!(sent.expect("a shell").success());
    let status = sweep.wait().expect("it ends");
    assert_eq!(status.signal(), Some(15));
    assert_eq!(unfinished(), [""; 0]);
    // The pipe closes when the last process that holds it ends.
    let mut rest = String::new();
    let mut pipe = sweep.stderr.take().expect("a pipe");
    pipe.read_to_string(&mut rest).expect("text");
    assert!(
        start.elapsed() < Duration::from_secs(60),
        "the capture went on"
    );
}
