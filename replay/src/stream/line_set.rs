//! The lines that are touched at all: the misses of an infinite cache.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// Lines of a block, as a power of two.
const BLOCK_BITS: u32 = 16;
const BLOCK_WORDS: usize = 1 << (BLOCK_BITS - 6);

type Block = [AtomicU64; BLOCK_WORDS];

/// A set of lines, a bit each, that threads fill together. Only blocks that somebody touches take
/// memory: a table may name textures of gigabytes of which nobody samples more than a corner.
#[derive(Debug)]
pub struct LineSet {
    blocks: Vec<OnceLock<Box<Block>>>,
}

impl LineSet {
    /// An empty set, for lines below `lines`.
    #[must_use]
    pub fn new(lines: u64) -> Self {
        let blocks = lines.div_ceil(1 << BLOCK_BITS);
        Self {
            blocks: (0..blocks).map(|_| OnceLock::new()).collect(),
        }
    }

    /// Adds a line.
    #[inline(always)]
    pub fn insert(&self, line: u32) {
        let block = &self.blocks[(line >> BLOCK_BITS) as usize];
        let words = block.get_or_init(|| Box::new([const { AtomicU64::new(0) }; BLOCK_WORDS]));
        let word = &words[line as usize / 64 % BLOCK_WORDS];
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
        let blocks = self.blocks.iter().filter_map(OnceLock::get);
        blocks.flat_map(|words| words.iter()).map(ones).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_count_once_and_blocks_that_nobody_touches_take_no_memory() {
        let set = LineSet::new(u64::from(u32::MAX) + 1);
        for line in [0, 1, 63, 64, 65_535, 65_536, u32::MAX, 1, u32::MAX] {
            set.insert(line);
        }
        assert_eq!(set.count(), 7);
        assert_eq!(set.blocks.iter().filter_map(OnceLock::get).count(), 3);
    }
}
