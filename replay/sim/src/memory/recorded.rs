//! A cache that records which lines enter and leave it, to show its content over time.

use super::cache::{Cache, EMPTY};

/// A line, and whether it is in the cache from now on. [`EMPTY`] stands for all lines of the cache.
pub type Change = (u32, bool);

/// A cache and its changes since they were last taken. It must report its evictions, which a sectored cache does not.
pub(super) struct Recorded {
    cache: Box<dyn Cache>,
    changes: Vec<Change>,
}

impl Recorded {
    pub(super) fn new(cache: Box<dyn Cache>) -> Self {
        Self {
            cache,
            changes: Vec::new(),
        }
    }
}

impl Cache for Recorded {
    fn lookup(&mut self, line: u32) -> bool {
        self.cache.lookup(line)
    }

    fn contains(&self, line: u32) -> bool {
        self.cache.contains(line)
    }

    fn fill(&mut self, line: u32) -> u32 {
        let evicted = self.cache.fill(line);
        if evicted != EMPTY {
            self.changes.push((evicted, false));
        }
        if evicted != line {
            self.changes.push((line, true));
        }
        evicted
    }

    fn remove(&mut self, line: u32) -> bool {
        let was_there = self.cache.remove(line);
        if was_there {
            self.changes.push((line, false));
        }
        was_there
    }

    fn take_evicted(&mut self, lines: &mut Vec<u32>) {
        self.cache.take_evicted(lines);
    }

    fn take_changes(&mut self, changes: &mut Vec<Change>) {
        changes.append(&mut self.changes);
    }

    fn clear(&mut self) {
        self.cache.clear();
        self.changes.push((EMPTY, false));
    }
}
