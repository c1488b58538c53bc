//! The path of L2 misses: further levels, if configured, then memory.

use super::caches::of_core;
use super::other_work::OtherWork;
use crate::config::{ConfigError, Inclusion, RunConfig};
use crate::memory::cache::EMPTY;
use crate::memory::dram::{Dram, DramResult};
use crate::memory::in_flight::{Mshrs, NOT_IN_FLIGHT};
use crate::memory::{Access, AnyCache, Cache};
use crate::result::LowerLevelResult;
use std::ops::RangeInclusive;

/// The levels below the L2, and memory.
pub struct Below {
    levels: Vec<LowerLevel>,
    dram: Option<Dram>,
    memory_cycles: u64,
    /// L2 lines that inclusive levels have evicted.
    invalidated: Vec<RangeInclusive<u32>>,
}

/// A level. A missing line is allocated immediately (allocation on miss).
struct LowerLevel {
    name: &'static str,
    /// One cache, or one per core.
    caches: Vec<Filling>,
    /// Lines of each cache.
    lines: u64,
    line_bytes: u32,
    /// log2 of its line size over the L2's line size.
    shift: u32,
    inclusion: Inclusion,
    is_for_all_clients: bool,
    hit_cycles: u64,
    look_ups: u64,
    misses: u64,
    secondary_misses: u64,
}

/// A cache and its lines in flight.
struct Filling {
    cache: Box<dyn Cache>,
    in_flight: Mshrs,
}

impl Below {
    /// Empty levels and closed rows, or none if L2 misses are only counted. Each level has its own seed.
    ///
    /// # Errors
    /// An impossible geometry.
    pub fn build(config: &RunConfig) -> Result<Option<Self>, ConfigError> {
        if !config.simulates_below_l2() {
            return Ok(None);
        }
        let mut levels = Vec::new();
        let mut line_bytes = config.line_bytes;
        let mut seed = config.seed;
        for (name, level, own_line_bytes) in config.level.named(config.line_bytes).skip(2) {
            line_bytes = own_line_bytes;
            let mut filling = |_| {
                seed = seed.wrapping_sub(1);
                Ok(Filling {
                    cache: AnyCache::build(level, name, line_bytes, seed)?.into_box(),
                    in_flight: Mshrs::new(),
                })
            };
            let caches = (0..level.caches(config.cores)).map(&mut filling);
            levels.push(LowerLevel {
                name,
                caches: caches.collect::<Result<_, ConfigError>>()?,
                lines: level.size_bytes / u64::from(line_bytes),
                line_bytes,
                shift: line_bytes.ilog2() - config.line_bytes.ilog2(),
                inclusion: level.inclusion,
                is_for_all_clients: !level.clients.is_textures(),
                hit_cycles: level.hit_cycles.into(),
                look_ups: 0,
                misses: 0,
                secondary_misses: 0,
            });
        }
        let dram = config.dram.as_ref();
        Ok(Some(Self {
            levels,
            dram: dram.map(|dram| Dram::new(dram, line_bytes)),
            memory_cycles: config.memory_cycles.into(),
            invalidated: Vec::new(),
        }))
    }

    /// Reads a line for a core's L2 and returns its arrival cycle; without time it arrives at once. `now` never
    /// decreases.
    ///
    /// A level that holds the line sends it after `hit_cycles`, or when the line arrives there, whichever is later.
    pub fn read(&mut self, core: usize, line: u32, now: Option<u64>) -> u64 {
        let missed = self.look_up(core, line);
        let arrival = match (self.levels.get_mut(missed), now) {
            (Some(level), Some(now)) => level.arrival(core, line, now),
            (Some(_), None) => 0,
            (None, _) => {
                let line = self.line_of_memory(line);
                if let Some(dram) = &mut self.dram {
                    dram.read(line, now);
                }
                now.map_or(0, |now| now + self.memory_cycles)
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
        let Some(first) = self
            .levels
            .iter()
            .position(|level| level.is_for_all_clients)
        else {
            self.memory(access.address, access.bytes, access.write, now);
            return 0;
        };
        if access.write {
            self.memory(access.address, access.bytes, true, now);
            return 0;
        }
        let line_bytes = u64::from(self.levels[first].line_bytes);
        let lines =
            access.address / line_bytes..(access.address + access.bytes).div_ceil(line_bytes);
        let mut served = 0;
        for line in lines {
            let l2_line = (line << self.levels[first].shift) as u32;
            let mut levels = self.levels.iter_mut();
            let hit =
                levels.position(|level| level.is_for_all_clients && level.holds(core, l2_line));
            served += if hit.is_some() { line_bytes } else { 0 };
            for index in 0..hit.unwrap_or(self.levels.len()) {
                let level = &self.levels[index];
                if level.is_for_all_clients && level.inclusion != Inclusion::Exclusive {
                    self.fill_level(core, index, l2_line);
                }
            }
            if hit.is_none() {
                let last = self.levels.iter().rfind(|level| level.is_for_all_clients);
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
        let mut levels = self.levels.iter_mut();
        let hit = levels.position(|level| level.look_up(core, line));
        hit.unwrap_or(self.levels.len())
    }

    /// Fills a line into the first `missed` levels. Exclusive levels only receive evictions of the level above.
    fn fill(&mut self, core: usize, missed: usize, line: u32) {
        for index in 0..missed {
            if self.levels[index].inclusion != Inclusion::Exclusive {
                self.fill_level(core, index, line);
            }
        }
    }

    fn fill_level(&mut self, core: usize, index: usize, line: u32) {
        let level = &mut self.levels[index];
        let (shift, inclusion) = (level.shift, level.inclusion);
        let evicted = level.cache(core).fill(line >> shift);
        if evicted == EMPTY {
            return;
        }
        let first = evicted << shift;
        let lines = first..=first | ((1 << shift) - 1);
        if inclusion == Inclusion::Inclusive {
            for above in &mut self.levels[..index] {
                for line in lines.clone().step_by(1 << above.shift) {
                    for of in &mut above.caches {
                        of.cache.remove(line >> above.shift);
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
            && level.inclusion == Inclusion::Exclusive
            && !level.caches[0].cache.contains(line >> level.shift)
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
        line >> self.levels.last().map_or(0, |level| level.shift)
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
            let (lines, shift) = (self.levels[index].lines, self.levels[index].shift);
            for core in 0..self.levels[index].caches.len() {
                for line in other.lines(lines, shift) {
                    if !self.levels[index].cache(core).contains(line) {
                        self.fill_level(core, index, line << shift);
                    }
                }
            }
        }
    }

    /// Serves all requests and returns the counts of the levels (L3 first) and of the DRAM.
    pub fn result(&self) -> (Vec<LowerLevelResult>, Option<DramResult>) {
        let level = |level: &LowerLevel| LowerLevelResult {
            name: level.name.to_owned(),
            line_bytes: level.line_bytes,
            line_miss_rate: level.misses as f64 / level.look_ups.max(1) as f64,
            line_lookups: level.look_ups,
            line_misses: level.misses,
            secondary_misses: level.secondary_misses,
        };
        let levels = self.levels.iter().map(level).collect();
        (levels, self.dram.as_ref().map(Dram::result))
    }
}

impl LowerLevel {
    /// The cache that a core uses.
    fn cache(&mut self, core: usize) -> &mut Box<dyn Cache> {
        &mut of_core(&mut self.caches, core).cache
    }

    /// Looks up the line that contains an L2 line for another client, without counting. Returns true for a hit.
    fn holds(&mut self, core: usize, line: u32) -> bool {
        let line = line >> self.shift;
        self.cache(core).lookup(line)
    }

    /// Looks up the line that contains an L2 line. Returns true for a hit.
    fn look_up(&mut self, core: usize, line: u32) -> bool {
        let line = line >> self.shift;
        self.look_ups += 1;
        let hit = match self.inclusion {
            Inclusion::Exclusive => self.cache(core).remove(line),
            _ => self.cache(core).lookup(line),
        };
        self.misses += u64::from(!hit);
        hit
    }

    /// When a line that the level holds, or has in flight, arrives at the L2.
    fn arrival(&mut self, core: usize, line: u32, now: u64) -> u64 {
        let sent = now + self.hit_cycles;
        let in_flight = &of_core(&mut self.caches, core).in_flight;
        match in_flight.arrival(line >> self.shift, now) {
            NOT_IN_FLIGHT => sent,
            arrival => {
                self.secondary_misses += 1;
                arrival.max(sent)
            }
        }
    }

    /// Records the arrival of a missing line. A line that was evicted in flight and is requested
    /// again arrives with its first fetch.
    fn enter(&mut self, core: usize, line: u32, now: u64, arrival: u64) {
        let line = line >> self.shift;
        let in_flight = &mut of_core(&mut self.caches, core).in_flight;
        if arrival > now && in_flight.arrival(line, now) == NOT_IN_FLIGHT {
            in_flight.enter(line, now, arrival);
        }
    }
}

#[cfg(test)]
mod tests;
