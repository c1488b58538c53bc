//! Levels below the L2, through the engine.

use super::*;
use crate::config::{Inclusion, LevelConfig, LowerLevels, PrefetchConfig, Prefetching};
use crate::memory::dram::DramConfig;
use crate::result::RunResult;

fn with(levels: &[LevelConfig], mode: Mode) -> RunConfig {
    RunConfig {
        mode,
        level: LowerLevels::of(levels).unwrap(),
        ..functional(Order::MORTON)
    }
}

const MODES: [Mode; 3] = [Mode::Functional, Mode::Timed, Mode::FirstMiss];

/// A result without what lies below the L2.
fn above(result: &RunResult) -> RunResult {
    RunResult {
        external_bytes: 0,
        lower_levels: Vec::new(),
        dram: None,
        ..result.clone()
    }
}

#[test]
fn an_l3_as_slow_as_memory_changes_external_traffic_alone() {
    let trace = small();
    for mode in MODES {
        let without = replay(&trace, &with(&[], mode)).unwrap();
        let slow = LevelConfig {
            hit_cycles: RunConfig::default().tmu.l2_penalty_cycles,
            ..LevelConfig::lru(4 << 20)
        };
        let result = replay(&trace, &with(&[slow], mode)).unwrap();
        assert_eq!(above(&result), above(&without), "{mode:?}");
        let l3 = &result.lower_levels[0];
        assert_eq!(l3.line_lookups, without.l2.misses, "{mode:?}");
        // Nothing is evicted from it.
        assert_eq!(l3.line_misses, result.unique_lines, "{mode:?}");
        assert_eq!(result.external_bytes, 16 * result.unique_lines, "{mode:?}");
    }
}

#[test]
fn a_prefetcher_that_fetches_nothing_changes_nothing() {
    let trace = small();
    for mode in MODES {
        let without = replay(&trace, &with(&[], mode)).unwrap();
        let prefetch = Some(PrefetchConfig {
            prefetcher: Prefetching::ALIGNED_BLOCK,
            lines: Some(1),
        });
        let config = with(&[], mode);
        let mut idle = replay(&trace, &RunConfig { prefetch, ..config }).unwrap();
        assert_eq!(idle.prefetch.take().unwrap().lines, 0, "{mode:?}");
        assert_eq!(idle, without, "{mode:?}");
    }
}

#[test]
fn a_prefetcher_trades_bytes_for_misses() {
    let trace = small();
    for mode in MODES {
        // Large enough that prefetched lines evict nothing that is used again.
        let plain = RunConfig {
            l2: CacheConfig::lru(128 << 10),
            ..with(&[], mode)
        };
        let without = replay(&trace, &plain).unwrap();
        let prefetch = Some(PrefetchConfig::default());
        let with = replay(&trace, &RunConfig { prefetch, ..plain }).unwrap();
        let prefetched = with.prefetch.unwrap();
        assert!(with.l2.misses < without.l2.misses, "{mode:?}");
        assert!(with.external_bytes > without.external_bytes, "{mode:?}");
        assert_eq!(
            with.external_bytes,
            16 * (with.l2.misses + prefetched.lines),
            "{mode:?}"
        );
        assert!(prefetched.useful_lines <= prefetched.lines, "{mode:?}");
        assert!(prefetched.late_lines <= prefetched.useful_lines, "{mode:?}");
    }
}

#[test]
fn a_faster_l3_shortens_a_replay_whose_l2_is_small() {
    let trace = small();
    let cycles = |levels: &[LevelConfig]| {
        let mut config = with(levels, Mode::Timed);
        (config.l1, config.l2) = (CacheConfig::lru(1 << 10), CacheConfig::lru(1 << 10));
        replay(&trace, &config).unwrap().cycles.unwrap()
    };
    assert!(cycles(&[LevelConfig::lru(4 << 20)]) < cycles(&[]));
}

#[test]
fn a_batch_gives_what_each_replay_gives_alone() {
    let trace = small();
    let long = LevelConfig {
        line_bytes: Some(64),
        ..LevelConfig::lru(16 << 10)
    };
    let levels: [&[LevelConfig]; 4] = [&[], &[LevelConfig::lru(16 << 10)], &[long], &[long, long]];
    let mut configs = Vec::new();
    for mode in MODES {
        for levels in levels {
            for dram in [None, Some(DramConfig::default())] {
                for prefetch in [None, Some(PrefetchConfig::default())] {
                    let config = with(levels, mode);
                    configs.push(RunConfig {
                        dram,
                        prefetch,
                        ..config
                    });
                }
            }
        }
    }
    let answers = Mutex::new(vec![RunResult::default(); configs.len()]);
    let keep = |index: usize, result| answers.lock().unwrap()[index] = result;
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    replay_all(&trace, &configs, &memory, &keep).unwrap();
    for (config, found) in configs.iter().zip(answers.into_inner().unwrap()) {
        assert_eq!(found, replay(&trace, config).unwrap(), "{config:?}");
        let Some(dram) = &found.dram else {
            continue;
        };
        let line_bytes = found.lower_levels.last().map_or(16, |last| last.line_bytes);
        let requested = dram.requests * u64::from(line_bytes);
        assert_eq!(requested, found.external_bytes, "{config:?}");
    }
}

#[test]
fn inclusion_matters_where_a_level_evicts_what_others_hold() {
    let trace = small();
    for mode in MODES {
        let of = |size_bytes, inclusion| {
            let level = LevelConfig {
                inclusion,
                ..LevelConfig::lru(size_bytes)
            };
            let config = RunConfig {
                l2: CacheConfig::lru(4 << 10),
                ..with(&[level], mode)
            };
            replay(&trace, &config).unwrap()
        };
        // Nothing is evicted from a large level.
        let [independent, mut inclusive] =
            [Inclusion::None, Inclusion::Inclusive].map(|inclusion| of(4 << 20, inclusion));
        assert_eq!(inclusive.invalidated_lines.take(), Some(0), "{mode:?}");
        assert_eq!(inclusive, independent, "{mode:?}");
        // A level as large as the L2 takes lines from it; an exclusive one adds its own size.
        let [independent, inclusive, exclusive] =
            [Inclusion::None, Inclusion::Inclusive, Inclusion::Exclusive]
                .map(|inclusion| of(4 << 10, inclusion));
        assert!(inclusive.invalidated_lines > Some(0), "{mode:?}");
        assert!(
            exclusive.external_bytes < independent.external_bytes,
            "{mode:?}"
        );
        assert_eq!(exclusive.access_hash, inclusive.access_hash);
    }
}

#[test]
fn more_mshrs_than_are_used_change_nothing_and_few_of_them_cost_cycles() {
    let trace = small();
    for mode in [Mode::Timed, Mode::FirstMiss] {
        let of = |l2_mshrs| {
            let mut config = with(&[], mode);
            config.tmu.l2_mshrs = l2_mshrs;
            replay(&trace, &config).unwrap()
        };
        let unlimited = of(0);
        let mut many = of(65_536);
        let counted = many.l2_mshrs.take().unwrap();
        assert!(counted.peak > 4 && counted.stalled_misses == 0, "{mode:?}");
        assert_eq!(many, unlimited, "{mode:?}");
        let few = of(2);
        let counted = few.l2_mshrs.unwrap();
        assert_eq!(counted.peak, 2);
        assert!(
            counted.stall_cycles > 0 && few.cycles > unlimited.cycles,
            "{mode:?}"
        );
        // Just enough of them.
        let mut enough = of(many_enough(&of(65_536)));
        assert_eq!(enough.l2_mshrs.take().unwrap().stalled_misses, 0);
        assert_eq!(enough, unlimited, "{mode:?}");
    }
}

fn many_enough(result: &RunResult) -> u32 {
    result.l2_mshrs.unwrap().peak as u32
}

#[test]
fn sectors_and_victim_caches_are_replayed_in_every_mode() {
    let trace = small();
    for mode in MODES {
        let of = |sectors, victim_lines| {
            let plain = with(&[], mode);
            let cache = |cache: CacheConfig| CacheConfig {
                sectors,
                victim_lines,
                ..cache
            };
            let config = RunConfig {
                l1: cache(plain.l1),
                l2: cache(CacheConfig::lru(4 << 10)),
                ..plain
            };
            replay(&trace, &config).unwrap()
        };
        let plain = of(1, 0);
        let (sectored, victims) = (of(4, 0), of(1, 16));
        for other in [&sectored, &victims] {
            assert_eq!(other.access_hash, plain.access_hash, "{mode:?}");
            assert_eq!(other.unique_lines, plain.unique_lines, "{mode:?}");
        }
        assert!(victims.l1.misses < plain.l1.misses, "{mode:?}");
        assert_ne!(sectored.l2.misses, plain.l2.misses, "{mode:?}");
    }
}

/// Repeats that find their lines in the L1 are left out of a stream only where no other level can invalidate them: one
/// configuration at a time gives what a machine gives that sees every access.
#[test]
fn back_invalidation_is_exact_in_functional_mode() {
    let trace = small();
    for (l2_inclusion, l3_inclusion) in [
        (Inclusion::Inclusive, Inclusion::None),
        (Inclusion::None, Inclusion::Inclusive),
        (Inclusion::Inclusive, Inclusion::Exclusive),
    ] {
        let level = LevelConfig {
            inclusion: l3_inclusion,
            ..LevelConfig::lru(2 << 10)
        };
        let config = RunConfig {
            l1: CacheConfig::lru(1 << 10),
            l2: CacheConfig {
                inclusion: l2_inclusion,
                ..CacheConfig::lru(2 << 10)
            },
            ..with(&[level], Mode::Functional)
        };
        let result = replay(&trace, &config).unwrap();
        let mut plain = single(&trace, &config);
        assert!(result.invalidated_lines > Some(0));
        plain.external_bytes = result.external_bytes;
        plain.invalidated_lines = result.invalidated_lines;
        plain.lower_levels.clone_from(&result.lower_levels);
        assert_eq!(result, plain);
    }
}

/// With an L2 that holds everything, each line is prefetched or missed once; nearly all are prefetched but the first item's, and the
/// cycles of their misses are saved.
#[test]
fn the_next_items_lines_are_fetched_while_an_item_is_shaded() {
    let trace = small();
    for (mode, cores) in [(Mode::Timed, 1), (Mode::Timed, 3), (Mode::FirstMiss, 2)] {
        let plain = RunConfig {
            l2: CacheConfig::lru(4 << 20),
            cores,
            ..with(&[], mode)
        };
        let prefetch = Some(PrefetchConfig {
            prefetcher: Prefetching::TILE_AHEAD,
            lines: None,
        });
        let without = replay(&trace, &plain).unwrap();
        let ahead = replay(&trace, &RunConfig { prefetch, ..plain }).unwrap();
        let counted = ahead.prefetch.unwrap();
        assert_eq!(
            ahead.l2.misses + counted.lines,
            ahead.unique_lines,
            "{mode:?}"
        );
        assert_eq!(counted.useful_lines, counted.lines, "{mode:?}");
        assert_eq!(ahead.external_bytes, without.external_bytes, "{mode:?}");
        assert!(
            2 * ahead.l2.misses < without.l2.misses,
            "{mode:?}: {} {}",
            ahead.l2.misses,
            without.l2.misses
        );
        // Threads that stop at their first miss wait for whole loops, so that fewer misses need not shorten a small frame.
        assert!(
            mode == Mode::FirstMiss || ahead.cycles < without.cycles,
            "{mode:?}"
        );
    }
    let functional = RunConfig {
        prefetch: Some(PrefetchConfig {
            prefetcher: Prefetching::TILE_AHEAD,
            lines: None,
        }),
        ..with(&[], Mode::Functional)
    };
    let error = functional.validate().unwrap_err().to_string();
    assert!(
        error.starts_with("prefetch.prefetcher: expected one that goes by requests"),
        "{error}"
    );
}
