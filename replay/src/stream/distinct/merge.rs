//! Lines that several bundles of a quad have, listed once.

use super::Use;
use std::hint::select_unpredictable;

/// Buckets of the table; a power of two, far more than a segment has lines.
const BUCKETS: usize = 512;

/// Merges what bundles of the same segment have in common.
#[derive(Debug)]
pub(super) struct Merge {
    /// Open addressing: the merge that wrote it, and the index in `seen`. What other merges
    /// wrote is empty.
    buckets: Vec<(u32, u32)>,
    /// Of this merge.
    pub(super) number: u32,
    /// Lines so far.
    count: u32,
    /// Each with its use; without footprints once it is written.
    seen: [(u32, Use); Use::FIRST_LINES],
    /// Index in `seen` of what was listed.
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
    /// Lists what is listed from `start` on again, each line of each cell once and where it was last.
    #[inline(never)]
    pub(super) fn again(&mut self, start: usize, distinct: &mut Vec<u32>, uses: &mut Vec<Use>) {
        self.number = self.number.wrapping_add(1);
        if self.number == 0 {
            // Numbers start again: what was written with them is forgotten.
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
            // No branches on whether a line comes up for the first time: then it keeps its slot, else the
            // next one takes it.
            let Some(slot) = left.checked_sub(1) else {
                break;
            };
            let (line, of) = &mut self.seen[usize::from(index)];
            (distinct[slot], uses[slot]) = (*line, *of);
            left -= usize::from(of.footprints() != 0);
            of.bits = 0;
        }
    }

    /// Adds a line; its index in `seen`.
    #[inline(always)]
    fn add(&mut self, line: u32, of: Use) -> u32 {
        let bucket = bucket(line);
        let (number, index) = self.buckets[bucket];
        // No branches: whether a line is new is a coin toss to the processor.
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

    /// Adds a line whose bucket another one has, or the same line of another cell.
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
