//! Caches with delayed fills. A line that was requested and has not arrived is *in flight* (it
//! occupies an MSHR, of unlimited number). Further requests for it merge with the same fetch.
//!
//! Lines are filled in order of arrival, equal arrivals in order of request. Cycles never decrease
//! from call to call.

mod allocate_on_miss;
mod calendar;
mod immediate;
mod limited_mshrs;
mod table;

pub use allocate_on_miss::AllocateOnMiss;
pub use immediate::Immediate;
pub use limited_mshrs::LimitedMshrs;
pub use table::Mshrs;

use super::{Cache, Change};
use calendar::InFlight;

/// The arrival of a line that is not in flight.
pub const NOT_IN_FLIGHT: u64 = u64::MAX;

/// A cache and its lines in flight.
pub trait DelayedFill: Send {
    /// False if a requested line arrives at once, and cycles mean nothing.
    const HAS_LATENCIES: bool = true;

    /// Looks up lines and marks resident ones as used. Calls `missing` for each other line, in
    /// order, with its index, number and arrival ([`NOT_IN_FLIGHT`] if it was not requested).
    fn look_up_all(&mut self, lines: &[u32], now: u64, mut missing: impl FnMut(usize, u32, u64)) {
        for (index, &line) in lines.iter().enumerate() {
            match self.look_up(line, now) {
                0 => {}
                arrival => missing(index, line, arrival),
            }
        }
    }

    /// Looks up a line and marks it as used. Returns its arrival: 0 if it is resident,
    /// [`NOT_IN_FLIGHT`] if it was not requested.
    fn look_up(&mut self, line: u32, now: u64) -> u64;

    /// Arrival of a line in flight, or [`NOT_IN_FLIGHT`].
    fn arrival(&mut self, line: u32, now: u64) -> u64;

    /// True if the line is resident or in flight. Marks nothing as used.
    fn holds(&mut self, line: u32, now: u64) -> bool;

    /// Fills a line that is neither resident nor in flight, immediately or at its arrival.
    /// [`Self::look_up`] or [`Self::holds`] was called for it in this cycle.
    fn enter(&mut self, line: u32, now: u64, arrival: u64);

    /// Removes a resident line; one in flight still arrives. Returns true if it was resident.
    fn remove(&mut self, line: u32, now: u64) -> bool;

    /// Appends the lines evicted since the last call, if the cache records them.
    fn take_evicted(&mut self, _lines: &mut Vec<u32>) {}

    /// Appends the changes of the content since the last call, if the cache records them.
    fn take_changes(&mut self, _changes: &mut Vec<Change>) {}

    /// Empties the cache and drops the lines in flight.
    fn clear(&mut self);
}

/// A cache that supports delayed fills.
pub trait Delay {
    /// The cache with its lines in flight.
    type Delayed: DelayedFill;

    /// An empty cache; most lines arrive within `usual_cycles`.
    fn delayed(self, usual_cycles: u64) -> Self::Delayed;
}

/// Any policy fills in order of time.
impl Delay for Box<dyn Cache> {
    type Delayed = TimeOrder<Self>;

    fn delayed(self, usual_cycles: u64) -> Self::Delayed {
        TimeOrder {
            cache: self,
            in_flight: InFlight::new(usual_cycles),
        }
    }
}

/// A cache that fills arrived lines in order of time before each look-up.
#[derive(Debug)]
pub struct TimeOrder<C> {
    cache: C,
    in_flight: InFlight,
}

impl<C: Cache> DelayedFill for TimeOrder<C> {
    fn look_up_all(&mut self, lines: &[u32], now: u64, mut missing: impl FnMut(usize, u32, u64)) {
        self.in_flight.arrive(now, &mut self.cache);
        let mut start = 0;
        while let Some(index) = self.cache.lookup_all(&lines[start..]) {
            let index = start + index;
            let line = lines[index];
            let arrival = self.in_flight.arrival(line).unwrap_or(NOT_IN_FLIGHT);
            missing(index, line, arrival);
            start = index + 1;
        }
    }

    fn look_up(&mut self, line: u32, now: u64) -> u64 {
        self.in_flight.arrive(now, &mut self.cache);
        if self.cache.lookup(line) {
            return 0;
        }
        self.in_flight.arrival(line).unwrap_or(NOT_IN_FLIGHT)
    }

    fn arrival(&mut self, line: u32, now: u64) -> u64 {
        self.in_flight.arrive(now, &mut self.cache);
        self.in_flight.arrival(line).unwrap_or(NOT_IN_FLIGHT)
    }

    fn holds(&mut self, line: u32, now: u64) -> bool {
        self.in_flight.arrive(now, &mut self.cache);
        self.cache.contains(line) || self.in_flight.arrival(line).is_some()
    }

    fn enter(&mut self, line: u32, now: u64, arrival: u64) {
        if arrival <= now {
            self.cache.fill(line);
        } else {
            self.in_flight.request(line, now, arrival);
        }
    }

    fn remove(&mut self, line: u32, now: u64) -> bool {
        self.in_flight.arrive(now, &mut self.cache);
        self.cache.remove(line)
    }

    fn take_evicted(&mut self, lines: &mut Vec<u32>) {
        self.cache.take_evicted(lines);
    }

    fn take_changes(&mut self, changes: &mut Vec<Change>) {
        self.cache.take_changes(changes);
    }

    fn clear(&mut self) {
        self.cache.clear();
        self.in_flight.clear();
    }
}
