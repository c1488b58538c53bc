//! The L2 as the cores' L1 caches see it: the cache, its prefetcher and the path of its misses.

use super::below::{Below, BelowResult};
use super::delayed::{DelayedFill, NOT_IN_FLIGHT};
use super::prefetch::{Demand, Prefetcher};
use super::{Cache, EMPTY};
use crate::config::{ConfigError, PrefetchConfig, RunConfig};
use crate::result::{PrefetchResult, Timeline};
use std::collections::HashSet;

/// What a configuration has beside and below the L2.
pub struct MissPath {
    below: Option<Below>,
    prefetch: Option<Prefetch>,
    memory_cycles: u64,
    /// Fetches by interval of time, where they are recorded.
    fetched_lines: Option<Vec<u32>>,
}

/// What was counted beside and below the L2.
#[derive(Clone, Debug, Default)]
pub struct MissPathResult {
    /// Levels below the L2 and DRAM.
    pub below: BelowResult,
    /// The prefetcher, where the configuration has one.
    pub prefetch: Option<PrefetchResult>,
}

impl MissPath {
    /// Empty levels below the L2.
    ///
    /// # Errors
    /// A geometry that cannot be built.
    pub fn build(config: &RunConfig) -> Result<Self, ConfigError> {
        Ok(Self {
            below: Below::build(config)?,
            prefetch: config.prefetch.as_ref().map(Prefetch::new),
            memory_cycles: config.tmu.l2_penalty_cycles.into(),
            fetched_lines: config.timeline.then(Vec::new),
        })
    }

    /// When a line that the L2 requests `now` is there.
    #[inline(always)]
    fn fetch(&mut self, line: u32, now: u64) -> u64 {
        if let Some(fetched_lines) = &mut self.fetched_lines {
            let interval = (now / Timeline::INTERVAL_CYCLES) as usize;
            if fetched_lines.len() <= interval {
                fetched_lines.resize(interval + 1, 0);
            }
            fetched_lines[interval] += 1;
        }
        match &mut self.below {
            None => now + self.memory_cycles,
            Some(below) => below.read_at(line, now),
        }
    }
}

/// A prefetcher and the state of what it fetched.
struct Prefetch {
    prefetcher: Box<dyn Prefetcher>,
    /// Prefetched lines without a demand request so far, whether they are still there or not.
    unused: HashSet<u32>,
    /// Lines that the last request asked to prefetch.
    wanted: Vec<u32>,
    counts: PrefetchResult,
}

impl Prefetch {
    fn new(config: &PrefetchConfig) -> Self {
        Self {
            prefetcher: config.build(),
            unused: HashSet::new(),
            wanted: Vec::new(),
            counts: PrefetchResult::default(),
        }
    }

    /// Counts a demand request and collects what is to be prefetched.
    fn observe(&mut self, line: u32, answer: Answer) {
        let is_first = self.unused.remove(&line);
        let demand = match answer {
            Answer::Miss(_) => Demand::Miss,
            _ if is_first => Demand::FirstUse,
            _ => Demand::Hit,
        };
        self.counts.evicted_lines += u64::from(is_first && demand == Demand::Miss);
        self.counts.useful_lines += u64::from(demand == Demand::FirstUse);
        let late = is_first && matches!(answer, Answer::InFlight(_));
        self.counts.late_lines += u64::from(late);
        self.wanted.clear();
        self.prefetcher.observe(line, demand, &mut self.wanted);
    }

    fn fetched(&mut self, line: u32) {
        self.counts.lines += 1;
        self.unused.insert(line);
    }
}

/// How the L2 answers a request of an L1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The line is there.
    Hit,
    /// It is in flight and arrives then.
    InFlight(u64),
    /// It is fetched and arrives then.
    Miss(u64),
}

/// The L2 and what lies beside and below it.
pub struct SharedLevel<C> {
    /// The cache alone.
    pub cache: C,
    path: MissPath,
}

impl<C> SharedLevel<C> {
    /// An empty cache over a path for its misses.
    pub fn new(cache: C, path: MissPath) -> Self {
        Self { cache, path }
    }

    /// What was counted beside and below the L2, all requests answered.
    #[must_use]
    pub fn result(&self) -> MissPathResult {
        MissPathResult {
            below: (self.path.below.as_ref()).map_or_else(BelowResult::default, Below::result),
            prefetch: self.path.prefetch.as_ref().map(|prefetch| prefetch.counts),
        }
    }

    /// Fetches by interval of time; nothing where they are not recorded.
    #[must_use]
    pub fn fetched_lines(&self) -> &[u32] {
        self.path.fetched_lines.as_deref().unwrap_or_default()
    }

    fn clear_path(&mut self) {
        self.path.below.iter_mut().for_each(Below::clear);
        if let Some(prefetch) = &mut self.path.prefetch {
            prefetch.unused.clear();
        }
    }
}

/// Where time passes.
impl<D: DelayedFill> SharedLevel<D> {
    /// Answers a request; a line that misses is fetched.
    #[inline(always)]
    pub fn request(&mut self, line: u32, now: u64) -> Answer {
        let answer = match self.cache.look_up(line, now) {
            0 => Answer::Hit,
            NOT_IN_FLIGHT => {
                let arrival = self.path.fetch(line, now);
                self.cache.enter(line, now, arrival);
                Answer::Miss(arrival)
            }
            arrival => Answer::InFlight(arrival),
        };
        if self.path.prefetch.is_some() {
            self.prefetch(line, now, answer);
        }
        answer
    }

    #[inline(never)]
    fn prefetch(&mut self, line: u32, now: u64, answer: Answer) {
        let Some(mut prefetch) = self.path.prefetch.take() else {
            return;
        };
        prefetch.observe(line, answer);
        for index in 0..prefetch.wanted.len() {
            let line = prefetch.wanted[index];
            if line != EMPTY && !self.cache.holds(line, now) {
                let arrival = self.path.fetch(line, now);
                self.cache.enter(line, now, arrival);
                prefetch.fetched(line);
            }
        }
        self.path.prefetch = Some(prefetch);
    }

    /// Empties the levels and drops the lines in flight.
    pub fn clear(&mut self) {
        self.cache.clear();
        self.clear_path();
    }
}

/// Where time does not pass: what is fetched is there at once.
impl<C: Cache> SharedLevel<C> {
    /// Looks up, and on a miss fills. True for a hit.
    #[inline(always)]
    pub fn access(&mut self, line: u32) -> bool {
        let hit = self.cache.access(line);
        if !hit && let Some(below) = &mut self.path.below {
            below.read(line);
        }
        if self.path.prefetch.is_some() {
            self.prefetch_at_once(line, hit);
        }
        hit
    }

    #[inline(never)]
    fn prefetch_at_once(&mut self, line: u32, hit: bool) {
        let Some(prefetch) = &mut self.path.prefetch else {
            return;
        };
        prefetch.observe(line, if hit { Answer::Hit } else { Answer::Miss(0) });
        for index in 0..prefetch.wanted.len() {
            let line = prefetch.wanted[index];
            if line != EMPTY && !self.cache.contains(line) {
                if let Some(below) = &mut self.path.below {
                    below.read(line);
                }
                self.cache.fill(line);
                prefetch.fetched(line);
            }
        }
    }

    /// Empties the levels.
    pub fn empty(&mut self) {
        self.cache.clear();
        self.clear_path();
    }
}

#[cfg(test)]
mod tests;
