//! A cache that allocates on a miss: the way is allocated and its victim evicted when the line is
//! requested, not when it is filled.
//!
//! A line in flight can be evicted before it arrives. Look-ups until its arrival still merge with
//! its fetch; later ones miss. (Hardware that never evicts a line in flight must stall instead.)

use super::{Cache, Change, Delay, DelayedFill, Mshrs, NOT_IN_FLIGHT};

/// A cache to be converted to allocation on a miss.
pub struct AllocateOnMiss(pub Box<dyn Cache>);

impl Delay for AllocateOnMiss {
    type Delayed = Reserved;

    fn delayed(self, _usual_cycles: u64) -> Reserved {
        Reserved {
            cache: self.0,
            in_flight: Mshrs::new(),
        }
    }
}

/// A cache whose resident lines may still be in flight.
pub struct Reserved {
    cache: Box<dyn Cache>,
    in_flight: Mshrs,
}

impl DelayedFill for Reserved {
    fn look_up(&mut self, line: u32, now: u64) -> u64 {
        let allocated = self.cache.lookup(line);
        match self.in_flight.arrival(line, now) {
            NOT_IN_FLIGHT if allocated => 0,
            arrival => arrival,
        }
    }

    fn arrival(&mut self, line: u32, now: u64) -> u64 {
        self.in_flight.arrival(line, now)
    }

    fn holds(&mut self, line: u32, now: u64) -> bool {
        self.cache.contains(line) || self.in_flight.arrival(line, now) != NOT_IN_FLIGHT
    }

    fn enter(&mut self, line: u32, now: u64, arrival: u64) {
        self.cache.fill(line);
        if arrival > now {
            self.in_flight.enter(line, now, arrival);
        }
    }

    fn remove(&mut self, line: u32, _now: u64) -> bool {
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
