//! A cache that records which lines enter and leave it: the lines it evicts, for levels that depend on them, or all
//! changes, to show its content over time.

use super::cache::{Cache, EMPTY};

/// A line, and whether it is in the cache from now on. [`EMPTY`] stands for all lines of the cache.
pub type Change = (u32, bool);

/// A cache, and what happened since it was last taken.
pub(super) struct Recorded {
    cache: Box<dyn Cache>,
    evicted: Option<Vec<u32>>,
    changes: Option<Vec<Change>>,
}

impl Recorded {
    /// Records evictions.
    pub(super) fn evictions(cache: Box<dyn Cache>) -> Self {
        Self {
            cache,
            evicted: Some(Vec::new()),
            changes: None,
        }
    }

    /// Records all changes of a cache that reports its evictions, which a sectored cache does not.
    pub(super) fn changes(cache: Box<dyn Cache>) -> Self {
        Self {
            cache,
            evicted: None,
            changes: Some(Vec::new()),
        }
    }

    fn change(&mut self, line: u32, is_in: bool) {
        if let Some(changes) = &mut self.changes {
            changes.push((line, is_in));
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
            self.change(evicted, false);
            if let Some(lines) = &mut self.evicted {
                lines.push(evicted);
            }
        }
        if evicted != line {
            self.change(line, true);
        }
        evicted
    }

    fn remove(&mut self, line: u32) -> bool {
        let was_there = self.cache.remove(line);
        if was_there {
            self.change(line, false);
        }
        was_there
    }

    fn take_evicted(&mut self, lines: &mut Vec<u32>) {
        match &mut self.evicted {
            Some(evicted) => lines.append(evicted),
            None => self.cache.take_evicted(lines),
        }
    }

    fn take_changes(&mut self, changes: &mut Vec<Change>) {
        if let Some(own) = &mut self.changes {
            changes.append(own);
        }
    }

    fn clear(&mut self) {
        self.cache.clear();
        self.change(EMPTY, false);
        if let Some(lines) = &mut self.evicted {
            lines.clear();
        }
    }
}
