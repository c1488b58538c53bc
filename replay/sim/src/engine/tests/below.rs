//! Replays with levels below the L2.

use super::*;
use crate::config::{Inclusion, LevelConfig, Levels, PrefetchConfig, Prefetching};
use crate::memory::dram::DramConfig;
use crate::result::{MemoryResult, RunResult};

/// Two small levels and these below them.
fn with(levels: &[LevelConfig], time: Time) -> RunConfig {
    let mut config = in_time(time, functional(Order::MORTON));
    config.level = config.level.over(levels).unwrap();
    config
}

/// Replaces the L2.
fn over_l2(l2: LevelConfig, mut config: RunConfig) -> RunConfig {
    config.level.l2 = LevelConfig {
        hit_cycles: config.level.l2.hit_cycles,
        ..l2
    };
    config
}

/// A level below the L2.
fn lower(size_bytes: u64) -> LevelConfig {
    Levels::usual(2, size_bytes)
}

const TIMES: [Time; 3] = [AT_ONCE, LOOPING, FIRST_MISS];

/// The result without the levels below the L2.
fn above(result: &RunResult) -> RunResult {
    RunResult {
        external_bytes: 0,
        memory: MemoryResult {
            lower_levels: Vec::new(),
            dram: None,
            ..result.memory.clone()
        },
        ..result.clone()
    }
}

#[test]
fn an_l3_as_slow_as_memory_changes_only_dram_traffic() {
    let trace = small();
    for time in TIMES {
        let without = replay(&trace, &with(&[], time)).unwrap();
        let slow = LevelConfig {
            hit_cycles: RunConfig::default().memory_cycles,
            ..lower(4 << 20)
        };
        let result = replay(&trace, &with(&[slow], time)).unwrap();
        assert_eq!(above(&result), above(&without), "{time:?}");
        let l3 = &result.memory.lower_levels[0];
        assert_eq!(l3.line_lookups, without.l2.counters.line_misses, "{time:?}");
        // The L3 evicts nothing.
        assert_eq!(l3.line_misses, result.unique_lines, "{time:?}");
        assert_eq!(result.external_bytes, 16 * result.unique_lines, "{time:?}");
    }
}

#[test]
fn a_prefetcher_that_fetches_nothing_changes_nothing() {
    let trace = small();
    for time in TIMES {
        let without = replay(&trace, &with(&[], time)).unwrap();
        let prefetch = Some(PrefetchConfig {
            prefetcher: Prefetching::ALIGNED_BLOCK,
            lines: Some(1),
        });
        let config = with(&[], time);
        let mut idle = replay(&trace, &RunConfig { prefetch, ..config }).unwrap();
        assert_eq!(idle.memory.prefetch.take().unwrap().lines, 0, "{time:?}");
        assert_eq!(idle, without, "{time:?}");
    }
}

#[test]
fn a_prefetcher_reduces_misses_and_adds_traffic() {
    let trace = small();
    for time in TIMES {
        // Large enough that prefetches evict no line that is used again.
        let plain = over_l2(LevelConfig::lru(128 << 10), with(&[], time));
        let without = replay(&trace, &plain).unwrap();
        let prefetch = Some(PrefetchConfig::default());
        let with = replay(&trace, &RunConfig { prefetch, ..plain }).unwrap();
        let prefetched = with.memory.prefetch.unwrap();
        assert!(
            with.l2.counters.line_misses < without.l2.counters.line_misses,
            "{time:?}"
        );
        assert!(with.external_bytes > without.external_bytes, "{time:?}");
        assert_eq!(
            with.external_bytes,
            16 * (with.l2.counters.line_misses + prefetched.lines),
            "{time:?}"
        );
        assert!(prefetched.useful_lines <= prefetched.lines, "{time:?}");
        assert!(prefetched.late_lines <= prefetched.useful_lines, "{time:?}");
    }
}

#[test]
fn a_faster_l3_shortens_a_replay_whose_l2_is_small() {
    let trace = small();
    let cycles = |levels: &[LevelConfig]| {
        let mut config = with(levels, LOOPING);
        (config.level.l1.size_bytes, config.level.l2.size_bytes) = (1 << 10, 1 << 10);
        replay(&trace, &config).unwrap().cycles.unwrap()
    };
    assert!(cycles(&[lower(4 << 20)]) < cycles(&[]));
}

#[test]
fn a_batch_has_the_results_of_separate_replays() {
    let trace = small();
    let long = LevelConfig {
        line_bytes: Some(64),
        ..lower(16 << 10)
    };
    let levels: [&[LevelConfig]; 4] = [&[], &[lower(16 << 10)], &[long], &[long, long]];
    let mut configs = Vec::new();
    for time in TIMES {
        for levels in levels {
            for dram in [None, Some(DramConfig::default())] {
                for prefetch in [None, Some(PrefetchConfig::default())] {
                    let config = with(levels, time);
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
        let Some(dram) = &found.memory.dram else {
            continue;
        };
        let line_bytes = found
            .memory
            .lower_levels
            .last()
            .map_or(16, |last| last.line_bytes);
        let requested = dram.requests * u64::from(line_bytes);
        assert_eq!(requested, found.external_bytes, "{config:?}");
    }
}

#[test]
fn inclusion_has_an_effect_if_a_level_evicts_lines_of_other_levels() {
    let trace = small();
    for time in TIMES {
        let of = |size_bytes, inclusion| {
            let level = LevelConfig {
                inclusion,
                ..lower(size_bytes)
            };
            let config = over_l2(LevelConfig::lru(4 << 10), with(&[level], time));
            replay(&trace, &config).unwrap()
        };
        // A large level evicts nothing.
        let [independent, mut inclusive] =
            [Inclusion::None, Inclusion::Inclusive].map(|inclusion| of(4 << 20, inclusion));
        assert_eq!(
            inclusive.memory.invalidated_lines.take(),
            Some(0),
            "{time:?}"
        );
        assert_eq!(inclusive, independent, "{time:?}");
        // A level of the L2's size takes lines from it if inclusive and adds its own size if exclusive.
        let [independent, inclusive, exclusive] =
            [Inclusion::None, Inclusion::Inclusive, Inclusion::Exclusive]
                .map(|inclusion| of(4 << 10, inclusion));
        assert!(inclusive.memory.invalidated_lines > Some(0), "{time:?}");
        assert!(
            exclusive.external_bytes < independent.external_bytes,
            "{time:?}"
        );
        assert_eq!(exclusive.access_hash, inclusive.access_hash);
    }
}

#[test]
fn more_mshrs_than_are_used_change_nothing_and_few_of_them_cost_cycles() {
    let trace = small();
    for time in [LOOPING, FIRST_MISS] {
        let of = |l2_mshrs| {
            let mut config = with(&[], time);
            config.tmu.l2_mshrs = l2_mshrs;
            replay(&trace, &config).unwrap()
        };
        let unlimited = of(0);
        let mut many = of(65_536);
        let counted = many.memory.l2_mshrs.take().unwrap();
        assert!(counted.peak > 4 && counted.stalled_misses == 0, "{time:?}");
        assert_eq!(many, unlimited, "{time:?}");
        let few = of(2);
        let counted = few.memory.l2_mshrs.unwrap();
        assert_eq!(counted.peak, 2);
        assert!(
            counted.stall_cycles > 0 && few.cycles > unlimited.cycles,
            "{time:?}"
        );
        // Exactly as many as needed.
        let mut enough = of(many_enough(&of(65_536)));
        assert_eq!(enough.memory.l2_mshrs.take().unwrap().stalled_misses, 0);
        assert_eq!(enough, unlimited, "{time:?}");
    }
}

fn many_enough(result: &RunResult) -> u32 {
    result.memory.l2_mshrs.unwrap().peak as u32
}

#[test]
fn sectors_and_victim_caches_are_replayed_in_every_mode() {
    let trace = small();
    for time in TIMES {
        let of = |sectors, victim_lines| {
            let plain = with(&[], time);
            let cache = |cache: LevelConfig| LevelConfig {
                sectors,
                victim_lines,
                ..cache
            };
            let config = RunConfig {
                level: Levels::two(cache(plain.level.l1), cache(LevelConfig::lru(4 << 10))),
                ..plain
            };
            replay(&trace, &config).unwrap()
        };
        let plain = of(1, 0);
        let (sectored, victims) = (of(4, 0), of(1, 16));
        for other in [&sectored, &victims] {
            assert_eq!(other.access_hash, plain.access_hash, "{time:?}");
            assert_eq!(other.unique_lines, plain.unique_lines, "{time:?}");
        }
        assert!(
            victims.l1.counters.line_misses < plain.l1.counters.line_misses,
            "{time:?}"
        );
        assert_ne!(
            sectored.l2.counters.line_misses, plain.l2.counters.line_misses,
            "{time:?}"
        );
    }
}

/// A stream omits repeats that hit in the L1 only if no other level can invalidate them. A batch must give
/// the results of a machine that sees every access.
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
            ..lower(2 << 10)
        };
        let l2 = LevelConfig {
            inclusion: l2_inclusion,
            ..LevelConfig::lru(2 << 10)
        };
        let config = over_l2(l2, with(&[level], AT_ONCE));
        let result = replay(&trace, &config).unwrap();
        let mut plain = single(&trace, &config);
        assert!(result.memory.invalidated_lines > Some(0));
        plain.external_bytes = result.external_bytes;
        plain.memory.invalidated_lines = result.memory.invalidated_lines;
        plain
            .memory
            .lower_levels
            .clone_from(&result.memory.lower_levels);
        assert_eq!(result, plain);
    }
}

/// With an L2 that holds everything, each line is prefetched or missed once. Nearly all lines after the
/// first item's are prefetched, which saves the cycles of their misses.
#[test]
fn the_next_items_lines_are_fetched_while_an_item_is_shaded() {
    let trace = small();
    for (time, cores) in [(LOOPING, 1), (LOOPING, 3), (FIRST_MISS, 2)] {
        let plain = RunConfig {
            cores,
            ..over_l2(LevelConfig::lru(4 << 20), with(&[], time))
        };
        let prefetch = Some(PrefetchConfig {
            prefetcher: Prefetching::TILE_AHEAD,
            lines: None,
        });
        let without = replay(&trace, &plain).unwrap();
        let ahead = replay(&trace, &RunConfig { prefetch, ..plain }).unwrap();
        let counted = ahead.memory.prefetch.unwrap();
        assert_eq!(
            ahead.l2.counters.line_misses + counted.lines,
            ahead.unique_lines,
            "{time:?}"
        );
        assert_eq!(counted.useful_lines, counted.lines, "{time:?}");
        assert_eq!(ahead.external_bytes, without.external_bytes, "{time:?}");
        assert!(
            2 * ahead.l2.counters.line_misses < without.l2.counters.line_misses,
            "{time:?}: {} {}",
            ahead.l2.counters.line_misses,
            without.l2.counters.line_misses
        );
        // Threads that stop at their first miss wait for whole loops, so fewer misses need not shorten a small frame.
        assert!(
            time == FIRST_MISS || ahead.cycles < without.cycles,
            "{time:?}"
        );
    }
    let functional = RunConfig {
        prefetch: Some(PrefetchConfig {
            prefetcher: Prefetching::TILE_AHEAD,
            lines: None,
        }),
        ..with(&[], AT_ONCE)
    };
    let error = functional.validate().unwrap_err().to_string();
    assert!(
        error.starts_with("prefetch.prefetcher: expected one that goes by requests"),
        "{error}"
    );
}
