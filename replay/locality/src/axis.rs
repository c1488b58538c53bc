//! Sets of times on an axis that is renumbered when full, so that memory depends on the number of distinct
//! lines, not on the length of the stream.

/// A hierarchical bit set of times: one bit per time, one bit per non-empty word, and so on. Finding the
/// last member before a time reads few words.
#[derive(Clone, Debug)]
pub(crate) struct TimeSet {
    /// Lowest level first; the last level has one word.
    levels: Vec<Vec<u64>>,
}

impl TimeSet {
    /// An empty set of times below `times`.
    pub(crate) fn new(times: u32) -> Self {
        let mut levels = vec![vec![0; (times as usize).div_ceil(64).max(1)]];
        while let Some(words) = levels.last().map(Vec::len).filter(|&words| words > 1) {
            levels.push(vec![0; words.div_ceil(64)]);
        }
        Self { levels }
    }

    #[inline(always)]
    pub(crate) fn insert(&mut self, time: u32) {
        let mut at = time as usize;
        for words in &mut self.levels {
            let word = &mut words[at / 64];
            let was_empty = *word == 0;
            *word |= 1 << (at % 64);
            if !was_empty {
                return;
            }
            at /= 64;
        }
    }

    #[inline(always)]
    pub(crate) fn remove(&mut self, time: u32) {
        let mut at = time as usize;
        for words in &mut self.levels {
            let word = &mut words[at / 64];
            *word &= !(1 << (at % 64));
            if *word != 0 {
                return;
            }
            at /= 64;
        }
    }

    /// The last member not later than `time`.
    #[inline(always)]
    pub(crate) fn last_until(&self, time: u32) -> Option<u32> {
        let mut at = time as usize;
        let mut level = 0;
        // Ascends to a word with a member at `at` or before it.
        let mut found = loop {
            let word = self.levels.get(level)?[at / 64] & (u64::MAX >> (63 - at % 64));
            if word != 0 {
                break at / 64 * 64 + word.ilog2() as usize;
            }
            at = (at / 64).checked_sub(1)?;
            level += 1;
        };
        // Descends to the last member below that bit.
        while level > 0 {
            level -= 1;
            found = found * 64 + self.levels[level][found].ilog2() as usize;
        }
        Some(found as u32)
    }

    /// Members, ascending.
    fn iter(&self) -> impl Iterator<Item = u32> {
        let words = (0_u32..).zip(&self.levels[0]);
        words.flat_map(|(number, &word)| {
            let mut left = word;
            std::iter::from_fn(move || {
                let bit = (left != 0).then(|| left.trailing_zeros())?;
                left &= left - 1;
                Some(number * 64 + bit)
            })
        })
    }

    /// The renumbered set, on an axis of `times`.
    pub(crate) fn renumbered(&self, numbers: &Renumbering, times: u32) -> Self {
        let mut new = Self::new(times);
        self.iter().for_each(|time| new.insert(numbers.of(time)));
        new
    }
}

/// A set of times that counts the members after a time.
#[derive(Clone, Debug)]
pub(crate) struct CountedTimes {
    words: Vec<u64>,
    /// Fenwick tree over blocks of words: members up to each block.
    blocks: Vec<u32>,
    count: u32,
}

/// Words per block.
const BLOCK: usize = 8;

impl CountedTimes {
    /// An empty set of times below `times`.
    pub(crate) fn new(times: u32) -> Self {
        let words = (times as usize).div_ceil(64).max(1);
        Self {
            words: vec![0; words],
            blocks: vec![0; words.div_ceil(BLOCK) + 1],
            count: 0,
        }
    }

    #[inline(always)]
    fn count_in_block(&mut self, word: usize, difference: i32) {
        self.count = self.count.wrapping_add_signed(difference);
        let mut block = word / BLOCK + 1;
        while let Some(count) = self.blocks.get_mut(block) {
            *count = count.wrapping_add_signed(difference);
            block += block & block.wrapping_neg();
        }
    }

    #[inline(always)]
    pub(crate) fn insert(&mut self, time: u32) {
        let word = time as usize / 64;
        self.words[word] |= 1 << (time % 64);
        self.count_in_block(word, 1);
    }

    /// Removes a member and inserts `end`, which becomes the last one. Returns the number of members between them.
    #[inline(always)]
    pub(crate) fn move_to_end(&mut self, time: u32, end: u32) -> u32 {
        let (from, to) = (time as usize / 64, end as usize / 64);
        let behind = self.words[from] >> (time % 64) >> 1;
        let after = if to - from <= 2 * BLOCK {
            let between = &self.words[from + 1..(to + 1).max(from + 1)];
            behind.count_ones() + between.iter().map(|word| word.count_ones()).sum::<u32>()
        } else {
            self.count - self.count_until(from) + behind.count_ones()
        };
        self.words[from] &= !(1 << (time % 64));
        self.words[to] |= 1 << (end % 64);
        if from / BLOCK != to / BLOCK {
            self.count_in_block(from, -1);
            self.count_in_block(to, 1);
        }
        after
    }

    /// Number of members in the words up to `word`.
    fn count_until(&self, word: usize) -> u32 {
        let block = word / BLOCK;
        let own = &self.words[block * BLOCK..=word];
        let mut count = own.iter().map(|word| word.count_ones()).sum();
        let mut node = block;
        while node > 0 {
            count += self.blocks[node];
            node &= node - 1;
        }
        count
    }

    /// The renumbered set: members become the first times of a new axis.
    pub(crate) fn renumbered(&self, numbers: &Renumbering, times: u32) -> Self {
        let mut new = Self::new(times);
        let members = TimeSet {
            levels: vec![self.words.clone()],
        };
        members.iter().for_each(|time| new.insert(numbers.of(time)));
        new
    }
}

/// Maps the times still needed to consecutive new numbers from zero.
#[derive(Clone, Debug)]
pub(crate) struct Renumbering {
    needed: Vec<u64>,
    /// Number of needed times before each word.
    before: Vec<u32>,
    count: u32,
}

impl Renumbering {
    /// Keeps the members of these sets.
    pub(crate) fn new<'a>(
        counted: &CountedTimes,
        others: impl Iterator<Item = &'a TimeSet>,
    ) -> Self {
        let mut needed = counted.words.clone();
        for set in others {
            for (word, other) in needed.iter_mut().zip(&set.levels[0]) {
                *word |= other;
            }
        }
        let mut count = 0;
        let before = needed
            .iter()
            .map(|word| {
                let before = count;
                count += word.count_ones();
                before
            })
            .collect();
        Self {
            needed,
            before,
            count,
        }
    }

    /// Number of times kept.
    pub(crate) fn len(&self) -> u32 {
        self.count
    }

    /// The new number of a time: the number of needed times before it. Times that are not needed keep their
    /// position among the needed ones.
    pub(crate) fn of(&self, time: u32) -> u32 {
        let word = time as usize / 64;
        match self.needed.get(word) {
            None => self.count,
            Some(bits) => {
                let below = bits & !(u64::MAX << (time % 64));
                self.before[word] + below.count_ones()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::random::Random;
    use std::collections::BTreeSet;

    #[test]
    fn the_last_member_up_to_a_time_equals_that_of_a_sorted_set() {
        for times in [1, 64, 65, 5000, 300_000] {
            let (mut set, mut plain) = (TimeSet::new(times), BTreeSet::new());
            let mut random = Random(u64::from(times));
            for _ in 0..4000 {
                let time = random.below(times);
                if random.below(3) == 0 {
                    set.remove(time);
                    plain.remove(&time);
                } else if random.below(40) == 0 {
                    set.insert(time);
                    plain.insert(time);
                }
                let at = random.below(times);
                let expected = plain.range(..=at).next_back().copied();
                assert_eq!(set.last_until(at), expected, "{times} times, at {at}");
            }
            assert!(set.iter().eq(plain));
        }
    }

    #[test]
    fn members_after_a_time_are_counted() {
        let times = 40_000;
        let (mut set, mut plain) = (CountedTimes::new(times), BTreeSet::new());
        let (mut random, mut now) = (Random(1), 0);
        while now < times {
            // Also uses distant members and long empty stretches.
            now += 1 + random.below(if now % 7 == 0 { 900 } else { 2 });
            if now >= times {
                break;
            }
            let pick = random.below(1 + plain.len() as u32 * 5 / 4) as usize;
            match plain.iter().nth(pick).copied() {
                None => set.insert(now),
                Some(member) => {
                    let between = plain.range(member + 1..).count() as u32;
                    plain.remove(&member);
                    assert_eq!(set.move_to_end(member, now), between, "{member} to {now}");
                }
            }
            plain.insert(now);
            assert_eq!(set.count as usize, plain.len());
        }
    }

    #[test]
    fn renumbering_keeps_the_order() {
        let mut counted = CountedTimes::new(300);
        let mut other = TimeSet::new(300);
        for time in [3, 64, 200] {
            counted.insert(time);
        }
        for time in [64, 130] {
            other.insert(time);
        }
        let numbers = Renumbering::new(&counted, [&other].into_iter());
        let new = [0, 3, 4, 64, 130, 131, 200, 299, 400].map(|time| numbers.of(time));
        assert_eq!(new, [0, 0, 1, 1, 2, 3, 3, 4, 4]);
        assert!(other.renumbered(&numbers, 64).iter().eq([1, 2]));
        let mut moved = counted.renumbered(&numbers, 64);
        assert_eq!((moved.count, moved.move_to_end(0, 4)), (3, 2));
    }
}
