//! Least recently used: the tags of a set are sorted by last use, most recent first.
//!
//! Moving a hit to the front of four packed tags was four times faster than time stamps and twice
//! as fast as SIMD compares. Repeated accesses, which dominate texture traffic, end at the first
//! compare.

use crate::memory::cache::{Cache, EMPTY, empty_way};

/// Associativity, fixed at compile time where speed matters.
pub trait Ways: Copy + Send {
    /// Number of ways.
    fn ways(self) -> usize;
}

/// `N` ways, known at compile time so that the search is unrolled.
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

/// A line number. The largest one marks an empty way.
pub trait Line: Copy + Eq {
    /// No line has this number.
    const EMPTY: Self;

    /// The set of the line; `mask` is the number of sets minus one.
    fn set(self, mask: u32) -> usize;
}

impl Line for u32 {
    const EMPTY: Self = EMPTY;

    #[inline(always)]
    fn set(self, mask: u32) -> usize {
        (self & mask) as usize
    }
}

impl Line for u64 {
    const EMPTY: Self = Self::MAX;

    #[inline(always)]
    fn set(self, mask: u32) -> usize {
        (self & Self::from(mask)) as usize
    }
}

/// An LRU cache.
#[derive(Clone, Debug)]
pub struct Lru<W: Ways, L: Line = u32> {
    tags: Vec<L>,
    set_mask: u32,
    ways: W,
}

/// The cache of nearly all replays.
pub type FourWayLru = Lru<WaysOf<4>>;

impl<W: Ways, L: Line> Lru<W, L> {
    /// An empty cache; `sets` is a power of two.
    pub fn new(sets: u32, ways: W) -> Self {
        debug_assert!(sets.is_power_of_two());
        Self {
            tags: vec![L::EMPTY; sets as usize * ways.ways()],
            set_mask: sets - 1,
            ways,
        }
    }

    /// Number of sets.
    pub(in crate::memory) fn sets(&self) -> u32 {
        self.set_mask + 1
    }

    #[inline(always)]
    fn set(&mut self, line: L) -> &mut [L] {
        let ways = self.ways.ways();
        let first = line.set(self.set_mask) * ways;
        &mut self.tags[first..first + ways]
    }

    /// Looks up a line and fills it immediately on a miss. Returns true for a hit.
    #[inline(always)]
    pub fn access(&mut self, line: L) -> bool {
        let set = self.set(line);
        let ways = set.len();
        to_front(set, line) < ways
    }
}

/// Moves the line to the front, shifting the tags before it back. Returns its previous depth, or
/// the number of ways if it was absent (the last tag is dropped).
#[inline(always)]
pub(in crate::memory) fn to_front<L: Line>(set: &mut [L], line: L) -> usize {
    if let Ok(four) = <&mut [L; 4]>::try_from(&mut *set) {
        let [first, second, third, fourth] = *four;
        if first == line {
            return 0;
        }
        // Branch-free: whether the line lies second, third or fourth is an unpredictable branch.
        let found = [second, third, fourth].map(|tag| tag == line);
        let third_kept = if found[0] { third } else { second };
        let fourth_kept = if found[0] | found[1] { fourth } else { third };
        *four = [line, first, third_kept, fourth_kept];
        let third_or_deeper = if found[2] { 3 } else { 4 };
        let second_or_deeper = if found[1] { 2 } else { third_or_deeper };
        return if found[0] { 1 } else { second_or_deeper };
    }
    let mut carried = line;
    for (depth, tag) in set.iter_mut().enumerate() {
        let found = std::mem::replace(tag, carried);
        if found == line {
            return depth;
        }
        carried = found;
    }
    set.len()
}

/// Moves the line to the front if it is resident.
#[inline(always)]
pub(in crate::memory) fn look_up(set: &mut [u32], line: u32) -> bool {
    if let Ok(four) = <&mut [u32; 4]>::try_from(&mut *set) {
        let [first, second, third, fourth] = *four;
        if first == line {
            return true;
        }
        let found = [second, third, fourth].map(|tag| tag == line);
        if !(found[0] | found[1] | found[2]) {
            return false;
        }
        let third_kept = if found[0] { third } else { second };
        let fourth_kept = if found[2] { third } else { fourth };
        *four = [line, first, third_kept, fourth_kept];
        return true;
    }
    let Some(way) = set.iter().position(|&tag| tag == line) else {
        return false;
    };
    set[..=way].rotate_right(1);
    true
}

/// Removes a line; the lines behind it move up. Returns true if it was resident.
pub(in crate::memory) fn take_out(set: &mut [u32], line: u32) -> bool {
    let Some(way) = empty_way(set, line) else {
        return false;
    };
    set[way..].rotate_left(1);
    true
}

impl<W: Ways> Cache for Lru<W> {
    #[inline(always)]
    fn lookup(&mut self, line: u32) -> bool {
        look_up(self.set(line), line)
    }

    #[inline(always)]
    fn lookup_all(&mut self, lines: &[u32]) -> Option<usize> {
        // Locals keep everything except the tags in registers.
        let (ways, mask) = (self.ways.ways(), self.set_mask);
        let tags = self.tags.as_mut_slice();
        lines.iter().position(|&line| {
            let first = line.set(mask) * ways;
            !look_up(&mut tags[first..first + ways], line)
        })
    }

    #[inline(always)]
    fn contains(&self, line: u32) -> bool {
        let ways = self.ways.ways();
        let first = line.set(self.set_mask) * ways;
        self.tags[first..first + ways].contains(&line)
    }

    fn fill(&mut self, line: u32) -> u32 {
        let set = self.set(line);
        let evicted = set.last().copied().unwrap_or(EMPTY);
        for way in (1..set.len()).rev() {
            set[way] = set[way - 1];
        }
        set[0] = line;
        evicted
    }

    fn remove(&mut self, line: u32) -> bool {
        take_out(self.set(line), line)
    }

    fn clear(&mut self) {
        self.tags.fill(EMPTY);
    }

    #[inline(always)]
    fn access(&mut self, line: u32) -> bool {
        Self::access(self, line)
    }

    /// At most as many lines as ways cannot evict each other, and a repeat leaves the same stack.
    fn repeat_safe_lines(&self) -> u32 {
        self.ways.ways() as u32
    }
}
