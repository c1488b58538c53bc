//! The L2 as seen by the L1 caches: one cache or one per core, with prefetchers and the path of their misses.

use super::below::Below;
use super::inclusion::Evictions;
use super::level::{Level, LevelShape, of_core};
use super::other_work::OtherWork;
use crate::config::{ConfigError, PrefetchConfig, RunConfig};
use crate::memory::cache::EMPTY;
use crate::memory::in_flight::{DelayedFill, Immediate, LimitedMshrs, NOT_IN_FLIGHT};
use crate::memory::prefetch::{Demand, Prefetcher};
use crate::memory::{Access, Cache, Change};
use crate::result::{L2Change, MemoryResult, MshrResult, PrefetchResult, Timeline};
use formats::layout::Layout;
use std::collections::HashSet;
use std::sync::Arc;

/// The parts of a configuration beside and below the L2.
pub struct MissPath {
    l2: LevelShape,
    below: Below,
    /// One per L2 cache; empty without prefetcher.
    prefetch: Vec<Prefetch>,
    /// One per L2 cache, if the number of MSHRs is limited.
    mshrs: Vec<LimitedMshrs>,
    /// Present if levels depend on each other's evictions.
    evictions: Option<Evictions>,
    /// True if a request has effects after its answer: prefetches or evictions to process, or changes to record.
    has_consequences: bool,
    /// Fetches per interval of time, if recorded.
    fetched_lines: Option<Vec<u32>>,
    /// Changes of the L2's content, if recorded.
    changes: Option<Changes>,
}

impl MissPath {
    /// Memory directly below the L2, which is only counted.
    pub fn memory_alone() -> Self {
        Self {
            l2: LevelShape::alone(),
            below: Below::memory_alone(0),
            prefetch: Vec::new(),
            mshrs: Vec::new(),
            evictions: None,
            has_consequences: false,
            fetched_lines: None,
            changes: None,
        }
    }

    /// Empty levels below the L2. `layout` gives the location of textures, if lines belong to textures.
    ///
    /// # Errors
    /// An impossible geometry.
    pub fn build(config: &RunConfig, layout: Option<&Arc<Layout>>) -> Result<Self, ConfigError> {
        let caches = 0..config.level.l2.caches(config.cores);
        let mshrs = config.tmu.l2_mshrs;
        let limited = caches.clone().filter(|_| mshrs > 0);
        let prefetchers = caches.filter_map(|_| config.prefetch.as_ref());
        let l2 = LevelShape::all(config).nth(1);
        Ok(Self {
            l2: l2.unwrap_or(LevelShape::alone()),
            below: Below::build(config)?,
            prefetch: prefetchers
                .map(|prefetch| Prefetch::new(prefetch, config.line_bytes, layout))
                .collect(),
            mshrs: limited.map(|_| LimitedMshrs::new(mshrs)).collect(),
            evictions: Evictions::build(config),
            has_consequences: config.prefetch.is_some()
                || config.level.depend_on_evictions()
                || config.records_l2(),
            fetched_lines: config.timeline.then(Vec::new),
            changes: config.records_l2().then(Changes::new),
        })
    }

    /// True if evictions of other levels invalidate L1 lines.
    pub fn invalidates(&self) -> bool {
        self.evictions.is_some()
    }

    /// Arrival of a line that the L2 requests at `now`.
    #[inline(always)]
    fn fetch<D: DelayedFill>(&mut self, core: usize, line: u32, now: u64) -> u64 {
        if !D::HAS_LATENCIES {
            self.below.read(core, line, None);
            return now;
        }
        if !self.mshrs.is_empty() {
            return self.fetch_by_mshr(core, line, now);
        }
        self.read(core, line, now)
    }

    #[inline(never)]
    fn fetch_by_mshr(&mut self, core: usize, line: u32, now: u64) -> u64 {
        let start = of_core(&mut self.mshrs, core).start(now);
        let arrival = self.read(core, line, start);
        of_core(&mut self.mshrs, core).enter(arrival);
        arrival
    }

    /// True if a fetch would wait for an MSHR.
    fn is_busy(&mut self, core: usize, now: u64) -> bool {
        !self.mshrs.is_empty() && of_core(&mut self.mshrs, core).are_in_use(now)
    }

    /// Arrival of a line that is read from below at `now`.
    #[inline(always)]
    fn read(&mut self, core: usize, line: u32, now: u64) -> u64 {
        if let Some(fetched_lines) = &mut self.fetched_lines {
            let interval = (now / Timeline::INTERVAL_CYCLES) as usize;
            if fetched_lines.len() <= interval {
                fetched_lines.resize(interval + 1, 0);
            }
            fetched_lines[interval] += 1;
        }
        self.below.read(core, line, Some(now))
    }
}

/// The changes of finished frames, those after them, and those of one cache since the last request.
struct Changes {
    frames: Vec<Vec<L2Change>>,
    all: Vec<L2Change>,
    new: Vec<Change>,
    /// Further changes to record. Frames after the one in which they run out have none, which limits memory.
    left: usize,
}

impl Changes {
    /// 256 MiB of them.
    const MOST: usize = (256 << 20) / size_of::<L2Change>();

    fn new() -> Self {
        Self {
            frames: Vec::new(),
            all: Vec::new(),
            new: Vec::new(),
            left: Self::MOST,
        }
    }
}

/// A prefetcher and the state of its lines.
struct Prefetch {
    prefetcher: Box<dyn Prefetcher>,
    /// Prefetched lines without a demand request so far, resident or not.
    unused: HashSet<u32>,
    /// Lines to prefetch after the last request.
    wanted: Vec<u32>,
    counts: PrefetchResult,
}

impl Prefetch {
    fn new(config: &PrefetchConfig, line_bytes: u32, layout: Option<&Arc<Layout>>) -> Self {
        Self {
            prefetcher: config.build(line_bytes, layout.cloned()),
            unused: HashSet::new(),
            wanted: Vec::new(),
            counts: PrefetchResult::default(),
        }
    }

    /// Counts a demand request and collects the lines to prefetch.
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

/// The L2's answer to a request of an L1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The line is resident.
    Hit,
    /// The line is in flight and arrives at this cycle.
    InFlight(u64),
    /// The line is fetched and arrives at this cycle.
    Miss(u64),
}

/// The L2 and everything beside and below it.
pub struct SecondLevel<C> {
    level: Level<C>,
    path: MissPath,
}

impl<C> SecondLevel<C> {
    /// Empty caches above the path of their misses.
    pub fn new(caches: Vec<C>, path: MissPath) -> Self {
        let shape = path.l2;
        Self {
            level: Level { shape, caches },
            path,
        }
    }

    /// Delays DRAM requests from `cycle` on by the time that requests without a time have taken.
    pub fn catch_up(&mut self, cycle: u64) {
        self.path.below.catch_up(cycle);
    }

    /// Accesses memory below the L2 for a client other than the texture units, while no core works.
    /// Returns the bytes that lower levels serve.
    pub fn idle_client_access(&mut self, access: &Access) -> u64 {
        self.path.below.client_access(0, access, None)
    }

    /// The cache that a core uses.
    #[inline(always)]
    pub fn cache(&mut self, core: usize) -> &mut C {
        self.level.cache(core)
    }

    /// Serves all requests and returns the counts beside and below the L2.
    pub fn result(&self) -> MemoryResult {
        let path = &self.path;
        let (lower_levels, dram) = path.below.result();
        let prefetch = path.prefetch.iter().map(|prefetch| prefetch.counts);
        let mshrs = path.mshrs.iter().map(|mshrs| mshrs.counts);
        MemoryResult {
            prefetch: prefetch.reduce(PrefetchResult::plus),
            l2_mshrs: mshrs.reduce(MshrResult::plus),
            invalidated_lines: (path.evictions.as_ref())
                .map(|evictions| evictions.invalidated_lines),
            lower_levels,
            dram,
        }
    }

    /// Fetches per interval of time; empty if not recorded.
    pub fn fetched_lines(&self) -> &[u32] {
        self.path.fetched_lines.as_deref().unwrap_or_default()
    }

    /// Changes of the L2's content by frame; empty if not recorded.
    pub fn changes(&self) -> &[Vec<L2Change>] {
        self.path.changes.as_ref().map_or(&[], |of| &of.frames)
    }

    /// Maximum number of lines of the next work item to prefetch when an item starts.
    pub fn lines_of_next_item(&self) -> usize {
        let prefetch = self.path.prefetch.first();
        prefetch.map_or(0, |prefetch| prefetch.prefetcher.lines_of_next_item())
    }

    /// Removes lines evicted by inclusive levels from the L1 caches. `remove` removes a line from
    /// all of them and returns how many held it.
    #[inline(always)]
    pub fn invalidate_l1(&mut self, remove: impl FnMut(u32) -> u64) {
        if let Some(evictions) = &mut self.path.evictions
            && evictions.are_pending()
        {
            evictions.invalidate_l1(remove);
        }
    }
}

impl<C: Cache> SecondLevel<Immediate<C>> {
    /// Looks up a line for a core and fills it on a miss. Returns true for a hit.
    #[inline(always)]
    pub fn access(&mut self, core: usize, line: u32) -> bool {
        let hit = self.level.cache(core).0.access(line);
        if !hit {
            self.path.below.read(core, line, None);
        }
        if self.path.has_consequences {
            let answer = if hit { Answer::Hit } else { Answer::Miss(0) };
            self.prefetch(core, line, 0, answer);
            self.follow_evictions(0);
        }
        hit
    }
}

impl<D: DelayedFill> SecondLevel<D> {
    /// Answers a core's request and fetches a missing line.
    #[inline(always)]
    pub fn request(&mut self, core: usize, line: u32, now: u64) -> Answer {
        let cache = self.level.cache(core);
        let answer = match cache.look_up(line, now) {
            0 => Answer::Hit,
            NOT_IN_FLIGHT => {
                let arrival = self.path.fetch::<D>(core, line, now);
                cache.enter(line, now, arrival);
                Answer::Miss(arrival)
            }
            arrival => Answer::InFlight(arrival),
        };
        if self.path.has_consequences {
            self.prefetch(core, line, now, answer);
            self.follow_evictions(now);
            self.record(now);
        }
        answer
    }

    /// Records what has changed in the L2 up to the request at `now`.
    #[inline(never)]
    fn record(&mut self, now: u64) {
        let Some(Changes { all, new, left, .. }) = &mut self.path.changes else {
            return;
        };
        for cache in &mut self.level.caches {
            cache.take_changes(new);
            if *left == 0 {
                new.clear();
            }
            all.extend(new.drain(..).map(|(line, is_there)| L2Change {
                cycle: now,
                line,
                is_there,
            }));
        }
    }

    /// Ends a frame: lines that have arrived by `now` enter the L2, if its changes are recorded.
    pub fn end_frame(&mut self, now: u64) {
        if self.path.changes.is_some() {
            for cache in &mut self.level.caches {
                cache.arrival(EMPTY, now);
            }
            self.record(now);
        }
        if let Some(changes) = &mut self.path.changes
            && changes.left > 0
        {
            changes.left = changes.left.saturating_sub(changes.all.len());
            changes.frames.push(std::mem::take(&mut changes.all));
        }
    }

    #[inline(never)]
    fn follow_evictions(&mut self, now: u64) {
        if let Some(evictions) = &mut self.path.evictions {
            let caches = &mut self.level.caches;
            for cache in caches.iter_mut() {
                cache.take_evicted(&mut evictions.evicted);
            }
            evictions.follow(&mut self.path.below, |line| {
                let removed = caches.iter_mut().map(|cache| cache.remove(line, now));
                removed.map(u64::from).sum()
            });
        }
    }

    #[inline(never)]
    fn prefetch(&mut self, core: usize, line: u32, now: u64, answer: Answer) {
        if !self.path.prefetch.is_empty() {
            of_core(&mut self.path.prefetch, core).observe(line, answer);
            self.fetch_wanted(core, now);
        }
    }

    /// Accesses memory for a client other than the texture units. Returns the bytes that caches serve.
    pub fn client_access(&mut self, core: usize, access: &Access, now: u64) -> u64 {
        if access.write || !self.level.shape.is_for_all_clients {
            let now = D::HAS_LATENCIES.then_some(now);
            return self.path.below.client_access(core, access, now);
        }
        let line_bytes = u64::from(self.level.shape.line_bytes);
        let last = access.address + access.bytes - 1;
        let lines = access.address / line_bytes..=last / line_bytes;
        let hits = lines.filter(|&line| self.request(core, line as u32, now) == Answer::Hit);
        (hits.count() as u64 * line_bytes).min(access.bytes)
    }

    /// Prefetches lines of the next work item when an item starts.
    pub fn prefetch_item(&mut self, core: usize, lines: &[u32], now: u64) {
        if !self.path.prefetch.is_empty() {
            let wanted = &mut of_core(&mut self.path.prefetch, core).wanted;
            wanted.clear();
            wanted.extend_from_slice(lines);
            self.fetch_wanted(core, now);
            self.follow_evictions(now);
            self.record(now);
        }
    }

    fn fetch_wanted(&mut self, core: usize, now: u64) {
        let wanted = std::mem::take(&mut of_core(&mut self.path.prefetch, core).wanted);
        for &line in &wanted {
            let cache = self.level.cache(core);
            if line != EMPTY && !cache.holds(line, now) {
                if D::HAS_LATENCIES && self.path.is_busy(core, now) {
                    of_core(&mut self.path.prefetch, core).counts.dropped_lines += 1;
                    continue;
                }
                cache.enter(line, now, self.path.fetch::<D>(core, line, now));
                of_core(&mut self.path.prefetch, core).fetched(line);
            }
        }
        of_core(&mut self.path.prefetch, core).wanted = wanted;
    }

    /// Empties the levels and drops the lines in flight.
    pub fn clear(&mut self, now: u64) {
        self.level.caches.iter_mut().for_each(D::clear);
        self.path.below.clear();
        self.path.mshrs.iter_mut().for_each(LimitedMshrs::clear);
        for prefetch in &mut self.path.prefetch {
            prefetch.unused.clear();
        }
        self.record(now);
    }

    /// Other work fills part of each cache. Its lines arrive at `now`.
    pub fn lose(&mut self, other: OtherWork, now: u64) {
        for cache in &mut self.level.caches {
            for line in other.l2_lines() {
                let is_there = match D::HAS_LATENCIES {
                    true => cache.holds(line, now),
                    false => cache.look_up(line, now) == 0,
                };
                if !is_there {
                    cache.enter(line, now, now);
                }
            }
        }
        // Evictions of the L2 enter an exclusive level before other work fills that level.
        self.follow_evictions(now);
        self.path.below.lose(other);
        self.follow_evictions(now);
        self.record(now);
    }
}

#[cfg(test)]
mod tests;
