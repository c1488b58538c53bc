//! Random replacement, seeded.

use crate::memory::cache::{Cache, EMPTY, empty_way};

/// A cache with random replacement; empty ways are used first.
pub(super) struct RandomReplacement {
    tags: Vec<u32>,
    ways: usize,
    set_mask: u32,
    state: u64,
}

impl RandomReplacement {
    /// An empty cache; `sets` is a power of two.
    pub fn new(sets: u32, ways: u32, seed: u64) -> Self {
        Self {
            tags: vec![EMPTY; sets as usize * ways as usize],
            ways: ways as usize,
            set_mask: sets - 1,
            // Xorshift must not start at zero.
            state: seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1,
        }
    }
}

impl Cache for RandomReplacement {
    fn lookup(&mut self, line: u32) -> bool {
        self.contains(line)
    }

    fn contains(&self, line: u32) -> bool {
        let first = (line & self.set_mask) as usize * self.ways;
        self.tags[first..first + self.ways].contains(&line)
    }

    fn fill(&mut self, line: u32) -> u32 {
        let first = (line & self.set_mask) as usize * self.ways;
        let set = &mut self.tags[first..first + self.ways];
        let way = set.iter().position(|&tag| tag == EMPTY).unwrap_or_else(|| {
            self.state ^= self.state << 13;
            self.state ^= self.state >> 7;
            self.state ^= self.state << 17;
            // Uses the high bits, scaled, because the low bits of xorshift are weak.
            (((self.state >> 32) * set.len() as u64) >> 32) as usize
        });
        std::mem::replace(&mut set[way], line)
    }

    fn remove(&mut self, line: u32) -> bool {
        let first = (line & self.set_mask) as usize * self.ways;
        empty_way(&mut self.tags[first..first + self.ways], line).is_some()
    }

    fn clear(&mut self) {
        self.tags.fill(EMPTY);
    }
}
