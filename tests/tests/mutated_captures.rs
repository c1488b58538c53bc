//! What a captured program leaves for its trace, with changed bytes: it becomes a valid trace, or the reason why not is
//! an error. Nothing may panic, take ten seconds or make a trace of more than a few megabytes.
//!
//! `MUTATIONS=100000 MUTATIONS_FROM=5000 cargo test --release --workspace --test e2e mutated_captures` tries more and
//! different ones.
#![cfg(target_os = "linux")]

use formats::textrace::{Textrace, TextraceWriter, Tile};
use parallax_tests::traces::Random;
use parallax_tests::{has_lavapipe, program, run_ok};
use programs::{Cameras, Job, Session, Wanted, check, drain};
use spool::FramesBy;
use std::fs;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Number of cases, unless `MUTATIONS` sets it.
const CASES: u64 = 500;
const MOST_TIME: Duration = Duration::from_secs(10);
const MOST_BYTES: usize = 16 << 20;
const FRAMES: [u32; 2] = [1, 2];

/// Bytes of room that stay after the last record.
const ROOM: usize = 4096;

/// Values in place of numbers of the events.
const NUMBERS: [&str; 12] = [
    "0",
    "1",
    "2",
    "-1",
    "0.5",
    "65535",
    "65536",
    "2147483648",
    "4294967295",
    "18446744073709551615",
    "null",
    "[]",
];

/// The files of a capture: names and bytes.
type Files = Vec<(PathBuf, Vec<u8>)>;

/// Captures a program, and copies the layer's files before they are removed.
fn captured() -> Files {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let kept = folder.path().join("kept");
    fs::create_dir(&kept).expect("a folder");
    let script = "\"$0\" --frames 4 --size 32x32 && cp \"$TMPDIR\"/.scratch-*/*.events \"$TMPDIR\"/.scratch-*/*.records \"$1\"";
    let mut command = program("tracegen");
    command.env("TMPDIR", folder.path());
    command.args(["app", "--frames", "1..3", "--to-end", "--check", "-o"]);
    command.arg(folder.path().join("whole.textrace"));
    command.args([
        "--",
        "sh",
        "-c",
        script,
        env!("CARGO_BIN_EXE_vulkan_program"),
    ]);
    run_ok(command.arg(&kept));
    let entries = fs::read_dir(&kept).expect("a folder");
    let mut files: Files = entries
        .map(|entry| {
            let path = entry.expect("an entry").path();
            let name = path.file_name().expect("a name").into();
            let mut bytes = fs::read(&path).expect("a file");
            // Room for later records follows the last one.
            let used = bytes
                .iter()
                .rposition(|byte| *byte != 0)
                .map_or(0, |last| last + 1);
            bytes.truncate(used.next_multiple_of(ROOM));
            (name, bytes)
        })
        .collect();
    files.sort();
    assert_eq!(files.len(), 2, "{files:?}");
    files
}

/// Converts the files in a folder to a trace, as `tracegen app` does. Returns its bytes.
fn converted(folder: &Path) -> Result<Vec<u8>, String> {
    let mut session = Session::of_capture(folder, "program").map_err(|e| e.to_string())?;
    let job = Job {
        frames: &FRAMES,
        eyes: &Wanted::First,
        frames_by: FramesBy::Auto,
        cameras: Cameras::default(),
        program: "program".to_owned(),
        tool: "test".to_owned(),
        command_line: Vec::new(),
        record_bytes: 1 << 30,
    };
    let writer = TextraceWriter::growing_in_memory().map_err(|e| e.to_string())?;
    let (writer, _) = drain(&mut session, &job, writer).map_err(|e| e.to_string())?;
    check(&mut session, &FRAMES).map_err(|e| e.to_string())?;
    writer.into_bytes().map_err(|e| e.to_string())
}

/// Changes one or a few places. The text describes the changes.
fn mutate(files: &mut Files, random: &mut Random) -> String {
    let mut what = String::new();
    for _ in 0..1 + random.below(3) {
        let number = usize::from(random.below(5) == 0);
        let (name, bytes) = &mut files[number];
        what += &match number {
            0 => of_events(bytes, random),
            _ => of_records(bytes, random),
        };
        what += &format!(" of {}; ", name.display());
    }
    what
}

fn of_events(bytes: &mut Vec<u8>, random: &mut Random) -> String {
    let mut lines: Vec<Vec<u8>> = bytes
        .split_inclusive(|byte| *byte == b'\n')
        .map(<[u8]>::to_vec)
        .collect();
    if lines.is_empty() {
        return "nothing".to_owned();
    }
    let at = random.below(lines.len() as u32) as usize;
    let other = random.below(lines.len() as u32) as usize;
    let what = match random.below(8) {
        0 => {
            lines.remove(at);
            format!("line {at} removed")
        }
        1 => {
            let copy = lines[other].clone();
            lines.insert(at, copy);
            format!("line {other} repeated at {at}")
        }
        2 => {
            lines.swap(at, other);
            format!("lines {at} and {other} exchanged")
        }
        3 => {
            let line = &mut lines[at];
            let place = random.below(line.len() as u32) as usize;
            line[place] = random.bits() as u8;
            format!("byte {place} of line {at}")
        }
        _ => {
            let line = String::from_utf8_lossy(&lines[at]).into_owned();
            let numbers = numbers(&line);
            let Some(&(start, end)) =
                numbers.get(random.below(numbers.len().max(1) as u32) as usize)
            else {
                return "nothing".to_owned();
            };
            let new = NUMBERS[random.below(NUMBERS.len() as u32) as usize];
            lines[at] = format!("{}{new}{}", &line[..start], &line[end..]).into_bytes();
            format!("line {at}: {new} at {start} for {}", &line[start..end])
        }
    };
    *bytes = lines.concat();
    what
}

/// Places of the numbers in a line.
fn numbers(line: &str) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut start = None;
    for (at, byte) in line.bytes().enumerate() {
        match (byte.is_ascii_digit(), start) {
            (true, None) => start = Some(at),
            (false, Some(first)) => {
                found.push((first, at));
                start = None;
            }
            _ => {}
        }
    }
    found
}

fn of_records(bytes: &mut Vec<u8>, random: &mut Random) -> String {
    let at = 4 * random.below((bytes.len() / 4).max(1) as u32) as usize;
    if random.below(8) == 0 {
        bytes.truncate(at);
        return format!("cut to {at} bytes");
    }
    let word = match random.below(3) {
        0 => u32::MAX,
        1 => 1 << random.below(32),
        _ => random.bits() as u32,
    };
    match bytes.get_mut(at..at + 4) {
        Some(old) => old.copy_from_slice(&word.to_le_bytes()),
        None => return "nothing".to_owned(),
    }
    format!("{word:#x} at byte {at}")
}

fn write(folder: &Path, files: &Files) {
    for (name, bytes) in files {
        fs::write(folder.join(name), bytes).expect("room");
    }
}

/// Reads all tiles of a trace.
fn read(bytes: Vec<u8>) {
    let trace = Textrace::from_bytes(bytes).expect("a valid trace");
    let mut tile = Tile::default();
    for (number, pass) in trace.tables().passes.iter().enumerate() {
        for index in 0..pass.tile_count() {
            let decoded = trace.decode_tile(number, index as usize, &mut tile);
            decoded.expect("a valid tile");
        }
    }
}

#[test]
fn changed_files_of_a_captured_program_become_a_valid_trace_or_an_error() {
    if !has_lavapipe() {
        return;
    }
    let number = |name: &str| {
        std::env::var(name)
            .ok()
            .map(|n| n.parse().expect("a number"))
    };
    let cases: u64 = number("MUTATIONS").unwrap_or(CASES);
    let from: u64 = number("MUTATIONS_FROM").unwrap_or(0);
    let sound = captured();
    let folder = tempfile::tempdir().expect("a temporary folder");
    write(folder.path(), &sound);
    read(converted(folder.path()).expect("the sound files"));
    let (mut made, mut slowest) = (0, Duration::ZERO);
    for seed in from..from + cases {
        let mut files = sound.clone();
        let what = mutate(&mut files, &mut Random(seed));
        write(folder.path(), &files);
        let start = Instant::now();
        let outcome = catch_unwind(|| converted(folder.path()));
        slowest = slowest.max(start.elapsed());
        let result = outcome.unwrap_or_else(|_| panic!("case {seed}: {what}: a panic"));
        assert!(start.elapsed() < MOST_TIME, "case {seed}: {what}: slow");
        if let Ok(bytes) = result {
            made += 1;
            assert!(
                bytes.len() < MOST_BYTES,
                "case {seed}: {what}: {}",
                bytes.len()
            );
            assert!(
                catch_unwind(|| read(bytes)).is_ok(),
                "case {seed}: {what}: invalid"
            );
        }
    }
    println!("{cases} changed captures, {made} of them valid; the slowest took {slowest:?}");
    assert!(made > 0 && made < cases);
}
