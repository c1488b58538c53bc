//! Misses in flight (MSHRs without a limit): lines that were requested and have not arrived.
//! Further requests for such a line merge with its fetch. Arrivals are events of a calendar.

use super::Cache;
use crate::memory::calendar::Calendar;

/// No entry.
const NONE: u32 = u32::MAX;

/// Number of hash chains, by the low bits of the line.
const CHAINS: usize = 256;

/// A line in flight. Entries are reused after its arrival.
#[derive(Clone, Copy, Debug)]
struct Entry {
    line: u32,
    /// Next entry of its chain, or next free entry.
    chained: u32,
    cycle: u64,
}

/// Lines in flight into one cache.
#[derive(Clone, Debug)]
pub struct InFlight {
    entries: Vec<Entry>,
    free: u32,
    /// First entry of each chain.
    chains: Vec<u32>,
    /// Arrivals: the number of the request, which orders equal arrivals, and the entry.
    arrivals: Calendar<(u64, u32)>,
    /// Arrivals of the last cycle.
    arrived: Vec<(u64, u32)>,
    requests: u64,
}

impl InFlight {
    /// No lines; most should arrive within `usual_cycles`.
    pub fn new(usual_cycles: u64) -> Self {
        Self {
            entries: Vec::new(),
            free: NONE,
            chains: vec![NONE; CHAINS],
            arrivals: Calendar::new(usual_cycles),
            arrived: Vec::new(),
            requests: 0,
        }
    }

    /// Drops all lines in flight.
    pub fn clear(&mut self) {
        self.entries.clear();
        self.free = NONE;
        self.chains.fill(NONE);
        self.arrivals.clear();
    }

    /// Arrival of the line, if it is in flight.
    #[inline(always)]
    pub fn arrival(&self, line: u32) -> Option<u64> {
        let mut at = self.chains[line as usize % CHAINS];
        while at != NONE {
            let entry = &self.entries[at as usize];
            if entry.line == line {
                return Some(entry.cycle);
            }
            at = entry.chained;
        }
        None
    }

    /// Adds a line, not yet in flight, that arrives at `cycle`, after `now`. All arrivals up to
    /// `now` must have been processed by [`Self::arrive`].
    pub fn request(&mut self, line: u32, now: u64, cycle: u64) {
        let chain = &mut self.chains[line as usize % CHAINS];
        let entry = Entry {
            line,
            chained: *chain,
            cycle,
        };
        let at = match self.entries.get_mut(self.free as usize) {
            Some(free) => {
                let next = std::mem::replace(free, entry).chained;
                std::mem::replace(&mut self.free, next)
            }
            None => {
                self.entries.push(entry);
                self.entries.len() as u32 - 1
            }
        };
        *chain = at;
        self.arrivals.skip_to(now);
        self.arrivals.push(cycle, (self.requests, at));
        self.requests += 1;
    }

    /// Fills the lines that have arrived by `now` into the cache.
    #[inline(always)]
    pub fn arrive(&mut self, now: u64, cache: &mut impl Cache) {
        if self.arrivals.next() <= now {
            self.fill(now, cache);
        }
    }

    #[inline(never)]
    fn fill(&mut self, now: u64, cache: &mut impl Cache) {
        let mut arrived = std::mem::take(&mut self.arrived);
        while self.arrivals.next() <= now && self.arrivals.advance(&mut arrived).is_some() {
            for &(_, at) in &arrived {
                cache.fill(self.entries[at as usize].line);
                self.forget(at);
            }
        }
        self.arrived = arrived;
    }

    /// Unlinks an entry from its chain and frees it.
    fn forget(&mut self, at: u32) {
        let Entry { line, chained, .. } = self.entries[at as usize];
        let chain = line as usize % CHAINS;
        if self.chains[chain] == at {
            self.chains[chain] = chained;
        } else {
            let mut before = self.chains[chain] as usize;
            while self.entries[before].chained != at {
                before = self.entries[before].chained as usize;
            }
            self.entries[before].chained = chained;
        }
        self.entries[at as usize].chained = self.free;
        self.free = at;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::{Lru, WaysOf};
    use proptest::prelude::*;

    #[test]
    fn a_line_is_in_the_cache_from_its_arrival_on() {
        let mut cache = Lru::new(4, WaysOf::<4>);
        let mut in_flight = InFlight::new(220);
        in_flight.request(7, 0, 20);
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
        let mut in_flight = InFlight::new(220);
        in_flight.request(1, 0, 220);
        in_flight.request(2, 0, 20);
        in_flight.arrive(300, &mut cache);
        assert!(
            cache.lookup(1),
            "the later arrival replaced the earlier one"
        );
    }

    /// Records the order of fills.
    #[derive(Default)]
    struct Fills(Vec<u32>);

    impl Cache for Fills {
        fn lookup(&mut self, line: u32) -> bool {
            self.0.contains(&line)
        }

        fn contains(&self, line: u32) -> bool {
            self.0.contains(&line)
        }

        fn fill(&mut self, line: u32) -> u32 {
            self.0.push(line);
            u32::MAX
        }

        fn remove(&mut self, _line: u32) -> bool {
            false
        }

        fn clear(&mut self) {
            self.0.clear();
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        /// Latencies within and far beyond the calendar, and lines that share chains.
        #[test]
        fn arrivals_equal_those_of_a_sorted_list(
            steps in prop::collection::vec((0_u64..90, prop_oneof![1_u64..40, 1_u64..900]), 1..200),
        ) {
            let mut in_flight = InFlight::new(60);
            let mut filled = Fills::default();
            let mut plain: Vec<(u64, u32)> = Vec::new();
            let mut expected = Vec::new();
            let mut now = 0;
            for (number, (pause, latency)) in (0_u32..).zip(steps) {
                now += pause;
                in_flight.arrive(now, &mut filled);
                plain.sort_by_key(|&(cycle, _)| cycle);
                let due = plain.partition_point(|&(cycle, _)| cycle <= now);
                expected.extend(plain.drain(..due).map(|(_, line)| line));
                prop_assert_eq!(&filled.0, &expected);
                let line = number * 64;
                in_flight.request(line, now, now + latency);
                plain.push((now + latency, line));
                for &(cycle, line) in &plain {
                    prop_assert_eq!(in_flight.arrival(line), Some(cycle));
                }
                prop_assert_eq!(in_flight.arrival(line + 1), None);
            }
        }
    }
}
