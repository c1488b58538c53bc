//! Tree pseudo-LRU: one bit per node of a binary tree over the ways points to the half that was not used last.

use crate::memory::cache::{Cache, EMPTY, empty_way};

/// A tree-PLRU cache.
pub(super) struct TreePlru {
    tags: Vec<u32>,
    /// Tree bits by set: node 1 is the root, node `n` has the children `2n` and `2n + 1`.
    trees: Vec<u64>,
    ways: usize,
    set_mask: u32,
}

/// A tree of 64 bits has at most 64 leaves.
pub(super) fn accepts_ways(ways: u32) -> bool {
    ways.is_power_of_two() && ways <= 64
}

impl TreePlru {
    /// An empty cache; `sets` and `ways` are powers of two, `ways` at most 64.
    pub fn new(sets: u32, ways: u32) -> Self {
        Self {
            tags: vec![EMPTY; sets as usize * ways as usize],
            trees: vec![0; sets as usize],
            ways: ways as usize,
            set_mask: sets - 1,
        }
    }

    /// Points every node on the way's path to the other half.
    fn touch(&mut self, set: usize, way: usize) {
        let tree = &mut self.trees[set];
        let mut node = way + self.ways;
        while node > 1 {
            let parent = node / 2;
            if node.is_multiple_of(2) {
                *tree |= 1 << parent;
            } else {
                *tree &= !(1 << parent);
            }
            node = parent;
        }
    }
}

impl Cache for TreePlru {
    fn lookup(&mut self, line: u32) -> bool {
        let set = (line & self.set_mask) as usize;
        let first = set * self.ways;
        let way = self.tags[first..first + self.ways]
            .iter()
            .position(|&tag| tag == line);
        if let Some(way) = way {
            self.touch(set, way);
        }
        way.is_some()
    }

    fn contains(&self, line: u32) -> bool {
        let first = (line & self.set_mask) as usize * self.ways;
        self.tags[first..first + self.ways].contains(&line)
    }

    fn fill(&mut self, line: u32) -> u32 {
        let set = (line & self.set_mask) as usize;
        let first = set * self.ways;
        let empty = self.tags[first..first + self.ways]
            .iter()
            .position(|&tag| tag == EMPTY);
        let way = empty.unwrap_or_else(|| {
            let mut node = 1;
            while node < self.ways {
                node = 2 * node + (self.trees[set] >> node & 1) as usize;
            }
            node - self.ways
        });
        let evicted = std::mem::replace(&mut self.tags[first + way], line);
        self.touch(set, way);
        evicted
    }

    fn remove(&mut self, line: u32) -> bool {
        let first = (line & self.set_mask) as usize * self.ways;
        empty_way(&mut self.tags[first..first + self.ways], line).is_some()
    }

    fn clear(&mut self) {
        self.tags.fill(EMPTY);
        self.trees.fill(0);
    }
}
