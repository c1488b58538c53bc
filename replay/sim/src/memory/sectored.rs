//! A sectored cache: a tag covers an aligned group of lines (sectors), and a miss fetches one of
//! them. It needs fewer tags for the same capacity, but unused sectors waste space.

use super::cache::{Cache, EMPTY};
use std::collections::HashMap;

/// A cache whose tags each cover several lines.
pub(super) struct Sectored {
    /// Holds group numbers: line numbers over the number of sectors.
    tags: Box<dyn Cache>,
    /// Valid sectors of each group in `tags`, one bit each.
    valid: HashMap<u32, u64>,
    sectors: u32,
}

impl Sectored {
    /// `sectors` is a power of two, at most 64.
    pub(super) fn new(tags: Box<dyn Cache>, sectors: u32) -> Self {
        debug_assert!(sectors.is_power_of_two() && sectors <= 64);
        Self {
            tags,
            valid: HashMap::new(),
            sectors,
        }
    }

    /// The group of a line, and its sector bit.
    fn place(&self, line: u32) -> (u32, u64) {
        (line / self.sectors, 1 << (line % self.sectors))
    }
}

impl Cache for Sectored {
    /// A group is marked as used when a valid sector is looked up.
    fn lookup(&mut self, line: u32) -> bool {
        self.contains(line) && self.tags.lookup(self.place(line).0)
    }

    fn contains(&self, line: u32) -> bool {
        let (group, bit) = self.place(line);
        self.valid.get(&group).is_some_and(|valid| valid & bit != 0)
    }

    /// An evicted group drops all its sectors. They are not reported, because no other level may depend on them.
    fn fill(&mut self, line: u32) -> u32 {
        let (group, bit) = self.place(line);
        if let Some(valid) = self.valid.get_mut(&group) {
            *valid |= bit;
            self.tags.lookup(group);
        } else {
            let evicted = self.tags.fill(group);
            self.valid.remove(&evicted);
            self.valid.insert(group, bit);
        }
        EMPTY
    }

    fn remove(&mut self, line: u32) -> bool {
        let was_there = self.contains(line);
        let (group, bit) = self.place(line);
        if let Some(valid) = self.valid.get_mut(&group) {
            *valid &= !bit;
            if *valid == 0 {
                self.valid.remove(&group);
                self.tags.remove(group);
            }
        }
        was_there
    }

    fn clear(&mut self) {
        self.tags.clear();
        self.valid.clear();
    }
}
