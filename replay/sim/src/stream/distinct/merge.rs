//! Merges lines that occur in several bundles of a quad.

use crate::stream::tag::Use;
use std::hint::select_unpredictable;

/// Buckets of the hash table, a power of two much larger than the lines of a segment.
const BUCKETS: usize = 512;

/// Merges the common lines of bundles in a segment.
#[derive(Debug)]
pub(super) struct Merge {
    /// Open addressing: the number of the merge that wrote the bucket, and an index into `seen`. Buckets of
    /// other merges count as empty.
    buckets: Vec<(u32, u32)>,
    /// Number of the current merge.
    pub(super) number: u32,
    /// Number of lines so far.
    count: u32,
    /// Each line with its use. The footprints are cleared once the line is written.
    seen: [(u32, Use); Use::FIRST_LINES],
    /// Index into `seen` of each listed line.
    indexes: [u8; Use::FIRST_LINES],
}

impl Default for Merge {
    fn default() -> Self {
        Self {
            buckets: vec![(0, 0); BUCKETS],
            number: 0,
            count: 0,
            seen: [(0, Use::default()); Use::FIRST_LINES],
            indexes: [0; Use::FIRST_LINES],
        }
    }
}

impl Merge {
    /// Rewrites the list from `start` on so that each line of each cell occurs once, at its last position.
    #[inline(never)]
    pub(super) fn again(&mut self, start: usize, distinct: &mut Vec<u32>, uses: &mut Vec<Use>) {
        self.number = self.number.wrapping_add(1);
        if self.number == 0 {
            // Merge numbers wrap around, so entries with old numbers are cleared.
            self.buckets.fill((0, 0));
            self.number = 1;
        }
        self.count = 0;
        let listed = distinct.len() - start;
        for (at, (&line, &of)) in distinct[start..].iter().zip(&uses[start..]).enumerate() {
            self.indexes[at % Use::FIRST_LINES] = self.add(line, of) as u8;
        }
        distinct.truncate(start + self.count as usize);
        uses.truncate(distinct.len());
        let (distinct, uses) = (&mut distinct[start..], &mut uses[start..]);
        let mut left = distinct.len();
        for &index in self.indexes[..listed].iter().rev() {
            // Branch-free: a line seen for the first time keeps its slot; otherwise the next line overwrites it.
            let Some(slot) = left.checked_sub(1) else {
                break;
            };
            let (line, of) = &mut self.seen[usize::from(index)];
            (distinct[slot], uses[slot]) = (*line, *of);
            left -= usize::from(of.footprints() != 0);
            of.bits = 0;
        }
    }

    /// Adds a line and returns its index in `seen`.
    #[inline(always)]
    fn add(&mut self, line: u32, of: Use) -> u32 {
        let bucket = bucket(line);
        let (number, index) = self.buckets[bucket];
        // Branch-free: whether a line is new is unpredictable.
        let new = number != self.number;
        let index = select_unpredictable(new, self.count, index);
        let seen = &mut self.seen[index as usize % Use::FIRST_LINES];
        let same = (seen.0 == line) & (seen.1.cell() == of.cell());
        if !(new | same) {
            return self.add_beside(bucket, line, of);
        }
        let all = Use {
            bits: seen.1.bits | of.footprints(),
            cell: seen.1.cell,
        };
        *seen = (
            line,
            Use {
                bits: select_unpredictable(new, of.bits, all.bits),
                cell: select_unpredictable(new, of.cell, all.cell),
            },
        );
        self.buckets[bucket] = (self.number, index);
        self.count += u32::from(new);
        index
    }

    /// Adds a line whose bucket is occupied by another line, or by the same line of another cell.
    #[inline(never)]
    fn add_beside(&mut self, first: usize, line: u32, of: Use) -> u32 {
        let mut bucket = first;
        let mut listed = 0;
        loop {
            let (number, index) = self.buckets[bucket];
            if number != self.number {
                let index = self.count;
                self.buckets[bucket] = (self.number, index);
                let cell = of.cell | listed;
                self.seen[index as usize] = (line, Use { cell, ..of });
                self.count += 1;
                return index;
            }
            let seen = &mut self.seen[index as usize];
            if seen.0 == line {
                if seen.1.cell() == of.cell() {
                    seen.1.bits |= of.footprints();
                    return index;
                }
                listed = Use::LISTED;
            }
            bucket = (bucket + 1) % BUCKETS;
        }
    }
}

#[inline(always)]
fn bucket(line: u32) -> usize {
    line.wrapping_mul(0x9e37_79b1) as usize >> (u32::BITS - BUCKETS.ilog2())
}
