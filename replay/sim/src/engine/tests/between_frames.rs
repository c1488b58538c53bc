//! What caches keep from frame to frame.

use super::*;

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
