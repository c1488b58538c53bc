//! The lines that are touched at all: the misses of an infinite cache.

use std::sync::atomic::{AtomicU64, Ordering};

/// A set of lines, a bit each, that threads fill together.
#[derive(Debug)]
pub struct LineSet {
    words: Vec<AtomicU64>,
}

impl LineSet {
    /// An empty set, for lines below `lines`.
    #[must_use]
    pub fn new(lines: u64) -> Self {
        Self {
            words: (0..lines.div_ceil(64)).map(|_| AtomicU64::new(0)).collect(),
        }
    }

    /// Adds a line.
    #[inline(always)]
    pub fn insert(&self, line: u32) {
        let word = &self.words[line as usize / 64];
        let bit = 1 << (line % 64);
        // Nearly all lines are there already, and a read does not take the word from the others.
        if word.load(Ordering::Relaxed) & bit == 0 {
            word.fetch_or(bit, Ordering::Relaxed);
        }
    }

    /// Number of lines.
    #[must_use]
    pub fn count(&self) -> u64 {
        let ones = |word: &AtomicU64| u64::from(word.load(Ordering::Relaxed).count_ones());
        self.words.iter().map(ones).sum()
    }
}
