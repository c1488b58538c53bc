//! The lines that are touched at all: the misses of an infinite cache.

use super::{Consumer, Lines};

/// A set of lines, a bit each.
#[derive(Clone, Debug)]
pub struct LineSet {
    words: Vec<u64>,
}

impl LineSet {
    /// An empty set, for lines below `lines`.
    #[must_use]
    pub fn new(lines: u64) -> Self {
        Self {
            words: vec![0; lines.div_ceil(64) as usize],
        }
    }

    /// Adds a line.
    #[inline(always)]
    pub fn insert(&mut self, line: u32) {
        self.words[line as usize / 64] |= 1 << (line % 64);
    }

    /// Number of lines.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.words.iter().map(|w| u64::from(w.count_ones())).sum()
    }
}

impl Consumer for LineSet {
    fn quad(&mut self, _core: usize, _tile: usize) {}

    #[inline(always)]
    fn footprint(&mut self, _cell: usize, lines: Lines<'_>) -> bool {
        lines.iter().for_each(|line| self.insert(line));
        true
    }
}
