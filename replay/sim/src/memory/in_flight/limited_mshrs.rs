//! A limited number of MSHRs: a miss that finds all in use waits for the first free one.

use crate::result::MshrResult;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The MSHRs of a cache whose misses come in order of time.
pub struct LimitedMshrs {
    most: usize,
    /// Cycle at which each MSHR in use becomes free, earliest on top.
    free_at: BinaryHeap<Reverse<u64>>,
    /// Counts so far.
    pub counts: MshrResult,
}

impl LimitedMshrs {
    /// `most` MSHRs, at least one, all free.
    pub fn new(most: u32) -> Self {
        Self {
            most: most.max(1) as usize,
            free_at: BinaryHeap::new(),
            counts: MshrResult::default(),
        }
    }

    fn free(&mut self, now: u64) {
        while self.free_at.peek().is_some_and(|&Reverse(at)| at <= now) {
            self.free_at.pop();
        }
    }

    /// True if all are in use.
    pub fn are_in_use(&mut self, now: u64) -> bool {
        self.free(now);
        self.free_at.len() >= self.most
    }

    /// The cycle at which the first MSHR in use becomes free.
    pub fn next_free(&self) -> Option<u64> {
        self.free_at.peek().map(|&Reverse(at)| at)
    }

    /// The cycle at which a miss at `now` gets an MSHR. Times of successive misses must not
    /// decrease; the returned times do not either.
    pub fn start(&mut self, now: u64) -> u64 {
        if !self.are_in_use(now) {
            return now;
        }
        let start = self.free_at.pop().map_or(now, |Reverse(at)| at);
        self.counts.stalled_misses += 1;
        self.counts.stall_cycles += start - now;
        start
    }

    /// Occupies the MSHR of the last miss until its line arrives.
    pub fn enter(&mut self, arrival: u64) {
        self.free_at.push(Reverse(arrival));
        self.counts.peak = self.counts.peak.max(self.free_at.len() as u64);
    }

    /// Frees all MSHRs.
    pub fn clear(&mut self) {
        self.free_at.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn one_mshr_serialises_misses() {
        let mut mshrs = LimitedMshrs::new(1);
        for (now, expected) in [(0, 0), (10, 100), (20, 200), (500, 500)] {
            let start = mshrs.start(now);
            assert_eq!(start, expected);
            mshrs.enter(start + 100);
        }
        let expected = MshrResult {
            peak: 1,
            stalled_misses: 2,
            stall_cycles: 90 + 180,
        };
        assert_eq!(mshrs.counts, expected);
    }

    proptest! {
        /// Compares with a queue with one slot per MSHR: each miss takes the slot that is free first.
        #[test]
        fn misses_start_as_in_a_queue_with_one_server_per_mshr(
            most in 1_u32..6,
            misses in prop::collection::vec((0_u64..60, 1_u64..200), 1..200),
        ) {
            let mut mshrs = LimitedMshrs::new(most);
            let mut free_at = vec![0_u64; most as usize];
            let (mut now, mut stalled) = (0, 0);
            for (pause, latency) in misses {
                now += pause;
                let slot = (0..free_at.len()).min_by_key(|&slot| free_at[slot]).unwrap();
                let expected = now.max(free_at[slot]);
                stalled += u64::from(expected > now);
                prop_assert_eq!(mshrs.start(now), expected);
                mshrs.enter(expected + latency);
                free_at[slot] = expected + latency;
            }
            prop_assert_eq!(mshrs.counts.stalled_misses, stalled);
            prop_assert!(mshrs.counts.peak <= u64::from(most));
        }
    }
}
