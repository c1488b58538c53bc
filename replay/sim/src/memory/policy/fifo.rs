//! First in, first out: a hit changes nothing, and the oldest line is evicted.

use crate::memory::cache::{Cache, EMPTY};

/// A FIFO cache.
pub(super) struct Fifo {
    tags: Vec<u32>,
    /// The next victim's way, by set.
    oldest: Vec<u8>,
    ways: usize,
    set_mask: u32,
}

impl Fifo {
    /// An empty cache; `sets` is a power of two, `ways` at most 255.
    pub fn new(sets: u32, ways: u32) -> Self {
        Self {
            tags: vec![EMPTY; sets as usize * ways as usize],
            oldest: vec![0; sets as usize],
            ways: ways as usize,
            set_mask: sets - 1,
        }
    }
}

impl Cache for Fifo {
    fn lookup(&mut self, line: u32) -> bool {
        self.contains(line)
    }

    fn contains(&self, line: u32) -> bool {
        let first = (line & self.set_mask) as usize * self.ways;
        self.tags[first..first + self.ways].contains(&line)
    }

    fn fill(&mut self, line: u32) -> u32 {
        let set = (line & self.set_mask) as usize;
        let oldest = &mut self.oldest[set];
        let tag = &mut self.tags[set * self.ways + usize::from(*oldest)];
        let evicted = std::mem::replace(tag, line);
        *oldest = if usize::from(*oldest) + 1 == self.ways {
            0
        } else {
            *oldest + 1
        };
        evicted
    }

    /// Moves older lines up, so that the emptied way is the next victim.
    fn remove(&mut self, line: u32) -> bool {
        let set = (line & self.set_mask) as usize;
        let tags = &mut self.tags[set * self.ways..][..self.ways];
        let Some(mut way) = tags.iter().position(|&tag| tag == line) else {
            return false;
        };
        while way != usize::from(self.oldest[set]) {
            let older = way.checked_sub(1).unwrap_or(self.ways - 1);
            tags[way] = tags[older];
            way = older;
        }
        tags[way] = EMPTY;
        true
    }

    fn clear(&mut self) {
        self.tags.fill(EMPTY);
        self.oldest.fill(0);
    }
}
