use super::*;
use crate::config::{LevelConfig, Levels, Prefetching};
use crate::memory::{AllocateOnMiss, AnyCache, Delay, Replacement};
use proptest::prelude::*;

const SETS: u32 = 8;

fn config(prefetch: Option<PrefetchConfig>) -> RunConfig {
    RunConfig {
        level: Levels::two(
            LevelConfig::lru(8 << 10),
            LevelConfig::lru(u64::from(SETS) * 4 * 16),
        ),
        prefetch,
        ..RunConfig::default()
    }
}

fn cache(config: &RunConfig) -> AnyCache {
    AnyCache::build(&config.level.l2, "L2", 16, 1).unwrap()
}

fn functional(config: &RunConfig) -> SecondLevel<Immediate<Box<dyn Cache>>> {
    SecondLevel::new(
        vec![Immediate(cache(config).into_box())],
        MissPath::build(config, None).unwrap(),
    )
}

/// A timed L2 of any type, as a function from line and cycle to the answer.
type Request = Box<dyn FnMut(u32, u64) -> Answer>;

fn timed(config: &RunConfig) -> [Request; 2] {
    fn request<D: DelayedFill + 'static>(cache: D, config: &RunConfig) -> Request {
        let mut level = SecondLevel::new(vec![cache], MissPath::build(config, None).unwrap());
        Box::new(move |line, now| level.request(0, line, now))
    }
    let AnyCache::FourWayLru(by_set) = cache(config) else {
        panic!("four ways")
    };
    [
        request(by_set.delayed(200), config),
        request(cache(config).into_box().delayed(200), config),
    ]
}

fn prefetch(prefetcher: Prefetching, lines: u32) -> Option<PrefetchConfig> {
    Some(PrefetchConfig {
        prefetcher,
        lines: Some(lines),
    })
}

/// Sets as lists, most recently used last, and lists of unused prefetched lines.
#[derive(Default)]
struct Twin {
    sets: Vec<Vec<u32>>,
    unused: Vec<u32>,
    counts: PrefetchResult,
    misses: u64,
}

impl Twin {
    fn fill(&mut self, line: u32) {
        let set = &mut self.sets[(line % SETS) as usize];
        set.push(line);
        if set.len() > 4 {
            set.remove(0);
        }
    }

    fn access(&mut self, line: u32, config: &PrefetchConfig) {
        let set = &mut self.sets[(line % SETS) as usize];
        let hit = set.contains(&line);
        let first = self.unused.contains(&line);
        self.unused.retain(|&other| other != line);
        if hit {
            set.retain(|&other| other != line);
            set.push(line);
            self.counts.useful_lines += u64::from(first);
        } else {
            self.counts.evicted_lines += u64::from(first);
            self.misses += 1;
            self.fill(line);
        }
        let n = config.lines();
        let wanted: Vec<u32> = match config.prefetcher.name() {
            "next-line" if !hit || first => (line + 1..=line + n).collect(),
            "aligned-block" if !hit => (0..n).map(|i| line / n * n + ((line % n) ^ i)).collect(),
            _ => Vec::new(),
        };
        for line in wanted {
            if !self.sets[(line % SETS) as usize].contains(&line) {
                self.fill(line);
                self.counts.lines += 1;
                self.unused.push(line);
            }
        }
    }
}

proptest! {
    #[test]
    fn prefetching_equals_a_replay_on_lists(
        block in any::<bool>(),
        log_lines in 0_u32..4,
        steps in prop::collection::vec((0_u32..3, 0_u32..120), 1..600),
    ) {
        let kind = if block { Prefetching::ALIGNED_BLOCK } else { Prefetching::NEXT_LINE };
        let config = config(prefetch(kind, 1 << log_lines));
        let mut level = functional(&config);
        let mut twin = Twin { sets: vec![Vec::new(); SETS as usize], ..Twin::default() };
        let (mut misses, mut line) = (0, 0);
        for (step, target) in steps {
            // Runs of neighbours, and jumps.
            line = if step == 0 { target } else { line + 1 };
            misses += u64::from(!level.access(0, line));
            twin.access(line, &config.prefetch.unwrap());
            prop_assert_eq!(level.result().prefetch.unwrap(), twin.counts);
        }
        prop_assert_eq!(misses, twin.misses);
    }

    /// Compares the cache that fills set by set with the one that fills in order of time.
    #[test]
    fn both_kinds_of_timed_cache_give_equal_answers(
        block in any::<bool>(),
        log_lines in 0_u32..4,
        l3 in any::<bool>(),
        steps in prop::collection::vec((0_u64..60, 0_u32..120), 1..400),
    ) {
        let kind = if block { Prefetching::ALIGNED_BLOCK } else { Prefetching::NEXT_LINE };
        let mut config = config(prefetch(kind, 1 << log_lines));
        if l3 {
            config.level = config.level.over(&[Levels::usual(2, 1 << 12)]).unwrap();
        }
        let [mut by_set, mut in_order] = timed(&config);
        let mut now = 0;
        for (pause, line) in steps {
            now += pause;
            prop_assert_eq!(by_set(line, now), in_order(line, now));
        }
    }

    /// `contains` must not change which lines are evicted.
    #[test]
    fn contains_agrees_with_look_ups_and_changes_nothing(
        policy in 0_usize..8,
        steps in prop::collection::vec((0_u32..80, 0_u32..80), 1..400),
    ) {
        let replacement = Replacement::all().nth(policy).unwrap();
        let mut config = config(None);
        config.level.l2.replacement = replacement;
        let [mut asked, mut plain] = [0, 1].map(|_| cache(&config).into_box());
        for (other, line) in steps {
            asked.contains(other);
            let held = asked.contains(line);
            let hit = asked.access(line);
            prop_assert_eq!(held, hit);
            prop_assert_eq!(hit, plain.access(line));
        }
    }
}

/// N consecutive lines. With next-line, the first use of each prefetched line fetches the next: one
/// miss, N prefetched lines. With blocks of four: one miss per block and three prefetched lines.
#[test]
fn a_stream_misses_once_with_the_next_line_and_once_for_each_block() {
    let run = |prefetch| {
        let config = config(prefetch);
        let mut level = functional(&config);
        let misses = (0..400).filter(|&line| !level.access(0, line)).count() as u64;
        (misses, level.result().prefetch.unwrap())
    };
    let counts = |lines, useful_lines| PrefetchResult {
        lines,
        useful_lines,
        ..PrefetchResult::default()
    };
    assert_eq!(
        run(prefetch(Prefetching::NEXT_LINE, 1)),
        (1, counts(400, 399))
    );
    assert_eq!(
        run(prefetch(Prefetching::ALIGNED_BLOCK, 4)),
        (100, counts(300, 300))
    );
}

/// Requests ten cycles apart: a prefetched line is late until the time between its fetch and its
/// request reaches the latency.
#[test]
fn a_prefetched_line_arrives_after_the_latency_of_its_own_fetch() {
    let config = config(prefetch(Prefetching::NEXT_LINE, 1));
    for mut request in timed(&config) {
        assert_eq!(request(0, 0), Answer::Miss(200));
        assert_eq!(request(1, 10), Answer::InFlight(200));
        assert_eq!(request(2, 20), Answer::InFlight(210));
        assert_eq!(request(3, 220), Answer::Hit);
        assert_eq!(request(9, 230), Answer::Miss(430));
    }
}

#[test]
fn a_cache_that_allocates_on_a_miss_keeps_prefetched_lines() {
    let config = config(prefetch(Prefetching::ALIGNED_BLOCK, 4));
    let reserved = AllocateOnMiss(cache(&config).into_box()).delayed(200);
    let mut level = SecondLevel::new(vec![reserved], MissPath::build(&config, None).unwrap());
    assert_eq!(level.request(0, 5, 0), Answer::Miss(200));
    assert_eq!(level.request(0, 4, 50), Answer::InFlight(200));
    assert_eq!(level.request(0, 6, 200), Answer::Hit);
    let counts = level.result().prefetch.unwrap();
    assert_eq!(
        (counts.lines, counts.useful_lines, counts.late_lines),
        (3, 2, 1)
    );
}
