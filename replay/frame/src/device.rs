//! The event loop: cores, the L2, DRAM, and the items that cores take.

use super::core::{Asks, Core};
use super::counts::Counts;
use super::dram::{Answer, Dram, MakeChannels};
use super::l2::{Found, L2};
use super::machine::Machine;
use super::timeline::{FrameTimeline, TileSpan};
use super::work::Part;
use sim::config::ConfigError;
use sim::memory::{Calendar, Servers};
use sim::order::WorkItem;
use sim::sums::Unbalanced;
use std::collections::VecDeque;

/// Cycles that most events lie ahead at most.
const DAYS: u64 = 2047;

/// Events by their order within a cycle. Their keys have a core, and a line, a slot or a bank.
mod event {
    pub const READ: u64 = 0;
    pub const WRITTEN: u64 = 1;
    /// A line from the L2 enters the port of a core.
    pub const PORT: u64 = 2;
    pub const ARRIVE: u64 = 3;
    pub const LAUNCHED: u64 = 4;
    pub const FILTERED: u64 = 5;
    pub const ISSUED: u64 = 6;
    pub const WAKE_BANK: u64 = 7;
    pub const WAKE_DRAM: u64 = 8;
    pub const WAKE_CORE: u64 = 9;

    pub fn key(kind: u64, core: usize, place: u64) -> u64 {
        kind << 56 | (core as u64) << 40 | place
    }
}
use event::key;

/// The items of a phase, as the cores take them.
pub trait Source {
    /// Reason why an item cannot be read.
    type Error;

    /// Replaces `part`, which is empty, by the next part of a core. False after its last one.
    ///
    /// # Errors
    /// An item that cannot be read.
    fn take(&mut self, core: usize, part: &mut Part) -> Result<bool, Self::Error>;

    /// Parts of each item: one, or one for each core.
    fn parts(&self) -> u32 {
        1
    }

    /// True if cores start an item only when all cores have shaded the one before.
    fn cores_wait(&self) -> bool {
        false
    }
}

/// The machine in its current cycle.
pub struct Device {
    machine: Machine,
    cores: Vec<Core>,
    l2: L2,
    ports: Vec<Servers>,
    dram: Dram,
    calendar: Calendar<u64>,
    now: u64,
    /// Earliest pending wake-up of DRAM and of each core.
    dram_wake: u64,
    wakes: Vec<u64>,
    /// Banks and cores to be polled in this cycle.
    banks_due: Vec<bool>,
    stalled: Vec<bool>,
    cores_due: Vec<bool>,
    /// Parts of each item from number `open` on that are not shaded.
    left: VecDeque<u32>,
    open: u64,
    spare: Vec<Part>,
    counts: Counts,
    /// Lines from DRAM, by position of the item in the scheduler's list.
    pub pressure: Vec<u64>,
    spans: Vec<TileSpan>,
}

impl Device {
    /// An idle machine with empty caches.
    ///
    /// # Errors
    /// An impossible cache.
    pub fn new(machine: &Machine, channels: &MakeChannels<'_>) -> Result<Self, ConfigError> {
        let cores: Result<Vec<Core>, _> = (0..machine.cores).map(|_| Core::new(machine)).collect();
        Ok(Self {
            cores: cores?,
            l2: L2::new(machine)?,
            ports: vec![Servers::new(1, machine.port_ticks); machine.cores],
            dram: Dram::new(machine, channels),
            calendar: Calendar::new(DAYS),
            now: 0,
            dram_wake: u64::MAX,
            wakes: vec![u64::MAX; machine.cores],
            banks_due: vec![false; machine.banks],
            stalled: vec![false; machine.banks],
            cores_due: vec![false; machine.cores],
            left: VecDeque::new(),
            open: 0,
            spare: Vec::new(),
            counts: Counts::default(),
            pressure: Vec::new(),
            spans: Vec::new(),
            machine: machine.clone(),
        })
    }

    /// Records the timeline.
    pub fn record(&mut self) {
        for core in &mut self.cores {
            core.record = Some(Box::default());
        }
    }

    /// Keeps the spans of a phase that has ended, with the tiles of its items.
    pub fn keep_spans(&mut self, items: &[WorkItem]) {
        for (core, of) in self.cores.iter_mut().enumerate() {
            let held = of.record.iter_mut().flat_map(|of| of.held.drain(..));
            self.spans
                .extend(held.map(|(slot, cycles, index)| TileSpan {
                    core,
                    slot,
                    cycles,
                    tiles: items[index].tiles().collect(),
                }));
        }
    }

    /// The timeline, if it was recorded.
    pub fn timeline(self) -> Option<FrameTimeline> {
        let records = self.cores.into_iter().map(|of| Some(of.record?.causes));
        Some(FrameTimeline {
            causes: records.collect::<Option<_>>()?,
            spans: self.spans,
        })
    }

    /// The current cycle.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// Runs all items of a phase, and returns when the last tile is written.
    ///
    /// # Errors
    /// An item that cannot be read.
    pub fn run<S: Source>(&mut self, source: &mut S) -> Result<(), S::Error> {
        let mut has_items = vec![true; self.cores.len()];
        (self.open, self.left) = (0, VecDeque::new());
        self.fetch(source, &mut has_items)?;
        let mut keys = Vec::new();
        while self.cores.iter().any(|core| core.held_tiles() > 0) {
            let Some(now) = self.calendar.advance(&mut keys) else {
                unreachable!("a tile in work without an event");
            };
            self.now = now;
            for &key in &keys {
                self.handle(key >> 56, key as usize >> 40 & 0xffff, key & 0xff_ffff_ffff);
            }
            self.poll_banks();
            if self.dram_wake <= now {
                self.poll_dram();
            }
            self.poll_cores(source.cores_wait());
            self.fetch(source, &mut has_items)?;
        }
        Ok(())
    }

    fn handle(&mut self, kind: u64, core: usize, place: u64) {
        let (now, slot) = (self.now, place as usize);
        match kind {
            event::READ => {
                self.dram.arrived(now);
                self.counts.fills[1] += 1;
                let (cores, calendar) = (&mut self.cores, &mut self.calendar);
                let ready = now + self.machine.l2_cycles;
                self.l2.fill(place as u32, |core| {
                    cores[core].has_left_dram(place as u32, now);
                    calendar.push(ready, key(event::PORT, core, place));
                });
                // An MSHR and merges are free again.
                for (due, stalled) in self.banks_due.iter_mut().zip(&mut self.stalled) {
                    *due |= std::mem::take(stalled);
                }
            }
            event::WRITTEN => self.release(core, slot),
            event::PORT => {
                let end = self.ports[core].take(now).end;
                let key = key(event::ARRIVE, core, place);
                self.calendar.push(end.max(now + 1), key);
            }
            event::ARRIVE => {
                self.cores[core].arrive(place as u32, now);
                self.cores_due[core] = true;
            }
            event::LAUNCHED => {
                self.cores[core].make_ready(slot, now);
                self.cores_due[core] = true;
            }
            event::FILTERED => {
                self.cores[core].filtered(slot, now);
                self.cores_due[core] = true;
            }
            event::ISSUED => {
                self.cores_due[core] = true;
                if let Some(held) = self.cores[core].issued(slot, now) {
                    self.shaded(core, held, now);
                }
            }
            event::WAKE_BANK => self.banks_due[core] = true,
            event::WAKE_DRAM => {}
            _ => self.cores_due[core] = true,
        }
    }

    /// All warps of a tile have finished: it is written, not before `from`.
    fn shaded(&mut self, core: usize, slot: usize, from: u64) {
        let Some(held) = &self.cores[core].held[slot] else {
            return;
        };
        let place = (held.part.item - self.open) as usize;
        let (first, lines) = (held.part.write_first, held.part.write_lines);
        self.left[place] -= 1;
        while self.left.front() == Some(&0) {
            self.left.pop_front();
            self.open += 1;
            self.cores_due.fill(true);
        }
        if lines == 0 {
            self.release(core, slot);
        } else {
            self.dram.write(core, slot, first, lines);
            self.wake_dram(from);
        }
    }

    fn release(&mut self, core: usize, slot: usize) {
        if let Some(mut part) = self.cores[core].release(slot, self.now) {
            part.clear();
            self.spare.push(part);
        }
    }

    fn wake_dram(&mut self, at: u64) {
        if at < self.dram_wake {
            self.dram_wake = at;
            if at > self.now {
                self.calendar.push(at, key(event::WAKE_DRAM, 0, 0));
            }
        }
    }

    /// Each bank looks up a line. The first bank changes from cycle to cycle, so that all get MSHRs.
    fn poll_banks(&mut self) {
        let (now, banks) = (self.now, self.banks_due.len());
        for turn in 0..banks {
            let bank = (turn + now as usize) % banks;
            if !std::mem::take(&mut self.banks_due[bank]) {
                continue;
            }
            match self.l2.step(bank) {
                Found::Hit(core, line) => {
                    self.counts.l2[0] += 1;
                    let key = key(event::PORT, core, line.into());
                    self.calendar.push(now + self.machine.l2_cycles, key);
                }
                Found::Merged(core, line) => {
                    self.counts.l2[1] += 1;
                    self.cores[core].comes_from_dram(line, now);
                }
                Found::Miss(core, line) => {
                    self.counts.l2[2] += 1;
                    let index = self.cores[core].comes_from_dram(line, now);
                    if let Some(lines) = self.pressure.get_mut(index) {
                        *lines += 1;
                    }
                    self.dram.read(now, line);
                    self.dram_wake = self.dram_wake.min(now);
                }
                Found::Full => {
                    self.stalled[bank] = true;
                    continue;
                }
                Found::Idle => continue,
            }
            if self.l2.has_work(bank) {
                let key = key(event::WAKE_BANK, bank, 0);
                self.calendar.push(now + 1, key);
            }
        }
    }

    fn poll_dram(&mut self) {
        let calendar = &mut self.calendar;
        let next = self.dram.poll(self.now, |at, answer| {
            let key = match answer {
                Answer::Read(line) => key(event::READ, 0, line.into()),
                Answer::Written(core, slot) => key(event::WRITTEN, core, slot as u64),
            };
            calendar.push(at, key);
        });
        self.dram_wake = u64::MAX;
        next.into_iter().for_each(|at| self.wake_dram(at));
    }

    fn poll_cores(&mut self, cores_wait: bool) {
        let now = self.now;
        let open = cores_wait.then_some(self.open);
        let mut asks = Asks::default();
        for core in 0..self.cores.len() {
            if !std::mem::take(&mut self.cores_due[core]) {
                continue;
            }
            if self.wakes[core] <= now {
                self.wakes[core] = u64::MAX;
            }
            asks.wake = u64::MAX;
            self.cores[core].poll(now, &self.machine, open, &mut asks);
            for (list, kind) in [
                (&mut asks.launched, event::LAUNCHED),
                (&mut asks.issued, event::ISSUED),
                (&mut asks.filtered, event::FILTERED),
            ] {
                for (at, slot) in list.drain(..) {
                    self.calendar.push(at, key(kind, core, slot as u64));
                }
            }
            for line in asks.lines.drain(..) {
                let bank = self.l2.request(core, line);
                if !self.stalled[bank] {
                    self.calendar.push(now + 1, key(event::WAKE_BANK, bank, 0));
                }
            }
            self.wake_core(core, asks.wake);
        }
    }

    fn wake_core(&mut self, core: usize, at: u64) {
        if at < self.wakes[core] {
            self.wakes[core] = at;
            self.calendar.push(at, key(event::WAKE_CORE, core, 0));
        }
    }

    /// Gives items to cores with free slots. The core with the fewest tiles goes first.
    fn fetch<S: Source>(&mut self, source: &mut S, has_items: &mut [bool]) -> Result<(), S::Error> {
        loop {
            let tiles = |core: &usize| self.cores[*core].held_tiles();
            let free = (0..self.cores.len()).filter(|core| has_items[*core]);
            let Some(core) = free.min_by_key(tiles) else {
                return Ok(());
            };
            if tiles(&core) >= self.machine.tiles {
                return Ok(());
            }
            let mut part = self.spare.pop().unwrap_or_default();
            if !source.take(core, &mut part)? {
                has_items[core] = false;
                self.spare.push(part);
                continue;
            }
            let place = (part.item - self.open) as usize;
            if place >= self.left.len() {
                self.left.resize(place + 1, source.parts());
            }
            let is_empty = part.warps.is_empty();
            let now = self.now;
            if let Some(slot) = self.cores[core].hold(part, now) {
                self.wake_core(core, now + 1);
                if is_empty {
                    self.shaded(core, slot, now + 1);
                    // Cores that waited for this tile are polled in the next cycle.
                    for core in 0..self.cores.len() {
                        if std::mem::take(&mut self.cores_due[core]) {
                            self.wake_core(core, now + 1);
                        }
                    }
                }
            }
        }
    }

    /// The counters so far.
    ///
    /// # Errors
    /// A sum that the model did not conserve.
    pub fn counts(&mut self) -> Result<Counts, Unbalanced> {
        let now = self.now;
        let mut all = self.counts;
        for core in &mut self.cores {
            core.count_until(now);
            let of = &core.counts;
            all.cycles.add(&of.cycles);
            formats::add_fields!(
                all,
                of,
                warp_cycles,
                warps_in_flight,
                footprints,
                alu_ticks,
                answered
            );
            for (sums, counts) in [
                (&mut all.warps[..], &of.warps[..]),
                (&mut all.requests[..], &of.requests[..]),
                (&mut all.l1[..], &of.l1[..]),
                (&mut all.fills[..], &of.fills[..]),
            ] {
                sums.iter_mut().zip(counts).for_each(|(sum, of)| *sum += of);
            }
        }
        all.dram_in_flight = self.dram.occupancy_until(now);
        all.dram_cycles = self.dram.latencies;
        all.dram_lines = self.dram.lines;
        all.check(now * self.cores.len() as u64)?;
        Ok(all)
    }
}
