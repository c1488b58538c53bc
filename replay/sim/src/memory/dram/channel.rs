//! A DRAM channel: its queues, its banks and the earliest clock of each command.

use super::PagePolicy;
use super::mapping::BurstAddress;
use super::presets::Device;
use std::collections::VecDeque;

/// Counts of a channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Counts {
    /// Reads.
    pub reads: u64,
    /// Reads whose row was open when first scheduled, or was opened for an earlier request.
    pub row_hits: u64,
    /// Reads that opened a row in a bank without an open row.
    pub row_empty: u64,
    /// Reads that first had to close another row.
    pub row_conflicts: u64,
    /// Rows opened.
    pub activates: u64,
    /// Writes.
    pub writes: u64,
    /// Writes whose row was open.
    pub write_row_hits: u64,
    /// Refreshes of all banks.
    pub refreshes: u64,
    /// Clock of the last data.
    pub end: u64,
    /// Histogram of read latencies in clocks, from arrival to last data.
    pub latencies: Vec<u64>,
}

/// A queued request.
#[derive(Clone, Copy, Debug)]
struct Request {
    place: BurstAddress,
    arrival: u64,
    /// The first command it needed.
    needed: Option<Needed>,
    /// Number to be answered with, in a closed loop.
    number: Option<u64>,
}

/// The next command of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Needed {
    /// A read or a write.
    Data,
    Activate,
    Precharge,
}

/// A bank: its open row and the earliest clock of each command.
#[derive(Clone, Copy, Debug, Default)]
struct Bank {
    row: Option<u64>,
    data_from: u64,
    activate_from: u64,
    precharge_from: u64,
}

/// A DRAM channel.
#[derive(Clone, Debug)]
pub struct Channel {
    device: Device,
    capacity: usize,
    policy: PagePolicy,
    banks: Vec<Bank>,
    /// Per bank group.
    read_from: Vec<u64>,
    write_from: Vec<u64>,
    activate_from: Vec<u64>,
    /// Clocks of the last four activates (tFAW window).
    window: VecDeque<u64>,
    reads: Vec<Request>,
    writes: Vec<Request>,
    /// True while writes are served.
    is_writing: bool,
    /// Requests that found their queue full: place, true for writes, arrival clock and number if given.
    backlog: VecDeque<(BurstAddress, bool, Option<u64>, Option<u64>)>,
    /// The next free clock of the command bus.
    now: u64,
    refresh_due: u64,
    /// Counts so far.
    pub counts: Counts,
    /// Numbers of answered requests, each with the clock of its last data.
    pub answered: Vec<(u64, u64)>,
}

impl Channel {
    /// A channel with all banks closed.
    pub fn new(device: Device, capacity: usize, policy: PagePolicy) -> Self {
        let groups = device.groups as usize;
        Self {
            device,
            capacity,
            policy,
            banks: vec![Bank::default(); device.banks() as usize],
            read_from: vec![0; groups],
            write_from: vec![0; groups],
            activate_from: vec![0; groups],
            window: VecDeque::with_capacity(4),
            reads: Vec::with_capacity(capacity),
            writes: Vec::new(),
            is_writing: false,
            backlog: VecDeque::new(),
            now: 0,
            refresh_due: u64::from(device.refi),
            counts: Counts::default(),
            answered: Vec::new(),
        }
    }

    /// The next free clock of the command bus.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// Adds a request that arrives at `clock`, or without one as soon as the queue has room.
    pub fn arrive(&mut self, place: BurstAddress, write: bool, clock: Option<u64>) {
        if let Some(clock) = clock {
            self.advance(clock);
        } else {
            while self.queue(write).len() >= self.capacity || !self.backlog.is_empty() {
                self.step(None);
            }
        }
        self.backlog.push_back((place, write, clock, None));
        self.admit();
    }

    /// Adds a numbered request that arrives at `clock`. The caller has checked that a write finds room.
    pub fn arrive_numbered(&mut self, place: BurstAddress, write: bool, clock: u64, number: u64) {
        self.advance(clock);
        match write {
            true => self.writes.push(Request {
                place,
                arrival: clock,
                needed: None,
                number: Some(number),
            }),
            false => self
                .backlog
                .push_back((place, write, Some(clock), Some(number))),
        }
        self.admit();
    }

    /// True if the queue of writes has room.
    pub fn takes_writes(&self) -> bool {
        self.writes.len() < self.capacity
    }

    /// Issues the commands before `clock`. Later requests cannot change them.
    pub fn advance(&mut self, clock: u64) {
        while self.is_busy() && self.step(Some(clock)) {}
        if !self.is_busy() {
            // The channel was idle; only refreshes happened.
            while self.refresh_due <= clock {
                self.now = self.now.max(self.refresh_due);
                self.refresh();
            }
            self.now = self.now.max(clock);
        }
    }

    /// True while a request is queued.
    pub fn is_busy(&self) -> bool {
        !(self.reads.is_empty() && self.writes.is_empty())
    }

    fn queue(&mut self, write: bool) -> &mut Vec<Request> {
        match write {
            true => &mut self.writes,
            false => &mut self.reads,
        }
    }

    /// The queue being served.
    fn served(&self) -> &[Request] {
        match self.is_writing {
            true => &self.writes,
            false => &self.reads,
        }
    }

    /// Switches between reads and writes when the queue levels require it.
    fn turn(&mut self) {
        let writes = self.writes.len();
        self.is_writing = match self.is_writing {
            false => 5 * writes > 4 * self.capacity || (self.reads.is_empty() && writes > 0),
            true => writes > 0 && (5 * writes >= self.capacity || self.reads.is_empty()),
        };
    }

    /// Serves all queued requests.
    pub fn drain(&mut self) {
        while self.is_busy() {
            self.step(None);
        }
    }

    /// Moves requests from the backlog into the queues while there is room.
    fn admit(&mut self) {
        while let Some(&(place, write, clock, number)) = self.backlog.front()
            && self.queue(write).len() < self.capacity
        {
            self.backlog.pop_front();
            let arrival = clock.unwrap_or(self.now);
            self.queue(write).push(Request {
                place,
                arrival,
                needed: None,
                number,
            });
        }
    }

    /// Issues the next command if it comes before `until`. Returns whether it did.
    fn step(&mut self, until: Option<u64>) -> bool {
        let before = |clock: u64| until.is_none_or(|until| clock < until);
        if self.now >= self.refresh_due {
            self.refresh();
            return true;
        }
        self.turn();
        let mut best: Option<(u64, bool, usize, Needed)> = None;
        for (index, request) in self.served().iter().enumerate() {
            let Some((from, needed)) = self.next_command(request) else {
                continue;
            };
            let from = from.max(self.now).max(request.arrival);
            let other = needed != Needed::Data;
            // The queue is in order of arrival, so the older request wins a tie.
            if best.is_none_or(|(clock, is_other, ..)| (from, other) < (clock, is_other)) {
                best = Some((from, other, index, needed));
            }
        }
        let Some((clock, _, index, needed)) = best else {
            return false;
        };
        if clock >= self.refresh_due && before(self.refresh_due) {
            self.now = self.refresh_due;
            return true;
        }
        if !before(clock) {
            return false;
        }
        self.now = clock + 1;
        let write = self.is_writing;
        let request = &mut self.queue(write)[index];
        request.needed.get_or_insert(needed);
        let place = request.place;
        match needed {
            Needed::Precharge => self.precharge(place.bank as usize, clock),
            Needed::Activate => self.activate(place, clock),
            Needed::Data => self.transfer(index, clock),
        }
        true
    }

    /// The next command of a request and its earliest clock. None while queued requests still need
    /// the bank's open row.
    fn next_command(&self, request: &Request) -> Option<(u64, Needed)> {
        let BurstAddress {
            bank, group, row, ..
        } = request.place;
        let (bank_state, group) = (&self.banks[bank as usize], group as usize);
        match bank_state.row {
            Some(open) if open == row => {
                let of_bus = match self.is_writing {
                    true => self.write_from[group],
                    false => self.read_from[group],
                };
                Some((bank_state.data_from.max(of_bus), Needed::Data))
            }
            Some(open) => {
                let is_wanted =
                    |other: &Request| other.place.bank == bank && other.place.row == open;
                (!self.served().iter().any(is_wanted))
                    .then_some((bank_state.precharge_from, Needed::Precharge))
            }
            None => {
                let window = match self.window.len() {
                    4 => self.window[0] + u64::from(self.device.faw),
                    _ => 0,
                };
                let from = bank_state.activate_from.max(self.activate_from[group]);
                Some((from.max(window), Needed::Activate))
            }
        }
    }

    fn precharge(&mut self, bank: usize, clock: u64) {
        let bank = &mut self.banks[bank];
        bank.row = None;
        bank.activate_from = bank.activate_from.max(clock + u64::from(self.device.rp));
    }

    fn activate(&mut self, place: BurstAddress, clock: u64) {
        let device = &self.device;
        let bank = &mut self.banks[place.bank as usize];
        bank.row = Some(place.row);
        bank.data_from = clock + u64::from(device.rcd);
        bank.precharge_from = clock + u64::from(device.ras);
        for (group, from) in (0..).zip(&mut self.activate_from) {
            let gap = if group == place.group {
                device.rrd_l
            } else {
                device.rrd_s
            };
            *from = (*from).max(clock + u64::from(gap));
        }
        if self.window.len() == 4 {
            self.window.pop_front();
        }
        self.window.push_back(clock);
        self.counts.activates += 1;
    }

    /// Reads or writes the burst of a request.
    fn transfer(&mut self, index: usize, clock: u64) {
        let (device, write) = (self.device, self.is_writing);
        let request = self.queue(write).remove(index);
        let place = request.place;
        let burst = u64::from(device.burst);
        let latency = u64::from(if write { device.cwl } else { device.cl });
        let data = clock + latency + burst;
        for group in 0..device.groups as usize {
            let is_same = group == place.group as usize;
            let [ccd, wtr] = match is_same {
                true => [device.ccd_l, device.wtr_l],
                false => [device.ccd_s, device.wtr_s],
            };
            let same_way = clock + u64::from(ccd.max(device.burst));
            let other_way = match write {
                true => data + u64::from(wtr),
                // The data bus needs two idle clocks when it changes direction.
                false => (data + 2).saturating_sub(u64::from(device.cwl)),
            };
            let [reads, writes] = match write {
                true => [other_way, same_way],
                false => [same_way, other_way],
            };
            self.read_from[group] = self.read_from[group].max(reads);
            self.write_from[group] = self.write_from[group].max(writes);
        }
        let bank = &mut self.banks[place.bank as usize];
        let recovered = match write {
            true => data + u64::from(device.wr),
            false => clock + u64::from(device.rtp),
        };
        bank.precharge_from = bank.precharge_from.max(recovered);
        self.count(&request, data);
        self.admit();
        let wants =
            |other: &Request| other.place.bank == place.bank && other.place.row == place.row;
        if self.policy == PagePolicy::Closed && !self.reads.iter().chain(&self.writes).any(wants) {
            // Auto-precharge belongs to the transfer and takes no slot on the command bus.
            let from = self.banks[place.bank as usize].precharge_from;
            self.precharge(place.bank as usize, from);
        }
    }

    fn count(&mut self, request: &Request, data: u64) {
        let answer = request.number.map(|number| (number, data));
        self.answered.extend(answer);
        let counts = &mut self.counts;
        counts.end = counts.end.max(data);
        let is_hit = !matches!(request.needed, Some(Needed::Precharge | Needed::Activate));
        if self.is_writing {
            counts.writes += 1;
            counts.write_row_hits += u64::from(is_hit);
            return;
        }
        counts.reads += 1;
        match request.needed {
            Some(Needed::Precharge) => counts.row_conflicts += 1,
            Some(Needed::Activate) => counts.row_empty += 1,
            _ => counts.row_hits += 1,
        }
        let latency = (data - request.arrival) as usize;
        // Very long latencies share one bucket.
        let latency = latency.min(LONGEST);
        if counts.latencies.len() <= latency {
            counts.latencies.resize(latency + 1, 0);
        }
        counts.latencies[latency] += 1;
    }

    /// Closes all rows and refreshes all banks.
    fn refresh(&mut self) {
        let rp = u64::from(self.device.rp);
        let ready = self.banks.iter().map(|bank| match bank.row {
            Some(_) => bank.precharge_from.max(self.now) + rp,
            None => bank.activate_from.max(self.now),
        });
        let start = ready.max().unwrap_or(self.now);
        let end = start + u64::from(self.device.rfc);
        for bank in &mut self.banks {
            bank.row = None;
            bank.activate_from = end;
        }
        self.counts.refreshes += 1;
        self.refresh_due += u64::from(self.device.refi);
        self.now = start + 1;
    }
}

/// Latencies above this many clocks count as this many.
const LONGEST: usize = 1 << 20;
