//! The way of a ray through a unit: requests, waits for lines and MSHRs, and pipelines.

use super::device::Device;
use super::event::{SLOT, key, phase};
use super::memory::{Found, Full};
use super::unit::State;

impl Device<'_> {
    /// Continues the item of a slot: it was accepted, left a pipeline, or has its lines.
    pub(super) fn proceed(&mut self, unit: usize, slot: usize, now: u64) {
        let u = &mut self.units[unit];
        u.count_until(now, &mut self.counts.cycles);
        match u.slots[slot].state {
            State::ForLines(_) => {
                u.set(slot, State::Moving);
                self.issue(unit, slot, now);
            }
            _ => self.begin_request(unit, slot, now),
        }
    }

    /// Begins the next request of a slot, or finishes its item.
    fn begin_request(&mut self, unit: usize, slot: usize, now: u64) {
        let u = &mut self.units[unit];
        let s = &mut u.slots[slot];
        if s.request < s.end {
            s.lines_done = 0;
            s.arrival = 0;
            s.from_dram = false;
            s.fetched = [false; 2];
            self.counts.requests += 1;
            let (batch, request) = (s.batch, s.request as usize);
            self.look_up(unit, slot, now);
            self.prefetch(unit, slot, (batch, request), now);
            return;
        }
        let (returns, calendar) = (&mut self.returns, &mut self.calendar);
        u.finish(slot, now, |slot, cycle| {
            if cycle == now {
                returns.push((unit, slot));
            } else {
                calendar.push(cycle, key(phase::RETURN, unit, 0, slot));
            }
        });
    }

    /// Fetches ahead what a request of a batch says.
    fn prefetch(&mut self, unit: usize, slot: usize, (batch, request): (u64, usize), now: u64) {
        let batch = &self.loaded[(batch - self.first) as usize].batch;
        let Some(ahead) = batch.ahead.get(request) else {
            return;
        };
        let eye = self.units[unit].slots[slot].eye;
        for of in &batch.prefetches[ahead.start as usize..ahead.end as usize] {
            for line in of.first_line..of.first_line + of.lines {
                let level = (unit, of.pipeline as usize);
                self.memory
                    .prefetch(level, line, eye, now, &mut self.counts);
            }
        }
    }

    /// Looks up the remaining lines of a slot's request.
    fn look_up(&mut self, unit: usize, slot: usize, now: u64) {
        let (u, counts) = (&mut self.units[unit], &mut self.counts);
        let s = &mut u.slots[slot];
        let batch = &self.loaded[(s.batch - self.first) as usize].batch;
        let request = batch.requests[s.request as usize];
        let kind = request.pipeline as usize;
        while s.lines_done < request.lines {
            let line = request.first_line + s.lines_done;
            match self.memory.look_up((unit, kind), line, s.eye, now, counts) {
                Found::Hit => {}
                Found::Later {
                    arrival,
                    fetches_l1,
                    fetches_l2,
                } => {
                    s.arrival = s.arrival.max(arrival);
                    s.from_dram |= arrival > now + self.machine.l2_latency;
                    s.fetched[0] |= fetches_l1;
                    s.fetched[1] |= fetches_l2;
                }
                Found::Full(full) => {
                    u.set(slot, State::ForMshr);
                    self.park(unit, slot, kind, full);
                    return;
                }
            }
            s.lines_done += 1;
        }
        counts.l1_fetching_requests += u64::from(s.fetched[0]);
        counts.l2_fetching_requests += u64::from(s.fetched[1]);
        if s.arrival > now {
            let (arrival, from_dram) = (s.arrival, s.from_dram);
            u.set(slot, State::ForLines(from_dram));
            self.calendar
                .push(arrival, key(phase::UNIT, unit, SLOT, slot));
        } else {
            self.issue(unit, slot, now);
        }
    }

    /// Puts a slot into the queue for an MSHR.
    fn park(&mut self, unit: usize, slot: usize, kind: usize, full: Full) {
        match full {
            Full::L1 => {
                self.memory.l1[2 * unit + kind].park(unit, slot);
                self.schedule_retry(Some(2 * unit + kind));
            }
            Full::L2 => {
                self.memory.l2.park(unit, slot);
                self.schedule_retry(None);
            }
        }
    }

    /// Schedules the next retry for an MSHR of an L1, or of the L2.
    fn schedule_retry(&mut self, l1: Option<usize>) {
        let (level, key) = match l1 {
            Some(at) => {
                let key = key(phase::UNIT, at / 2, at as u64 % 2, 0);
                (&mut self.memory.l1[at], key)
            }
            None => (&mut self.memory.l2, key(phase::L2_RETRY, 0, 0, 0)),
        };
        if let Some(cycle) = level.schedule_retry() {
            self.calendar.push(cycle, key);
        }
    }

    /// Lets rays that wait for an MSHR of an L1, or of the L2, try again while one is free.
    pub(super) fn retry(&mut self, l1: Option<usize>, now: u64) {
        match l1 {
            Some(at) => self.memory.l1[at].start_retry(),
            None => self.memory.l2.start_retry(),
        }
        loop {
            let next = match l1 {
                Some(at) => self.memory.l1[at].next_waiting(now),
                None => self.memory.l2.next_waiting(now),
            };
            let Some((unit, slot)) = next else {
                break;
            };
            let u = &mut self.units[unit];
            u.count_until(now, &mut self.counts.cycles);
            u.set(slot, State::Moving);
            self.look_up(unit, slot, now);
        }
        self.schedule_retry(l1);
    }

    /// Queues a slot's request for its pipeline; its data is complete.
    fn issue(&mut self, unit: usize, slot: usize, now: u64) {
        let (u, counts) = (&mut self.units[unit], &mut self.counts);
        let s = &mut u.slots[slot];
        let batch = &self.loaded[(s.batch - self.first) as usize].batch;
        let pipeline = batch.requests[s.request as usize].pipeline;
        s.request += 1;
        counts.answers += 1;
        match pipeline as usize {
            0 => counts.steps += 1,
            _ => counts.tests += 1,
        }
        let done = u.issue(pipeline, now);
        self.calendar.push(done, key(phase::UNIT, unit, SLOT, slot));
    }
}
