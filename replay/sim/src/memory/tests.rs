use super::cache::EMPTY;
use super::in_flight::Immediate;
use super::*;
use crate::config::{Inclusion, LevelConfig, Levels, RunConfig};
use proptest::prelude::*;
use std::collections::HashSet;

/// Brute-force twin: sets as lists of lines, next victim first.
struct Twin {
    sets: Vec<Vec<u32>>,
    ways: usize,
    move_on_hit: bool,
}

impl Twin {
    fn new(sets: usize, ways: usize, move_on_hit: bool) -> Self {
        Self {
            sets: vec![Vec::new(); sets],
            ways,
            move_on_hit,
        }
    }

    fn access(&mut self, line: u32) -> bool {
        let index = line as usize % self.sets.len();
        let set = &mut self.sets[index];
        let found = set.iter().position(|&l| l == line);
        match found {
            Some(at) if self.move_on_hit => {
                set.remove(at);
                set.push(line);
            }
            Some(_) => {}
            None => {
                if set.len() == self.ways {
                    set.remove(0);
                }
                set.push(line);
            }
        }
        found.is_some()
    }
}

fn config(lines: u64, ways: u32, replacement: Replacement) -> LevelConfig {
    LevelConfig {
        ways,
        replacement,
        ..LevelConfig::lru(lines * 16)
    }
}

fn cache(lines: u64, ways: u32, replacement: Replacement) -> Box<dyn Cache> {
    seeded(5, lines, ways, replacement)
}

fn seeded(seed: u64, lines: u64, ways: u32, replacement: Replacement) -> Box<dyn Cache> {
    let built = AnyCache::build(&config(lines, ways, replacement), "L1", 16, seed);
    built.unwrap().into_box()
}

fn built(config: &LevelConfig) -> Box<dyn Cache> {
    let built = AnyCache::build(config, "L1", 16, 5);
    built.unwrap().into_box()
}

/// Caches of every policy, alone, with sectors, with a victim cache and with both.
fn kinds(lines: u64, ways: u32) -> Vec<LevelConfig> {
    let mut all = Vec::new();
    for replacement in Replacement::all() {
        for (sectors, victim_lines) in [(1, 0), (4, 0), (1, 3), (2, 2)] {
            all.push(LevelConfig {
                sectors,
                victim_lines,
                ..config(lines * u64::from(sectors), ways, replacement)
            });
        }
    }
    all
}

/// Misses of a fully associative LRU cache, by brute force.
fn stack_misses(trace: &[u32], lines: usize) -> usize {
    let mut twin = Twin::new(1, lines, true);
    trace.iter().filter(|&&line| !twin.access(line)).count()
}

fn misses(cache: &mut dyn Cache, trace: &[u32]) -> usize {
    trace.iter().filter(|&&line| !cache.access(line)).count()
}

/// A trace with texture-like locality: mostly near the last line, sometimes far.
fn trace() -> impl Strategy<Value = Vec<u32>> {
    prop::collection::vec(prop_oneof![4 => 0_u32..40, 1 => 0_u32..400], 1..600)
}

/// Brute-force twin of re-reference interval prediction: one set, with each line and its prediction by way.
#[derive(Default)]
struct RripTwin {
    ways: Vec<(u32, u32)>,
    newest: u32,
    fills: u32,
}

impl RripTwin {
    fn access(&mut self, line: u32, ways: usize, is_bimodal: bool) -> bool {
        if let Some(held) = self.ways.iter_mut().find(|held| held.0 == line) {
            if line != self.newest {
                held.1 = 0;
            }
            return true;
        }
        self.fills += 1;
        let prediction = 2 + u32::from(is_bimodal && !self.fills.is_multiple_of(32));
        self.newest = line;
        if self.ways.len() < ways {
            self.ways.push((line, prediction));
            return false;
        }
        loop {
            if let Some(victim) = self.ways.iter_mut().find(|held| held.1 == 3) {
                *victim = (line, prediction);
                return false;
            }
            self.ways.iter_mut().for_each(|held| held.1 += 1);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn rrip_equals_its_brute_force_twin(trace in trace()) {
        for (policy, is_bimodal) in [(Replacement::SRRIP, false), (Replacement::BRRIP, true)] {
            for ways in [1, 3, 4, 16] {
                let mut twin = RripTwin::default();
                let mut cache = cache(u64::from(ways), ways, policy);
                for &line in &trace {
                    prop_assert_eq!(cache.access(line), twin.access(line, ways as usize, is_bimodal));
                }
            }
        }
    }

    #[test]
    fn lru_equals_its_brute_force_twin_at_every_associativity(trace in trace()) {
        for ways in [1, 2, 3, 4, 8, 16] {
            let mut twin = Twin::new(4, ways as usize, true);
            let mut cache = cache(4 * u64::from(ways), ways, Replacement::LRU);
            for &line in &trace {
                prop_assert_eq!(cache.access(line), twin.access(line));
            }
        }
    }

    #[test]
    fn fifo_equals_its_brute_force_twin(trace in trace()) {
        for ways in [1, 3, 4] {
            let mut twin = Twin::new(8, ways as usize, false);
            let mut cache = cache(8 * u64::from(ways), ways, Replacement::FIFO);
            for &line in &trace {
                prop_assert_eq!(cache.access(line), twin.access(line));
            }
        }
    }

    #[test]
    fn of_several_look_ups_of_a_line_only_the_last_matters(trace in trace(), wanted in prop::collection::vec(0_u32..40, 1..20)) {
        for kind in kinds(32, 4) {
            let (mut all, mut last) = (built(&kind), built(&kind));
            for &line in &trace {
                prop_assert_eq!(all.access(line), last.access(line));
            }
            let mut distinct: Vec<u32> = Vec::new();
            for &line in wanted.iter().rev() {
                if !distinct.contains(&line) {
                    distinct.push(line);
                }
            }
            let there: Vec<u32> = wanted.iter().copied().filter(|&line| all.lookup(line)).collect();
            distinct.reverse();
            let mut rest = distinct.as_slice();
            while let Some(missing) = last.lookup_all(rest) {
                prop_assert!(!there.contains(&rest[missing]));
                rest = &rest[missing + 1..];
            }
            for &line in trace.iter().rev() {
                prop_assert_eq!(all.access(line), last.access(line));
            }
        }
    }

    /// `fill` reports the line that leaves, `remove` makes a line absent, and the next fill of that
    /// set evicts nothing.
    #[test]
    fn a_cache_holds_the_filled_lines_that_were_not_evicted_or_removed(
        trace in trace(),
        removed in prop::collection::vec(0_u32..40, 1..20),
    ) {
        for kind in kinds(32, 4).into_iter().filter(|kind| kind.sectors == 1) {
            let mut cache = built(&kind);
            let mut held: HashSet<u32> = HashSet::new();
            for (step, &line) in trace.iter().enumerate() {
                prop_assert_eq!(cache.lookup(line), held.contains(&line));
                if held.insert(line) {
                    let evicted = cache.fill(line);
                    prop_assert_eq!(evicted != EMPTY, held.remove(&evicted));
                }
                if step % 7 == 0 {
                    let line = removed[step % removed.len()];
                    prop_assert_eq!(cache.remove(line), held.remove(&line));
                    prop_assert!(!cache.contains(line));
                    if kind.victim_lines == 0 && !held.contains(&line) {
                        let before = held.iter().filter(|&&other| other % 8 == line % 8).count();
                        let evicted = cache.fill(line);
                        prop_assert_eq!(evicted == EMPTY, before < 4);
                        held.remove(&evicted);
                        held.insert(line);
                    }
                }
                for &line in &held {
                    prop_assert!(cache.contains(line));
                }
            }
        }
    }

    /// Sets as lists of groups, each with its valid sectors.
    #[test]
    fn a_sectored_cache_equals_lists_of_groups(trace in trace()) {
        for sectors in [2_u32, 4, 16] {
            let mut cache = built(&LevelConfig {
                sectors,
                ..config(u64::from(4 * 2 * sectors), 2, Replacement::LRU)
            });
            let mut sets: Vec<Vec<(u32, HashSet<u32>)>> = vec![Vec::new(); 4];
            for &line in &trace {
                let group = line / sectors;
                let set = &mut sets[group as usize % 4];
                let at = set.iter().position(|other| other.0 == group);
                let hit = at.is_some_and(|at| set[at].1.contains(&line));
                let mut entry = at.map_or_else(|| (group, HashSet::new()), |at| set.remove(at));
                entry.1.insert(line);
                set.push(entry);
                if set.len() > 2 {
                    set.remove(0);
                }
                prop_assert_eq!(cache.access(line), hit);
            }
        }
    }

    /// An exclusive level adds its lines to a fully associative L2; an inclusive level always holds
    /// all lines of the L2.
    #[test]
    fn inclusion_holds_after_every_request(trace in trace(), l2_inclusive in any::<bool>()) {
        for inclusion in [Inclusion::Inclusive, Inclusion::Exclusive] {
            let level = LevelConfig { ways: 16, inclusion, ..LevelConfig::lru(16 * 16) };
            let of_l2 = if l2_inclusive { Inclusion::Inclusive } else { Inclusion::None };
            let l2 = LevelConfig { inclusion: of_l2, ..config(8, 8, Replacement::LRU) };
            let levels = Levels::two(config(8, 4, Replacement::LRU), l2);
            let config = RunConfig {
                level: levels.over(&[level]).unwrap(),
                ..RunConfig::default()
            };
            config.validate().unwrap();
            let mut caches = Caches::build(&config).unwrap().boxed();
            let l2 = caches.l2.into_iter().map(Immediate).collect();
            let mut l2 = SecondLevel::new(l2, MissPath::build(&config, None).unwrap());
            let mut missed = Vec::new();
            for (step, &line) in trace.iter().enumerate() {
                if caches.l1[step % 2].access(line) {
                    continue;
                }
                missed.push(line);
                l2.access(step % 2, line);
                l2.invalidate_l1(|line| caches.l1.iter_mut().map(|l1| u64::from(l1.remove(line))).sum());
                if inclusion == Inclusion::Exclusive && !l2_inclusive {
                    continue;
                }
                for line in 0..400 {
                    let in_l1 = caches.l1.iter().any(|l1| l1.contains(line));
                    prop_assert!(!in_l1 || !l2_inclusive || l2.cache(0).0.contains(line));
                }
            }
            let result = l2.result();
            let l3 = &result.lower_levels[0];
            if inclusion == Inclusion::Exclusive {
                prop_assert_eq!(l3.line_misses as usize, stack_misses(&missed, 8 + 16));
            } else {
                // The L3 holds all lines of the L2, so it cannot miss.
                let below = l3.line_misses;
                let held: Vec<u32> = (0..400).filter(|&line| l2.cache(0).0.contains(line)).collect();
                for line in held {
                    l2.cache(0).remove(line, 0);
                    l2.access(0, line);
                }
                prop_assert_eq!(l2.result().lower_levels[0].line_misses, below);
            }
        }
    }

    #[test]
    fn lookup_then_fill_equals_access(trace in trace()) {
        let (mut whole, mut steps) = (cache(32, 4, Replacement::LRU), cache(32, 4, Replacement::LRU));
        for &line in &trace {
            let hit = steps.lookup(line);
            if !hit {
                steps.fill(line);
            }
            prop_assert_eq!(whole.access(line), hit);
        }
    }

    #[test]
    fn lru_misses_equal_stack_distances_of_a_fully_associative_cache(trace in trace()) {
        for lines in [1, 2, 8, 64] {
            let mut stack: Vec<u32> = Vec::new();
            let mut expected = 0;
            for &line in &trace {
                let depth = stack.iter().rev().position(|&l| l == line);
                expected += usize::from(depth.is_none_or(|d| d >= lines));
                stack.retain(|&l| l != line);
                stack.push(line);
            }
            let mut cache = cache(lines as u64, lines as u32, Replacement::LRU);
            prop_assert_eq!(misses(&mut *cache, &trace), expected);
        }
    }

    #[test]
    fn a_forest_has_the_counts_of_each_of_its_caches(
        trace in trace(),
        shapes in prop::collection::btree_map(0_u32..7, 1_u32..9, 1..5),
    ) {
        let trees: Vec<(u32, u32)> = shapes.into_iter().map(|(bits, ways)| (1 << bits, ways)).collect();
        let mut forest = Forest::new(&trees);
        let mut alone: Vec<_> = trees
            .iter()
            .flat_map(|&(sets, most)| (1..=most).map(move |ways| (sets, ways)))
            .map(|(sets, ways)| (sets, ways, cache(u64::from(sets * ways), ways, Replacement::LRU)))
            .collect();
        let mut depths = vec![0; trees.len()];
        for &line in &trace {
            let mut until = forest.clone();
            forest.access(line, &mut depths);
            let deepest = depths.iter().copied().max().unwrap_or(0);
            let mut of_last = vec![0; trees.len()];
            let lines = [line, line, line];
            prop_assert_eq!(until.access_all(&lines, u32::from(deepest) + 1, &mut of_last), 3);
            prop_assert_eq!(until.clone().access_all(&[line], 0, &mut of_last), 1);
            for (sets, ways, cache) in &mut alone {
                let tree = trees.iter().position(|tree| tree.0 == *sets).unwrap();
                prop_assert_eq!(cache.access(line), u32::from(depths[tree]) < *ways);
            }
        }
    }

    #[test]
    fn a_larger_lru_cache_with_the_same_sets_includes_the_smaller_one(trace in trace()) {
        let (mut small, mut large) = (cache(16, 2, Replacement::LRU), cache(32, 4, Replacement::LRU));
        for &line in &trace {
            let hit = small.access(line);
            prop_assert!(large.access(line) || !hit);
        }
    }

    #[test]
    fn no_policy_beats_beladys(trace in trace()) {
        for policy in Replacement::all() {
            let mut cache = cache(16, 16, policy);
            prop_assert!(misses(&mut *cache, &trace) >= belady_misses(&trace, 16));
        }
    }

    #[test]
    fn repeating_a_safe_sequence_changes_nothing(trace in trace(), first in 0_u32..40) {
        for kind in kinds(16, 4) {
            let (mut once, mut twice) = (built(&kind), built(&kind));
            for &line in &trace {
                let safe: Vec<u32> =
                    (0..once.repeat_safe_lines()).map(|i| line + i * (first % 5)).collect();
                for &l in &safe {
                    prop_assert_eq!(once.access(l), twice.access(l));
                }
                prop_assert!(safe.iter().all(|&l| twice.access(l)));
            }
        }
    }
}

/// Lines that map to one set, accessed cyclically. A victim cache for the lines beyond the set's
/// ways avoids all but the first misses; one line less, or no victim cache, avoids none.
#[test]
fn a_victim_cache_holds_the_conflicts_of_a_set() {
    for (ways, victim_lines) in [(1, 1), (4, 3), (8, 16)] {
        let trace: Vec<u32> = (0..10)
            .flat_map(|_| (0..ways + victim_lines).map(|line| 64 * line))
            .collect();
        let of = |victim_lines| {
            let kind = LevelConfig {
                victim_lines,
                ..config(u64::from(16 * ways), ways, Replacement::LRU)
            };
            misses(&mut *built(&kind), &trace)
        };
        assert_eq!(of(victim_lines), (ways + victim_lines) as usize);
        assert_eq!(of(victim_lines - 1), trace.len());
        assert_eq!(of(0), trace.len());
    }
}

/// Misses of the optimal policy: the victim is the line used furthest in the future.
fn belady_misses(trace: &[u32], lines: usize) -> usize {
    let mut held: HashSet<u32> = HashSet::new();
    let mut misses = 0;
    for (now, &line) in trace.iter().enumerate() {
        if held.contains(&line) {
            continue;
        }
        misses += 1;
        if held.len() == lines {
            let next = |l: u32| {
                trace[now..]
                    .iter()
                    .position(|&t| t == l)
                    .unwrap_or(usize::MAX)
            };
            let victim = held.iter().copied().max_by_key(|&l| (next(l), l)).unwrap();
            held.remove(&victim);
        }
        held.insert(line);
    }
    misses
}

#[test]
fn streaming_misses_every_line_once() {
    let trace: Vec<u32> = (0..1000).flat_map(|line| [line; 3]).collect();
    for policy in Replacement::all() {
        assert_eq!(
            misses(&mut *cache(64, 4, policy), &trace),
            1000,
            "{policy:?}"
        );
    }
}

#[test]
fn a_cycle_one_line_longer_than_an_lru_cache_always_misses() {
    let trace: Vec<u32> = (0..10).flat_map(|_| 0..9).collect();
    assert_eq!(
        misses(&mut *cache(8, 8, Replacement::LRU), &trace),
        trace.len()
    );
    assert_eq!(misses(&mut *cache(16, 16, Replacement::LRU), &trace), 9);
}

#[test]
fn tree_plru_never_evicts_the_line_used_last() {
    let mut cache = cache(4, 4, Replacement::TREE_PLRU);
    for line in [0, 1, 2, 3] {
        cache.access(line);
    }
    cache.access(1);
    cache.access(9);
    assert!(cache.lookup(1) && cache.lookup(9));
}

#[test]
fn tree_plru_with_two_ways_is_lru() {
    let trace: Vec<u32> = (0..500_u32)
        .map(|i| i.wrapping_mul(2_654_435_761) >> 27)
        .collect();
    assert_eq!(
        misses(&mut *cache(16, 2, Replacement::TREE_PLRU), &trace),
        misses(&mut *cache(16, 2, Replacement::LRU), &trace)
    );
}

#[test]
fn random_replacement_follows_its_seed() {
    let trace: Vec<u32> = (0..2000_u32)
        .map(|i| i.wrapping_mul(2_654_435_761) >> 25)
        .collect();
    let run = |seed| {
        let mut cache = seeded(seed, 32, 4, Replacement::RANDOM);
        misses(&mut *cache, &trace)
    };
    assert_eq!(run(1), run(1));
    assert!((1..20).any(|seed| run(seed) != run(0)));
}

#[test]
fn dueling_follows_the_better_insertion() {
    let run = |policy, trace: &[u32]| misses(&mut *cache(4096, 4, policy), trace);
    // A loop slightly larger than the cache: bimodal insertion keeps a part of it.
    let thrashing: Vec<u32> = (0..60).flat_map(|_| 0..6144).collect();
    let of = |policy| run(policy, &thrashing);
    let (fixed, bimodal) = (of(Replacement::SRRIP), of(Replacement::BRRIP));
    assert!(bimodal < fixed * 6 / 10, "{bimodal} {fixed}");
    assert!(of(Replacement::DRRIP) < fixed * 7 / 10);
    // A moving working set: lines are used again soon, so bimodal insertion loses them.
    let moving: Vec<u32> = (0..4000)
        .flat_map(|start| (0..64).map(move |i| start * 16 + i * 97 % 2048))
        .collect();
    let of = |policy| run(policy, &moving);
    let (fixed, bimodal) = (of(Replacement::SRRIP), of(Replacement::BRRIP));
    assert!(fixed < bimodal, "{fixed} {bimodal}");
    assert!(of(Replacement::DRRIP) < (fixed + bimodal) / 2);
}

#[test]
fn hit_prediction_keeps_a_working_set_from_a_scan() {
    // Each region of the working set is used twice, alternating with a stream without reuse.
    let scan_lines = 512;
    let scan = |round: u32| (1 << 20) + round * scan_lines..(1 << 20) + (round + 1) * scan_lines;
    let trace: Vec<u32> = (0..400_u32)
        .flat_map(|round| (0..128).chain(0..128).chain(scan(round)))
        .collect();
    let of = |policy| misses(&mut *cache(256, 4, policy), &trace);
    let (ship, lru) = (of(Replacement::SHIP), of(Replacement::LRU));
    let scanned = 400 * scan_lines as usize;
    assert_eq!(lru, scanned + 400 * 128);
    // Half of the working set stays: the first lines of an untrained region still evict the rest.
    assert!(ship < scanned + 220 * 128, "{}", ship - scanned);
}
