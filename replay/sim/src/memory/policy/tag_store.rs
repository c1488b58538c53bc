//! A cache that keeps the tags, for policies that only choose ways. Empty ways are filled first.

use crate::memory::cache::{Cache, EMPTY, empty_way};

/// A replacement policy for all sets of a cache.
pub trait Policy: Send {
    /// A look-up of `line` found it in this way.
    fn hit(&mut self, _set: u32, _way: u32, _line: u32) {}

    /// `line` was filled into this way.
    fn fill(&mut self, set: u32, way: u32, line: u32);

    /// The way to evict from a full set; less than the number of ways.
    fn victim(&mut self, set: u32) -> u32;

    /// All lines were removed.
    fn clear(&mut self) {}
}

impl Policy for Box<dyn Policy> {
    fn hit(&mut self, set: u32, way: u32, line: u32) {
        (**self).hit(set, way, line);
    }

    fn fill(&mut self, set: u32, way: u32, line: u32) {
        (**self).fill(set, way, line);
    }

    fn victim(&mut self, set: u32) -> u32 {
        (**self).victim(set)
    }

    fn clear(&mut self) {
        (**self).clear();
    }
}

/// The tags of a cache, and its policy.
pub(super) struct TagStore<P> {
    tags: Vec<u32>,
    set_mask: u32,
    ways: usize,
    policy: P,
    repeat_safe_lines: u32,
}

impl<P: Policy> TagStore<P> {
    /// An empty cache; `sets` is a power of two. See [`Cache::repeat_safe_lines`].
    pub(super) fn new(sets: u32, ways: u32, policy: P, repeat_safe_lines: u32) -> Self {
        Self {
            tags: vec![EMPTY; sets as usize * ways as usize],
            set_mask: sets - 1,
            ways: ways as usize,
            policy,
            repeat_safe_lines,
        }
    }

    /// The set of a line, and the place of its first way.
    fn set_of(&self, line: u32) -> (u32, usize) {
        let set = line & self.set_mask;
        (set, set as usize * self.ways)
    }

    fn way_of(&self, line: u32) -> Option<usize> {
        let (_, first) = self.set_of(line);
        let mut tags = self.tags[first..first + self.ways].iter();
        tags.position(|&tag| tag == line)
    }
}

impl<P: Policy> Cache for TagStore<P> {
    fn lookup(&mut self, line: u32) -> bool {
        let Some(way) = self.way_of(line) else {
            return false;
        };
        let (set, _) = self.set_of(line);
        self.policy.hit(set, way as u32, line);
        true
    }

    fn contains(&self, line: u32) -> bool {
        self.way_of(line).is_some()
    }

    fn fill(&mut self, line: u32) -> u32 {
        let (set, first) = self.set_of(line);
        let tags = &mut self.tags[first..first + self.ways];
        let empty = tags.iter().position(|&tag| tag == EMPTY);
        let way = empty.unwrap_or_else(|| self.policy.victim(set) as usize % self.ways);
        let evicted = std::mem::replace(&mut tags[way], line);
        self.policy.fill(set, way as u32, line);
        evicted
    }

    fn remove(&mut self, line: u32) -> bool {
        let (_, first) = self.set_of(line);
        empty_way(&mut self.tags[first..first + self.ways], line).is_some()
    }

    fn clear(&mut self) {
        self.tags.fill(EMPTY);
        self.policy.clear();
    }

    fn repeat_safe_lines(&self) -> u32 {
        self.repeat_safe_lines
    }
}
