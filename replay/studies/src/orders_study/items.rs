//! Work items as sets of lines, for searches. A search ignores time and L1 caches: an item accesses each of its
//! lines in the L2 once. Its misses differ by about a thousandth from those of a replay with two cores.

use std::collections::HashMap;

/// Distinct lines of items.
#[derive(Clone, Debug, Default)]
pub struct Items {
    /// The lines of each item (by number), in order of first use.
    pub(super) lines: Vec<Vec<u32>>,
    /// The address of each line over the line size.
    pub(super) addresses: Vec<u32>,
    /// The items that use each line, ascending.
    pub(super) users: Vec<Vec<u32>>,
}

impl Items {
    /// Builds items from the lines that each uses, which may repeat.
    pub fn new(accesses: &[Vec<u32>]) -> Self {
        let mut items = Self::default();
        let mut numbers: HashMap<u32, u32> = HashMap::new();
        for (item, accesses) in (0..).zip(accesses) {
            let mut lines = Vec::new();
            for &address in accesses {
                let number = *numbers.entry(address).or_insert_with(|| {
                    items.addresses.push(address);
                    items.users.push(Vec::new());
                    items.addresses.len() as u32 - 1
                });
                let users = &mut items.users[number as usize];
                if users.last() != Some(&item) {
                    users.push(item);
                    lines.push(number);
                }
            }
            items.lines.push(lines);
        }
        items
    }

    /// Number of items.
    pub fn len(&self) -> usize {
        self.lines.len()
    }

    /// True if there are no items.
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// Number of distinct lines of all items.
    #[cfg(test)]
    pub(super) fn distinct_lines(&self) -> u64 {
        self.addresses.len() as u64
    }

    /// Misses of an LRU cache if the items run in this order.
    pub fn misses(&self, order: &[u32], cache: &Lru) -> u64 {
        let mut state = cache.empty();
        let run = |&item: &u32| u64::from(cache.run(self, item, &mut state));
        order.iter().map(run).sum()
    }
}

/// The geometry of an LRU cache for numbered lines.
#[derive(Clone, Debug)]
pub struct Lru {
    /// The first way of each line's set.
    first: Vec<u32>,
    ways: usize,
    lines: usize,
}

/// No line.
pub(super) const NONE: u32 = u32::MAX;

impl Lru {
    /// A cache for the lines of items; `sets` is a power of two.
    pub fn new(items: &Items, sets: u32, ways: u32) -> Self {
        let first = |address: &u32| (address & (sets - 1)) * ways;
        Self {
            first: items.addresses.iter().map(first).collect(),
            ways: ways as usize,
            lines: sets as usize * ways as usize,
        }
    }

    /// The contents of an empty cache.
    pub(super) fn empty(&self) -> Vec<u32> {
        vec![NONE; self.lines]
    }

    /// Accesses a line. On a miss, returns the evicted line, or [`NONE`] for a free way.
    #[inline(always)]
    pub(super) fn access(&self, line: u32, state: &mut [u32]) -> Option<u32> {
        let first = self.first[line as usize] as usize;
        let set = &mut state[first..first + self.ways];
        let mut carried = line;
        for way in set {
            std::mem::swap(way, &mut carried);
            if carried == line {
                return None;
            }
        }
        Some(carried)
    }

    /// Accesses all lines of an item and returns its misses.
    #[inline(always)]
    pub(super) fn run(&self, items: &Items, item: u32, state: &mut [u32]) -> u32 {
        let lines = &items.lines[item as usize];
        let misses = lines
            .iter()
            .filter(|line| self.access(**line, state).is_some());
        misses.count() as u32
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;

    pub fn accesses() -> impl Strategy<Value = Vec<Vec<u32>>> {
        prop::collection::vec(prop::collection::vec(0_u32..64, 0..12), 1..24)
    }

    proptest! {
        #[test]
        fn misses_equal_those_of_plain_lists(accesses in accesses(), sets in 0_u32..3, ways in 1_u32..5) {
            let sets = 1 << sets;
            let items = Items::new(&accesses);
            let order: Vec<u32> = (0..items.len() as u32).rev().collect();
            let mut plain: Vec<Vec<u32>> = vec![Vec::new(); sets as usize];
            let mut misses = 0;
            for lines in accesses.iter().rev() {
                for (at, line) in lines.iter().enumerate() {
                    if lines[..at].contains(line) {
                        continue;
                    }
                    let set = &mut plain[(line % sets) as usize];
                    misses += u64::from(!set.contains(line));
                    set.retain(|other| other != line);
                    set.insert(0, *line);
                    set.truncate(ways as usize);
                }
            }
            prop_assert_eq!(items.misses(&order, &Lru::new(&items, sets, ways)), misses);
        }
    }
}
