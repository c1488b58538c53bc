//! Events by cycle: arrivals of lines in all caches, and the events of ray-tracing units. Cycles without events
//! cost nothing.

use super::busy_days::BusyDays;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Future events. The order of events of one cycle is that of their keys.
#[derive(Clone, Debug)]
pub struct Calendar<K> {
    /// Keys by the low bits of the cycle; the length is a power of two.
    days: Vec<Vec<K>>,
    /// Days with events.
    busy: BusyDays,
    now: u64,
    /// The next cycle with events, or the maximum.
    next: u64,
    /// Events beyond the lists, earliest on top.
    late: BinaryHeap<Reverse<(u64, K)>>,
}

impl<K: Copy + Ord> Calendar<K> {
    /// No events; the current cycle is 0. Most events should come within `usual_cycles`, at most 4095.
    pub fn new(usual_cycles: u64) -> Self {
        let days = (usual_cycles + 1).next_power_of_two().clamp(64, 4096) as usize;
        Self {
            days: vec![Vec::new(); days],
            busy: BusyDays::new(days),
            now: 0,
            next: u64::MAX,
            late: BinaryHeap::new(),
        }
    }

    /// Removes all events and returns to cycle 0.
    pub fn clear(&mut self) {
        *self = Self::new(self.days.len() as u64 - 1);
    }

    /// The next cycle with events, or the maximum if there are none.
    #[inline(always)]
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Moves to a cycle before which there are no events.
    pub fn skip_to(&mut self, cycle: u64) {
        debug_assert!(cycle < self.next, "events before cycle {cycle}");
        self.now = self.now.max(cycle);
    }

    /// Adds an event of a cycle after the current one.
    pub fn push(&mut self, cycle: u64, key: K) {
        debug_assert!(cycle > self.now, "cycle {cycle} is not after {}", self.now);
        if cycle - self.now < self.days.len() as u64 {
            let day = cycle as usize & (self.days.len() - 1);
            self.days[day].push(key);
            self.busy.set(day);
        } else {
            self.late.push(Reverse((cycle, key)));
        }
        self.next = self.next.min(cycle);
    }

    /// Advances to the next cycle with events, and replaces `keys` by theirs, in order.
    pub fn advance(&mut self, keys: &mut Vec<K>) -> Option<u64> {
        keys.clear();
        if self.next == u64::MAX {
            return None;
        }
        let cycle = self.next;
        self.now = cycle;
        let day = cycle as usize & (self.days.len() - 1);
        std::mem::swap(keys, &mut self.days[day]);
        self.busy.clear(day);
        while let Some(&Reverse((at, key))) = self.late.peek()
            && at == cycle
        {
            self.late.pop();
            keys.push(key);
        }
        keys.sort_unstable();
        let late = self.late.peek().map_or(u64::MAX, |Reverse((at, _))| *at);
        let day = self.busy.first_from(cycle + 1).unwrap_or(u64::MAX);
        self.next = day.min(late);
        Some(cycle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Compares with a sorted list. Some events lie beyond the lists, and some cycles are skipped.
        #[test]
        fn events_come_by_cycle_and_key(
            usual_cycles in prop_oneof![Just(60_u64), Just(2047)],
            pushes in prop::collection::vec((1_u64..5000, 0_u64..50), 1..300),
        ) {
            let mut calendar = Calendar::new(usual_cycles);
            let mut plain: Vec<(u64, u64)> = Vec::new();
            let (mut now, mut keys) = (0, Vec::new());
            for (index, (ahead, key)) in pushes.into_iter().enumerate() {
                calendar.push(now + ahead, key);
                plain.push((now + ahead, key));
                plain.sort_unstable();
                prop_assert_eq!(calendar.next(), plain[0].0);
                if index % 3 == 0 {
                    now = (now + key).min(plain[0].0 - 1);
                    calendar.skip_to(now);
                    continue;
                }
                now = plain[0].0;
                let of_now = plain.iter().take_while(|(cycle, _)| *cycle == now).count();
                let expected: Vec<u64> = plain.drain(..of_now).map(|(_, key)| key).collect();
                prop_assert_eq!(calendar.advance(&mut keys), Some(now));
                prop_assert_eq!(&keys, &expected);
            }
        }
    }
}
