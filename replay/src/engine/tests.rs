use super::counts::CacheCounts;
use super::functional::Functional;
use super::summary::summary;
use super::*;
use crate::config::{
    BetweenFrames, CountBy, Inclusion, LevelConfig, Levels, Mode, Order, Replacement, TmuModel,
};
use crate::memory::Hierarchy;
use crate::order::{self, PlanInputs, WorkItem};
use crate::result::LevelCounters;
use crate::stream::synthetic::Synthetic;
use crate::stream::testing::repeated;
use crate::stream::{
    Bins, Consumer, Expander, LineSet, MemoryTrace, QuadLines, TraceCounts, interleave, testing,
};
use formats::footprint::record_footprints;
use formats::layout::Layout;
use formats::random::Random;
use formats::textrace::with_operands;
use std::collections::{HashMap, HashSet};

fn small() -> MemoryTrace {
    Synthetic {
        size_px: [72, 56],
        patch_px: 24,
        layers: 2,
        materials: 3,
        ..Synthetic::default()
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

/// LRU sets as plain lists, most recently used last.
struct TwinCache(Vec<Vec<u64>>);

impl TwinCache {
    fn new(config: &LevelConfig) -> Self {
        Self(vec![Vec::new(); config.sets("", 16).unwrap() as usize])
    }

    fn access(&mut self, line: u64) -> bool {
        let index = (line % self.0.len() as u64) as usize;
        let set = &mut self.0[index];
        let hit = set.contains(&line);
        set.retain(|&l| l != line);
        set.push(line);
        if set.len() > 4 {
            set.remove(0);
        }
        hit
    }
}

/// A straightforward single-core replay without tables and shortcuts.
fn twin(trace: &MemoryTrace, config: &RunConfig) -> (LevelCounters, LevelCounters, usize) {
    let (mut c1, mut c2) = (LevelCounters::default(), LevelCounters::default());
    let (mut l1, mut l2) = (
        TwinCache::new(&config.level.l1),
        TwinCache::new(&config.level.l2),
    );
    let mut seen = HashSet::new();
    let layout = Layout::new(&trace.tables.textures, &config.layout).unwrap();
    let inputs = PlanInputs::new(config, &trace.tables.meta);
    let phases = order::plan(config.order, &inputs, &trace.tables.passes);
    for item in phases.iter().flatten() {
        let WorkItem::Tile(at) = item else {
            panic!("single-view orders only")
        };
        let tile = &trace.tiles[at.pass as usize][at.tile as usize];
        for run in &tile.runs {
            let records = &tile.records[run.first as usize..][..run.count as usize];
            for (record, operands) in with_operands(records) {
                record_footprints(
                    &trace.tables,
                    run.draw,
                    record,
                    operands,
                    &config.sampling,
                    |sample, f| {
                        let mut lines: Vec<u64> = Vec::new();
                        for texel in f.texels() {
                            let at = layout.address(
                                sample.texture,
                                f.layer.into(),
                                f.level.into(),
                                texel,
                            );
                            let line = at.unwrap() / 16;
                            if !lines.contains(&line) {
                                lines.push(line);
                            }
                        }
                        seen.extend(lines.iter().copied());
                        c1.footprints += 1;
                        c1.line_lookups += lines.len() as u64;
                        let missing: Vec<u64> =
                            lines.into_iter().filter(|&l| !l1.access(l)).collect();
                        let misses = missing.iter().filter(|&&l| !l2.access(l)).count() as u64;
                        c1.footprint_misses += u64::from(!missing.is_empty());
                        c1.line_misses += missing.len() as u64;
                        c2.footprints += u64::from(!missing.is_empty());
                        c2.line_lookups += missing.len() as u64;
                        c2.line_misses += misses;
                        c2.footprint_misses += u64::from(misses > 0);
                    },
                );
            }
        }
    }
    (c1, c2, seen.len())
}

#[test]
fn one_core_equals_a_brute_force_replay() {
    let trace = small();
    for order in [Order::SCANLINE, Order::HILBERT, Order::RANDOM] {
        let config = RunConfig {
            cores: 1,
            ..functional(order)
        };
        let result = replay(&trace, &config).unwrap();
        let (l1, l2, unique) = twin(&trace, &config);
        assert_eq!(result.l1.counters, l1);
        assert_eq!(result.l2.counters, l2);
        assert_eq!(result.unique_lines, unique as u64);
        assert!(
            l2.line_misses > unique as u64,
            "the caches are too large to test anything"
        );
    }
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
fn every_order_and_mode_replays_the_same_accesses() {
    let trace = small();
    let conserved = |mode, assign, order| {
        let config = RunConfig {
            mode,
            assign,
            ..functional(order)
        };
        let r = replay(&trace, &config).unwrap();
        (
            r.access_hash,
            r.unique_lines,
            r.footprints,
            r.l1.counters.line_lookups,
            r.quads,
            r.lanes,
        )
    };
    let expected = conserved(Mode::Functional, Assign::Static, Order::SCANLINE);
    for order in Order::all() {
        for mode in [Mode::Functional, Mode::Timed] {
            for assign in [Assign::Static, Assign::FirstIdle] {
                assert_eq!(
                    conserved(mode, assign, order),
                    expected,
                    "{} {mode:?}",
                    order.name()
                );
            }
        }
    }
}

#[test]
fn the_access_hash_sees_a_single_changed_access() {
    let mut trace = small();
    let config = functional(Order::MORTON);
    let before = replay(&trace, &config).unwrap().access_hash;
    let tile = trace.tiles[0]
        .iter_mut()
        .find(|t| !t.records.is_empty())
        .unwrap();
    tile.records[0].uv[0] += 64 * formats::textrace::SUBTEXELS;
    assert_ne!(replay(&trace, &config).unwrap().access_hash, before);
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
fn parts_add_up_to_the_whole() {
    let trace = small();
    for mode in [Mode::Functional, Mode::Timed] {
        let config = RunConfig {
            mode,
            tile_maps: true,
            ..functional(Order::Z2_LRTA)
        };
        let r = replay(&trace, &config).unwrap();
        for parts in [&r.by_view, &r.by_texture, &r.by_level] {
            let mut sum = (LevelCounters::default(), LevelCounters::default());
            for part in parts {
                sum.0.add(&part.l1);
                sum.1.add(&part.l2);
            }
            assert_eq!(sum, (r.l1.counters, r.l2.counters));
        }
        let total = |pick: &dyn Fn(&crate::result::TileMap) -> &Vec<u32>| -> u64 {
            r.tile_maps
                .iter()
                .flat_map(|m| pick(m).iter().map(|&n| u64::from(n)))
                .sum()
        };
        assert_eq!(total(&|m| &m.footprints), r.footprints);
        assert_eq!(total(&|m| &m.l1_misses), r.l1.counters.footprint_misses);
        assert_eq!(total(&|m| &m.l2_misses), r.l2.counters.line_misses);
    }
}

#[test]
fn tile_overdraw_counts_pixels_inside_the_image_only() {
    let trace = Synthetic {
        size_px: [40, 40],
        patch_px: 40,
        ..Synthetic::default()
    }
    .generate();
    let config = RunConfig {
        tile_maps: true,
        ..functional(Order::MORTON)
    };
    let result = replay(&trace, &config).unwrap();
    let left = &result.tile_maps[0];
    assert_eq!(left.tiles, [3, 3]);
    // One layer of patches covers the left eye's image and the parts of cut tiles beyond it.
    assert!(
        left.overdraw[..2].iter().all(|&o| o == 1.0),
        "{:?}",
        left.overdraw
    );
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

#[test]
fn a_trace_without_textures_has_no_footprints() {
    let mut trace = small();
    trace.tables.textures.clear();
    trace.tables.draws.iter_mut().for_each(|d| d.groups.clear());
    for mode in [Mode::Functional, Mode::Timed] {
        let result = replay(
            &trace,
            &RunConfig {
                mode,
                ..RunConfig::default()
            },
        )
        .unwrap();
        assert_eq!((result.footprints, result.l1.footprint_miss_rate), (0, 0.0));
        assert!(result.quads > 0);
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
    let inputs = PlanInputs::new(config, &trace.tables.meta);
    let phases = order::plan(config.order, &inputs, &trace.tables.passes);
    let mut cores = Cores::new(&frame, config.cores as usize);
    machine
        .run(&mut cores, &phases, config.dispatch(), None)
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
    let inputs = PlanInputs::new(config, &trace.tables.meta);
    let phases = order::plan(config.order, &inputs, &trace.tables.passes);
    let mut recorder = Recorder::default();
    let mut cores = Cores::new(&frame, config.cores as usize);
    interleave(&mut cores, &phases, config.dispatch(), &mut recorder).unwrap();
    recorder.sent
}

#[test]
fn several_cores_equal_brute_force_caches_on_the_recorded_stream() {
    let trace = small();
    for assign in [Assign::FirstIdle, Assign::Static] {
        for order in Order::all() {
            let config = RunConfig {
                assign,
                cores: 3,
                ..functional(order)
            };
            let sent = sent(&trace, &config);
            let mut l1: Vec<TwinCache> = (0..3).map(|_| TwinCache::new(&config.level.l1)).collect();
            let mut l2 = TwinCache::new(&config.level.l2);
            let (mut l1_lines, mut l2_lines) = (0, 0);
            for (core, _, lines) in &sent {
                for &line in lines {
                    if !l1[*core].access(line.into()) {
                        l1_lines += 1;
                        l2_lines += u64::from(!l2.access(line.into()));
                    }
                }
            }
            let result = replay(&trace, &config).unwrap();
            assert_eq!(sent.len() as u64, result.footprints);
            assert_eq!(
                (
                    result.l1.counters.line_misses,
                    result.l2.counters.line_misses
                ),
                (l1_lines, l2_lines)
            );
        }
    }
}

#[test]
fn unique_lines_do_not_depend_on_the_caches() {
    let trace = small();
    let touched = LineSet::new(1 << 24);
    let sent = sent(&trace, &functional(Order::SCANLINE));
    let lines = sent.iter().flat_map(|(.., lines)| lines);
    lines.for_each(|&line| touched.insert(line));
    assert!(touched.count() > 0);
    for mode in [Mode::Functional, Mode::Timed] {
        for l1 in [64, 1 << 10, 1 << 20] {
            let config = RunConfig {
                mode,
                level: Levels::two(LevelConfig::lru(l1), LevelConfig::lru(8 << 10)),
                ..functional(Order::Z2_STA)
            };
            let result = replay(&trace, &config).unwrap();
            assert_eq!(result.unique_lines, touched.count());
        }
    }
}

#[test]
fn caches_accept_lines_outside_a_trace() {
    let config = functional(Order::MORTON);
    let bins = Bins::new(&testing::tables(&[[64, 64]]), CountBy::Texture).unwrap();
    let hierarchy = Hierarchy::build(&config).unwrap();
    let mut caches = Functional::new(hierarchy, CacheCounts::new(&bins, false));
    let (mut l1, mut l2) = (
        TwinCache::new(&config.level.l1),
        TwinCache::new(&config.level.l2),
    );
    let (mut l1_lines, mut l2_lines) = (0, 0);
    for step in 0..10_000_u64 {
        let line = step * step % 1009 + step % 7;
        let tile = testing::tile_lines(&[&[&[line as u32]]]);
        caches.quad(0, tile.quad(0));
        if !l1.access(line) {
            l1_lines += 1;
            l2_lines += u64::from(!l2.access(line));
        }
    }
    let counted = caches.outcome(&config).counts.cells[0];
    assert_eq!((counted.l1.lines, counted.l2.lines), (l1_lines, l2_lines));
    assert!(l1_lines > l2_lines && l2_lines > 1009);
}

mod below;
mod one_pass;
mod plain_first_miss;
mod plain_timed;
mod prefetch_fifo;
mod timeline;

#[test]
fn with_a_flush_between_frames_each_frame_has_the_misses_of_a_separate_replay() {
    let (one, three) = (small(), repeated(&small(), 3));
    for policy in Replacement::all() {
        for mode in [Mode::Functional, Mode::Timed] {
            let mut config = RunConfig {
                mode,
                ..functional(Order::Z2_STA)
            };
            // A partly filled slot is carried over between frames. One footprint per slot leaves none partly filled.
            config.tmu.retry_footprints = 1;
            (config.level.l1.replacement, config.level.l2.replacement) = (policy, policy);
            let flush = RunConfig {
                between_frames: BetweenFrames::Flush,
                ..config
            };
            let single = replay(&one, &config).unwrap();
            let [kept, flushed] = [config, flush].map(|c| replay(&three, &c).unwrap());
            assert_eq!(flushed.footprints, 3 * single.footprints);
            // Random victims differ from frame to frame.
            if policy != Replacement::RANDOM {
                assert_ne!(
                    kept.l2.counters.line_misses, flushed.l2.counters.line_misses,
                    "{policy:?} {mode:?}"
                );
                // Predictions trained by the previous frame can be wrong; without them, the previous
                // frame's lines only add hits.
                if [Replacement::LRU, Replacement::FIFO, Replacement::TREE_PLRU].contains(&policy) {
                    assert!(
                        kept.l2.counters.line_misses < flushed.l2.counters.line_misses,
                        "{policy:?} {mode:?}"
                    );
                }
                assert_eq!(
                    flushed.l1.counters.line_misses,
                    3 * single.l1.counters.line_misses,
                    "{policy:?} {mode:?}"
                );
                assert_eq!(
                    flushed.l2.counters.line_misses,
                    3 * single.l2.counters.line_misses,
                    "{policy:?} {mode:?}"
                );
                assert_eq!(flushed.cycles, single.cycles.map(|cycles| 3 * cycles));
            }
        }
    }
}

/// Part of the L2 is lost between frames, compared with plain lists: in a shared pass, alone, and with caches of other types.
#[test]
fn other_work_between_frames_evicts_its_share_of_the_l2() {
    let (one, three) = (small(), repeated(&small(), 3));
    let mut of_size = Vec::new();
    for (percent, l2_bytes, ways) in [
        (1, 8, 4),
        (30, 2, 4),
        (50, 8, 2),
        (75, 8, 4),
        (100, 16, 4),
        (50, 16, 8),
    ] {
        let mut config = RunConfig {
            between_frames: BetweenFrames::Lose(percent),
            ..functional(Order::Z2_STA)
        };
        config.level.l2.size_bytes = l2_bytes << 10;
        config.level.l2.ways = ways;
        let sent = sent(&one, &config);
        let mut l2 = one_pass::Twin::new(&config.level.l2);
        let mut misses = 0;
        for frame in 0..3_u32 {
            let mut l1 = [0, 1].map(|_| one_pass::Twin::new(&config.level.l1));
            for (core, _, lines) in &sent {
                let missing = lines.iter().filter(|line| !l1[*core].access(**line));
                misses += missing.filter(|line| !l2.access(**line)).count() as u64;
            }
            let other = (l2_bytes << 10) / 16 * u64::from(percent) / 100;
            (0..other as u32).for_each(|line| {
                l2.access(0xf000_0000 + (frame << 20) + line);
            });
        }
        of_size.push((config, misses));
    }
    let configs: Vec<RunConfig> = of_size.iter().map(|(config, _)| *config).collect();
    let results = all(&three, &configs, 1 << 30);
    for ((config, misses), result) in of_size.iter().zip(&results) {
        assert_eq!(result.l2.counters.line_misses, *misses, "{config:?}");
        assert_eq!(*result, replay(&three, config).unwrap());
    }
    // Losing all of the L2 equals a flush. Without time, losing less costs less.
    let fifo = (Mode::Timed, TmuModel::PrefetchFifo);
    for time in [AT_ONCE, LOOPING, FIRST_MISS, fifo] {
        let misses = |between_frames, replacement| {
            let mut config = RunConfig {
                between_frames,
                ..in_time(time, functional(Order::Z2_STA))
            };
            config.level.l2.replacement = replacement;
            replay(&three, &config).unwrap().l2.counters.line_misses
        };
        for replacement in [Replacement::LRU, Replacement::FIFO] {
            let shares = [
                BetweenFrames::Keep,
                BetweenFrames::Lose(25),
                BetweenFrames::Lose(75),
                BetweenFrames::Lose(100),
            ];
            let found = shares.map(|share| misses(share, replacement));
            let is_sorted = time != AT_ONCE || found.is_sorted();
            assert!(is_sorted, "{replacement:?}: {found:?}");
            let is_less = time == FIRST_MISS || found[0] < found[3];
            assert!(is_less, "{time:?} {replacement:?}: {found:?}");
            assert_eq!(
                found[3],
                misses(BetweenFrames::Flush, replacement),
                "{time:?}"
            );
        }
    }
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

/// Other work takes its share of each lower level too, whatever the inclusion, the sharing and the time.
#[test]
fn other_work_between_frames_evicts_its_share_of_lower_levels() {
    let three = repeated(&small(), 3);
    for time in [AT_ONCE, LOOPING] {
        for (inclusion, shared) in [
            (Inclusion::None, true),
            (Inclusion::None, false),
            (Inclusion::Inclusive, true),
            (Inclusion::Exclusive, true),
        ] {
            let misses = |between_frames| {
                let mut config = RunConfig {
                    between_frames,
                    ..in_time(time, functional(Order::Z2_STA))
                };
                let l3 = LevelConfig {
                    inclusion,
                    ways: 16,
                    ..LevelConfig::lru(64 << 10)
                };
                config.level = config.level.over(&[l3]).unwrap();
                config.level.l2.size_bytes = 4 << 10;
                config.level.l2.shared = shared;
                let result = replay(&three, &config).unwrap();
                result.memory.lower_levels[0].line_misses
            };
            let found = [
                BetweenFrames::Keep,
                BetweenFrames::Lose(50),
                BetweenFrames::Lose(100),
            ]
            .map(misses);
            let place = format!("{time:?} {inclusion:?} {shared}: {found:?}");
            assert!(found.is_sorted() && found[0] < found[2], "{place}");
            assert_eq!(found[2], misses(BetweenFrames::Flush), "{place}");
        }
    }
}

#[test]
fn partial_loss_is_refused_for_levels_with_more_lines_than_other_work() {
    let mut config = functional(Order::MORTON);
    config.between_frames = BetweenFrames::Lose(50);
    config.validate().unwrap();
    let l3 = LevelConfig {
        ways: 16,
        line_bytes: Some(64),
        ..LevelConfig::lru(512 << 20)
    };
    config.level = config.level.over(&[l3]).unwrap();
    let error = config.validate().unwrap_err().to_string();
    assert!(
        error.starts_with("between_frames: expected keep or flush"),
        "{error}"
    );
    config.between_frames = BetweenFrames::Flush;
    config.validate().unwrap();
}

/// Each material of the trace has its own textures, so counts by draw are sums of counts by texture.
#[test]
fn counts_by_draw_equal_those_of_its_textures() {
    let trace = small();
    for time in [AT_ONCE, LOOPING, FIRST_MISS] {
        let config = in_time(time, functional(Order::Z2_STA));
        let by_texture = replay(&trace, &config).unwrap();
        let by_draw = RunConfig {
            count_by: CountBy::Draw,
            ..config
        };
        let mut by_draw = replay(&trace, &by_draw).unwrap();
        let parts = std::mem::take(&mut by_draw.by_draw);
        assert_eq!(parts.len(), trace.tables.draws.len());
        assert!(by_draw.by_texture.is_empty() && by_draw.by_level.is_empty());
        by_draw.by_texture.clone_from(&by_texture.by_texture);
        by_draw.by_level.clone_from(&by_texture.by_level);
        assert_eq!(by_draw, by_texture, "{time:?}");
        let textures_of = |draw: &formats::textrace::Draw| {
            let samples = draw.groups.iter().flat_map(|group| &group.samples);
            samples
                .map(|sample| sample.texture)
                .collect::<HashSet<u32>>()
        };
        let mut by_textures: HashMap<Vec<u32>, [LevelCounters; 2]> = HashMap::new();
        for (draw, part) in trace.tables.draws.iter().zip(&parts) {
            let mut textures: Vec<u32> = textures_of(draw).into_iter().collect();
            textures.sort_unstable();
            let [l1, l2] = by_textures.entry(textures).or_default();
            l1.add(&part.l1);
            l2.add(&part.l2);
        }
        assert!(by_textures.len() > 1);
        for (textures, levels) in by_textures {
            let mut expected = [LevelCounters::default(); 2];
            for texture in textures {
                let part = &by_texture.by_texture[texture as usize];
                expected[0].add(&part.l1);
                expected[1].add(&part.l2);
            }
            // A footprint counts once per draw, and so does a look-up of a line shared by several of its textures.
            assert_eq!(levels, expected, "{time:?}");
        }
    }
}
