//! The path of L2 misses: further levels, if configured, then memory.

use super::level::{Level, LevelShape};
use super::other_work::OtherWork;
use crate::config::{ConfigError, Inclusion, RunConfig};
use crate::memory::cache::EMPTY;
use crate::memory::dram::{Dram, DramResult};
use crate::memory::in_flight::{Mshrs, NOT_IN_FLIGHT};
use crate::memory::{Access, AnyCache, Cache, SimpleMemory};
use crate::result::LowerLevelResult;
use std::ops::RangeInclusive;

/// The levels below the L2, and memory.
pub struct Below {
    levels: Vec<Level<Filling>>,
    /// Counts of each level.
    counts: Vec<LineCounts>,
    memory: SimpleMemory,
    dram: Option<Dram>,
    /// L2 lines that inclusive levels have evicted.
    invalidated: Vec<RangeInclusive<u32>>,
}

#[derive(Clone, Copy, Debug, Default)]
struct LineCounts {
    look_ups: u64,
    misses: u64,
    secondary_misses: u64,
}

/// A cache that allocates a missing line immediately (allocation on miss), and its lines in flight.
struct Filling {
    cache: Box<dyn Cache>,
    in_flight: Mshrs,
}

impl Below {
    /// Memory alone, which is only counted.
    pub fn memory_alone(latency_cycles: u64) -> Self {
        Self {
            levels: Vec::new(),
            counts: Vec::new(),
            memory: SimpleMemory::new(latency_cycles, 0),
            dram: None,
            invalidated: Vec::new(),
        }
    }

    /// Empty levels and closed rows. Each level has its own seed.
    ///
    /// # Errors
    /// An impossible geometry.
    pub fn build(config: &RunConfig) -> Result<Self, ConfigError> {
        let mut below = Self::memory_alone(config.memory_cycles.into());
        let mut line_bytes = config.line_bytes;
        let mut seed = config.seed;
        for (level, shape) in config.level.iter().zip(LevelShape::all(config)).skip(2) {
            line_bytes = shape.line_bytes;
            let mut filling = |_| {
                seed = seed.wrapping_sub(1);
                Ok(Filling {
                    cache: AnyCache::build(level, shape.name, line_bytes, seed)?.into_box(),
                    in_flight: Mshrs::new(),
                })
            };
            let caches = (0..level.caches(config.cores)).map(&mut filling);
            below.levels.push(Level {
                shape,
                caches: caches.collect::<Result<_, ConfigError>>()?,
            });
        }
        below.counts = vec![LineCounts::default(); below.levels.len()];
        below.dram = (config.dram.as_ref()).map(|dram| Dram::new(dram, line_bytes));
        Ok(below)
    }

    /// Reads a line for a core's L2 and returns its arrival cycle; without time it arrives at once. `now` never
    /// decreases.
    #[inline(always)]
    pub fn read(&mut self, core: usize, line: u32, now: Option<u64>) -> u64 {
        if self.levels.is_empty() && self.dram.is_none() {
            return now.map_or(0, |now| self.memory.read(now));
        }
        self.read_levels(core, line, now)
    }

    /// A level that holds the line sends it after `hit_cycles`, or when the line arrives there, whichever is later.
    #[inline(never)]
    fn read_levels(&mut self, core: usize, line: u32, now: Option<u64>) -> u64 {
        let missed = self.look_up(core, line);
        let arrival = match (self.levels.get_mut(missed), now) {
            (Some(level), Some(now)) => {
                let (arrival, is_merged) = level.arrival(core, line, now);
                self.counts[missed].secondary_misses += u64::from(is_merged);
                arrival
            }
            (Some(_), None) => 0,
            (None, _) => {
                let line = self.line_of_memory(line);
                if let Some(dram) = &mut self.dram {
                    dram.read(line, now);
                }
                now.map_or(0, |now| self.memory.read(now))
            }
        };
        self.fill(core, missed, line);
        if let Some(now) = now {
            for level in &mut self.levels[..missed] {
                level.enter(core, line, now, arrival);
            }
        }
        arrival
    }

    /// Accesses memory for a client other than the texture units. Returns the bytes served by
    /// levels for all clients. Writes pass through.
    pub fn client_access(&mut self, core: usize, access: &Access, now: Option<u64>) -> u64 {
        let mut levels = self.levels.iter();
        let Some(first) = levels.position(|level| level.shape.is_for_all_clients) else {
            self.memory(access.address, access.bytes, access.write, now);
            return 0;
        };
        if access.write {
            self.memory(access.address, access.bytes, true, now);
            return 0;
        }
        let line_bytes = u64::from(self.levels[first].shape.line_bytes);
        let lines =
            access.address / line_bytes..(access.address + access.bytes).div_ceil(line_bytes);
        let mut served = 0;
        for line in lines {
            let l2_line = (line << self.levels[first].shape.shift) as u32;
            let mut levels = self.levels.iter_mut();
            let hit = levels
                .position(|level| level.shape.is_for_all_clients && level.holds(core, l2_line));
            served += if hit.is_some() { line_bytes } else { 0 };
            for index in 0..hit.unwrap_or(self.levels.len()) {
                let level = &self.levels[index].shape;
                if level.is_for_all_clients && level.inclusion != Inclusion::Exclusive {
                    self.fill_level(core, index, l2_line);
                }
            }
            if hit.is_none() {
                let mut shapes = self.levels.iter().map(|level| level.shape);
                let last = shapes.rfind(|level| level.is_for_all_clients);
                let bytes = last.map_or(line_bytes, |last| u64::from(last.line_bytes));
                self.memory(line * line_bytes / bytes * bytes, bytes, false, now);
            }
        }
        served.min(access.bytes)
    }

    fn memory(&mut self, address: u64, bytes: u64, write: bool, now: Option<u64>) {
        if let Some(dram) = &mut self.dram {
            dram.request(address, bytes, write, now);
        }
    }

    /// See [`Dram::catch_up`].
    pub fn catch_up(&mut self, cycle: u64) {
        if let Some(dram) = &mut self.dram {
            dram.catch_up(cycle);
        }
    }

    /// The first level that holds a line, or the number of levels. An exclusive level gives up the line.
    fn look_up(&mut self, core: usize, line: u32) -> usize {
        for (index, level) in self.levels.iter_mut().enumerate() {
            self.counts[index].look_ups += 1;
            if level.look_up(core, line) {
                return index;
            }
            self.counts[index].misses += 1;
        }
        self.levels.len()
    }

    /// Fills a line into the first `missed` levels. Exclusive levels only receive evictions of the level above.
    fn fill(&mut self, core: usize, missed: usize, line: u32) {
        for index in 0..missed {
            if self.levels[index].shape.inclusion != Inclusion::Exclusive {
                self.fill_level(core, index, line);
            }
        }
    }

    fn fill_level(&mut self, core: usize, index: usize, line: u32) {
        let level = &mut self.levels[index];
        let LevelShape {
            shift, inclusion, ..
        } = level.shape;
        let evicted = level.cache(core).cache.fill(line >> shift);
        if evicted == EMPTY {
            return;
        }
        let first = evicted << shift;
        let lines = first..=first | ((1 << shift) - 1);
        if inclusion == Inclusion::Inclusive {
            for above in &mut self.levels[..index] {
                for line in lines.clone().step_by(1 << above.shape.shift) {
                    for of in &mut above.caches {
                        of.cache.remove(line >> above.shape.shift);
                    }
                }
            }
            self.invalidated.push(lines);
        }
        self.take_evicted(index + 1, first);
    }

    /// Passes a line evicted by the level above to an exclusive level.
    fn take_evicted(&mut self, index: usize, line: u32) {
        if let Some(level) = self.levels.get(index)
            && level.shape.inclusion == Inclusion::Exclusive
            && !level.caches[0].cache.contains(line >> level.shape.shift)
        {
            self.fill_level(0, index, line);
        }
    }

    /// Passes a line evicted by the L2 to an exclusive L3.
    pub fn take_evicted_by_l2(&mut self, line: u32) {
        self.take_evicted(0, line);
    }

    /// L2 lines evicted by an inclusive level since the last call.
    pub fn take_invalidated(&mut self) -> Vec<RangeInclusive<u32>> {
        std::mem::take(&mut self.invalidated)
    }

    fn line_of_memory(&self, line: u32) -> u32 {
        line >> self.levels.last().map_or(0, |level| level.shape.shift)
    }

    /// Empties the levels. DRAM rows stay open.
    pub fn clear(&mut self) {
        for level in &mut self.levels {
            for of in &mut level.caches {
                of.cache.clear();
                of.in_flight.clear();
            }
        }
    }

    /// Other work fills part of each cache, without being counted.
    pub fn lose(&mut self, other: OtherWork) {
        for index in 0..self.levels.len() {
            let shape = self.levels[index].shape;
            for core in 0..self.levels[index].caches.len() {
                for line in other.lines(shape.lines, shape.shift) {
                    if !self.levels[index].cache(core).cache.contains(line) {
                        self.fill_level(core, index, line << shape.shift);
                    }
                }
            }
        }
    }

    /// Serves all requests and returns the counts of the levels (L3 first) and of the DRAM.
    pub fn result(&self) -> (Vec<LowerLevelResult>, Option<DramResult>) {
        let levels = self.levels.iter().zip(&self.counts);
        let level = |(level, counts): (&Level<Filling>, &LineCounts)| LowerLevelResult {
            name: level.shape.name.to_owned(),
            line_bytes: level.shape.line_bytes,
            line_miss_rate: counts.misses as f64 / counts.look_ups.max(1) as f64,
            line_lookups: counts.look_ups,
            line_misses: counts.misses,
            secondary_misses: counts.secondary_misses,
        };
        (
            levels.map(level).collect(),
            self.dram.as_ref().map(Dram::result),
        )
    }
}

impl Level<Filling> {
    /// Looks up the line that contains an L2 line for another client. Returns true for a hit.
    fn holds(&mut self, core: usize, line: u32) -> bool {
        let line = line >> self.shape.shift;
        self.cache(core).cache.lookup(line)
    }

    /// Looks up the line that contains an L2 line. Returns true for a hit.
    fn look_up(&mut self, core: usize, line: u32) -> bool {
        match self.shape.inclusion {
            Inclusion::Exclusive => {
                let line = line >> self.shape.shift;
                self.cache(core).cache.remove(line)
            }
            _ => self.holds(core, line),
        }
    }

    /// When a line that the level holds, or has in flight, arrives at the L2, and whether it is in flight.
    fn arrival(&mut self, core: usize, line: u32, now: u64) -> (u64, bool) {
        let sent = now + self.shape.hit_cycles;
        let line = line >> self.shape.shift;
        match self.cache(core).in_flight.arrival(line, now) {
            NOT_IN_FLIGHT => (sent, false),
            arrival => (arrival.max(sent), true),
        }
    }

    /// Records the arrival of a missing line. A line that was evicted in flight and is requested
    /// again arrives with its first fetch.
    fn enter(&mut self, core: usize, line: u32, now: u64, arrival: u64) {
        let line = line >> self.shape.shift;
        let in_flight = &mut self.cache(core).in_flight;
        if arrival > now && in_flight.arrival(line, now) == NOT_IN_FLIGHT {
            in_flight.enter(line, now, arrival);
        }
    }
}

#[cfg(test)]
mod tests;
