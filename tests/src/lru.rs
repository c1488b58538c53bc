//! A cache in the simplest form, to compare models with.

/// An LRU cache: one list of lines per set, most recently used first.
pub struct Lru {
    /// The lines of each set.
    pub sets: Vec<Vec<u64>>,
    ways: usize,
}

impl Lru {
    /// An empty cache.
    pub fn new(sets: usize, ways: usize) -> Self {
        Self {
            sets: vec![Vec::new(); sets],
            ways,
        }
    }

    /// Whether the line was there; it is from then on.
    pub fn access(&mut self, line: u64) -> bool {
        let set = line as usize % self.sets.len();
        let set = &mut self.sets[set];
        let found = set.iter().position(|&other| other == line);
        match found {
            Some(at) => set[..=at].rotate_right(1),
            None => {
                set.truncate(self.ways - 1);
                set.insert(0, line);
            }
        }
        found.is_some()
    }
}
