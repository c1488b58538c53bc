//! Levels below the L2, through the engine.

use super::*;
use crate::config::{LevelConfig, LowerLevels, PrefetchConfig, Prefetching};
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
            lines: 1,
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
