//! Captures of programs that make random, valid Vulkan calls. Whatever fails is a fault of the layer.
//!
//! `RANDOM_SEEDS=1000` runs more seeds, from `RANDOM_FIRST` on.

use formats::textrace::{Draw, Textrace};
use parallax_tests::{has_lavapipe, program, run_ok};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Seeds that are run by default. They contain those of the faults that were found:
/// 1, 5, 6, 9: the draws of a command buffer that was submitted twice in a frame had the records of both
/// executions. 2, 4: after a program destroyed its instance and created another one, the loader loaded the
/// layer again, and the capture ended.
const SEEDS: u64 = 20;

/// Operations of a program.
const CALLS: &str = "100";

/// Sizes of the textures that a draw reads. Each texture of a device has a size of its own.
type Sizes = BTreeSet<[u32; 2]>;

fn number(variable: &str, default: u64) -> u64 {
    let value = std::env::var(variable).ok();
    value.map_or(default, |text| text.parse().expect("a number"))
}

/// Captures two frames of a program, and checks what is recorded and that nothing changes. Every fifth program
/// is captured twice.
fn check(seed: u64) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text = seed.to_string();
    let arguments = |picture: &Path| {
        let random = [
            "--random",
            &text,
            "--calls",
            CALLS,
            "--frames",
            "3",
            "--picture",
        ];
        let mut all: Vec<_> = random.iter().map(std::ffi::OsString::from).collect();
        all.push(picture.into());
        all
    };
    let plain = folder.path().join("plain");
    let output = run_ok(super::vulkan_program().args(arguments(&plain)));
    let plain = std::fs::read(plain).expect("pictures and results of queries");
    let trace = folder.path().join("random.textrace");
    let capture = || {
        let picture = folder.path().join("captured");
        let mut command = program("tracegen");
        command
            .args([
                "app", "--frames", "1..3", "--to-end", "--check", "--eyes", "mono", "-o",
            ])
            .arg(&trace)
            .arg("--")
            .arg(env!("CARGO_BIN_EXE_vulkan_program"))
            .args(arguments(&picture));
        let message = run_ok(&mut command).stderr;
        let message = String::from_utf8_lossy(&message);
        assert!(message.contains(" 0 different"), "seed {seed}: {message}");
        let captured = std::fs::read(&picture).expect("pictures and results of queries");
        assert!(
            plain == captured,
            "seed {seed}: the layer changes pictures or queries"
        );
        std::fs::read(&trace).expect("a trace")
    };
    let first = capture();
    run_ok(program("replay").arg("validate").arg(&trace));
    check_textures(seed, &trace, &String::from_utf8_lossy(&output.stdout));
    if seed.is_multiple_of(5) {
        assert!(first == capture(), "seed {seed}: another trace");
    }
}

/// Checks that the draws of a trace are draws into the pictures, in the same order and with the same textures.
/// Draws without fragments have no textures in a trace.
fn check_textures(seed: u64, trace: &Path, lines: &str) {
    let trace = Textrace::open(trace).expect("a trace");
    let tables = trace.tables();
    let of_draw = |draw: &Draw| -> Sizes {
        let samples = draw.groups.iter().flat_map(|group| &group.samples);
        samples
            .map(|sample| size(&tables.textures[sample.texture as usize].name))
            .collect()
    };
    let drawn: Vec<Sizes> = tables
        .draws
        .iter()
        .map(of_draw)
        .filter(|of| !of.is_empty())
        .collect();
    let mut expected = lines.lines().filter_map(|line| {
        let (frame, sizes) = line.split_once(' ').expect("a frame and sizes");
        let sizes: Vec<[u32; 2]> = serde_json::from_str(sizes).expect("sizes");
        ["1", "2"]
            .contains(&frame)
            .then(|| sizes.into_iter().collect::<Sizes>())
    });
    assert!(!drawn.is_empty());
    for (place, of) in drawn.iter().enumerate() {
        assert!(
            expected.any(|other| of.is_subset(&other)),
            "seed {seed}: draw {place} with textures reads {of:?}"
        );
    }
}

/// Size of an image from the name of a texture, such as `image 3 (17x18) from level 1, layer 0`.
fn size(name: &str) -> [u32; 2] {
    let (_, rest) = name.split_once('(').expect("a size");
    let (size, _) = rest.split_once(')').expect("a size");
    let (width, height) = size.split_once('x').expect("a size");
    [width, height].map(|side| side.parse().expect("a number"))
}

#[test]
fn programs_of_random_calls_are_captured_without_a_change() {
    if !has_lavapipe() {
        return;
    }
    let first = number("RANDOM_FIRST", 1);
    let end = first + number("RANDOM_SEEDS", SEEDS);
    let next = AtomicU64::new(first);
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= end {
                        break;
                    }
                    check(seed);
                }
            });
        }
    });
}
