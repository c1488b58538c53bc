//! A set of draws that is filled in any order and read in ascending order.

/// One bit per draw, and one bit per non-empty word, so that the time for reading depends on the number of
/// elements.
#[derive(Clone, Debug, Default)]
pub(crate) struct DrawSet {
    words: Vec<u64>,
    summary: Vec<u64>,
}

impl DrawSet {
    /// Makes room for draws `0..len`.
    pub fn reserve(&mut self, len: usize) {
        let words = len.div_ceil(64).max(self.words.len());
        self.words.resize(words, 0);
        self.summary.resize(words.div_ceil(64), 0);
    }

    /// Adds a draw within the capacity.
    #[inline]
    pub fn insert(&mut self, draw: u32) {
        let word = draw as usize / 64;
        self.words[word] |= 1 << (draw % 64);
        self.summary[word / 64] |= 1 << (word % 64);
    }

    /// Appends the draws in ascending order and empties the set.
    pub fn drain_into(&mut self, list: &mut Vec<u32>) {
        for (group, summary) in self.summary.iter_mut().enumerate() {
            let mut words = std::mem::take(summary);
            while words != 0 {
                let word = 64 * group + words.trailing_zeros() as usize;
                words &= words - 1;
                let mut draws = std::mem::take(&mut self.words[word]);
                while draws != 0 {
                    list.push(64 * word as u32 + draws.trailing_zeros());
                    draws &= draws - 1;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_are_read_once_in_ascending_order_and_removed() {
        let mut set = DrawSet::default();
        set.reserve(10_000);
        let mut list = vec![];
        for draw in [9_999, 64, 5, 4_096, 63, 5, 0, 4_095] {
            set.insert(draw);
        }
        set.drain_into(&mut list);
        assert_eq!(list, [0, 5, 63, 64, 4_095, 4_096, 9_999]);
        list.clear();
        set.insert(7);
        set.drain_into(&mut list);
        assert_eq!(list, [7]);
    }
}
