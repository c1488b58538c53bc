//! Misses in flight (the entries of a miss status holding register file, without a limit): a line
//! that was asked for and is not there yet. Whoever asks again meanwhile waits for the same fetch.

use super::Cache;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use std::hash::{BuildHasherDefault, Hasher};

/// Lines on their way into one cache.
#[derive(Debug, Default)]
pub struct InFlight {
    /// Cycle of arrival by line.
    lines: HashMap<u32, u64, BuildHasherDefault<LineHasher>>,
    /// Arrivals, the earliest on top; the count keeps equal ones in the order of their requests.
    arrivals: BinaryHeap<Reverse<(u64, u64, u32)>>,
    requests: u64,
}

impl InFlight {
    /// When the line arrives, if it is on its way.
    #[inline]
    #[must_use]
    pub fn arrival(&self, line: u32) -> Option<u64> {
        self.lines.get(&line).copied()
    }

    /// The line, which is not on its way yet, will arrive at `cycle`.
    pub fn request(&mut self, line: u32, cycle: u64) {
        self.lines.insert(line, cycle);
        self.arrivals.push(Reverse((cycle, self.requests, line)));
        self.requests += 1;
    }

    /// Fills what has arrived by `now` into the cache.
    #[inline]
    pub fn arrive(&mut self, now: u64, cache: &mut impl Cache) {
        while let Some(&Reverse((cycle, _, line))) = self.arrivals.peek() {
            if cycle > now {
                break;
            }
            self.arrivals.pop();
            self.lines.remove(&line);
            cache.fill(line);
        }
    }
}

/// Multiplicative hash: line numbers are not hostile, and SipHash would dominate the lookup.
#[derive(Debug, Default)]
pub struct LineHasher(u64);

impl Hasher for LineHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u32(self.0 as u32 ^ u32::from(byte));
        }
    }

    fn write_u32(&mut self, line: u32) {
        let product = u64::from(line).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        // The table takes its index from the low bits and its tag from the high ones.
        self.0 = product ^ product >> 32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cache::{Lru, WaysOf};

    #[test]
    fn a_line_is_in_the_cache_from_its_arrival_on() {
        let mut cache = Lru::new(4, WaysOf::<4>);
        let mut in_flight = InFlight::default();
        in_flight.request(7, 20);
        in_flight.arrive(19, &mut cache);
        assert_eq!(in_flight.arrival(7), Some(20));
        assert!(!cache.lookup(7));
        in_flight.arrive(20, &mut cache);
        assert_eq!(in_flight.arrival(7), None);
        assert!(cache.lookup(7));
    }

    #[test]
    fn lines_arrive_in_the_order_of_time_not_of_requests() {
        let mut cache = Lru::new(1, WaysOf::<1>);
        let mut in_flight = InFlight::default();
        in_flight.request(1, 220);
        in_flight.request(2, 20);
        in_flight.arrive(300, &mut cache);
        assert!(
            cache.lookup(1),
            "the later arrival replaced the earlier one"
        );
    }
}
