//! Misses in flight (MSHRs without a limit): lines that were requested and have not arrived.
//! Further requests for such a line merge with its fetch.
//!
//! Arrivals are kept in a calendar queue: one list of lines for each of the next cycles and one bit
//! per non-empty list, so that requests and arrivals need no search. Arrivals beyond the calendar's
//! end wait in a heap; the default latencies never reach it.

use super::Cache;
use crate::memory::busy_days::BusyDays;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

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
    /// Next entry of the same cycle, in order of request.
    later: u32,
    cycle: u64,
}

/// First and last entry of a cycle.
#[derive(Clone, Copy, Debug)]
struct Day {
    first: u32,
    last: u32,
}

/// Lines in flight into one cache.
#[derive(Clone, Debug)]
pub struct InFlight {
    entries: Vec<Entry>,
    free: u32,
    /// First entry of each chain.
    chains: Vec<u32>,
    /// By the low bits of the cycle; the length is a power of two.
    days: Vec<Day>,
    /// Days with entries.
    busy: BusyDays,
    /// The earliest cycle with work to do.
    wake: u64,
    /// Arrivals beyond the calendar, earliest on top. The count keeps equal arrivals in order of request.
    late: BinaryHeap<Reverse<(u64, u64, u32)>>,
    requests: u64,
}

impl InFlight {
    /// An empty calendar; most lines should arrive within `usual_cycles`.
    pub fn new(usual_cycles: u64) -> Self {
        let days = (usual_cycles + 1).next_power_of_two().clamp(64, 4096) as usize;
        let empty = Day {
            first: NONE,
            last: NONE,
        };
        Self {
            entries: Vec::new(),
            free: NONE,
            chains: vec![NONE; CHAINS],
            days: vec![empty; days],
            busy: BusyDays::new(days),
            wake: u64::MAX,
            late: BinaryHeap::new(),
            requests: 0,
        }
    }

    /// Drops all lines in flight.
    pub fn clear(&mut self) {
        *self = Self::new(self.days.len() as u64 - 1);
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
        let entry = Entry {
            line,
            chained: self.chains[line as usize % CHAINS],
            later: NONE,
            cycle,
        };
        let at = match self.entries.get(self.free as usize) {
            Some(free) => std::mem::replace(&mut self.free, free.chained),
            None => {
                self.entries.push(entry);
                self.entries.len() as u32 - 1
            }
        };
        self.entries[at as usize] = entry;
        self.chains[line as usize % CHAINS] = at;
        let days = self.days.len() as u64;
        if cycle - now < days {
            self.enter(at);
        } else {
            self.late.push(Reverse((cycle, self.requests, at)));
            self.requests += 1;
            self.wake = self.wake.min(cycle - days + 1);
        }
    }

    /// Adds an entry to the calendar, after those of the same cycle.
    fn enter(&mut self, at: u32) {
        let cycle = self.entries[at as usize].cycle;
        let day = cycle as usize & (self.days.len() - 1);
        let Day { first, last } = self.days[day];
        match self.entries.get_mut(last as usize) {
            Some(last) => last.later = at,
            None => self.busy.set(day),
        }
        self.days[day] = Day {
            first: if first == NONE { at } else { first },
            last: at,
        };
        self.wake = self.wake.min(cycle);
    }

    /// Fills the lines that have arrived by `now` into the cache.
    #[inline(always)]
    pub fn arrive(&mut self, now: u64, cache: &mut impl Cache) {
        if self.wake <= now {
            self.wake_up(now, cache);
        }
    }

    #[inline(never)]
    fn wake_up(&mut self, now: u64, cache: &mut impl Cache) {
        // In order of time: late arrivals enter the calendar before its next day is processed.
        while self.wake <= now {
            let today = self.wake;
            self.take(today, cache);
            self.turn_to(today);
        }
        if !self.late.is_empty() {
            // A request at `now` must queue behind earlier ones of the same cycle.
            self.turn_to(now);
        }
    }

    /// Advances the calendar to a day with no work left: moves late arrivals into it and finds the
    /// next day with work.
    fn turn_to(&mut self, today: u64) {
        let days = self.days.len() as u64;
        while let Some(&Reverse((cycle, _, at))) = self.late.peek() {
            if cycle - today >= days {
                break;
            }
            self.late.pop();
            self.enter(at);
        }
        let late = self.late.peek();
        let admission = late.map_or(u64::MAX, |Reverse((cycle, ..))| cycle - days + 1);
        self.wake = self
            .busy
            .first_from(today + 1)
            .unwrap_or(u64::MAX)
            .min(admission);
    }

    /// Fills all lines that arrive at a cycle, in order of request.
    fn take(&mut self, cycle: u64, cache: &mut impl Cache) {
        let day = cycle as usize & (self.days.len() - 1);
        let mut at = self.days[day].first;
        self.days[day] = Day {
            first: NONE,
            last: NONE,
        };
        self.busy.clear(day);
        while at != NONE {
            let Entry { line, later, .. } = self.entries[at as usize];
            self.forget(at);
            cache.fill(line);
            at = later;
        }
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
