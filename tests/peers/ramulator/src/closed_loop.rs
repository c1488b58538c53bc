//! Both simulators behind the L2 of `replay schedule`, whose requests depend on earlier answers.

use super::channels::{Policy, Ramulator, Record, Recorded};
use formats::textrace::Textrace;
use frame::schedulers::Scheduler;
use frame::{Point, Settings, replay_with};
use sim::config::RunConfig;
use sim::memory::dram::{Channels, Dram, DramConfig, DramPreset};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

/// Device, channels, and whether Ramulator keeps its own timings.
type Memory = (DramPreset, u32, bool);

const MEMORIES: [Memory; 5] = [
    (DramPreset::Ddr4, 1, false),
    (DramPreset::Ddr4, 2, false),
    (DramPreset::Lpddr4, 1, false),
    (DramPreset::Lpddr4, 2, false),
    (DramPreset::Lpddr4, 2, true),
];
const SCHEDULERS: [&str; 2] = ["first-idle", "z2-sta"];
const POLICIES: [Policy; 2] = [Policy::HitsFirst, Policy::Published];

/// Largest differences that the test allows with the same policy and timings: cycles in percent, and the distance of
/// the distributions of latencies.
const LIMITS: [f64; 2] = [2.0, 0.05];

/// Cycles of all frames, and what the channels did.
type Found = (u64, Record);

/// Replays a trace with these channels.
fn simulate(
    trace: &Textrace,
    (preset, count, _): Memory,
    scheduler: &str,
    make: impl Fn(&DramConfig, u32) -> Box<dyn Channels> + Sync,
) -> Found {
    let dram = DramConfig {
        preset,
        channels: count,
        ..DramConfig::default()
    };
    let config = RunConfig {
        dram: Some(dram),
        ..RunConfig::default()
    };
    let point = Point {
        scheduler: Scheduler::find(scheduler).expect("a scheduler"),
        settings: Settings::default(),
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

/// A comparison: its row, and whether it holds the limits.
fn compare(trace: &Textrace, scene: &str, memory: Memory, scheduler: &str) -> Vec<(String, bool)> {
    let ours = simulate(trace, memory, scheduler, |dram, line| {
        Box::new(Dram::new(dram, line))
    });
    let (preset, count, own_timings) = memory;
    let row = |policy| {
        let theirs = simulate(trace, memory, scheduler, |dram, _| {
            Box::new(Ramulator::new(dram, policy, own_timings))
        });
        let apart = 100.0 * (ours.0 as f64 / theirs.0 as f64 - 1.0);
        let distance = ours.1.distance(&theirs.1);
        let hits = |of: &Record| 100.0 * of.result.row_hits as f64 / of.result.reads as f64;
        let is_same = policy == Policy::HitsFirst && !own_timings;
        let text = format!(
            "{scene},{},{count},{},{},{scheduler},{},{},{apart:.2},{:.1},{:.1},{distance:.3},{:.1},{:.1},{},{}",
            preset.device().name,
            if policy == Policy::HitsFirst {
                "hits first"
            } else {
                "cap of 16"
            },
            if own_timings { "Ramulator's" } else { "ours" },
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
            !is_same || (apart.abs() <= LIMITS[0] && distance <= LIMITS[1]),
        )
    };
    POLICIES.map(row).to_vec()
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
    let jobs: Vec<(&(Textrace, String), Memory, &str)> = traces
        .iter()
        .flat_map(|of| MEMORIES.map(|memory| SCHEDULERS.map(|by| (of, memory, by))))
        .flatten()
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
        "scene,DRAM,channels,order of requests,timings,scheduler,\"cycles, ours\",\"cycles, Ramulator\",\"apart, %\",\"mean latency, ours, clocks\",\
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
