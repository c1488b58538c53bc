//! Events by cycle. Cycles without events cost nothing.

use sim::memory::BusyDays;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Cycles ahead that are kept in lists. A power of two; a queue for memory is rarely longer.
const DAYS: usize = 2048;

/// Future events. The order of events of one cycle is that of their keys.
pub struct Calendar {
    /// Keys by the low bits of the cycle.
    days: Vec<Vec<u64>>,
    /// Days with events.
    busy: BusyDays,
    now: u64,
    /// Events beyond the lists, earliest on top.
    late: BinaryHeap<Reverse<(u64, u64)>>,
}

impl Calendar {
    /// No events; the current cycle is 0.
    pub fn new() -> Self {
        Self {
            days: vec![Vec::new(); DAYS],
            busy: BusyDays::new(DAYS),
            now: 0,
            late: BinaryHeap::new(),
        }
    }

    /// Adds an event of a cycle after the current one.
    pub fn push(&mut self, cycle: u64, key: u64) {
        debug_assert!(cycle > self.now, "cycle {cycle} is not after {}", self.now);
        if cycle - self.now < DAYS as u64 {
            let day = cycle as usize % DAYS;
            self.days[day].push(key);
            self.busy.set(day);
        } else {
            self.late.push(Reverse((cycle, key)));
        }
    }

    /// Advances to the next cycle with events, and replaces `keys` by theirs, in order.
    pub fn advance(&mut self, keys: &mut Vec<u64>) -> Option<u64> {
        keys.clear();
        let late = self.late.peek().map(|Reverse((cycle, _))| *cycle);
        let cycle = match (self.busy.first_from(self.now + 1), late) {
            (Some(day), Some(late)) => day.min(late),
            (day, late) => day.or(late)?,
        };
        self.now = cycle;
        let day = cycle as usize % DAYS;
        std::mem::swap(keys, &mut self.days[day]);
        self.busy.clear(day);
        while let Some(&Reverse((at, key))) = self.late.peek()
            && at == cycle
        {
            self.late.pop();
            keys.push(key);
        }
        keys.sort_unstable();
        Some(cycle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Compares with a sorted list. Some events lie beyond the lists.
        #[test]
        fn events_come_by_cycle_and_key(
            pushes in prop::collection::vec((1_u64..5000, 0_u64..50), 1..300),
        ) {
            let mut calendar = Calendar::new();
            let mut plain: Vec<(u64, u64)> = Vec::new();
            let (mut now, mut keys) = (0, Vec::new());
            for (index, (ahead, key)) in pushes.into_iter().enumerate() {
                calendar.push(now + ahead, key);
                plain.push((now + ahead, key));
                if index % 3 != 0 {
                    continue;
                }
                plain.sort_unstable();
                now = plain[0].0;
                let of_now = plain.iter().take_while(|(cycle, _)| *cycle == now).count();
                let expected: Vec<u64> = plain.drain(..of_now).map(|(_, key)| key).collect();
                prop_assert_eq!(calendar.advance(&mut keys), Some(now));
                prop_assert_eq!(&keys, &expected);
            }
        }
    }
}
