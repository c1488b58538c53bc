use super::*;
use crate::config::{LevelConfig, Levels};
use crate::memory::dram::DramConfig;
use proptest::prelude::*;
use std::collections::HashMap;

/// An LRU level as lists of lines, most recently used last.
struct Twin {
    sets: Vec<Vec<u32>>,
    ways: usize,
    ratio: u32,
    hit_cycles: u64,
    arrivals: HashMap<u32, u64>,
    counts: [u64; 3],
}

impl Twin {
    /// Returns true for a hit.
    fn access(&mut self, line: u32) -> bool {
        let line = line / self.ratio;
        let index = line as usize % self.sets.len();
        let set = &mut self.sets[index];
        let hit = set.contains(&line);
        set.retain(|&other| other != line);
        set.push(line);
        if set.len() > self.ways {
            set.remove(0);
        }
        self.counts[0] += 1;
        self.counts[1] += u64::from(!hit);
        hit
    }
}

fn twins(config: &RunConfig) -> Vec<Twin> {
    let twin = |(name, level, line_bytes): (_, &LevelConfig, u32)| Twin {
        sets: vec![Vec::new(); level.sets(name, line_bytes).unwrap() as usize],
        ways: level.ways as usize,
        ratio: line_bytes / config.line_bytes,
        hit_cycles: level.hit_cycles.into(),
        arrivals: HashMap::new(),
        counts: [0; 3],
    };
    config
        .level
        .named(config.line_bytes)
        .skip(2)
        .map(twin)
        .collect()
}

/// Arrival of the line, computed level by level.
fn twin_read(twins: &mut [Twin], line: u32, now: u64, memory_cycles: u64) -> u64 {
    let Some((first, below)) = twins.split_first_mut() else {
        return now + memory_cycles;
    };
    let own = line / first.ratio;
    let known = first.arrivals.get(&own).copied().filter(|&at| at > now);
    if first.access(line) {
        first.counts[2] += u64::from(known.is_some());
        return (now + first.hit_cycles).max(known.unwrap_or(0));
    }
    let arrival = twin_read(below, line, now, memory_cycles);
    if known.is_none() {
        first.arrivals.insert(own, arrival);
    }
    arrival
}

fn level(sets: u64, ways: u32, line_bytes: u32, hit_cycles: u32) -> LevelConfig {
    LevelConfig {
        ways,
        line_bytes: Some(line_bytes),
        hit_cycles,
        ..LevelConfig::lru(sets * u64::from(ways) * u64::from(line_bytes))
    }
}

fn counts(below: &Below) -> Vec<[u64; 3]> {
    let levels = below.result().0.into_iter();
    let counts = levels.map(|l| [l.line_lookups, l.line_misses, l.secondary_misses]);
    counts.collect()
}

proptest! {
    /// One to four levels with line sizes growing from level to level, with and without time.
    #[test]
    fn levels_equal_lists_of_lines(
        shapes in prop::collection::vec((0_u32..4, 1_u32..6, 0_u32..3, 0_u32..90), 1..5),
        steps in prop::collection::vec((0_u64..40, 0_u32..400), 1..400),
    ) {
        let mut line_bytes = 16;
        let levels: Vec<LevelConfig> = shapes.iter().map(|&(sets, ways, grows, hit_cycles)| {
            line_bytes <<= grows;
            level(1 << sets, ways, line_bytes, hit_cycles)
        }).collect();
        let config = RunConfig { level: Levels::default().over(&levels).unwrap(), ..RunConfig::default() };
        config.validate().unwrap();
        let [mut timed, mut functional] = [0, 1].map(|_| Below::build(&config).unwrap());
        let (mut timed_twins, mut functional_twins) = (twins(&config), twins(&config));
        let mut now = 0;
        for (pause, line) in steps {
            now += pause;
            let found = timed.read(0, line, Some(now));
            prop_assert_eq!(found, twin_read(&mut timed_twins, line, now, 200));
            functional.read(0, line, None);
            // Cycles this far apart leave nothing in flight.
            twin_read(&mut functional_twins, line, now * 1000, 0);
        }
        let of = |twins: &[Twin]| twins.iter().map(|twin| twin.counts).collect::<Vec<_>>();
        prop_assert_eq!(counts(&timed), of(&timed_twins));
        let without_merged = |counts: Vec<[u64; 3]>| counts.into_iter().map(|[a, b, _]| [a, b]).collect::<Vec<_>>();
        prop_assert_eq!(without_merged(counts(&functional)), without_merged(of(&functional_twins)));
        prop_assert!(counts(&functional).iter().all(|counts| counts[2] == 0));
    }
}

/// A stream of N lines through a level with lines four times as long has N/4 misses and merges
/// three of four requests while the fetch is in flight.
#[test]
fn a_stream_misses_once_for_each_longer_line() {
    let levels = Levels::default().over(&[level(64, 16, 64, 60)]).unwrap();
    let config = RunConfig {
        level: levels,
        dram: Some(DramConfig::default()),
        ..RunConfig::default()
    };
    let mut below = Below::build(&config).unwrap();
    for line in 0..400_u32 {
        let start = u64::from(line / 4 * 1000);
        let now = start + u64::from(line % 4);
        assert_eq!(below.read(0, line, Some(now)), start + 200, "line {line}");
    }
    assert_eq!(counts(&below), [[400, 100, 300]]);
    assert_eq!(below.result().1.unwrap().requests, 100);
    // All lines have arrived.
    assert_eq!(below.read(0, 3, Some(1_000_000)), 1_000_060);
    below.clear();
    assert_eq!(below.read(0, 3, Some(1_000_100)), 1_000_300);
}

#[test]
fn values_out_of_range_are_refused_with_the_name_of_the_level() {
    let fault = |levels: &[LevelConfig]| {
        let level = Levels::default().over(levels).unwrap();
        let config = RunConfig {
            level,
            ..RunConfig::default()
        };
        config.validate().unwrap_err().to_string()
    };
    let good = level(64, 16, 64, 60);
    assert_eq!(
        fault(&[good, level(64, 16, 32, 60)]),
        "level.line_bytes: expected a power of two from the line size of the level above to 4096, found 32 (L4)"
    );
    assert_eq!(
        fault(&[level(64, 16, 64, 100_001)]),
        "level.hit_cycles: expected 0 to 100000, found 100001 (L3)"
    );
    assert_eq!(
        fault(&[level(3, 16, 64, 60)]),
        "L3 cache of 3 KiB, 16 ways, 64-byte lines: expected a power-of-two number of sets up to 16777216, found 3; possible: 2 KiB or 4 KiB with 16 ways, or 3 KiB with 12 ways"
    );
    assert!(Levels::default().over(&[good; 5]).is_none());
}
