mod below;
mod between_frames;
mod brute_force;
mod counts;
mod one_pass;
mod plain_first_miss;
mod plain_timed;
mod prefetch_fifo;
mod repeats;
mod timeline;

use super::counts::CacheCounts;
use super::functional::Functional;
use super::machine::{FrameWork, Machine};
use super::outcome::MachineOutcome;
use super::summary::summary;
use super::*;
use crate::config::{
    Assign, BetweenFrames, CountBy, Inclusion, LevelConfig, Levels, Mode, Order, Replacement,
    RunConfig, TmuModel,
};
use crate::memory::Hierarchy;
use crate::order::WorkItem;
use crate::result::{LevelCounters, RunResult};
use crate::stream::testing::Synthetic;
use crate::stream::testing::repeated;
use crate::stream::{
    Bins, Consumer, Cores, Expander, LineMemory, LineSet, MemoryTrace, QuadLines, StreamError,
    TraceCounts, interleave, plan, testing,
};
use formats::footprint::record_footprints;
use formats::layout::Layout;
use formats::random::Random;
use formats::textrace::with_operands;
use std::collections::{HashMap, HashSet};
use std::sync::Mutex;

fn small() -> MemoryTrace {
    Synthetic {
        materials: 3,
        ..Synthetic::new([72, 56], 24)
    }
    .generate()
}

/// Two layers of rectangles with three textures each.
fn layered(size_px: [u32; 2], patch_px: u32, seed: u64) -> MemoryTrace {
    Synthetic {
        layers: 2,
        materials: 2,
        seed,
        ..Synthetic::new(size_px, patch_px)
    }
    .generate()
}

fn functional(order: Order) -> RunConfig {
    RunConfig {
        mode: Mode::Functional,
        order,
        level: Levels::two(LevelConfig::lru(1 << 10), LevelConfig::lru(8 << 10)),
        ..RunConfig::default()
    }
}

/// Orders of parts for random machines.
fn composed() -> impl Iterator<Item = Order> {
    let names = [
        "strip2+sta+offset",
        "band2+halves+boustro",
        "gilbert+merge+affinity",
        "zig-zag+halves+infinity",
        "scanline+lrta+quads",
    ];
    names.into_iter().map(|name| Order::find(name).unwrap())
}

/// Mode, and model of the texture unit.
type Time = (Mode, TmuModel);

const AT_ONCE: Time = (Mode::Functional, TmuModel::Looping);
const LOOPING: Time = (Mode::Timed, TmuModel::Looping);
const FIRST_MISS: Time = (Mode::Timed, TmuModel::FirstMiss);

fn in_time((mode, model): Time, mut config: RunConfig) -> RunConfig {
    (config.mode, config.tmu.model) = (mode, model);
    config
}

#[test]
fn lines_without_room_in_memory_are_expanded_again() {
    let trace = small();
    for order in [Order::MORTON, Order::Z2_STA_MERGE] {
        for mode in [Mode::Functional, Mode::Timed] {
            let config = RunConfig {
                mode,
                tile_maps: true,
                ..functional(order)
            };
            let expected = replay(&trace, &config).unwrap();
            for bytes in [0, 30_000] {
                let results = all(&trace, &[config], bytes);
                assert_eq!(results[0], expected, "{bytes} bytes");
            }
        }
    }
}

#[test]
fn without_penalties_timed_equals_functional_on_one_core() {
    let trace = small();
    for order in [Order::MORTON, Order::Z2_STA, Order::Z2_STA_MERGE] {
        let functional = RunConfig {
            cores: 1,
            ..functional(order)
        };
        let mut timed = RunConfig {
            mode: Mode::Timed,
            ..functional
        };
        (timed.level.l2.hit_cycles, timed.memory_cycles) = (0, 0);
        let expected = replay(&trace, &functional).unwrap();
        let mut found = replay(&trace, &timed).unwrap();
        assert_eq!(found.tmu.take().unwrap().utilization, 1.0);
        assert_eq!(found.cycles.take(), Some(expected.footprints));
        assert_eq!(found, expected);
    }
}

#[test]
fn an_infinite_cache_misses_each_line_once() {
    let trace = small();
    for mode in [Mode::Functional, Mode::Timed] {
        let config = RunConfig {
            mode,
            level: Levels::two(LevelConfig::lru(1 << 10), LevelConfig::lru(64 << 20)),
            ..RunConfig::default()
        };
        let result = replay(&trace, &config).unwrap();
        assert_eq!(result.l2.counters.line_misses, result.unique_lines);
    }
}

#[test]
fn misses_in_flight_are_merged_and_counted_separately() {
    // Two quads at the same place: the second needs the lines that the first has in flight.
    let trace = MemoryTrace {
        tables: testing::tables(&[[64, 64]]),
        tiles: vec![
            vec![testing::tile(&[(0, 1), (1, 1)])],
            vec![formats::textrace::Tile::default()],
        ],
    };
    let result = replay(&trace, &RunConfig::default()).unwrap();
    assert_eq!(result.l1.counters.line_misses, result.unique_lines);
    assert!(result.l1.counters.secondary_misses >= result.unique_lines);
    assert_eq!(result.l2.counters.line_lookups, result.unique_lines);
}

#[test]
fn static_lrta_gives_each_core_its_own_view() {
    // With one view per core, each L1 behaves as if it were the only one.
    let trace = small();
    let config = RunConfig {
        assign: Assign::Static,
        ..functional(Order::Z2_LRTA)
    };
    let both = replay(&trace, &config).unwrap();
    let alone: HashMap<&str, LevelCounters> = ["left", "right"]
        .into_iter()
        .enumerate()
        .map(|(eye, name)| {
            let mut one = trace.clone();
            one.tiles[1 - eye]
                .iter_mut()
                .for_each(formats::textrace::Tile::clear);
            let config = RunConfig {
                cores: 1,
                ..functional(Order::MORTON)
            };
            (name, replay(&one, &config).unwrap().l1.counters)
        })
        .collect();
    for part in &both.by_view {
        assert_eq!(part.l1, alone[part.name.as_str()], "{}", part.name);
    }
}

/// Results of all configurations in one batch, with a limit for the bytes of lines kept.
fn all(trace: &MemoryTrace, configs: &[RunConfig], bytes: u64) -> Vec<RunResult> {
    let results = Mutex::new(vec![None; configs.len()]);
    let keep = |index: usize, result| results.lock().unwrap()[index] = Some(result);
    let memory = LineMemory::new(bytes);
    replay_all(trace, configs, &memory, &keep).unwrap();
    let results = results.into_inner().unwrap();
    results.into_iter().map(Option::unwrap).collect()
}

/// Replays one configuration on the given machine.
fn alone(trace: &MemoryTrace, config: &RunConfig, machine: &mut dyn Machine) -> RunResult {
    let expander = Expander::new(trace, config).unwrap();
    let expander = expander.with_distinct_lines(config.mode == Mode::Timed);
    let memory = LineMemory::new(1 << 30);
    let mut counts = TraceCounts::new(expander.bins());
    let frame = expander.frame(0, &memory, &mut counts).unwrap();
    let phases = plan(trace, config).unwrap();
    let mut cores = Cores::new(&frame, config.cores as usize);
    machine
        .run(FrameWork {
            identity: None,
            cores: &mut cores,
            phases: &phases,
            assign: config.dispatch(),
            clients: None,
        })
        .unwrap();
    let outcome = machine.outcome(config);
    let (tmu, cycles) = (outcome.tmu, outcome.cycles);
    RunResult {
        tmu,
        cycles,
        memory: outcome.memory,
        ..summary(
            &trace.tables,
            expander.bins(),
            &counts,
            &outcome.counts,
            config,
        )
    }
}

/// Replays one functional configuration in caches of its own, boxed like those of any policy.
fn single(trace: &MemoryTrace, config: &RunConfig) -> RunResult {
    let bins = Bins::new(&trace.tables, CountBy::Texture).unwrap();
    let counts = CacheCounts::new(&bins, config.tile_maps);
    let caches = Hierarchy::build(config).unwrap();
    alone(trace, config, &mut Functional::new(caches, counts))
}

/// Number of random machines to compare with a twin; `MACHINES=1000` runs many.
fn machines(usual: u32) -> u32 {
    let many = std::env::var("MACHINES").ok();
    many.map_or(usual, |many| many.parse().expect("MACHINES: a number"))
}

/// A random LRU cache of up to `most_sets` sets and any small number of ways.
fn random_cache(random: &mut Random, most_sets: u64) -> LevelConfig {
    let ways = random.pick(&[1, 2, 3, 4, 4, 4, 5, 8, 12, 16]);
    let sets = 1 << random.below(u64::from(most_sets.ilog2()) + 1);
    LevelConfig {
        ways,
        ..LevelConfig::lru(sets * u64::from(ways) * 16)
    }
}
/// A footprint in the stream: core, cell and lines, with repeats written out.
type Sent = (usize, usize, Vec<u32>);

/// Records the stream.
#[derive(Default)]
struct Recorder {
    sent: Vec<Sent>,
}

impl Consumer for Recorder {
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        let before = self.sent.len();
        for footprint in quad.footprints() {
            for _ in 0..=footprint.repeats {
                self.sent
                    .push((core, footprint.cell, footprint.lines.to_vec()));
            }
        }
        assert_eq!((self.sent.len() - before) as u32, quad.footprints);
    }
}

fn sent(trace: &MemoryTrace, config: &RunConfig) -> Vec<Sent> {
    let (expander, memory) = (
        Expander::new(trace, config).unwrap(),
        LineMemory::new(1 << 30),
    );
    let mut counts = TraceCounts::new(expander.bins());
    let frame = expander.frame(0, &memory, &mut counts).unwrap();
    let phases = plan(trace, config).unwrap();
    let mut recorder = Recorder::default();
    let mut cores = Cores::new(&frame, config.cores as usize);
    interleave(&mut cores, &phases, config.dispatch(), &mut recorder).unwrap();
    recorder.sent
}

/// A machine with DRAM is simulated line by line, others in a shared pass. Misses are the same.
#[test]
fn dram_does_not_change_the_misses_of_an_l2_per_core() {
    let trace = small();
    let misses = |shared, dram| {
        let mut config = functional(Order::Z2_LRTA);
        config.level.l2.shared = shared;
        config.level.l2.size_bytes = 4 << 10;
        config.dram = dram;
        replay(&trace, &config).unwrap().l2.counters.line_misses
    };
    let dram = Some(crate::memory::dram::DramConfig::default());
    let [of_all, of_each] = [true, false].map(|shared| misses(shared, None));
    assert_eq!([of_all, of_each], [misses(true, dram), misses(false, dram)]);
    assert_ne!(of_all, of_each);
}
