//! Lines on their way into a cache, to be found by number.
//!
//! Nobody tells when a line has arrived: whoever asks says what time it is, and what arrives up to then
//! is as good as gone. So a line has one of four places, all looked at at once, and the next one that
//! needs a place takes any whose time has passed.

use super::delayed::NOT_ASKED;
use std::hint::select_unpredictable;

/// Buckets of four places. Texture units have some dozens of lines on their way.
const BUCKETS: usize = 128;

/// Places for lines of one hash.
#[derive(Clone, Copy, Debug)]
struct Bucket {
    lines: [u32; 4],
    /// When each arrives; long ago where there is none.
    arrivals: [u64; 4],
}

/// Lines on their way.
#[derive(Clone, Debug)]
pub(super) struct OnTheWay {
    /// As many as a hash has values, which spares checks.
    buckets: Box<[Bucket; BUCKETS]>,
    /// For whose hash there was no place: line and arrival.
    others: Vec<(u32, u64)>,
    /// When the last of these arrives.
    others_until: u64,
}

impl OnTheWay {
    pub(super) fn new() -> Self {
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

    /// When a line arrives, after `now`, or [`NOT_ASKED`].
    #[inline(always)]
    pub(super) fn arrival(&self, line: u32, now: u64) -> u64 {
        let bucket = &self.buckets[bucket(line)];
        let mut found = NOT_ASKED;
        for (&other, &arrival) in bucket.lines.iter().zip(&bucket.arrivals) {
            // No branches: which of them it is, the processor cannot guess.
            found = select_unpredictable((other == line) & (arrival > now), arrival, found);
        }
        if self.others_until > now {
            found = found.min(self.among_others(line, now));
        }
        found
    }

    #[cold]
    fn among_others(&self, line: u32, now: u64) -> u64 {
        let on_the_way = |&(other, arrival): &(u32, u64)| other == line && arrival > now;
        let found = self.others.iter().copied().find(on_the_way);
        found.map_or(NOT_ASKED, |(_, arrival)| arrival)
    }

    /// A line that is not on its way `now` arrives later.
    #[inline(always)]
    pub(super) fn enter(&mut self, line: u32, now: u64, arrival: u64) {
        let Bucket { lines, arrivals } = &mut self.buckets[bucket(line)];
        let mut place = arrivals.len();
        for (index, &other) in arrivals.iter().enumerate() {
            // No branches either.
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

    pub(super) fn clear(&mut self) {
        *self = Self::new();
    }
}

/// By the high bits of a product: lines of one set, of which many may be on their way, share their low bits.
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
        /// More lines than there are places for.
        #[test]
        fn lines_are_found_until_they_arrive(
            steps in prop::collection::vec((0_u64..4, 0_u32..4000, 1_u64..300), 1..3000),
        ) {
            let mut table = OnTheWay::new();
            let mut plain: HashMap<u32, u64> = HashMap::new();
            let mut now = 0;
            for (index, (pause, line, latency)) in steps.into_iter().enumerate() {
                now += pause;
                let of = plain.get(&line).filter(|arrival| **arrival > now);
                let expected = of.copied().unwrap_or(NOT_ASKED);
                prop_assert_eq!(table.arrival(line, now), expected);
                if expected == NOT_ASKED {
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
