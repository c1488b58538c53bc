//! A victim cache (Jouppi, ISCA 1990, section 3.2): a small fully associative LRU cache of evicted
//! lines. A hit in it swaps the line with the victim of its set.
//!
//! The swap is delayed until the next fill. Until then the line stays where it is, so that only the
//! last of several look-ups of a line matters, as for every cache here.

use super::cache::{Cache, EMPTY};

/// A cache and its victim cache.
pub(super) struct WithVictimCache {
    cache: Box<dyn Cache>,
    /// Least recently evicted first.
    victims: Vec<u32>,
    most_lines: usize,
    /// Victims hit since the last fill, in order of last use.
    hits: Vec<u32>,
}

impl WithVictimCache {
    pub(super) fn new(cache: Box<dyn Cache>, lines: u32) -> Self {
        Self {
            cache,
            victims: Vec::new(),
            most_lines: lines as usize,
            hits: Vec::new(),
        }
    }

    /// Moves hit victims into the cache; each takes the place of the line it evicts.
    fn swap_hits(&mut self) {
        for line in std::mem::take(&mut self.hits) {
            self.victims.retain(|&victim| victim != line);
            let evicted = self.cache.fill(line);
            if evicted != EMPTY {
                self.victims.push(evicted);
            }
        }
    }
}

impl Cache for WithVictimCache {
    fn lookup(&mut self, line: u32) -> bool {
        if self.cache.lookup(line) {
            return true;
        }
        let hit = self.victims.contains(&line);
        if hit {
            self.hits.retain(|&other| other != line);
            self.hits.push(line);
        }
        hit
    }

    fn contains(&self, line: u32) -> bool {
        self.cache.contains(line) || self.victims.contains(&line)
    }

    fn fill(&mut self, line: u32) -> u32 {
        self.swap_hits();
        let evicted = self.cache.fill(line);
        if evicted == EMPTY {
            return EMPTY;
        }
        self.victims.push(evicted);
        match self.victims.len() > self.most_lines {
            true => self.victims.remove(0),
            false => EMPTY,
        }
    }

    fn remove(&mut self, line: u32) -> bool {
        self.hits.retain(|&other| other != line);
        let lines = self.victims.len();
        self.victims.retain(|&victim| victim != line);
        self.victims.len() < lines || self.cache.remove(line)
    }

    fn clear(&mut self) {
        self.cache.clear();
        self.victims.clear();
        self.hits.clear();
    }
}
