//! Damaged experiment files and configurations must be read or refused, quickly.

use super::super::*;
use formats::random::Random;
use sim::config::RunConfig;
use std::time::{Duration, Instant};

const SEEDS: [&str; 4] = [
    include_str!("../../../../experiments/caches.toml"),
    include_str!("../../../../experiments/open-choices.toml"),
    include_str!("../../../../experiments/texel-density.toml"),
    "traces = [\"a.textrace\", \"b.textrace\"]\n[base]\nmode = \"functional\"\ncores = 4\n[base.l1]\nsize_bytes = \"8KiB\"\nways = 4\nreplacement = \"fifo\"\n[base.tmu]\nthreads = 64\n[axes]\norder = [\"morton\"]\nseed = [1, 2]\n",
];

/// Pieces inserted at random positions.
const PIECES: [&str; 16] = [
    "9223372036854775807",
    "-1",
    "1e999",
    "nan",
    "0x7fffffff",
    "\"99999999999999999999KiB\"",
    "[[[[[[[[[[",
    "{ a = { b = { c = 1 } } }",
    "[axes]\n",
    "order = [\"morton\"]\n",
    "l1.size_bytes.x = [1]\n",
    "\u{feff}",
    "\0",
    "\"\\u0000\u{1b}[31m\"",
    "1979-05-27T07:32:00Z",
    "'''",
];

fn mutated(random: &mut Random) -> String {
    let mut text: Vec<char> = SEEDS[random.below(SEEDS.len())].chars().collect();
    for _ in 0..=random.below(4) {
        let (at, end) = (random.below(text.len()), random.below(text.len()));
        let piece: Vec<char> = PIECES[random.below(PIECES.len())].chars().collect();
        match random.below(5) {
            0 => drop(text.drain(at.min(end)..at.max(end))),
            1 => {
                let copy: Vec<char> = text[at.min(end)..at.max(end)].to_vec();
                text.splice(at..at, copy);
            }
            2 if !text.is_empty() => text[at] = char::from(random.below(128) as u8),
            3 => {
                // Replaces a value by another value.
                let rest = text[at..]
                    .iter()
                    .position(|c| *c == '=')
                    .map(|i| at + i + 1);
                let from = rest.unwrap_or(at);
                let to = text[from..].iter().position(|c| *c == '\n');
                let to = to.map_or(text.len(), |i| from + i);
                text.splice(from..to, piece);
            }
            _ => drop(text.splice(at..at, piece)),
        }
    }
    text.into_iter().collect()
}

/// Reads a file both as `replay sweep` and as `replay run --config` do.
fn read(text: &str) -> bool {
    let start = Instant::now();
    let planned = ExperimentFile::parse(text).and_then(|file| file.plan());
    if let Ok(plan) = &planned {
        assert!(plan.points.len() <= MOST_POINTS);
        assert!(plan.points.iter().all(|p| p.config.validate().is_ok()));
    }
    if let Err(error) = &planned {
        let message = error.to_string();
        assert!(message.len() < 4096, "{} bytes: {message}", message.len());
    }
    let config = toml::from_str::<RunConfig>(text);
    let _ = config.map(|c| c.validate());
    let took = start.elapsed();
    assert!(took < Duration::from_secs(10), "{took:?} for\n{text:.2000}");
    planned.is_ok()
}

#[test]
fn ten_thousand_damaged_files_are_read_or_refused() {
    let mut random = Random(8);
    let read = (0..10_000).filter(|_| read(&mutated(&mut random))).count();
    // If all or none were refused, the mutations would test nothing.
    assert!((500..9500).contains(&read), "{read}");
}

#[test]
fn files_that_expand_enormously_are_refused() {
    let list = |n: usize| (0..n).map(|i| i.to_string()).collect::<Vec<_>>().join(",");
    let deep = |open: &str, close: &str| {
        format!(
            "[axes]\nseed = {}1{}\n",
            open.repeat(50_000),
            close.repeat(50_000)
        )
    };
    for text in [
        format!("[axes]\nseed = [{0}]\ncores = [{0}]\n", list(60_000)),
        format!("[one-at-a-time]\nseed = [{}]\n", list(150_000)),
        deep("[", "]"),
        deep("{a=", "}"),
        format!("[axes]\n{} = [1]\n", vec!["a"; 50_000].join(".")),
        format!("[{}]\n", vec!["axes"; 50_000].join(".")),
        (0..20_000).map(|i| format!("[t{i}]\n")).collect(),
        (0..20_000)
            .map(|i| format!("key{i} = 1\n"))
            .collect::<String>(),
        format!("[base]\nseed = {}\n", "9".repeat(100_000)),
        format!("[axes]\norder = \"{}\"\n", "x".repeat(100_000)),
        format!("[axes]\norder = [\"{}\"]\n", "x".repeat(100_000)),
        format!("{}[axes]\nseed = [1]\nseed = [2]\n", "\n".repeat(100_000)),
    ] {
        assert!(!read(&text), "{text:.80}");
    }
}
