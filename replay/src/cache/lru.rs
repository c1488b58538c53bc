//! Least recently used: the tags of a set lie in order of last use, most recent first.
//!
//! Moving a hit to the front of four packed tags beat time stamps by four times and SIMD compares
//! by two; the repeats that dominate texture traffic end at the first compare.

use super::{Cache, EMPTY};

/// Associativity, fixed at compile time where speed matters.
pub trait Ways: Copy {
    /// Number of ways.
    fn ways(self) -> usize;
}

/// `N` ways, known to the compiler, which unrolls the search.
#[derive(Clone, Copy, Debug)]
pub struct WaysOf<const N: usize>;

impl<const N: usize> Ways for WaysOf<N> {
    #[inline(always)]
    fn ways(self) -> usize {
        N
    }
}

/// Any number of ways.
#[derive(Clone, Copy, Debug)]
pub struct AnyWays(pub usize);

impl Ways for AnyWays {
    #[inline(always)]
    fn ways(self) -> usize {
        self.0
    }
}

/// An LRU cache.
pub struct Lru<W: Ways> {
    tags: Vec<u32>,
    set_mask: u32,
    ways: W,
}

impl<W: Ways> Lru<W> {
    /// An empty cache; `sets` is a power of two.
    #[must_use]
    pub fn new(sets: u32, ways: W) -> Self {
        debug_assert!(sets.is_power_of_two());
        Self {
            tags: vec![EMPTY; sets as usize * ways.ways()],
            set_mask: sets - 1,
            ways,
        }
    }

    #[inline(always)]
    fn set(&mut self, line: u32) -> &mut [u32] {
        let ways = self.ways.ways();
        let first = (line & self.set_mask) as usize * ways;
        &mut self.tags[first..first + ways]
    }
}

impl<W: Ways> Cache for Lru<W> {
    #[inline(always)]
    fn lookup(&mut self, line: u32) -> bool {
        let set = self.set(line);
        if set[0] == line {
            return true;
        }
        for way in 1..set.len() {
            if set[way] == line {
                for behind in (0..way).rev() {
                    set[behind + 1] = set[behind];
                }
                set[0] = line;
                return true;
            }
        }
        false
    }

    #[inline(always)]
    fn fill(&mut self, line: u32) {
        let set = self.set(line);
        for way in (1..set.len()).rev() {
            set[way] = set[way - 1];
        }
        set[0] = line;
    }

    /// One pass: shifts the tags back until the line is found or falls off the end.
    #[inline(always)]
    fn access(&mut self, line: u32) -> bool {
        let set = self.set(line);
        let mut carried = set[0];
        if carried == line {
            return true;
        }
        set[0] = line;
        for tag in &mut set[1..] {
            let found = *tag;
            *tag = carried;
            if found == line {
                return true;
            }
            carried = found;
        }
        false
    }

    /// No more lines than ways can crowd each other out, and a repeat leaves the same stack.
    fn repeat_safe_lines(&self) -> u32 {
        self.ways.ways() as u32
    }
}
