//! Compares the single pass over many LRU configurations with separate replays and with plain lists.

use super::*;
use crate::config::{Replacement, SetIndex};

/// LRU sets as plain lists, most recently used last.
pub(super) struct Twin {
    sets: Vec<Vec<u32>>,
    ways: usize,
    set_index: SetIndex,
}

impl Twin {
    pub(super) fn new(config: &LevelConfig) -> Self {
        Self {
            sets: vec![Vec::new(); config.sets("", 16).unwrap() as usize],
            ways: config.ways as usize,
            set_index: config.set_index,
        }
    }

    pub(super) fn access(&mut self, line: u32) -> bool {
        let sets = self.sets.len();
        let digit = |line: usize| (line % sets, line / sets);
        let (mut index, mut rest) = digit(line as usize);
        while self.set_index == SetIndex::Xor && rest > 0 && sets > 1 {
            let (next, above) = digit(rest);
            (index, rest) = (index ^ next, above);
        }
        let set = &mut self.sets[index];
        let hit = set.contains(&line);
        set.retain(|&l| l != line);
        set.push(line);
        if set.len() > self.ways {
            set.remove(0);
        }
        hit
    }
}

/// Counters of both levels for the complete recorded stream.
fn twin(sent: &[Sent], config: &RunConfig) -> (LevelCounters, LevelCounters) {
    let mut l1: Vec<Twin> = (0..config.cores)
        .map(|_| Twin::new(&config.level.l1))
        .collect();
    let mut l2 = Twin::new(&config.level.l2);
    let (mut first, mut second) = (LevelCounters::default(), LevelCounters::default());
    for (core, _, lines) in sent {
        let missing: Vec<u32> = lines
            .iter()
            .copied()
            .filter(|&l| !l1[*core].access(l))
            .collect();
        let misses = missing.iter().filter(|&&l| !l2.access(l)).count() as u64;
        first.footprints += 1;
        first.line_lookups += lines.len() as u64;
        first.line_misses += missing.len() as u64;
        first.footprint_misses += u64::from(!missing.is_empty());
        second.line_misses += misses;
        second.footprint_misses += u64::from(misses > 0);
    }
    second.footprints = first.footprint_misses;
    second.line_lookups = first.line_misses;
    (first, second)
}

#[test]
fn a_thousand_sets_of_configurations_have_the_counts_of_separate_replays() {
    let traces = [1, 2, 3].map(|seed| {
        Synthetic {
            size_px: [36, 28],
            patch_px: 14,
            layers: 2,
            textures: 2,
            materials: 2,
            seed,
        }
        .generate()
    });
    let mut random = Random(1);
    let (mut together, mut missed) = (0, 0);
    for set in 0..1000 {
        let trace = &traces[random.below(3) as usize];
        let orders: Vec<Order> = Order::all().chain(composed()).collect();
        let base = RunConfig {
            order: random.pick(&orders),
            cores: random.pick(&[1, 2, 2, 3]),
            assign: random.pick(&[Assign::FirstIdle, Assign::Static]),
            ..functional(Order::MORTON)
        };
        let configs: Vec<RunConfig> = (0..=random.below(6))
            .map(|_| RunConfig {
                level: Levels::two(
                    random_cache(&mut random, 32),
                    LevelConfig {
                        set_index: random.pick(&SetIndex::ALL),
                        ..random_cache(&mut random, 256)
                    },
                ),
                tile_maps: random.below(3) == 0,
                ..base
            })
            .collect();
        let results = all(trace, &configs, 1 << 30);
        for (config, result) in configs.iter().zip(&results) {
            assert_eq!(*result, single(trace, config), "set {set}: {config:?}");
            missed += result.l2.counters.line_misses;
        }
        let of = random.below(configs.len() as u64) as usize;
        let expected = twin(&sent(trace, &base), &configs[of]);
        let found = (results[of].l1.counters, results[of].l2.counters);
        assert_eq!(found, expected, "set {set}: {:?}", configs[of]);
        together += configs.len();
    }
    assert!(together > 3000 && missed > 100_000, "{together} {missed}");
}

#[test]
fn configurations_that_cannot_share_a_pass_are_separate() {
    let trace = small();
    let base = functional(Order::MORTON);
    let larger = |config: RunConfig| RunConfig {
        level: Levels::two(LevelConfig::lru(2 << 10), config.level.l2),
        ..config
    };
    let with = |change: fn(&mut RunConfig)| {
        let mut config = base;
        change(&mut config);
        config
    };
    let configs = [
        base,
        larger(base),
        with(|c| c.order = Order::Z2_STA),
        with(|c| c.level.l2.replacement = Replacement::FIFO),
        with(|c| c.mode = Mode::Timed),
        larger(with(|c| c.mode = Mode::Timed)),
        with(|c| c.line_bytes = 32),
        with(|c| c.sampling.lod_bias = 1.0),
    ];
    let memory = LineMemory::new(1 << 30);
    let work = replay_all(&trace, &configs, &memory, &|_, _| ()).unwrap();
    let expected = Work {
        replays: 8,
        passes: 7,
        expansions: 4,
    };
    assert_eq!(work, expected);
    let results = all(&trace, &configs, 1 << 30);
    for (config, result) in configs.iter().zip(results) {
        assert_eq!(result, replay(&trace, config).unwrap());
    }
}
