//! An LRU cache of four ways whose sets are filled one by one.
//!
//! What a fill does to a set depends on this set alone, so it need not be done when the line arrives,
//! but when somebody comes to the set next. Each set keeps what is on its way into it: no calendar, and
//! whoever misses looks for the line among the few of its set.

use super::EMPTY;
use super::delayed::{DelayedFill, Missing, NOT_ASKED};
use super::lru::look_up;

/// A line on its way.
#[derive(Clone, Copy, Debug)]
struct Arrival {
    cycle: u64,
    line: u32,
}

/// A set. What is on its way into it first lies with it.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
struct Set {
    /// In order of last use, most recent first.
    tags: [u32; 4],
    /// When the first line arrives; the end of time if none is on its way.
    due: u64,
    first: u32,
    /// Lines on their way after it, in [`SetOrder::later`].
    later: u32,
}

const EMPTY_SET: Set = Set {
    tags: [EMPTY; 4],
    due: u64::MAX,
    first: EMPTY,
    later: 0,
};

/// An LRU cache of four ways and what is on its way into its sets.
#[derive(Clone, Debug)]
pub struct SetOrder {
    /// A power of two.
    sets: Vec<Set>,
    /// By set, the latest first; of one cycle the last request first.
    later: Vec<Vec<Arrival>>,
}

impl SetOrder {
    /// An empty cache; `sets` is a power of two.
    #[must_use]
    pub fn new(sets: u32) -> Self {
        debug_assert!(sets.is_power_of_two());
        Self {
            sets: vec![EMPTY_SET; sets as usize],
            later: vec![Vec::new(); sets as usize],
        }
    }

    #[inline(always)]
    fn index(&self, line: u32) -> usize {
        line as usize & (self.sets.len() - 1)
    }

    /// Fills what has arrived in a set.
    #[inline(never)]
    fn settle(&mut self, index: usize, now: u64) {
        let set = &mut self.sets[index];
        while set.due <= now {
            let [first, second, third, _] = set.tags;
            set.tags = [set.first, first, second, third];
            let next = match set.later {
                0 => None,
                _ => self.later[index].pop(),
            };
            match next {
                Some(next) => {
                    set.later -= 1;
                    (set.due, set.first) = (next.cycle, next.line);
                }
                None => (set.due, set.first) = (u64::MAX, EMPTY),
            }
        }
    }

    /// When a line arrives in a settled set that does not hold it.
    #[inline(always)]
    fn on_its_way(&self, index: usize, line: u32) -> u64 {
        let set = &self.sets[index];
        if set.first == line {
            return set.due;
        }
        if set.later == 0 {
            return NOT_ASKED;
        }
        // No early end: where in the list it is, the processor cannot guess.
        let later = self.later[index].iter();
        later.fold(NOT_ASKED, |found, other| {
            if other.line == line {
                other.cycle
            } else {
                found
            }
        })
    }
}

impl DelayedFill for SetOrder {
    #[inline(always)]
    fn look_up_all(&mut self, lines: &[u32], now: u64, missing: &mut Vec<Missing>) -> u64 {
        let mut latest = 0;
        for (at, &line) in (0..).zip(lines) {
            let index = self.index(line);
            if self.sets[index].due <= now {
                self.settle(index, now);
            }
            if !look_up(&mut self.sets[index].tags, line) {
                let arrival = self.on_its_way(index, line);
                latest = latest.max(arrival);
                missing.push(Missing { index: at, arrival });
            }
        }
        latest
    }

    #[inline(always)]
    fn look_up(&mut self, line: u32, now: u64) -> u64 {
        let index = self.index(line);
        if self.sets[index].due <= now {
            self.settle(index, now);
        }
        if look_up(&mut self.sets[index].tags, line) {
            return 0;
        }
        self.on_its_way(index, line)
    }

    #[inline(always)]
    fn arrival(&mut self, line: u32, now: u64) -> u64 {
        let index = self.index(line);
        if self.sets[index].due <= now {
            self.settle(index, now);
        }
        self.on_its_way(index, line)
    }

    #[inline(always)]
    fn enter(&mut self, line: u32, now: u64, arrival: u64) {
        let index = self.index(line);
        let set = &mut self.sets[index];
        if arrival <= now {
            let [first, second, third, _] = set.tags;
            set.tags = [line, first, second, third];
            return;
        }
        if set.due == u64::MAX {
            (set.due, set.first) = (arrival, line);
            return;
        }
        set.later += 1;
        let later = &mut self.later[index];
        if arrival < set.due {
            later.push(Arrival {
                cycle: set.due,
                line: set.first,
            });
            (set.due, set.first) = (arrival, line);
            return;
        }
        let new = Arrival {
            cycle: arrival,
            line,
        };
        let mut at = later.len();
        later.push(new);
        while at > 0 && later[at - 1].cycle <= arrival {
            later[at] = later[at - 1];
            at -= 1;
        }
        later[at] = new;
    }

    fn clear(&mut self) {
        self.sets.fill(EMPTY_SET);
        self.later.iter_mut().for_each(Vec::clear);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cache::delayed::Delay;
    use crate::cache::{Cache, Lru, WaysOf};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        /// Sets with many lines on their way; lines that arrive at once, in one cycle, out of order.
        #[test]
        fn sets_filled_one_by_one_equal_a_cache_filled_in_the_order_of_time(
            steps in prop::collection::vec(
                (0_u64..30, prop::collection::vec(0_u32..60, 1..6),
                prop_oneof![Just(0_u64), Just(20), 1_u64..300]),
                1..200,
            ),
            clear_at in 0_usize..400,
        ) {
            let general: Box<dyn Cache> = Box::new(Lru::new(4, WaysOf::<4>));
            let mut general = general.delayed(220);
            let mut sets = Lru::new(4, WaysOf::<4>).delayed(220);
            let mut now = 0;
            for (step, (pause, lines, latency)) in steps.into_iter().enumerate() {
                now += pause;
                if step == clear_at {
                    general.clear();
                    sets.clear();
                }
                let [mut expected, mut found] = [Vec::new(), Vec::new()];
                prop_assert_eq!(
                    sets.look_up_all(&lines, now, &mut found),
                    general.look_up_all(&lines, now, &mut expected)
                );
                prop_assert_eq!(&found, &expected);
                let absent = found.iter().filter(|missing| missing.arrival == NOT_ASKED);
                for missing in absent {
                    let line = lines[missing.index as usize];
                    // Somebody before it in the list may have asked for it just now.
                    prop_assert_eq!(sets.look_up(line, now), general.look_up(line, now));
                    if sets.arrival(line, now) == NOT_ASKED && sets.look_up(line, now) != 0 {
                        sets.enter(line, now, now + latency);
                        general.enter(line, now, now + latency);
                    }
                    prop_assert_eq!(sets.arrival(line, now), general.arrival(line, now));
                }
            }
        }
    }
}
