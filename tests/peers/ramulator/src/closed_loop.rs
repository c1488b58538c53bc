//! Both simulators behind the L2 of `replay schedule`, whose requests depend on earlier answers.

use super::channels::{Policy, Ramulator, Record, Recorded, Timings};
use formats::textrace::Textrace;
use frame::schedulers::Scheduler;
use frame::{Point, Settings, replay_with};
use sim::config::{Mode, RunConfig};
use sim::memory::dram::{Channels, Dram, DramConfig, DramPreset};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

/// DRAM, and the bytes that a tile writes per pixel.
#[derive(Clone, Copy)]
struct Memory {
    preset: DramPreset,
    channels: u32,
    queue: u32,
    colour_bytes: u32,
}

const fn memory(preset: DramPreset, channels: u32) -> Memory {
    Memory {
        preset,
        channels,
        queue: 32,
        colour_bytes: 4,
    }
}

/// The first four have limits.
const MEMORIES: [Memory; 6] = [
    memory(DramPreset::Ddr4, 1),
    memory(DramPreset::Ddr4, 2),
    memory(DramPreset::Lpddr4, 1),
    memory(DramPreset::Lpddr4, 2),
    Memory {
        colour_bytes: 0,
        ..memory(DramPreset::Ddr4, 1)
    },
    Memory {
        queue: 512,
        ..memory(DramPreset::Ddr4, 1)
    },
];
const SCHEDULERS: [&str; 2] = ["first-idle", "z2-sta"];

/// What Ramulator is set to. Only the first has limits.
const VARIANTS: [(Policy, Timings); 6] = [
    (Policy::HitsFirst, Timings::Ours),
    (Policy::OldestFirst, Timings::Ours),
    (Policy::Published, Timings::Ours),
    (Policy::HitsFirst, Timings::OwnButRefresh),
    (Policy::HitsFirst, Timings::Own),
    (Policy::Published, Timings::Own),
];

/// Largest differences that the test allows with the same policy and timings: cycles in percent, and the distance of
/// the distributions of latencies.
const LIMITS: [f64; 2] = [2.0, 0.05];

/// Cycles of all frames, and what the channels did.
type Found = (u64, Record);

/// Replays a trace with these channels.
fn simulate(
    trace: &Textrace,
    memory: Memory,
    scheduler: &str,
    make: impl Fn(&DramConfig, u32) -> Box<dyn Channels> + Sync,
) -> Found {
    let dram = DramConfig {
        preset: memory.preset,
        channels: memory.channels,
        queue: memory.queue,
        ..DramConfig::default()
    };
    let config = RunConfig {
        mode: Mode::Functional,
        dram: Some(dram),
        ..RunConfig::default()
    };
    let point = Point {
        scheduler: Scheduler::find(scheduler).expect("a scheduler"),
        settings: Settings {
            colour_bytes: memory.colour_bytes,
            ..Settings::default()
        },
        records: false,
    };
    let record = Arc::default();
    let times = replay_with(
        trace,
        &config,
        &[point],
        &|dram| Box::new(Recorded::new(make(dram, config.line_bytes), &record)),
        &|_| {},
    );
    let times = times.expect("a replay");
    let cycles = times[0].frames.iter().map(|(cycles, _)| cycles).sum();
    let record = record.lock().expect("no panic").clone();
    (cycles, record)
}

/// Compares our model with each variant of Ramulator: the rows, and whether they hold the limits.
fn compare(trace: &Textrace, scene: &str, number: usize, scheduler: &str) -> Vec<(String, bool)> {
    let memory = MEMORIES[number];
    let ours = simulate(trace, memory, scheduler, |dram, line| {
        Box::new(Dram::new(dram, line))
    });
    // Both have the same timings of DDR4.
    let variants = match (memory.preset, memory.channels) {
        (DramPreset::Lpddr4, 2) => 6,
        _ if number < 4 => 3,
        _ => 1,
    };
    let row = |variant: usize| {
        let (policy, timings) = VARIANTS[variant];
        let theirs = simulate(trace, memory, scheduler, |dram, _| {
            Box::new(Ramulator::new(dram, policy, timings))
        });
        let apart = 100.0 * (ours.0 as f64 / theirs.0 as f64 - 1.0);
        let distance = ours.1.distance(&theirs.1);
        let hits = |of: &Record| 100.0 * of.result.row_hits as f64 / of.result.reads as f64;
        let has_limits = number < 4 && variant == 0;
        let text = format!(
            "{scene},{},{},{},{},{},{},{scheduler},{},{},{apart:.2},{:.1},{:.1},{distance:.3},{:.1},{:.1},{},{}",
            memory.preset.device().name,
            memory.channels,
            memory.queue,
            if memory.colour_bytes == 0 {
                "no"
            } else {
                "yes"
            },
            match policy {
                Policy::HitsFirst => "hits first",
                Policy::OldestFirst => "oldest first",
                Policy::Published => "oldest first after 16 hits",
            },
            match timings {
                Timings::Ours => "ours",
                Timings::Own => "Ramulator's",
                Timings::OwnButRefresh => "Ramulator's except tRFC",
            },
            ours.0,
            theirs.0,
            ours.1.mean(),
            theirs.1.mean(),
            hits(&ours.1),
            hits(&theirs.1),
            ours.1.result.reads,
            theirs.1.result.reads,
        );
        (
            text,
            !has_limits || (apart.abs() <= LIMITS[0] && distance <= LIMITS[1]),
        )
    };
    (0..variants).map(row).collect()
}

/// Prints the comparisons of all traces as CSV. Returns whether all hold the limits.
pub fn run(paths: &[String]) -> bool {
    let open = |path: &String| {
        let trace =
            Textrace::open(Path::new(path)).unwrap_or_else(|error| panic!("{path}: {error}"));
        let stem = Path::new(path).file_stem().unwrap_or_default();
        (trace, stem.to_string_lossy().into_owned())
    };
    let traces: Vec<(Textrace, String)> = paths.iter().map(open).collect();
    let jobs: Vec<(&(Textrace, String), usize, &str)> = traces
        .iter()
        .flat_map(|of| {
            (0..MEMORIES.len()).flat_map(move |memory| SCHEDULERS.map(|by| (of, memory, by)))
        })
        .collect();
    let (next, rows) = (
        AtomicUsize::new(0),
        Mutex::new(vec![Vec::new(); jobs.len()]),
    );
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    let Some(((trace, scene), memory, scheduler)) = jobs.get(at) else {
                        break;
                    };
                    let found = compare(trace, scene, *memory, scheduler);
                    rows.lock().expect("no panic")[at] = found;
                }
            });
        }
    });
    println!(
        "scene,DRAM,channels,queue,writes,order of requests,timings,scheduler,\"cycles, ours\",\"cycles, Ramulator\",\"apart, %\",\"mean latency, ours, clocks\",\
         \"mean latency, Ramulator, clocks\",largest distance,\"row hits, ours, %\",\"row hits, Ramulator, %\",\"reads, ours\",\"reads, Ramulator\""
    );
    let rows = rows.into_inner().expect("no panic");
    let mut is_held = true;
    for (row, holds) in rows.into_iter().flatten() {
        println!("{row}");
        is_held &= holds;
    }
    is_held
}
