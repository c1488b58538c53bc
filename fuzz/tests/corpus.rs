//! Runs the committed corpus, unchanged and changed, through every target on stable Rust.
//!
//! `FUZZ_CASES=n` changes every input n times.

use parallax_fuzz::{Target, limits};
use parallax_tests::traces::Random;
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::time::Duration;

#[global_allocator]
static ALLOCATOR: limits::Counting = limits::Counting;

const CASES: u32 = 30;
const MOST_INPUT_BYTES: usize = 8192;

/// The inputs of a target, in the order of their names.
fn inputs(target: &Target) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    let folder = folder.join(target.name);
    let entries =
        std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    assert!(!paths.is_empty(), "{} is empty", folder.display());
    paths
}

/// Changes, removes or repeats a few bytes.
fn change(bytes: &mut Vec<u8>, most: usize, random: &mut Random) {
    for _ in 0..1 + random.below(3) {
        let length = bytes.len() as u32;
        let at = random.below(length.max(1)) as usize;
        let end = at + random.below(17).min(length.saturating_sub(at as u32)) as usize;
        match random.below(4) {
            0 if length > 0 => bytes[at] ^= 1 << random.below(8),
            1 if length > 0 => bytes[at] = [0, 1, 0x7f, 0x80, 0xff][random.below(5) as usize],
            2 => drop(bytes.drain(at..end)),
            _ => {
                let copy = bytes[at..end].to_vec();
                bytes.splice(at..at, copy);
            }
        }
    }
    bytes.truncate(most);
}

fn held(target: &Target, bytes: &[u8], place: &str) -> limits::Taken {
    let work = || (target.run)(bytes);
    let taken = std::panic::catch_unwind(|| limits::held(work));
    match taken {
        Ok(Ok(taken)) => taken,
        Ok(Err(why)) => panic!("{place}: {why}"),
        Err(_) => panic!("{place}: it panicked, see above"),
    }
}

// A single test, because all targets share one thread, whose time then measures one input.
#[test]
fn every_input_is_read_or_refused_within_a_second_and_a_gigabyte() {
    limits::run_on_this_thread_alone();
    let cases = std::env::var("FUZZ_CASES").map_or(CASES, |n| n.parse().expect("a number"));
    for target in Target::ALL {
        let (mut runs, mut slowest, mut largest) = (0, Duration::ZERO, 0);
        let mut run = |bytes: &[u8], place: &str| {
            let taken = held(target, bytes, place);
            (slowest, largest) = (slowest.max(taken.time), largest.max(taken.bytes));
            runs += 1;
        };
        for path in inputs(target) {
            let bytes = std::fs::read(&path).expect("an input");
            run(&bytes, &path.display().to_string());
            for seed in 0..cases {
                let random = RefCell::new(Random(u64::from(seed) << 32 | bytes.len() as u64));
                let change = |bytes: &mut Vec<u8>, most: usize| {
                    change(bytes, most, &mut random.borrow_mut());
                };
                let changed = (target.mutate)(&bytes, MOST_INPUT_BYTES, seed, &change);
                run(&changed, &format!("{}, case {seed}", path.display()));
            }
        }
        println!(
            "{}: {runs} runs, at most {slowest:?} and {largest} bytes",
            target.name
        );
    }
}
