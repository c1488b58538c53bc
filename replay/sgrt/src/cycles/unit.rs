//! A T&I unit: its ray slots, pipelines and ports, and the causes of its idle cycles.

use super::batch::{Item, Pipeline};
use super::counts::UnitCycles;
use super::machine::Machine;
use formats::view::Eye;
use sim::memory::Servers;
use std::collections::{HashMap, VecDeque};

/// What the ray or warp of a slot does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Nothing: the slot is free.
    Free,
    /// It is handed over, or its last request is in a pipeline.
    Moving,
    /// It waits for lines; true if one of them was not in the L2 when it was requested.
    ForLines(bool),
    /// It waits for an MSHR.
    ForMshr,
    /// It has no requests left, and waits for its return.
    Finished,
}

/// A slot of a ray or warp.
#[derive(Clone, Copy, Debug)]
pub struct Slot {
    /// State.
    pub state: State,
    /// Number of its batch.
    pub batch: u64,
    /// Number of its return group in the batch, and the group's items.
    pub group: (usize, usize),
    /// Its current request in the batch.
    pub request: u32,
    /// End of its requests.
    pub end: u32,
    /// Lines of the current request that were looked up.
    pub lines_done: u32,
    /// Arrival of the last of these lines.
    pub arrival: u64,
    /// True if one of these lines was not in the L2 when it was requested.
    pub from_dram: bool,
    /// True if the current request fetched a line into the L1, and into the L2.
    pub fetched: [bool; 2],
    /// Number of rays.
    pub rays: u32,
    /// Their eye.
    pub eye: Eye,
    /// Cycle of acceptance.
    pub accepted: u64,
}

/// A unit.
pub struct Unit {
    /// Slots so far; more are added up to the limit.
    pub slots: Vec<Slot>,
    /// Free slots, one bit each.
    free: Vec<u64>,
    most_slots: usize,
    /// Port that accepts rays.
    pub input: Servers,
    output: Servers,
    pipelines: [Servers; 2],
    latencies: [u64; 2],
    /// Occupied slots in order of dispatch, if rays return in that order.
    order: Option<VecDeque<usize>>,
    /// Items that return together.
    group_items: usize,
    /// Finished slots of groups that have not returned, by batch and group.
    groups: HashMap<(u64, usize), Vec<usize>>,
    /// Batch and index of the next item to be accepted.
    pub cursor: (u64, usize),
    occupied: u32,
    for_mshr: u32,
    for_dram: u32,
    for_l2: u32,
    /// End of the last occupation of a pipeline so far.
    busy_until: u64,
    /// Cycles before this one are counted.
    counted: u64,
}

impl Unit {
    /// A unit without rays.
    pub fn new(machine: &Machine) -> Self {
        let port = || Servers::new(1, machine.port_interval);
        Self {
            slots: Vec::new(),
            free: Vec::new(),
            most_slots: machine.slots,
            input: port(),
            output: port(),
            pipelines: machine.pipelines.map(|p| Servers::new(p.count, p.interval)),
            latencies: machine.pipelines.map(|p| p.latency),
            order: machine.in_order_return.then(VecDeque::new),
            group_items: machine.return_group_rays,
            groups: HashMap::new(),
            cursor: (0, 0),
            occupied: 0,
            for_mshr: 0,
            for_dram: 0,
            for_l2: 0,
            busy_until: 0,
            counted: 0,
        }
    }

    /// True if a slot is free.
    pub fn has_room(&self) -> bool {
        (self.occupied as usize) < self.most_slots
    }

    /// Counts the cycles before `now` by cause. To be called before anything in the unit changes in cycle `now`.
    pub fn count_until(&mut self, now: u64, cycles: &mut UnitCycles) {
        if self.counted >= now {
            return;
        }
        let busy = self.busy_until.clamp(self.counted, now) - self.counted;
        let idle = now - self.counted - busy;
        self.counted = now;
        cycles.busy += busy;
        let cause = if self.occupied == 0 {
            &mut cycles.no_ray
        } else if self.for_mshr > 0 {
            &mut cycles.mshr
        } else if self.for_dram > 0 {
            &mut cycles.dram
        } else if self.for_l2 > 0 {
            &mut cycles.l2
        } else {
            &mut cycles.latency
        };
        *cause += idle;
    }

    /// Puts an item into the lowest free slot. `place` is its number in the batch and the number of the batch's items. Returns
    /// the slot.
    pub fn place(&mut self, item: &Item, batch: u64, place: (usize, usize), now: u64) -> usize {
        let group = place.0 / self.group_items;
        let items = (place.1 - group * self.group_items).min(self.group_items);
        let word = self.free.iter().position(|word| *word != 0);
        let slot = match word {
            Some(word) => 64 * word + self.free[word].trailing_zeros() as usize,
            None => self.slots.len(),
        };
        let placed = Slot {
            state: State::Moving,
            batch,
            group: (group, items),
            request: item.first,
            end: item.end,
            lines_done: 0,
            arrival: 0,
            from_dram: false,
            fetched: [false; 2],
            rays: item.rays,
            eye: item.eye,
            accepted: now,
        };
        if slot == self.slots.len() {
            self.slots.push(placed);
            self.free.resize(self.slots.len().div_ceil(64), 0);
        } else {
            self.slots[slot] = placed;
            self.free[slot / 64] &= !(1 << (slot % 64));
        }
        self.occupied += 1;
        if let Some(order) = &mut self.order {
            order.push_back(slot);
        }
        slot
    }

    /// Changes the state of a slot.
    pub fn set(&mut self, slot: usize, state: State) {
        let old = std::mem::replace(&mut self.slots[slot].state, state);
        if let Some(count) = self.count_of(old) {
            *count -= 1;
        }
        if let Some(count) = self.count_of(state) {
            *count += 1;
        }
    }

    fn count_of(&mut self, state: State) -> Option<&mut u32> {
        match state {
            State::ForMshr => Some(&mut self.for_mshr),
            State::ForLines(true) => Some(&mut self.for_dram),
            State::ForLines(false) => Some(&mut self.for_l2),
            State::Free | State::Moving | State::Finished => None,
        }
    }

    /// Queues a request for a pipeline. Returns the cycle of its result.
    pub fn issue(&mut self, pipeline: Pipeline, now: u64) -> u64 {
        let kind = pipeline as usize;
        let served = self.pipelines[kind].take(now);
        self.busy_until = self.busy_until.max(served.end);
        served.start + self.latencies[kind]
    }

    /// Finishes the item of a slot. Calls `returns` with the slot and cycle of each item whose return is now decided.
    pub fn finish(&mut self, slot: usize, now: u64, mut returns: impl FnMut(usize, u64)) {
        self.set(slot, State::Finished);
        if self.group_items > 1 {
            let Slot { batch, group, .. } = self.slots[slot];
            let finished = self.groups.entry((batch, group.0)).or_default();
            finished.push(slot);
            if finished.len() == group.1 {
                for slot in self.groups.remove(&(batch, group.0)).unwrap_or_default() {
                    returns(slot, self.output_cycle(slot, now));
                }
            }
            return;
        }
        if self.order.is_none() {
            returns(slot, self.output_cycle(slot, now));
            return;
        }
        while let Some(first) = self.order.as_ref().and_then(|order| order.front().copied())
            && self.slots[first].state == State::Finished
        {
            returns(first, self.output_cycle(first, now));
            if let Some(order) = &mut self.order {
                order.pop_front();
            }
        }
    }

    /// The cycle in which the last ray of a slot passes the output port.
    fn output_cycle(&mut self, slot: usize, now: u64) -> u64 {
        let rays = self.slots[slot].rays;
        (0..rays).fold(now, |_, _| self.output.take(now).start)
    }

    /// Frees a slot.
    pub fn release(&mut self, slot: usize) {
        self.set(slot, State::Free);
        self.free[slot / 64] |= 1 << (slot % 64);
        self.occupied -= 1;
    }
}
