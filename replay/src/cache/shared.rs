//! The L2 as the cores' L1 caches see it: the cache, its prefetcher and the path of its misses.

use super::below::{Below, BelowResult};
use super::delayed::{DelayedFill, NOT_IN_FLIGHT};
use super::inclusion::Evictions;
use super::limited_mshrs::LimitedMshrs;
use super::prefetch::{Demand, Prefetcher};
use super::{Cache, EMPTY};
use crate::config::{ConfigError, PrefetchConfig, RunConfig};
use crate::result::{MshrResult, PrefetchResult, Timeline};
use std::collections::HashSet;
use std::ops::Range;

/// What a configuration has beside and below the L2.
pub struct MissPath {
    below: Option<Below>,
    prefetch: Option<Prefetch>,
    /// Where their number is limited.
    mshrs: Option<LimitedMshrs>,
    /// Where levels depend on what others evict.
    evictions: Option<Evictions>,
    /// True with a prefetcher or with evictions to follow: what comes after the answer to a request.
    has_consequences: bool,
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
    /// The MSHRs of the L2, where their number is limited.
    pub mshrs: Option<MshrResult>,
    /// Lines invalidated by inclusive levels, where levels depend on what others evict.
    pub invalidated_lines: Option<u64>,
}

impl MissPath {
    /// Empty levels below the L2.
    ///
    /// # Errors
    /// A geometry that cannot be built.
    pub fn build(config: &RunConfig) -> Result<Self, ConfigError> {
        let mshrs = config.tmu.l2_mshrs;
        Ok(Self {
            below: Below::build(config)?,
            prefetch: config.prefetch.as_ref().map(Prefetch::new),
            mshrs: (mshrs > 0).then(|| LimitedMshrs::new(mshrs)),
            evictions: Evictions::build(config),
            has_consequences: config.prefetch.is_some() || config.levels_depend_on_evictions(),
            memory_cycles: config.tmu.l2_penalty_cycles.into(),
            fetched_lines: config.timeline.then(Vec::new),
        })
    }

    /// True where lines leave L1 caches because other levels evict them.
    #[must_use]
    pub fn invalidates(&self) -> bool {
        self.evictions.is_some()
    }

    /// When a line that the L2 requests `now` is there.
    #[inline(always)]
    fn fetch(&mut self, line: u32, now: u64) -> u64 {
        if self.mshrs.is_some() {
            return self.fetch_by_mshr(line, now);
        }
        self.read(line, now)
    }

    #[inline(never)]
    fn fetch_by_mshr(&mut self, line: u32, now: u64) -> u64 {
        let start = self.mshrs.as_mut().map_or(now, |mshrs| mshrs.start(now));
        let arrival = self.read(line, start);
        if let Some(mshrs) = &mut self.mshrs {
            mshrs.enter(arrival);
        }
        arrival
    }

    /// True if a fetch would wait for an MSHR.
    fn is_busy(&mut self, now: u64) -> bool {
        (self.mshrs.as_mut()).is_some_and(|mshrs| mshrs.are_in_use(now))
    }

    /// When a line is there that the path reads `now`.
    #[inline(always)]
    fn read(&mut self, line: u32, now: u64) -> u64 {
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
            mshrs: self.path.mshrs.as_ref().map(|mshrs| mshrs.counts),
            invalidated_lines: (self.path.evictions.as_ref())
                .map(|evictions| evictions.invalidated_lines),
        }
    }

    /// Fetches by interval of time; nothing where they are not recorded.
    #[must_use]
    pub fn fetched_lines(&self) -> &[u32] {
        self.path.fetched_lines.as_deref().unwrap_or_default()
    }

    /// Lines of the next work item that are prefetched when an item starts, at most.
    #[must_use]
    pub fn lines_of_next_item(&self) -> usize {
        let prefetch = self.path.prefetch.as_ref();
        prefetch.map_or(0, |prefetch| prefetch.prefetcher.lines_of_next_item())
    }

    /// Takes lines that inclusive levels have evicted out of the L1 caches: `remove` takes one out of all of them and returns
    /// how many held it.
    #[inline(always)]
    pub fn invalidate_l1(&mut self, remove: impl FnMut(u32) -> u64) {
        if let Some(evictions) = &mut self.path.evictions
            && evictions.are_pending()
        {
            evictions.invalidate_l1(remove);
        }
    }

    fn clear_path(&mut self) {
        self.path.below.iter_mut().for_each(Below::clear);
        self.path.mshrs.iter_mut().for_each(LimitedMshrs::clear);
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
        if self.path.has_consequences {
            self.prefetch(line, now, answer);
            self.follow_evictions(now);
        }
        answer
    }

    #[inline(never)]
    fn follow_evictions(&mut self, now: u64) {
        if let Some(evictions) = &mut self.path.evictions {
            self.cache.take_evicted(&mut evictions.evicted);
            evictions.follow(self.path.below.as_mut(), |line| {
                self.cache.remove(line, now)
            });
        }
    }

    #[inline(never)]
    fn prefetch(&mut self, line: u32, now: u64, answer: Answer) {
        let Some(mut prefetch) = self.path.prefetch.take() else {
            return;
        };
        prefetch.observe(line, answer);
        self.fetch_wanted(&mut prefetch, now);
        self.path.prefetch = Some(prefetch);
    }

    /// Fetches lines of the work item that comes next, as an item starts.
    pub fn prefetch_item(&mut self, lines: &[u32], now: u64) {
        if let Some(mut prefetch) = self.path.prefetch.take() {
            prefetch.wanted.clear();
            prefetch.wanted.extend_from_slice(lines);
            self.fetch_wanted(&mut prefetch, now);
            self.path.prefetch = Some(prefetch);
            self.follow_evictions(now);
        }
    }

    fn fetch_wanted(&mut self, prefetch: &mut Prefetch, now: u64) {
        for index in 0..prefetch.wanted.len() {
            let line = prefetch.wanted[index];
            if line != EMPTY && !self.cache.holds(line, now) {
                if self.path.is_busy(now) {
                    prefetch.counts.dropped_lines += 1;
                    continue;
                }
                let arrival = self.path.fetch(line, now);
                self.cache.enter(line, now, arrival);
                prefetch.fetched(line);
            }
        }
    }

    /// Empties the levels and drops the lines in flight.
    pub fn clear(&mut self) {
        self.cache.clear();
        self.clear_path();
    }

    /// Other work fetches lines of its own, which are there `now`.
    pub fn fill_with(&mut self, lines: Range<u32>, now: u64) {
        for line in lines {
            if !self.cache.holds(line, now) {
                self.cache.enter(line, now, now);
            }
        }
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
        if self.path.has_consequences {
            self.prefetch_at_once(line, hit);
            self.follow_evictions_at_once();
        }
        hit
    }

    #[inline(never)]
    fn follow_evictions_at_once(&mut self) {
        if let Some(evictions) = &mut self.path.evictions {
            self.cache.take_evicted(&mut evictions.evicted);
            evictions.follow(self.path.below.as_mut(), |line| self.cache.remove(line));
        }
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

    /// Other work fetches lines of its own.
    pub fn fill_with_at_once(&mut self, lines: Range<u32>) {
        for line in lines {
            self.cache.access(line);
        }
    }
}

#[cfg(test)]
mod tests;
