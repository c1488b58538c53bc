//! The fuzzer: `FUZZ_TARGET=gltf parallax-fuzz CORPUS_FOLDER...`, with libFuzzer's own flags.
#![no_main]

use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};
use parallax_fuzz::{Target, limits};
use std::sync::OnceLock;

#[global_allocator]
static ALLOCATOR: limits::Counting = limits::Counting;

/// The target that `FUZZ_TARGET` names.
fn target() -> &'static Target {
    static TARGET: OnceLock<&Target> = OnceLock::new();
    TARGET.get_or_init(|| {
        limits::run_on_this_thread_alone();
        let name = std::env::var("FUZZ_TARGET").unwrap_or_default();
        Target::named(&name).unwrap_or_else(|| {
            let names: Vec<&str> = Target::ALL.iter().map(|target| target.name).collect();
            eprintln!(
                "FUZZ_TARGET: expected one of {}, found '{name}'",
                names.join(", ")
            );
            std::process::exit(2);
        })
    })
}

fuzz_target!(|data: &[u8]| {
    if let Err(why) = limits::held(|| (target().run)(data)) {
        eprintln!("{}: {why}", target().name);
        // libFuzzer saves the input and stops.
        std::process::abort();
    }
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    let change = |bytes: &mut Vec<u8>, most: usize| {
        let length = bytes.len().min(most);
        bytes.resize(most, 0);
        let length = fuzzer_mutate(bytes, length, most);
        bytes.truncate(length);
    };
    let mutated = (target().mutate)(&data[..size], max_size, seed, &change);
    // A result that is too long would be truncated, so the plain mutation is used.
    if mutated.len() > max_size {
        return fuzzer_mutate(data, size, max_size);
    }
    data[..mutated.len()].copy_from_slice(&mutated);
    mutated.len()
});
