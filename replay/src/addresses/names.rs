//! Line numbers of 64 bits as numbers of 32 bits, which all caches take.
//!
//! The low bits, which choose the set, stay; what is above them, a range of neighbouring lines, gets a
//! number when it is first seen. Equal lines stay equal and others different, so that no count
//! changes. Memory that is touched sparsely over more than 2^32 lines cannot be told apart any more.

use std::collections::HashMap;

/// Ranges are at least so many lines, so that few are met.
const LEAST_BITS: u32 = 12;

/// Ranges that are found without a look into the table.
const RECENT: usize = 256;

/// Gives lines their names.
pub struct Names {
    kept_bits: u32,
    numbers: HashMap<u64, u32>,
    /// Range and number, by the range's low bits.
    recent: Box<[(u64, u32); RECENT]>,
}

impl Names {
    /// Keeps what chooses among up to `most_sets` sets, a power of two up to 2^24.
    pub fn new(most_sets: u32) -> Self {
        Self {
            kept_bits: most_sets.ilog2().max(LEAST_BITS),
            numbers: HashMap::new(),
            recent: Box::new([(u64::MAX, 0); RECENT]),
        }
    }

    /// Ranges that can be told apart. The last number is not used: it would hold the line that caches
    /// take for none.
    pub fn most_ranges(&self) -> u64 {
        (1 << (32 - self.kept_bits)) - 1
    }

    /// Lines of a range.
    pub fn range_lines(&self) -> u64 {
        1 << self.kept_bits
    }

    /// The name of a line; nothing if there are too many ranges.
    #[inline(always)]
    pub fn name(&mut self, line: u64) -> Option<u32> {
        let range = line >> self.kept_bits;
        let low = (line & (self.range_lines() - 1)) as u32;
        let (known, number) = self.recent[range as usize % RECENT];
        let number = if known == range {
            number
        } else {
            self.number(range)?
        };
        Some(number << self.kept_bits | low)
    }

    #[inline(never)]
    fn number(&mut self, range: u64) -> Option<u32> {
        let next = self.numbers.len() as u64;
        let most = self.most_ranges();
        let number = match self.numbers.get(&range) {
            Some(&number) => number,
            None if next >= most => return None,
            None => {
                self.numbers.insert(range, next as u32);
                next as u32
            }
        };
        self.recent[range as usize % RECENT] = (range, number);
        Some(number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_keep_low_bits_and_tell_lines_apart() {
        let mut names = Names::new(1 << 14);
        let lines: Vec<u64> = (0..4000_u64)
            .map(|i| i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 4)
            .chain([(1 << 60) - 1, 1 << 32])
            .collect();
        let named: Vec<u32> = lines.iter().map(|&l| names.name(l).unwrap()).collect();
        let distinct: std::collections::HashSet<u32> = named.iter().copied().collect();
        assert_eq!(distinct.len(), lines.len());
        for (line, name) in lines.iter().zip(&named) {
            assert_eq!(line & 0x3fff, u64::from(name & 0x3fff));
            assert_eq!(names.name(*line), Some(*name));
            assert_ne!(*name, u32::MAX);
        }
    }

    #[test]
    fn more_ranges_than_names_are_refused() {
        let mut names = Names::new(1 << 24);
        assert_eq!(names.most_ranges(), 255);
        assert!((0..255).all(|range| names.name(range << 24 | 0xff_ffff).is_some()));
        assert_eq!(names.name(255 << 24), None);
        assert!(names.name(7 << 24).is_some());
    }
}
