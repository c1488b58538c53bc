//! Renumbers 64-bit lines with 32 bits, as required by all caches.
//!
//! The low bits, which select the set, are preserved. The bits above them identify a range of neighbouring
//! lines, which is numbered when first accessed. Distinct lines stay distinct, so no count changes.
//! Accesses spread too sparsely over more than 2^32 lines cannot be numbered.

use std::collections::HashMap;

/// Minimum size of a range (log2 of lines), so that there are few ranges.
const LEAST_BITS: u32 = 12;

/// Ranges cached in front of the table.
const RECENT: usize = 256;

/// Maps lines to 32-bit numbers.
pub struct Names {
    kept_bits: u32,
    numbers: HashMap<u64, u32>,
    /// Range and number, by the low bits of the range.
    recent: Box<[(u64, u32); RECENT]>,
}

impl Names {
    /// Preserves the bits that select among up to `most_sets` sets, a power of two up to 2^24.
    pub fn new(most_sets: u32) -> Self {
        Self {
            kept_bits: most_sets.ilog2().max(LEAST_BITS),
            numbers: HashMap::new(),
            recent: Box::new([(u64::MAX, 0); RECENT]),
        }
    }

    /// Maximum number of ranges. The last number is reserved, because it contains `u32::MAX`.
    pub(super) fn most_ranges(&self) -> u64 {
        (1 << (32 - self.kept_bits)) - 1
    }

    /// Lines per range.
    pub(super) fn range_lines(&self) -> u64 {
        1 << self.kept_bits
    }

    /// The number of a line, or none if there are too many ranges.
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
    fn renumbered_lines_keep_low_bits_and_stay_distinct() {
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
    fn more_ranges_than_numbers_are_refused() {
        let mut names = Names::new(1 << 24);
        assert_eq!(names.most_ranges(), 255);
        assert!((0..255).all(|range| names.name(range << 24 | 0xff_ffff).is_some()));
        assert_eq!(names.name(255 << 24), None);
        assert!(names.name(7 << 24).is_some());
    }
}
