//! A second implementation of the simulation, for tests: a plain loop over all cycles that looks at every slot in each
//! of them. It shares only the types of input and output, the meaning of a tick, and the phases of a cycle.

use super::super::batch::{Batch, Item, Pipeline, Request};
use super::super::counts::{Counts, LineCounts};
use super::super::device::{BatchTiming, Simulated};
use super::super::machine::{CacheSize, Machine};
use formats::view::Eye;
use sim::memory::TICKS;
use std::collections::{BTreeMap, VecDeque};

/// A cache: per set the resident lines, most recently used first, and the lines in flight in order of request.
struct TwinCache {
    size: CacheSize,
    sets: Vec<Vec<u32>>,
    in_flight: Vec<(u32, u64)>,
    queue: VecDeque<(usize, usize)>,
    /// Prefetched lines without a request so far.
    unused: Vec<u32>,
    /// The last fetch of each line.
    fetched_by: BTreeMap<u32, Eye>,
}

impl TwinCache {
    fn new(size: CacheSize) -> Self {
        Self {
            size,
            sets: vec![Vec::new(); size.sets as usize],
            in_flight: Vec::new(),
            queue: VecDeque::new(),
            unused: Vec::new(),
            fetched_by: BTreeMap::new(),
        }
    }

    /// Removes a line from the unused ones: 1 if it was one.
    fn take_unused(&mut self, line: u32) -> u64 {
        let before = self.unused.len();
        self.unused.retain(|other| *other != line);
        (before - self.unused.len()) as u64
    }

    fn is_of_other(&self, line: u32, eye: Eye) -> u64 {
        u64::from(self.fetched_by.get(&line).is_some_and(|by| *by != eye))
    }

    fn set(&mut self, line: u32) -> &mut Vec<u32> {
        &mut self.sets[(line % self.size.sets) as usize]
    }

    fn fill(&mut self, cycle: u64) {
        let arrived: Vec<u32> = (self.in_flight.iter().filter(|(_, at)| *at == cycle))
            .map(|(line, _)| *line)
            .collect();
        self.in_flight.retain(|(_, at)| *at > cycle);
        for line in arrived {
            let ways = self.size.ways as usize;
            let set = self.set(line);
            set.insert(0, line);
            set.truncate(ways);
        }
    }

    fn hits(&mut self, line: u32) -> bool {
        let set = self.set(line);
        let Some(at) = set.iter().position(|other| *other == line) else {
            return false;
        };
        set.remove(at);
        set.insert(0, line);
        true
    }

    fn arrival(&self, line: u32) -> Option<u64> {
        let of_line = self.in_flight.iter().find(|(other, _)| *other == line);
        of_line.map(|(_, at)| *at)
    }

    fn is_full(&self) -> bool {
        self.in_flight.len() >= self.size.mshrs as usize
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Doing {
    /// Until a cycle.
    Entering(u64),
    Queued,
    /// Until a cycle.
    InPipeline(u64),
    /// Until a cycle, and whether from DRAM.
    Lines(u64, bool),
    Mshr,
    Finished,
    /// In the output queue, with rays left to pass.
    Leaving(u32),
}

#[derive(Clone)]
struct TwinSlot {
    doing: Doing,
    batch: usize,
    index: usize,
    item: Item,
    request: u32,
    line: u32,
    wait: (u64, bool),
    fetched: (bool, bool),
    accepted: u64,
}

struct TwinUnit {
    slots: Vec<Option<TwinSlot>>,
    queues: [VecDeque<usize>; 2],
    pipelines: [Vec<u64>; 2],
    input: u64,
    output: u64,
    order: VecDeque<usize>,
    finished: Vec<usize>,
    leaving: VecDeque<usize>,
    next: (usize, usize),
}

struct Twin<'a> {
    machine: &'a Machine,
    batches: &'a [Batch],
    units: Vec<TwinUnit>,
    l1: Vec<TwinCache>,
    l2: TwinCache,
    channel: u64,
    /// Start, cycles, lines and sent lines.
    stream: (u64, u64, u64, u64),
    stream_end: u64,
    /// First cycle after the kernels of the tile in the cores, then after its transfers.
    cores: Option<(u64, bool)>,
    opened: Vec<u64>,
    remaining: Vec<u64>,
    shaded: usize,
    counts: Counts,
    last: Counts,
    out: Simulated,
}

/// Simulates batches.
pub fn twin(machine: &Machine, batches: &[Batch]) -> Simulated {
    let unit = || TwinUnit {
        slots: vec![None; machine.slots],
        queues: Default::default(),
        pipelines: machine.pipelines.map(|p| vec![0; p.count as usize]),
        input: 0,
        output: 0,
        order: VecDeque::new(),
        finished: Vec::new(),
        leaving: VecDeque::new(),
        next: (0, 0),
    };
    let mut twin = Twin {
        machine,
        batches,
        units: (0..machine.units).map(|_| unit()).collect(),
        l1: (0..2 * machine.units)
            .map(|at| TwinCache::new(machine.l1[at % 2]))
            .collect(),
        l2: TwinCache::new(machine.l2),
        channel: 0,
        stream: (0, 1, 0, 0),
        stream_end: 0,
        cores: None,
        opened: Vec::new(),
        remaining: batches.iter().map(Batch::rays).collect(),
        shaded: 0,
        counts: Counts::default(),
        last: Counts::default(),
        out: Simulated::default(),
    };
    let mut cycle = 0;
    twin.open(0);
    twin.start_cores(0);
    while twin.shaded < batches.len() {
        twin.cycle(cycle);
        cycle += 1;
        assert!(cycle < 10_000_000, "the twin does not end");
    }
    twin.last.prefetch.useless += (twin.l1.iter())
        .map(|cache| cache.unused.len() as u64)
        .sum::<u64>();
    twin.out.counts = twin.last;
    twin.out
}

impl Twin<'_> {
    fn cycle(&mut self, now: u64) {
        self.l1.iter_mut().for_each(|cache| cache.fill(now));
        self.l2.fill(now);
        self.run_cores(now);
        self.send(now);
        while !self.l2.is_full()
            && let Some((unit, slot)) = self.l2.queue.pop_front()
        {
            self.look_up(unit, slot, now);
        }
        for unit in 0..self.units.len() {
            for cache in [2 * unit, 2 * unit + 1] {
                while !self.l1[cache].is_full()
                    && let Some((_, slot)) = self.l1[cache].queue.pop_front()
                {
                    self.look_up(unit, slot, now);
                }
            }
            for slot in 0..self.machine.slots {
                self.advance(unit, slot, now);
            }
            self.issue(unit, now);
        }
        for unit in 0..self.units.len() {
            self.leave(unit, now);
        }
        if self.end_batches(now + 1) {
            self.start_cores(now + 1);
        }
        for unit in 0..self.units.len() {
            self.accept(unit, now);
        }
        self.classify(now);
    }

    fn send(&mut self, now: u64) {
        let (start, cycles, lines, _) = self.stream;
        while self.stream.3 < lines && start + self.stream.3 * cycles / lines <= now {
            let due = start + self.stream.3 * cycles / lines;
            self.channel = self.channel.max(due * TICKS) + self.machine.dram_ticks_per_line;
            self.stream_end = self.channel;
            self.stream.3 += 1;
        }
    }

    fn run_cores(&mut self, now: u64) {
        let Some((until, computed)) = self.cores else {
            return;
        };
        if until > now {
            return;
        }
        if !computed && self.stream.2 > 0 {
            let end = self.stream_end.div_ceil(TICKS);
            if end > now {
                self.out.core_wait_cycles += end - now;
                self.cores = Some((end, true));
                return;
            }
        }
        self.cores = None;
        self.shaded += 1;
        self.out.frame_cycles = now;
        self.open(now);
        self.start_cores(now);
    }

    fn open(&mut self, now: u64) {
        while self.opened.len() < self.batches.len()
            && self.opened.len() - self.shaded < self.machine.tile_buffers
        {
            self.opened.push(now);
        }
        self.end_batches(now);
    }

    fn start_cores(&mut self, now: u64) {
        if self.cores.is_some() || self.shaded >= self.out.batches.len() {
            return;
        }
        let batch = &self.batches[self.shaded];
        let cycles = batch.core_cycles.max(1);
        self.stream = (now, cycles, batch.core_lines, 0);
        self.cores = Some((now + cycles, false));
    }

    fn end_batches(&mut self, end: u64) -> bool {
        let before = self.out.batches.len();
        while self.out.batches.len() < self.opened.len()
            && self.remaining[self.out.batches.len()] == 0
        {
            let start = self.opened[self.out.batches.len()].max(self.out.unit_cycles);
            let counts = std::mem::take(&mut self.counts);
            self.out.batches.push(BatchTiming {
                cycles: end.saturating_sub(start),
                counts,
            });
            self.last.add(&counts);
            self.out.unit_cycles = self.out.unit_cycles.max(end);
        }
        self.out.batches.len() > before
    }

    fn request(&self, slot: &TwinSlot) -> Request {
        self.batches[slot.batch].requests[slot.request as usize]
    }

    fn advance(&mut self, unit: usize, slot: usize, now: u64) {
        let Some(s) = &mut self.units[unit].slots[slot] else {
            return;
        };
        match s.doing {
            Doing::Entering(at) if at == now => {}
            Doing::InPipeline(at) if at == now => s.request += 1,
            Doing::Lines(at, _) if at == now => {
                self.queue(unit, slot);
                return;
            }
            _ => return,
        }
        if s.request == s.item.end {
            s.doing = Doing::Finished;
            if !self.machine.in_order_return {
                self.leave_together(unit, slot);
            }
            return;
        }
        (s.line, s.wait, s.fetched) = (0, (0, false), (false, false));
        self.counts.requests += 1;
        let (batch, number, eye) = (&self.batches[s.batch], s.request as usize, s.item.eye);
        self.look_up(unit, slot, now);
        for of in batch.ahead.get(number).cloned().unwrap_or(0..0) {
            let of = batch.prefetches[of as usize];
            for line in of.first_line..of.first_line + of.lines {
                self.prefetch(2 * unit + of.pipeline as usize, line, eye, now);
            }
        }
    }

    /// The items of a slot's group leave in the order in which they have finished, once all have.
    fn leave_together(&mut self, unit: usize, slot: usize) {
        let most = self.machine.return_group_rays;
        let u = &mut self.units[unit];
        u.finished.push(slot);
        let group = |of: &TwinSlot| (of.batch, of.index / most);
        let of = u.slots[slot].as_ref().map(group).expect("a ray");
        let is_of_group = |slot: &usize| u.slots[*slot].as_ref().map(group) == Some(of);
        let (mates, others): (Vec<_>, _) = u.finished.iter().partition(|slot| is_of_group(slot));
        let items = self.batches[of.0].items[unit].len();
        if mates.len() < most.min(items - of.1 * most) {
            return;
        }
        u.finished = others;
        for slot in mates {
            let s = u.slots[slot].as_mut().expect("a ray");
            s.doing = Doing::Leaving(s.item.rays);
            u.leaving.push_back(slot);
        }
    }

    fn prefetch(&mut self, at: usize, line: u32, eye: Eye, now: u64) {
        let p = &mut self.counts.prefetch;
        p.requested += 1;
        let (l1, l2) = (&mut self.l1[at], &mut self.l2);
        let is_resident = l1.set(line).contains(&line);
        if is_resident || l1.arrival(line).is_some() {
            p.held += 1;
            p.of_other_eye += l1.is_of_other(line, eye);
            return;
        }
        let is_in_l2 = l2.set(line).contains(&line) || l2.arrival(line).is_some();
        if l1.is_full() || (!is_in_l2 && l2.is_full()) {
            // The L2 is not asked for lines that the L1 can't take.
            p.dropped += 1;
            return;
        }
        p.issued += 1;
        p.dram_lines += u64::from(!is_in_l2);
        p.of_other_eye += u64::from(is_in_l2) * l2.is_of_other(line, eye);
        p.useless += l1.take_unused(line);
        l1.unused.push(line);
        let data = self.fetch_l2(line, eye, now);
        self.l1[at]
            .in_flight
            .push((line, data + self.machine.l2_latency));
        self.l1[at].fetched_by.insert(line, eye);
    }

    /// The arrival of a line in the L2, which holds it or has a free MSHR.
    fn fetch_l2(&mut self, line: u32, eye: Eye, now: u64) -> u64 {
        if self.l2.hits(line) {
            self.counts.l2.hits += 1;
            return now;
        }
        if let Some(arrival) = self.l2.arrival(line) {
            self.counts.l2.merged += 1;
            return arrival;
        }
        let start = self.channel.max(now * TICKS);
        self.channel = start + self.machine.dram_ticks_per_line;
        let arrival = start.div_ceil(TICKS) + self.machine.dram_latency;
        self.counts.l2.misses += 1;
        self.counts.dram_lines += 1;
        self.l2.in_flight.push((line, arrival));
        self.l2.fetched_by.insert(line, eye);
        arrival
    }

    fn queue(&mut self, unit: usize, slot: usize) {
        let s = self.units[unit].slots[slot].as_mut().expect("a ray");
        s.doing = Doing::Queued;
        let pipeline = self.batches[s.batch].requests[s.request as usize].pipeline;
        self.counts.answers += 1;
        match pipeline {
            Pipeline::Traversal => self.counts.steps += 1,
            Pipeline::Intersection => self.counts.tests += 1,
        }
        self.units[unit].queues[pipeline as usize].push_back(slot);
    }

    fn look_up(&mut self, unit: usize, slot: usize, now: u64) {
        let mut s = self.units[unit].slots[slot].take().expect("a ray");
        let request = self.request(&s);
        s.doing = Doing::Queued;
        while s.line < request.lines {
            if !self.look_up_line(unit, slot, &request, &mut s, now) {
                s.doing = Doing::Mshr;
                self.units[unit].slots[slot] = Some(s);
                return;
            }
            s.line += 1;
        }
        self.counts.l1_fetching_requests += u64::from(s.fetched.0);
        self.counts.l2_fetching_requests += u64::from(s.fetched.1);
        let (arrival, from_dram) = s.wait;
        if arrival > now {
            s.doing = Doing::Lines(arrival, from_dram);
        }
        self.units[unit].slots[slot] = Some(s);
        if arrival <= now {
            self.queue(unit, slot);
        }
    }

    /// False if an MSHR is missing.
    fn look_up_line(
        &mut self,
        unit: usize,
        slot: usize,
        request: &Request,
        s: &mut TwinSlot,
        now: u64,
    ) -> bool {
        let kind = request.pipeline as usize;
        let line = request.first_line + s.line;
        let l1 = &mut self.l1[2 * unit + kind];
        let counts: &mut LineCounts = match kind {
            0 => &mut self.counts.node_l1,
            _ => &mut self.counts.triangle_l1,
        };
        let latency = self.machine.l2_latency;
        if l1.hits(line) {
            counts.hits += 1;
            self.counts.prefetch.useful += l1.take_unused(line);
            return true;
        }
        if let Some(arrival) = l1.arrival(line) {
            counts.merged += 1;
            self.counts.prefetch.late += l1.take_unused(line);
            s.wait = (s.wait.0.max(arrival), s.wait.1 || arrival - now > latency);
            return true;
        }
        if l1.is_full() {
            self.counts.l1_mshr_waits += 1;
            l1.queue.push_back((unit, slot));
            return false;
        }
        let is_in_l2 = self.l2.set(line).contains(&line) || self.l2.arrival(line).is_some();
        if !is_in_l2 && self.l2.is_full() {
            self.counts.l2_mshr_waits += 1;
            self.l2.queue.push_back((unit, slot));
            return false;
        }
        counts.misses += 1;
        self.counts.prefetch.useless += l1.take_unused(line);
        s.fetched = (true, s.fetched.1 || !is_in_l2);
        let data = self.fetch_l2(line, s.item.eye, now);
        let l1 = &mut self.l1[2 * unit + kind];
        l1.in_flight.push((line, data + latency));
        l1.fetched_by.insert(line, s.item.eye);
        s.wait = (s.wait.0.max(data + latency), s.wait.1 || data > now);
        true
    }

    fn issue(&mut self, unit: usize, now: u64) {
        for kind in 0..2 {
            let u = &mut self.units[unit];
            while let Some(&slot) = u.queues[kind].front()
                && let Some(pipeline) = u.pipelines[kind].iter_mut().min()
                && *pipeline < (now + 1) * TICKS
            {
                let p = &self.machine.pipelines[kind];
                *pipeline = (*pipeline).max(now * TICKS) + p.interval;
                u.queues[kind].pop_front();
                let s = u.slots[slot].as_mut().expect("a ray");
                s.doing = Doing::InPipeline(now + p.latency);
            }
        }
    }

    fn leave(&mut self, unit: usize, now: u64) {
        let u = &mut self.units[unit];
        if self.machine.in_order_return {
            while let Some(&slot) = u.order.front()
                && let Some(s) = u.slots[slot].as_mut()
                && s.doing == Doing::Finished
            {
                s.doing = Doing::Leaving(s.item.rays);
                u.leaving.push_back(slot);
                u.order.pop_front();
            }
        }
        while u.output < (now + 1) * TICKS
            && let Some(&slot) = u.leaving.front()
        {
            u.output = u.output.max(now * TICKS) + self.machine.port_interval;
            let s = u.slots[slot].as_mut().expect("a ray");
            let Doing::Leaving(rays) = &mut s.doing else {
                panic!("a ray leaves that is not finished");
            };
            *rays -= 1;
            if *rays == 0 {
                let rays = u64::from(s.item.rays);
                self.counts.rays_left += rays;
                self.counts.ray_cycles += rays * (now + 1 - s.accepted);
                self.remaining[s.batch] -= rays;
                u.slots[slot] = None;
                u.leaving.pop_front();
            }
        }
    }

    fn accept(&mut self, unit: usize, now: u64) {
        let u = &mut self.units[unit];
        loop {
            while u.next.0 < self.opened.len()
                && u.next.1 == self.batches[u.next.0].items[unit].len()
            {
                u.next = (u.next.0 + 1, 0);
            }
            let room = u.slots.iter().position(Option::is_none);
            let (Some(slot), true) = (room, u.next.0 < self.opened.len()) else {
                return;
            };
            if u.input >= (now + 1) * TICKS {
                return;
            }
            let item = self.batches[u.next.0].items[unit][u.next.1];
            let mut last = now;
            for _ in 0..item.rays {
                let start = u.input.max(now * TICKS);
                last = start / TICKS;
                u.input = start + self.machine.port_interval;
            }
            u.slots[slot] = Some(TwinSlot {
                doing: Doing::Entering(last + 1),
                batch: u.next.0,
                index: u.next.1,
                item,
                request: item.first,
                line: 0,
                wait: (0, false),
                fetched: (false, false),
                accepted: now,
            });
            u.order.push_back(slot);
            u.next.1 += 1;
            self.counts.rays_entered += u64::from(item.rays);
        }
    }

    fn classify(&mut self, now: u64) {
        for u in &self.units {
            let rays: Vec<Doing> = u.slots.iter().flatten().map(|s| s.doing).collect();
            let occupied = |ticks: &u64| *ticks > now * TICKS;
            let busy = u.queues.iter().any(|queue| !queue.is_empty())
                || u.pipelines.iter().flatten().any(occupied);
            let any = |test: fn(&Doing) -> bool| rays.iter().any(test);
            let cycles = &mut self.counts.cycles;
            if busy {
                cycles.busy += 1;
            } else if rays.is_empty() {
                cycles.no_ray += 1;
            } else if any(|d| *d == Doing::Mshr) {
                cycles.mshr += 1;
            } else if any(|d| matches!(d, Doing::Lines(_, true))) {
                cycles.dram += 1;
            } else if any(|d| matches!(d, Doing::Lines(_, false))) {
                cycles.l2 += 1;
            } else {
                cycles.latency += 1;
            }
        }
    }
}
