//! Node and triangle caches of the units, the shared L2, and their MSHRs.
//!
//! Fills take place when lines arrive. Further look-ups of a line in flight merge with its fetch. A miss needs a free
//! MSHR of its L1, and one of the L2 if it misses there too; otherwise it waits in the queue of the first level without
//! one, and nothing is fetched.

use super::counts::{Counts, LineCounts};
use super::machine::{CacheSize, Machine};
use sim::memory::{AnyCache, Cache, Delay, DelayedFill, LimitedMshrs, NOT_IN_FLIGHT, SimpleMemory};
use std::collections::VecDeque;

/// A cache with its lines in flight, its MSHRs, and the rays that wait for one.
pub struct Level {
    cache: <Box<dyn Cache> as Delay>::Delayed,
    mshrs: LimitedMshrs,
    /// Unit and slot of each waiting ray, in order of arrival.
    waiting: VecDeque<(usize, usize)>,
    /// True if a retry is scheduled.
    scheduled: bool,
}

impl Level {
    fn new(size: CacheSize, usual_cycles: u64) -> Self {
        let cache = AnyCache::lru(size.sets, size.ways).into_box();
        Self {
            cache: cache.delayed(usual_cycles),
            mshrs: LimitedMshrs::new(size.mshrs),
            waiting: VecDeque::new(),
            scheduled: false,
        }
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
        let of_unit = |_| machine.l1.map(|size| Level::new(size, usual));
        Self {
            l1: (0..machine.units).flat_map(of_unit).collect(),
            l2: Level::new(machine.l2, usual),
            dram: SimpleMemory::new(machine.dram_latency, machine.dram_ticks_per_line),
            l2_latency: machine.l2_latency,
        }
    }

    /// Looks up a line in an L1 (node cache: kind 0, triangle cache: kind 1) and fetches it if necessary.
    pub fn look_up(
        &mut self,
        unit: usize,
        kind: usize,
        line: u32,
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
                return Found::Hit;
            }
            NOT_IN_FLIGHT => {}
            arrival => {
                of_l1.merged += 1;
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
        let (in_l2, fetches_l2) = match self.l2.cache.look_up(line, now) {
            0 => {
                counts.l2.hits += 1;
                (now, false)
            }
            NOT_IN_FLIGHT => {
                if self.l2.mshrs.are_in_use(now) {
                    counts.l2_mshr_waits += 1;
                    return Found::Full(Full::L2);
                }
                counts.l2.misses += 1;
                counts.dram_lines += 1;
                let arrival = self.dram.read(now);
                self.l2.cache.enter(line, now, arrival);
                self.l2.mshrs.enter(arrival);
                (arrival, true)
            }
            arrival => {
                counts.l2.merged += 1;
                (arrival, false)
            }
        };
        of_l1.misses += 1;
        let arrival = in_l2 + self.l2_latency;
        level.cache.enter(line, now, arrival);
        level.mshrs.enter(arrival);
        Found::Later {
            arrival,
            fetches_l1: true,
            fetches_l2,
        }
    }
}
