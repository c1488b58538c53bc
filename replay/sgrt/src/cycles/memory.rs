//! Node and triangle caches of the units, the shared L2, and their MSHRs.
//!
//! Fills take place when lines arrive. Further look-ups of a line in flight merge with its fetch. A miss needs a free
//! MSHR of its L1, and one of the L2 if it misses there too; otherwise it waits in the queue of the first level without
//! one, and nothing is fetched. A prefetch takes the same way, but is dropped if it finds no MSHR.

use super::counts::{Counts, LineCounts};
use super::machine::{CacheSize, Machine};
use formats::view::Eye;
use sim::memory::{AnyCache, Cache, Delay, DelayedFill, LimitedMshrs, NOT_IN_FLIGHT, SimpleMemory};
use std::collections::{HashMap, HashSet, VecDeque};

/// A cache with its lines in flight, its MSHRs, and the rays that wait for one.
pub struct Level {
    cache: <Box<dyn Cache> as Delay>::Delayed,
    mshrs: LimitedMshrs,
    /// Unit and slot of each waiting ray, in order of arrival.
    waiting: VecDeque<(usize, usize)>,
    /// True if a retry is scheduled.
    scheduled: bool,
    /// Prefetched lines that no ray has requested. Evicted ones are removed when they are fetched again.
    unused: HashSet<u32>,
    /// The eye that fetched each line last; absent without a prefetcher, because it costs time at each miss.
    fetched_by: Option<HashMap<u32, Eye>>,
}

impl Level {
    fn new(size: CacheSize, usual_cycles: u64, has_prefetcher: bool) -> Self {
        let cache = AnyCache::lru(size.sets, size.ways).into_box();
        Self {
            cache: cache.delayed(usual_cycles),
            mshrs: LimitedMshrs::new(size.mshrs),
            waiting: VecDeque::new(),
            scheduled: false,
            unused: HashSet::new(),
            fetched_by: has_prefetcher.then(HashMap::new),
        }
    }

    /// True if the other eye fetched the line last.
    fn is_of_other(&self, line: u32, eye: Eye) -> bool {
        let eyes = self.fetched_by.as_ref();
        eyes.and_then(|eyes| eyes.get(&line))
            .is_some_and(|by| *by != eye)
    }

    /// Notes the eye that fetches a line.
    fn note(&mut self, line: u32, eye: Eye) {
        if let Some(eyes) = &mut self.fetched_by {
            eyes.insert(line, eye);
        }
    }

    /// 1 if a line is prefetched and no ray has requested it before; 0 otherwise.
    fn take_unused(&mut self, line: u32) -> u64 {
        u64::from(!self.unused.is_empty() && self.unused.remove(&line))
    }

    /// Appends a ray to the queue.
    pub fn park(&mut self, unit: usize, slot: usize) {
        self.waiting.push_back((unit, slot));
    }

    /// Takes the first waiting ray if an MSHR is free.
    pub fn next_waiting(&mut self, now: u64) -> Option<(usize, usize)> {
        if self.waiting.is_empty() || self.mshrs.are_in_use(now) {
            return None;
        }
        self.waiting.pop_front()
    }

    /// Marks a scheduled retry as started.
    pub fn start_retry(&mut self) {
        self.scheduled = false;
    }

    /// The cycle of a retry to be scheduled, if rays wait and none is scheduled yet.
    pub fn schedule_retry(&mut self) -> Option<u64> {
        if self.waiting.is_empty() || self.scheduled {
            return None;
        }
        self.scheduled = true;
        self.mshrs.next_free()
    }
}

/// The level without a free MSHR.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Full {
    /// The unit's cache.
    L1,
    /// The shared cache.
    L2,
}

/// The result of a look-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// The line is resident.
    Hit,
    /// The line arrives later.
    Later {
        /// Cycle of arrival.
        arrival: u64,
        /// True if this look-up fetches it into the L1.
        fetches_l1: bool,
        /// True if this look-up fetches it into the L2.
        fetches_l2: bool,
    },
    /// No free MSHR.
    Full(Full),
}

/// All caches.
pub struct CacheMemory {
    /// Per unit, the node cache and then the triangle cache.
    pub l1: Vec<Level>,
    /// The shared cache.
    pub l2: Level,
    /// The DRAM channel.
    pub dram: SimpleMemory,
    l2_latency: u64,
}

impl CacheMemory {
    /// Empty caches and an idle channel.
    pub fn new(machine: &Machine) -> Self {
        let usual = machine.dram_latency + machine.l2_latency;
        let of_unit = |_| {
            machine
                .l1
                .map(|size| Level::new(size, usual, machine.has_prefetcher))
        };
        Self {
            l1: (0..machine.units).flat_map(of_unit).collect(),
            l2: Level::new(machine.l2, usual, machine.has_prefetcher),
            dram: SimpleMemory::new(machine.dram_latency, machine.dram_ticks_per_line),
            l2_latency: machine.l2_latency,
        }
    }

    /// Looks up a line in an L1 (node cache: kind 0, triangle cache: kind 1) and fetches it if necessary.
    pub fn look_up(
        &mut self,
        (unit, kind): (usize, usize),
        line: u32,
        eye: Eye,
        now: u64,
        counts: &mut Counts,
    ) -> Found {
        let level = &mut self.l1[2 * unit + kind];
        let of_l1: &mut LineCounts = match kind {
            0 => &mut counts.node_l1,
            _ => &mut counts.triangle_l1,
        };
        match level.cache.look_up(line, now) {
            0 => {
                of_l1.hits += 1;
                counts.prefetch.useful += level.take_unused(line);
                return Found::Hit;
            }
            NOT_IN_FLIGHT => {}
            arrival => {
                of_l1.merged += 1;
                counts.prefetch.late += level.take_unused(line);
                return Found::Later {
                    arrival,
                    fetches_l1: false,
                    fetches_l2: false,
                };
            }
        }
        if level.mshrs.are_in_use(now) {
            counts.l1_mshr_waits += 1;
            return Found::Full(Full::L1);
        }
        let Some((arrival, fetches_l2)) = self.fetch(line, eye, now, counts) else {
            counts.l2_mshr_waits += 1;
            return Found::Full(Full::L2);
        };
        let level = &mut self.l1[2 * unit + kind];
        counts.prefetch.useless += level.take_unused(line);
        match kind {
            0 => counts.node_l1.misses += 1,
            _ => counts.triangle_l1.misses += 1,
        }
        self.fill((unit, kind), line, eye, now, arrival);
        Found::Later {
            arrival,
            fetches_l1: true,
            fetches_l2,
        }
    }

    /// Fetches a line ahead into an L1, unless it is there or in flight or finds no MSHR.
    pub fn prefetch(
        &mut self,
        (unit, kind): (usize, usize),
        line: u32,
        eye: Eye,
        now: u64,
        counts: &mut Counts,
    ) {
        counts.prefetch.requested += 1;
        let level = &mut self.l1[2 * unit + kind];
        if level.cache.holds(line, now) {
            counts.prefetch.held += 1;
            counts.prefetch.of_other_eye += u64::from(level.is_of_other(line, eye));
            return;
        }
        if level.mshrs.are_in_use(now) {
            counts.prefetch.dropped += 1;
            return;
        }
        let is_of_other = self.l2.is_of_other(line, eye);
        let Some((arrival, fetches_l2)) = self.fetch(line, eye, now, counts) else {
            counts.prefetch.dropped += 1;
            return;
        };
        counts.prefetch.issued += 1;
        counts.prefetch.dram_lines += u64::from(fetches_l2);
        counts.prefetch.of_other_eye += u64::from(is_of_other && !fetches_l2);
        let was_unused = !self.l1[2 * unit + kind].unused.insert(line);
        counts.prefetch.useless += u64::from(was_unused);
        self.fill((unit, kind), line, eye, now, arrival);
    }

    /// Fills a line into an L1 at its arrival.
    fn fill(&mut self, (unit, kind): (usize, usize), line: u32, eye: Eye, now: u64, arrival: u64) {
        let level = &mut self.l1[2 * unit + kind];
        level.cache.enter(line, now, arrival);
        level.mshrs.enter(arrival);
        level.note(line, eye);
    }

    /// Prefetched lines that no ray requested, at the end.
    pub fn unused_prefetches(&self) -> u64 {
        self.l1.iter().map(|level| level.unused.len() as u64).sum()
    }

    /// Looks up a line in the L2 and fetches it if necessary. Returns its arrival at an L1, and whether it was fetched; `None`
    /// without a free MSHR.
    fn fetch(&mut self, line: u32, eye: Eye, now: u64, counts: &mut Counts) -> Option<(u64, bool)> {
        let (in_l2, fetches_l2) = match self.l2.cache.look_up(line, now) {
            0 => {
                counts.l2.hits += 1;
                (now, false)
            }
            NOT_IN_FLIGHT => {
                if self.l2.mshrs.are_in_use(now) {
                    return None;
                }
                counts.l2.misses += 1;
                counts.dram_lines += 1;
                let arrival = self.dram.read(now);
                self.l2.cache.enter(line, now, arrival);
                self.l2.mshrs.enter(arrival);
                self.l2.note(line, eye);
                (arrival, true)
            }
            arrival => {
                counts.l2.merged += 1;
                (arrival, false)
            }
        };
        Some((in_l2 + self.l2_latency, fetches_l2))
    }
}
