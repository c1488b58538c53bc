//! The set of accessed lines, whose size equals the misses of an infinite cache.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// log2 of the lines per block.
const BLOCK_BITS: u32 = 16;
const BLOCK_WORDS: usize = 1 << (BLOCK_BITS - 6);

type Block = [AtomicU64; BLOCK_WORDS];

/// A bit set of lines that threads fill concurrently. Only accessed blocks take memory, because a trace may
/// name gigabytes of textures and sample little of them.
#[derive(Debug)]
pub struct LineSet {
    blocks: Vec<OnceLock<Box<Block>>>,
}

impl LineSet {
    /// An empty set for lines below `lines`.
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
        // Nearly all lines are present already, and a read does not invalidate other cores' copies of the word.
        if word.load(Ordering::Relaxed) & bit == 0 {
            word.fetch_or(bit, Ordering::Relaxed);
        }
    }

    /// Number of lines.
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
    fn lines_count_once_and_unused_blocks_take_no_memory() {
        let set = LineSet::new(u64::from(u32::MAX) + 1);
        for line in [0, 1, 63, 64, 65_535, 65_536, u32::MAX, 1, u32::MAX] {
            set.insert(line);
        }
        assert_eq!(set.count(), 7);
        assert_eq!(set.blocks.iter().filter_map(OnceLock::get).count(), 3);
    }
}
