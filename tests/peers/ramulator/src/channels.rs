//! Ramulator 1 as channels of a closed loop, and channels whose latencies are recorded.

use sim::memory::dram::{Channels, DramConfig, DramPreset, DramResult};
use std::collections::HashMap;
use std::ffi::c_void;
use std::sync::{Arc, Mutex};

/// How Ramulator chooses among requests: its `Scheduler::Type`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    /// The oldest of those whose next command can be issued, which may close a row that others need.
    OldestFirst = 1,
    /// Its default: likewise, but after 16 hits to a row older requests go first.
    Published = 2,
    /// As our model: hits first, and no row is closed that a queued request needs.
    HitsFirst = 3,
}

/// Timings of Ramulator's LPDDR4. Those of DDR4 are equal to ours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Timings {
    /// Those of our device.
    Ours,
    /// Its own.
    Own,
    /// Its own, with our duration of a refresh.
    OwnButRefresh,
}

/// `PeerSettings` of channels.cc.
#[repr(C)]
struct Settings {
    is_lpddr4: bool,
    order: i32,
    counts: [u32; 3],
    clocks: [u32; 14],
}

unsafe extern "C" {
    fn peer_new(settings: *const Settings) -> *mut c_void;
    fn peer_delete(peer: *mut c_void);
    fn peer_takes_write(peer: *mut c_void, burst: u64) -> bool;
    fn peer_request(peer: *mut c_void, burst: u64, write: bool, clock: i64, number: u64);
    fn peer_advance(peer: *mut c_void, clock: i64);
    fn peer_answer(peer: *mut c_void, number: *mut u64, clock: *mut i64) -> bool;
    fn peer_counts(peer: *mut c_void, counts: *mut [u64; 5]);
}

/// Ramulator with the timings of our devices.
pub struct Ramulator(*mut c_void);

// SAFETY: the peer has no state that belongs to a thread, except lists of its statistics that are never read.
unsafe impl Send for Ramulator {}

impl Ramulator {
    /// An idle memory.
    pub fn new(config: &DramConfig, policy: Policy, timings: Timings) -> Self {
        let is_lpddr4 = match config.preset {
            DramPreset::Lpddr4 => true,
            DramPreset::Ddr4 => false,
            other => panic!("{other:?}: expected lpddr4 or ddr4"),
        };
        let d = config.preset.device();
        let burst = if timings == Timings::Ours { d.burst } else { 0 };
        let rfc = if timings == Timings::Own { 0 } else { d.rfc };
        let settings = Settings {
            is_lpddr4,
            order: policy as i32,
            counts: [config.channels, config.queue, 16],
            clocks: [
                burst, d.cl, d.rcd, d.rp, d.ras, d.rtp, d.cwl, d.wr, d.wtr_l, d.ccd_l, d.rrd_l,
                d.faw, rfc, d.refi,
            ],
        };
        // SAFETY: the layout is that of channels.cc.
        Self(unsafe { peer_new(&raw const settings) })
    }
}

impl Drop for Ramulator {
    fn drop(&mut self) {
        // SAFETY: the pointer is from `peer_new`, here and below.
        unsafe { peer_delete(self.0) }
    }
}

impl Channels for Ramulator {
    fn takes_write(&self, burst: u64) -> bool {
        unsafe { peer_takes_write(self.0, burst) }
    }

    fn request(&mut self, burst: u64, write: bool, clock: u64, number: u64) {
        unsafe { peer_request(self.0, burst, write, clock as i64, number) }
    }

    fn advance(&mut self, clock: u64, answered: &mut Vec<(u64, u64)>) {
        let (mut number, mut at) = (0, 0);
        unsafe { peer_advance(self.0, clock as i64) }
        while unsafe { peer_answer(self.0, &raw mut number, &raw mut at) } {
            answered.push((number, at as u64));
        }
    }

    fn result(&self) -> DramResult {
        let mut counts = [0; 5];
        unsafe { peer_counts(self.0, &raw mut counts) }
        let [reads, writes, row_hits, hits, activates] = counts;
        DramResult {
            reads,
            writes,
            row_hits,
            write_row_hits: hits - row_hits,
            activates,
            ..DramResult::default()
        }
    }
}

/// What channels did.
#[derive(Clone, Debug, Default)]
pub struct Record {
    /// Read bursts by clocks from arrival to last data.
    pub latencies: Vec<u64>,
    /// Counts.
    pub result: DramResult,
}

impl Record {
    fn reads(&self) -> f64 {
        self.latencies.iter().sum::<u64>() as f64
    }

    /// Mean clocks.
    pub fn mean(&self) -> f64 {
        let sum: u64 = (0..)
            .zip(&self.latencies)
            .map(|(clocks, count): (u64, _)| clocks * count)
            .sum();
        sum as f64 / self.reads()
    }

    /// Largest distance of the two cumulative distributions (Kolmogorov and Smirnov).
    pub fn distance(&self, other: &Self) -> f64 {
        let (mut sums, mut largest) = ([0; 2], 0.0_f64);
        for at in 0..self.latencies.len().max(other.latencies.len()) {
            let shares = [(self, 0), (other, 1)].map(|(of, side)| {
                sums[side] += of.latencies.get(at).unwrap_or(&0);
                sums[side] as f64 / of.reads()
            });
            largest = largest.max((shares[0] - shares[1]).abs());
        }
        largest
    }
}

/// Channels whose latencies are recorded, from the beginning to the end of their life.
pub struct Recorded {
    channels: Box<dyn Channels>,
    /// Clock of arrival of each request, and whether it writes.
    arrivals: HashMap<u64, (u64, bool)>,
    record: Record,
    to: Arc<Mutex<Record>>,
}

impl Recorded {
    /// Channels that write their record to `to` when they are dropped.
    pub fn new(channels: Box<dyn Channels>, to: &Arc<Mutex<Record>>) -> Self {
        Self {
            channels,
            arrivals: HashMap::new(),
            record: Record::default(),
            to: Arc::clone(to),
        }
    }
}

impl Channels for Recorded {
    fn takes_write(&self, burst: u64) -> bool {
        self.channels.takes_write(burst)
    }

    fn request(&mut self, burst: u64, write: bool, clock: u64, number: u64) {
        self.arrivals.insert(number, (clock, write));
        self.channels.request(burst, write, clock, number);
    }

    fn advance(&mut self, clock: u64, answered: &mut Vec<(u64, u64)>) {
        let before = answered.len();
        self.channels.advance(clock, answered);
        for (number, data) in &answered[before..] {
            let (arrival, write) = self.arrivals[number];
            if write {
                continue;
            }
            let latencies = &mut self.record.latencies;
            let latency = (data - arrival) as usize;
            latencies.resize(latencies.len().max(latency + 1), 0);
            latencies[latency] += 1;
        }
    }

    fn result(&self) -> DramResult {
        self.channels.result()
    }
}

impl Drop for Recorded {
    fn drop(&mut self) {
        let result = self.channels.result();
        let record = std::mem::take(&mut self.record);
        *self.to.lock().expect("no panic") = Record { result, ..record };
    }
}
