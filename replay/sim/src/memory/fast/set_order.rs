//! A four-way LRU cache that fills set by set.
//!
//! A fill affects only its own set, so it can wait until the set is next accessed. Each set keeps
//! its own lines in flight, and no calendar is needed.

use crate::memory::cache::EMPTY;
use crate::memory::in_flight::{Delay, DelayedFill, Mshrs, NOT_IN_FLIGHT};
use crate::memory::policy::{FourWayLru, look_up, take_out};

/// A line in flight.
#[derive(Clone, Copy, Debug)]
struct Arrival {
    cycle: u64,
    line: u32,
}

/// A set, with the first of its lines in flight.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
struct Set {
    /// Most recently used first.
    tags: [u32; 4],
    /// Arrival of the first line in flight, or the maximum if there is none.
    due: u64,
    first: u32,
    /// Number of further lines in flight, in [`SetOrder::later`].
    later: u32,
}

const EMPTY_SET: Set = Set {
    tags: [EMPTY; 4],
    due: u64::MAX,
    first: EMPTY,
    later: 0,
};

/// A four-way LRU cache with lines in flight.
#[derive(Clone, Debug)]
pub struct SetOrder {
    /// Power-of-two number of sets.
    sets: Vec<Set>,
    /// By set.
    later: Vec<Later>,
    /// Lines in flight into all sets.
    mshrs: Mshrs,
}

/// Lines in flight into a set after the first one.
#[derive(Clone, Debug, Default)]
struct Later {
    /// The first `gone` have been filled. The others are sorted by cycle, equal cycles in order of request.
    arrivals: Vec<Arrival>,
    gone: usize,
}

impl Later {
    /// Inserts a line; most arrive after all others.
    #[inline(always)]
    fn enter(&mut self, new: Arrival) {
        let all = self.arrivals.len();
        if all == self.arrivals.capacity() && self.gone > all / 2 {
            self.arrivals.drain(..std::mem::take(&mut self.gone));
        }
        let mut at = self.arrivals.len();
        self.arrivals.push(new);
        while at > self.gone && self.arrivals[at - 1].cycle > new.cycle {
            self.arrivals[at] = self.arrivals[at - 1];
            at -= 1;
        }
        self.arrivals[at] = new;
    }

    /// Inserts a line before all others.
    fn enter_first(&mut self, first: Arrival) {
        match self.gone.checked_sub(1) {
            Some(at) => {
                self.gone = at;
                self.arrivals[at] = first;
            }
            None => self.arrivals.insert(0, first),
        }
    }

    /// Removes the first line in flight.
    #[inline(always)]
    fn take(&mut self) -> Option<Arrival> {
        let first = *self.arrivals.get(self.gone)?;
        self.gone += 1;
        if self.gone == self.arrivals.len() {
            self.clear();
        }
        Some(first)
    }

    fn clear(&mut self) {
        self.arrivals.clear();
        self.gone = 0;
    }
}

/// Sets are independent, so each fills when it is next accessed.
impl Delay for FourWayLru {
    type Delayed = SetOrder;

    fn delayed(self, _usual_cycles: u64) -> SetOrder {
        SetOrder::new(self.sets())
    }
}

impl SetOrder {
    /// An empty cache; `sets` is a power of two.
    pub fn new(sets: u32) -> Self {
        debug_assert!(sets.is_power_of_two());
        Self {
            sets: vec![EMPTY_SET; sets as usize],
            later: vec![Later::default(); sets as usize],
            mshrs: Mshrs::new(),
        }
    }

    /// The set of a line, after filling the lines that have arrived.
    #[inline(always)]
    fn settled(&mut self, line: u32, now: u64) -> (&mut Set, &mut Later) {
        let index = line as usize & (self.sets.len() - 1);
        let (set, later) = (&mut self.sets[index], &mut self.later[index]);
        if set.due <= now {
            set.settle(later, now);
        }
        (set, later)
    }
}

impl Set {
    /// Fills the lines that have arrived.
    #[inline(never)]
    fn settle(&mut self, later: &mut Later, now: u64) {
        while self.due <= now {
            self.fill(self.first);
            let next = match self.later {
                0 => None,
                _ => later.take(),
            };
            (self.due, self.first) = (u64::MAX, EMPTY);
            if let Some(Arrival { cycle, line }) = next {
                (self.due, self.first) = (cycle, line);
                self.later -= 1;
            }
        }
    }

    #[inline(always)]
    fn fill(&mut self, line: u32) {
        let [first, second, third, _] = self.tags;
        self.tags = [line, first, second, third];
    }

    /// The arrival of a line that the set does not hold.
    #[inline(always)]
    fn arrival(&self, mshrs: &Mshrs, line: u32, now: u64) -> u64 {
        if self.first == line {
            return self.due;
        }
        if self.later == 0 {
            return NOT_IN_FLIGHT;
        }
        mshrs.arrival(line, now)
    }
}

impl DelayedFill for SetOrder {
    #[inline(always)]
    fn look_up_all(&mut self, lines: &[u32], now: u64, mut missing: impl FnMut(usize, u32, u64)) {
        let (sets, laters) = (&mut *self.sets, &mut *self.later);
        let mask = sets.len() - 1;
        for (at, &line) in lines.iter().enumerate() {
            let index = line as usize & mask;
            let set = &mut sets[index];
            if set.due <= now {
                set.settle(&mut laters[index], now);
            }
            if !look_up(&mut set.tags, line) {
                missing(at, line, set.arrival(&self.mshrs, line, now));
            }
        }
    }

    #[inline(always)]
    fn look_up(&mut self, line: u32, now: u64) -> u64 {
        let (set, _) = self.settled(line, now);
        if look_up(&mut set.tags, line) {
            return 0;
        }
        let set = *set;
        set.arrival(&self.mshrs, line, now)
    }

    #[inline(always)]
    fn arrival(&mut self, line: u32, now: u64) -> u64 {
        let (set, _) = self.settled(line, now);
        let set = *set;
        set.arrival(&self.mshrs, line, now)
    }

    fn holds(&mut self, line: u32, now: u64) -> bool {
        let (set, _) = self.settled(line, now);
        let set = *set;
        set.tags.contains(&line) || set.arrival(&self.mshrs, line, now) != NOT_IN_FLIGHT
    }

    #[inline(always)]
    fn enter(&mut self, line: u32, now: u64, arrival: u64) {
        let index = line as usize & (self.sets.len() - 1);
        let (set, later) = (&mut self.sets[index], &mut self.later[index]);
        debug_assert!(set.due > now, "looked up before");
        if arrival <= now {
            set.fill(line);
            return;
        }
        if set.due == u64::MAX {
            (set.due, set.first) = (arrival, line);
        } else if arrival < set.due {
            later.enter_first(Arrival {
                cycle: set.due,
                line: set.first,
            });
            set.later += 1;
            (set.due, set.first) = (arrival, line);
        } else {
            later.enter(Arrival {
                cycle: arrival,
                line,
            });
            set.later += 1;
        }
        self.mshrs.enter(line, now, arrival);
    }

    fn remove(&mut self, line: u32, now: u64) -> bool {
        let (set, _) = self.settled(line, now);
        take_out(&mut set.tags, line)
    }

    fn clear(&mut self) {
        self.sets.fill(EMPTY_SET);
        self.later.iter_mut().for_each(Later::clear);
        self.mshrs.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::{Cache, Delay, Lru, WaysOf};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        /// Compares sets with many lines in flight: equal arrivals, zero latencies, arrivals out of order.
        #[test]
        fn sets_filled_one_by_one_equal_a_cache_filled_in_time_order(
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
                sets.look_up_all(&lines, now, |index, line, arrival| found.push((index, line, arrival)));
                general.look_up_all(&lines, now, |index, line, arrival| expected.push((index, line, arrival)));
                prop_assert_eq!(&found, &expected);
                prop_assert!(found.iter().all(|(index, line, _)| lines[*index] == *line));
                let absent = found.iter().filter(|(.., arrival)| *arrival == NOT_IN_FLIGHT);
                for &(_, line, _) in absent {
                    // An earlier look-up of the list may have requested this line.
                    prop_assert_eq!(sets.look_up(line, now), general.look_up(line, now));
                    if sets.arrival(line, now) == NOT_IN_FLIGHT && sets.look_up(line, now) != 0 {
                        sets.enter(line, now, now + latency);
                        general.enter(line, now, now + latency);
                    }
                    prop_assert_eq!(sets.arrival(line, now), general.arrival(line, now));
                }
                if step % 5 == 0 {
                    prop_assert_eq!(sets.remove(lines[0], now), general.remove(lines[0], now));
                }
            }
        }
    }
}
