//! A cache that records the lines it evicts, for levels that depend on them.

use super::cache::{Cache, EMPTY};

/// A cache and its recorded evictions.
pub(super) struct Watched {
    cache: Box<dyn Cache>,
    evicted: Vec<u32>,
}

impl Watched {
    pub(super) fn new(cache: Box<dyn Cache>) -> Self {
        Self {
            cache,
            evicted: Vec::new(),
        }
    }
}

impl Cache for Watched {
    fn lookup(&mut self, line: u32) -> bool {
        self.cache.lookup(line)
    }

    fn contains(&self, line: u32) -> bool {
        self.cache.contains(line)
    }

    fn fill(&mut self, line: u32) -> u32 {
        let evicted = self.cache.fill(line);
        if evicted != EMPTY {
            self.evicted.push(evicted);
        }
        evicted
    }

    fn remove(&mut self, line: u32) -> bool {
        self.cache.remove(line)
    }

    fn take_evicted(&mut self, lines: &mut Vec<u32>) {
        lines.append(&mut self.evicted);
    }

    fn clear(&mut self) {
        self.cache.clear();
        self.evicted.clear();
    }
}
