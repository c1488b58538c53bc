//! A core: warps, ALUs, texture unit, and its L1 with MSHRs.
//!
//! A warp issues its first instructions, hands all its requests to the texture unit, waits for them, and issues the
//! others. ALUs run one warp's instructions at a time, of the oldest warp that can issue. The texture unit looks up
//! requests in order; each then waits in a FIFO, which the filter empties in order. A request leaves the FIFO when all
//! its lines have arrived.

use super::counts::Counts;
use super::machine::Machine;
use super::timeline::CoreRecord;
use super::work::{Part, Warp};
use sim::config::ConfigError;
use sim::memory::{AnyCache, Cache, TICKS};
use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap, HashMap, VecDeque};

/// What a core asks of the rest of the machine.
#[derive(Debug, Default)]
pub struct Asks {
    /// Warps (slots) that are launched, with the cycle in which they can issue.
    pub launched: Vec<(u64, usize)>,
    /// Cycles in which instructions of a warp end.
    pub issued: Vec<(u64, usize)>,
    /// Cycles in which the last request of a warp is filtered.
    pub filtered: Vec<(u64, usize)>,
    /// Lines for the L2.
    pub lines: Vec<u32>,
    /// Cycle of the next poll, if only time has to pass.
    pub wake: u64,
}

/// A tile of the core.
#[derive(Debug)]
pub struct Held {
    /// Its warps.
    pub part: Part,
    /// The next warp to be launched.
    next: usize,
    /// Warps that have not finished.
    pub left: usize,
    /// The cycle in which the core took it.
    since: u64,
}

/// A warp in flight.
#[derive(Clone, Copy, Debug)]
struct Running {
    /// Slot of its tile.
    held: usize,
    warp: Warp,
    launched: u64,
    /// Number of launch.
    age: u64,
    /// True after its textures.
    last: bool,
}

/// A request between look-up and filter.
#[derive(Clone, Copy, Debug)]
struct Entry {
    warp: usize,
    footprints: u32,
    /// Lines that have not arrived.
    missing: u32,
    /// True for the warp's last request.
    last: bool,
}

/// A line in flight to the L1.
#[derive(Debug, Default)]
struct Mshr {
    /// Numbers of the requests that wait.
    waiting: Vec<u64>,
    /// True while the line comes from DRAM.
    below: bool,
    /// The item that fetched it.
    index: usize,
}

/// A core.
pub struct Core {
    cache: Box<dyn Cache>,
    mshrs: HashMap<u32, Mshr>,
    spare: Vec<Mshr>,
    /// Lines in flight that come from DRAM.
    below: u32,
    /// Tiles by slot.
    pub held: Vec<Option<Held>>,
    running: Vec<Running>,
    free: BTreeSet<usize>,
    in_flight: u64,
    age: u64,
    /// Ticks at which rasteriser, ALUs and filter are free.
    raster_free: u64,
    alu_free: u64,
    filter_free: u64,
    /// Warps that can issue: not of priority, age, slot.
    ready: BinaryHeap<Reverse<(bool, u64, usize)>>,
    /// Warps with requests that are not looked up.
    asking: VecDeque<usize>,
    /// The next request of the first of these.
    request: u32,
    /// The request that is looked up, and its lines so far.
    current: Option<(Entry, u32)>,
    fifo: VecDeque<Entry>,
    /// Requests that left the FIFO.
    left: u64,
    stalled: bool,
    blocked: bool,
    counted: u64,
    /// Counters.
    pub counts: Counts,
    /// The timeline, if it is recorded.
    pub record: Option<Box<CoreRecord>>,
}

impl Core {
    /// An idle core.
    ///
    /// # Errors
    /// An impossible geometry of the L1.
    pub fn new(machine: &Machine) -> Result<Self, ConfigError> {
        let cache = AnyCache::build(&machine.l1, "L1", machine.line_bytes, 1)?;
        Ok(Self {
            cache: cache.into_box(),
            mshrs: HashMap::new(),
            spare: Vec::new(),
            below: 0,
            held: (0..machine.tiles).map(|_| None).collect(),
            running: Vec::new(),
            free: BTreeSet::new(),
            in_flight: 0,
            age: 0,
            raster_free: 0,
            alu_free: 0,
            filter_free: 0,
            ready: BinaryHeap::new(),
            asking: VecDeque::new(),
            request: 0,
            current: None,
            fifo: VecDeque::new(),
            left: 0,
            stalled: false,
            blocked: false,
            counted: 0,
            counts: Counts::default(),
            record: None,
        })
    }

    /// Tiles in its slots.
    pub fn held_tiles(&self) -> usize {
        self.held.iter().flatten().count()
    }

    /// Takes a tile into a free slot. Returns the slot.
    pub fn hold(&mut self, part: Part, now: u64) -> Option<usize> {
        self.count_until(now);
        let slot = self.held.iter().position(Option::is_none)?;
        let left = part.warps.len();
        self.held[slot] = Some(Held {
            part,
            next: 0,
            left,
            since: now,
        });
        self.blocked = false;
        Some(slot)
    }

    /// Frees the slot of a written tile.
    pub fn release(&mut self, slot: usize, now: u64) -> Option<Part> {
        self.count_until(now);
        let held = self.held[slot].take()?;
        if let Some(record) = &mut self.record {
            let cycles = [held.since, now];
            record.held.push((slot, cycles, held.part.index));
        }
        Some(held.part)
    }

    /// Counts the cycles before `now` by cause. To be called before anything in the core changes in cycle `now`.
    pub fn count_until(&mut self, now: u64) {
        let (from, cycles) = (self.counted, &mut self.counts.cycles);
        if from >= now {
            return;
        }
        let before = *cycles;
        self.counted = now;
        self.counts.warps_in_flight += self.in_flight * (now - from);
        let alu_end = self.alu_free.div_ceil(TICKS).clamp(from, now);
        let filter_end = self.filter_free.div_ceil(TICKS).clamp(alu_end, now);
        cycles.issue += alu_end - from;
        cycles.texture += filter_end - alu_end;
        let head = self.fifo.front();
        let cause = if self.in_flight == 0 {
            let has_warps = |held: &Held| held.next < held.part.warps.len();
            match self.held.iter().flatten().any(has_warps) {
                true if !self.blocked => &mut cycles.raster,
                false if self.held.iter().all(Option::is_none) => &mut cycles.no_work,
                _ => &mut cycles.barrier,
            }
        } else if self.stalled {
            &mut cycles.mshr
        } else if head.is_some_and(|entry| entry.missing > 0) {
            match self.below > 0 {
                true => &mut cycles.dram,
                false => &mut cycles.l2,
            }
        } else {
            &mut cycles.latency
        };
        *cause += now - filter_end;
        if let Some(record) = &mut self.record {
            let (all, before) = (cycles.list(), before.list());
            record.add(from, std::array::from_fn(|at| all[at] - before[at]));
        }
    }

    /// Marks a line in flight as coming from DRAM. Returns the item that fetched it.
    pub fn comes_from_dram(&mut self, line: u32, now: u64) -> usize {
        self.count_until(now);
        let Some(mshr) = self.mshrs.get_mut(&line) else {
            return 0;
        };
        mshr.below = true;
        self.below += 1;
        mshr.index
    }

    /// Marks a line as having left DRAM.
    pub fn has_left_dram(&mut self, line: u32, now: u64) {
        self.count_until(now);
        if let Some(mshr) = self.mshrs.get_mut(&line) {
            mshr.below = false;
            self.below -= 1;
        }
    }

    /// Fills a line.
    pub fn arrive(&mut self, line: u32, now: u64) {
        self.count_until(now);
        self.cache.fill(line);
        self.counts.fills[0] += 1;
        let Some(mut mshr) = self.mshrs.remove(&line) else {
            return;
        };
        for number in mshr.waiting.drain(..) {
            self.counts.answered += 1;
            let place = (number - self.left) as usize;
            let current = self.current.as_mut().map(|(entry, _)| entry);
            if let Some(entry) = self.fifo.get_mut(place).or(current) {
                entry.missing -= 1;
            }
        }
        self.spare.push(mshr);
    }

    /// A warp can issue: it was launched, or its textures are filtered.
    pub fn make_ready(&mut self, slot: usize, now: u64) {
        self.count_until(now);
        let of = &self.running[slot];
        self.ready.push(Reverse((!of.warp.priority, of.age, slot)));
    }

    /// Takes a warp whose requests are filtered.
    pub fn filtered(&mut self, slot: usize, now: u64) {
        self.running[slot].last = true;
        self.make_ready(slot, now);
    }

    /// Takes a warp whose instructions have ended. Returns the slot of its tile if that was the tile's last warp.
    pub fn issued(&mut self, slot: usize, now: u64) -> Option<usize> {
        self.count_until(now);
        let of = self.running[slot];
        if !of.last {
            if of.warp.first < of.warp.end {
                self.asking.push_back(slot);
            } else {
                self.filtered(slot, now);
            }
            return None;
        }
        self.free.insert(slot);
        self.in_flight -= 1;
        self.counts.warps[1] += 1;
        self.counts.warp_cycles += now - of.launched;
        let held = self.held[of.held].as_mut()?;
        held.left -= 1;
        (held.left == 0).then_some(of.held)
    }

    /// A cycle of the core: filters, looks up, issues and launches. `open` is the first item that is not shaded, if cores
    /// wait for each other.
    pub fn poll(&mut self, now: u64, machine: &Machine, open: Option<u64>, asks: &mut Asks) {
        self.count_until(now);
        self.filter(now, machine, asks);
        self.look_up(now, machine, asks);
        self.issue(now, asks);
        self.launch(now, machine, open, asks);
    }

    fn filter(&mut self, now: u64, machine: &Machine, asks: &mut Asks) {
        while let Some(&entry) = self.fifo.front()
            && entry.missing == 0
        {
            if self.filter_free / TICKS > now {
                asks.wake = asks.wake.min(self.filter_free / TICKS);
                return;
            }
            self.fifo.pop_front();
            self.left += 1;
            let ticks = u64::from(entry.footprints) * machine.filter_ticks;
            self.filter_free = self.filter_free.max(now * TICKS) + ticks;
            self.counts.requests[1] += 1;
            self.counts.footprints += u64::from(entry.footprints);
            if entry.last {
                let end = self.filter_free.div_ceil(TICKS) + machine.filter_cycles;
                asks.filtered.push((end.max(now + 1), entry.warp));
            }
        }
    }

    /// Looks up lines of one request.
    fn look_up(&mut self, now: u64, machine: &Machine, asks: &mut Asks) {
        self.stalled = false;
        let Some(&slot) = self.asking.front() else {
            return;
        };
        let Running { held, warp, .. } = self.running[slot];
        let Some(held) = &self.held[held] else { return };
        let number = warp.first + self.request;
        let request = held.part.requests[number as usize];
        let lines = held.part.lines_of(&request);
        let (mut entry, mut looked) = self.current.take().unwrap_or_else(|| {
            self.counts.requests[0] += 1;
            let entry = Entry {
                warp: slot,
                footprints: request.footprints,
                missing: 0,
                last: number + 1 == warp.end,
            };
            (entry, 0)
        });
        let name = self.left + self.fifo.len() as u64;
        for &line in lines
            .iter()
            .skip(looked as usize)
            .take(machine.lookups as usize)
        {
            if self.cache.lookup(line) {
                self.counts.l1[0] += 1;
            } else if let Some(mshr) = self.mshrs.get_mut(&line) {
                if mshr.waiting.len() >= machine.merges {
                    self.stalled = true;
                    break;
                }
                mshr.waiting.push(name);
                entry.missing += 1;
                self.counts.l1[1] += 1;
            } else if self.mshrs.len() < machine.l1_mshrs {
                let mut mshr = self.spare.pop().unwrap_or_default();
                mshr.waiting.push(name);
                (mshr.below, mshr.index) = (false, held.part.index);
                self.mshrs.insert(line, mshr);
                entry.missing += 1;
                self.counts.l1[2] += 1;
                asks.lines.push(line);
            } else {
                self.stalled = true;
                break;
            }
            looked += 1;
        }
        if (looked as usize) < lines.len() || self.fifo.len() >= machine.fifo {
            if (looked as usize) < lines.len() && !self.stalled {
                asks.wake = asks.wake.min(now + 1);
            }
            self.current = Some((entry, looked));
            return;
        }
        self.fifo.push_back(entry);
        self.request += 1;
        if entry.last {
            self.asking.pop_front();
            self.request = 0;
        }
        asks.wake = asks.wake.min(now + 1);
    }

    fn issue(&mut self, now: u64, asks: &mut Asks) {
        while let Some(&Reverse((.., slot))) = self.ready.peek() {
            if self.alu_free / TICKS > now {
                asks.wake = asks.wake.min(self.alu_free / TICKS);
                return;
            }
            self.ready.pop();
            let of = &self.running[slot];
            let ticks = of.warp.alu_ticks[usize::from(of.last)];
            self.alu_free = self.alu_free.max(now * TICKS) + ticks;
            self.counts.alu_ticks += ticks;
            let end = self.alu_free.div_ceil(TICKS).max(now + 1);
            asks.issued.push((end, slot));
        }
    }

    fn launch(&mut self, now: u64, machine: &Machine, open: Option<u64>, asks: &mut Asks) {
        self.blocked = false;
        while self.in_flight < machine.warps as u64 {
            let tiles = (0..).zip(&self.held);
            let tiles = tiles.filter_map(|(slot, held)| Some((slot, held.as_ref()?)));
            let oldest = tiles.clone().filter(|(_, held)| held.left > 0);
            let oldest = oldest.map(|(_, held)| held.part.item).min();
            let first = tiles.filter(|(_, held)| held.next < held.part.warps.len());
            let Some((slot, item)) = first
                .map(|(slot, held)| (slot, held.part.item))
                .min_by_key(|(_, item)| *item)
            else {
                return;
            };
            let waits_for_own = machine.barrier && oldest.is_some_and(|oldest| oldest < item);
            if waits_for_own || open.is_some_and(|open| item > open) {
                self.blocked = true;
                return;
            }
            if self.raster_free / TICKS > now {
                asks.wake = asks.wake.min(self.raster_free / TICKS);
                return;
            }
            let Some(held) = self.held[slot].as_mut() else {
                return;
            };
            let warp = held.part.warps[held.next];
            held.next += 1;
            let ticks = u64::from(warp.quads) * machine.raster_ticks;
            self.raster_free = self.raster_free.max(now * TICKS) + ticks;
            let running = Running {
                held: slot,
                warp,
                launched: now,
                age: self.age,
                last: false,
            };
            self.age += 1;
            self.in_flight += 1;
            self.counts.warps[0] += 1;
            let place = self.free.pop_first().unwrap_or(self.running.len());
            match self.running.get_mut(place) {
                Some(free) => *free = running,
                None => self.running.push(running),
            }
            let ready = self.raster_free.div_ceil(TICKS).max(now + 1);
            asks.launched.push((ready, place));
        }
    }
}
