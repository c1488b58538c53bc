//! A hash table of the lines in flight into a cache.
//!
//! Entries expire: a line whose arrival time is not later than `now` counts as filled, and its
//! entry can be reused. A line can be in any of the four entries of its bucket, which are compared
//! together.

use super::NOT_IN_FLIGHT;
use std::hint::select_unpredictable;

/// Buckets of four entries. Texture units have a few dozen lines in flight.
const BUCKETS: usize = 128;

/// Entries for lines with the same hash.
#[derive(Clone, Copy, Debug)]
struct Bucket {
    lines: [u32; 4],
    /// Arrival of each line; 0 in an unused entry.
    arrivals: [u64; 4],
}

/// Lines in flight.
#[derive(Clone, Debug)]
pub struct Mshrs {
    /// One bucket per hash value, which avoids bounds checks.
    buckets: Box<[Bucket; BUCKETS]>,
    /// Lines whose bucket was full, with their arrivals.
    others: Vec<(u32, u64)>,
    /// The latest arrival among these.
    others_until: u64,
}

impl Mshrs {
    pub fn new() -> Self {
        let empty = Bucket {
            lines: [0; 4],
            arrivals: [0; 4],
        };
        Self {
            buckets: Box::new([empty; BUCKETS]),
            others: Vec::new(),
            others_until: 0,
        }
    }

    /// Arrival of a line, after `now`, or [`NOT_IN_FLIGHT`].
    #[inline(always)]
    pub fn arrival(&self, line: u32, now: u64) -> u64 {
        let bucket = &self.buckets[bucket(line)];
        let mut found = NOT_IN_FLIGHT;
        for (&other, &arrival) in bucket.lines.iter().zip(&bucket.arrivals) {
            // A branch would be unpredictable.
            found = select_unpredictable((other == line) & (arrival > now), arrival, found);
        }
        if self.others_until > now {
            found = found.min(self.among_others(line, now));
        }
        found
    }

    #[cold]
    fn among_others(&self, line: u32, now: u64) -> u64 {
        let mshrs = |&(other, arrival): &(u32, u64)| other == line && arrival > now;
        let found = self.others.iter().copied().find(mshrs);
        found.map_or(NOT_IN_FLIGHT, |(_, arrival)| arrival)
    }

    /// Adds a line that is not in flight at `now`.
    #[inline(always)]
    pub fn enter(&mut self, line: u32, now: u64, arrival: u64) {
        let Bucket { lines, arrivals } = &mut self.buckets[bucket(line)];
        let mut place = arrivals.len();
        for (index, &other) in arrivals.iter().enumerate() {
            place = select_unpredictable(other <= now, index, place);
        }
        match arrivals.get_mut(place) {
            Some(free) => (lines[place], *free) = (line, arrival),
            None => self.enter_other(line, now, arrival),
        }
    }

    #[cold]
    fn enter_other(&mut self, line: u32, now: u64, arrival: u64) {
        self.others.retain(|(_, arrival)| *arrival > now);
        self.others.push((line, arrival));
        self.others_until = self.others_until.max(arrival);
    }

    pub fn clear(&mut self) {
        *self = Self::new();
    }
}

/// Hashes by the high bits of a product, because lines in flight into one set share their low bits.
#[inline(always)]
fn bucket(line: u32) -> usize {
    line.wrapping_mul(0x9e37_79b1) as usize >> (u32::BITS - BUCKETS.ilog2())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::HashMap;

    proptest! {
        /// Uses more lines than the table has entries.
        #[test]
        fn lines_are_found_until_they_arrive(
            steps in prop::collection::vec((0_u64..4, 0_u32..4000, 1_u64..300), 1..3000),
        ) {
            let mut table = Mshrs::new();
            let mut plain: HashMap<u32, u64> = HashMap::new();
            let mut now = 0;
            for (index, (pause, line, latency)) in steps.into_iter().enumerate() {
                now += pause;
                let of = plain.get(&line).filter(|arrival| **arrival > now);
                let expected = of.copied().unwrap_or(NOT_IN_FLIGHT);
                prop_assert_eq!(table.arrival(line, now), expected);
                if expected == NOT_IN_FLIGHT {
                    table.enter(line, now, now + latency);
                    plain.insert(line, now + latency);
                }
                if index == 2000 {
                    table.clear();
                    plain.clear();
                }
            }
        }
    }
}
