//! The event loop of the simulation: units, caches, DRAM and cores.

use super::batch::{Batch, BatchSource, Item};
use super::cores::Cores;
use super::counts::Counts;
use super::event::{SLOT, key, phase};
use super::machine::Machine;
use super::memory::CacheMemory;
use super::unit::Unit;
use sim::memory::Calendar;
use sim::sums::Unbalanced;
use std::collections::VecDeque;

/// Cycles that most events lie ahead at most; a queue for memory is rarely longer.
const DAYS: u64 = 2047;

/// The simulation of a frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Simulated {
    /// The batches, in order.
    pub batches: Vec<BatchTiming>,
    /// Cycles until the last ray has returned.
    pub unit_cycles: u64,
    /// Cycles until the last tile is shaded and transferred.
    pub frame_cycles: u64,
    /// Cycles in which the cores waited for the transfers of a tile.
    pub core_wait_cycles: u64,
    /// All counters.
    pub counts: Counts,
}

/// A batch in the simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BatchTiming {
    /// Cycles from the end of the previous batch, or from the cycle in which a tile buffer became free, to the return
    /// of the last ray.
    pub cycles: u64,
    /// The counters of this time.
    pub counts: Counts,
}

/// Reasons why a simulation fails.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SimulationError<E> {
    /// A batch that cannot be read.
    #[error("{0}")]
    Source(E),
    /// A defect of the model.
    #[error(transparent)]
    Unbalanced(Unbalanced),
}

/// Simulates all batches of a source.
///
/// # Errors
/// A batch that cannot be read, or a sum that the simulation did not conserve.
pub fn simulate<S: BatchSource>(
    machine: &Machine,
    source: &mut S,
) -> Result<Simulated, SimulationError<S::Error>> {
    let mut device = Device::new(machine);
    device.run(source).map_err(SimulationError::Source)?;
    let (rays, requests) = device.expected;
    device.counts.prefetch.useless += device.memory.unused_prefetches();
    device.out.counts.add(&device.counts);
    let counts = &device.out.counts;
    counts
        .check(rays, requests)
        .map_err(SimulationError::Unbalanced)?;
    device.out.core_wait_cycles = device.cores.wait_cycles;
    Ok(device.out)
}

/// A batch in a tile buffer.
pub(super) struct Loaded {
    pub batch: Batch,
    /// Rays that have not returned.
    remaining: u64,
    /// Cycle in which it was loaded.
    opened: u64,
}

/// The simulated machine in its current cycle.
pub(super) struct Device<'m> {
    pub machine: &'m Machine,
    pub units: Vec<Unit>,
    pub memory: CacheMemory,
    cores: Cores,
    /// Keys of [`super::event`] by cycle.
    pub calendar: Calendar<u64>,
    /// Batches in tile buffers, in order.
    pub loaded: VecDeque<Loaded>,
    /// Number of the first of these.
    pub first: u64,
    /// Emptied batches.
    spare: Vec<Batch>,
    is_source_empty: bool,
    /// Rays and requests of all batches so far.
    expected: (u64, u64),
    /// Items that return in this cycle.
    pub returns: Vec<(usize, usize)>,
    /// Counters since the end of the last batch.
    pub counts: Counts,
    pub out: Simulated,
}

impl<'m> Device<'m> {
    fn new(machine: &'m Machine) -> Self {
        Self {
            machine,
            units: (0..machine.units).map(|_| Unit::new(machine)).collect(),
            memory: CacheMemory::new(machine),
            cores: Cores::new(),
            calendar: Calendar::new(DAYS),
            loaded: VecDeque::new(),
            first: 0,
            spare: Vec::new(),
            is_source_empty: false,
            expected: (0, 0),
            returns: Vec::new(),
            counts: Counts::default(),
            out: Simulated::default(),
        }
    }

    fn run<S: BatchSource>(&mut self, source: &mut S) -> Result<(), S::Error> {
        self.load(source, 0)?;
        self.end_batches(0, 0);
        self.start_cores(0, 0);
        self.accept_all(0);
        let mut keys = Vec::new();
        while let Some(now) = self.calendar.advance(&mut keys) {
            for &key in &keys {
                let unit = (key >> 36) as usize & 0xff_ffff;
                let (kind, slot) = (key >> 32 & 0xf, (key & 0xffff_ffff) as usize);
                match key >> 60 {
                    phase::CORES => self.proceed_cores(source, now)?,
                    phase::L2_RETRY => self.retry(None, now),
                    phase::UNIT if kind == SLOT => self.proceed(unit, slot, now),
                    phase::UNIT => self.retry(Some(2 * unit + kind as usize), now),
                    phase::RETURN => self.returns.push((unit, slot)),
                    _ => {}
                }
            }
            self.return_rays(now);
            self.accept_all(now);
        }
        Ok(())
    }

    /// Loads batches into free tile buffers.
    fn load<S: BatchSource>(&mut self, source: &mut S, now: u64) -> Result<(), S::Error> {
        while self.loaded.len() < self.machine.tile_buffers && !self.is_source_empty {
            let mut batch = self.spare.pop().unwrap_or_default();
            batch.clear(self.machine.units);
            if !source.next(&mut batch)? {
                self.is_source_empty = true;
                return Ok(());
            }
            let remaining = batch.rays();
            self.expected.0 += remaining;
            let requests = |item: &Item| u64::from(item.end - item.first);
            self.expected.1 += batch.items.iter().flatten().map(requests).sum::<u64>();
            self.loaded.push_back(Loaded {
                batch,
                remaining,
                opened: now,
            });
        }
        Ok(())
    }

    /// The cores finish their kernels or their transfers.
    fn proceed_cores<S: BatchSource>(&mut self, source: &mut S, now: u64) -> Result<(), S::Error> {
        if let Some(next) = self.cores.proceed(now, &mut self.memory.dram) {
            self.calendar.push(next, key(phase::CORES, 0, 0, 0));
            return Ok(());
        }
        self.out.frame_cycles = now;
        if let Some(done) = self.loaded.pop_front() {
            self.spare.push(done.batch);
            self.first += 1;
        }
        self.load(source, now)?;
        self.end_batches(now, now);
        self.start_cores(now, now);
        Ok(())
    }

    /// Starts the cores at cycle `start` on the first batch, if they are idle and its rays have returned.
    fn start_cores(&mut self, now: u64, start: u64) {
        let Some(first) = self.loaded.front() else {
            return;
        };
        if !self.cores.are_idle() || first.remaining > 0 {
            return;
        }
        let (cycles, lines) = (first.batch.core_cycles, first.batch.core_lines);
        let next = self
            .cores
            .start(start, cycles, lines, &mut self.memory.dram);
        debug_assert!(next > now);
        self.calendar.push(next, key(phase::CORES, 0, 0, 0));
    }

    /// Closes the account of batches whose rays have all returned in cycle `now`; they end at cycle `end`.
    fn end_batches(&mut self, now: u64, end: u64) {
        while let Some(next) = (self.out.batches.len() as u64).checked_sub(self.first)
            && let Some(batch) = self.loaded.get(next as usize)
            && batch.remaining == 0
        {
            let start = batch.opened.max(self.out.unit_cycles);
            for unit in &mut self.units {
                unit.count_until(now, &mut self.counts.cycles);
            }
            let counts = std::mem::take(&mut self.counts);
            self.out.counts.add(&counts);
            self.out.batches.push(BatchTiming {
                cycles: end.saturating_sub(start),
                counts,
            });
            self.out.unit_cycles = self.out.unit_cycles.max(end);
        }
    }

    /// Returns the finished items of this cycle, and hands complete batches to the cores.
    fn return_rays(&mut self, now: u64) {
        if self.returns.is_empty() {
            return;
        }
        let mut ends = false;
        for (unit, slot) in std::mem::take(&mut self.returns) {
            let u = &mut self.units[unit];
            u.count_until(now, &mut self.counts.cycles);
            let s = u.slots[slot];
            let rays = u64::from(s.rays);
            u.release(slot);
            self.counts.rays_left += rays;
            self.counts.ray_cycles += rays * (now + 1 - s.accepted);
            let batch = &mut self.loaded[(s.batch - self.first) as usize];
            batch.remaining -= rays;
            ends |= batch.remaining == 0;
        }
        if ends {
            self.end_batches(now, now + 1);
            self.start_cores(now, now + 1);
        }
    }

    fn accept_all(&mut self, now: u64) {
        for unit in 0..self.units.len() {
            while self.units[unit].has_room() && self.accept(unit, now) {}
        }
    }

    /// Accepts the next item of a unit with a free slot. Returns true if another one may follow in this cycle.
    fn accept(&mut self, unit: usize, now: u64) -> bool {
        let u = &mut self.units[unit];
        let Some((batch, item, items)) = next_item(u, unit, &self.loaded, self.first) else {
            return false;
        };
        let ready = u.input.ready();
        if ready > now {
            self.calendar.push(ready, key(phase::ACCEPT, unit, 0, 0));
            return false;
        }
        u.count_until(now, &mut self.counts.cycles);
        let place = (u.cursor.1, items);
        u.cursor.1 += 1;
        let last = (0..item.rays).fold(now, |_, _| u.input.take(now).start);
        let slot = u.place(&item, batch, place, now);
        self.counts.rays_entered += u64::from(item.rays);
        let key = key(phase::UNIT, unit, SLOT, slot);
        self.calendar.push(last + 1, key);
        true
    }
}

/// The next item of a unit, the number of its batch, and the batch's items of the unit.
fn next_item(
    u: &mut Unit,
    unit: usize,
    loaded: &VecDeque<Loaded>,
    first: u64,
) -> Option<(u64, Item, usize)> {
    if u.cursor.0 < first {
        u.cursor = (first, 0);
    }
    loop {
        let (batch, index) = u.cursor;
        let items = &loaded.get((batch - first) as usize)?.batch.items[unit];
        if let Some(item) = items.get(index) {
            return Some((batch, *item, items.len()));
        }
        u.cursor = (batch + 1, 0);
    }
}
