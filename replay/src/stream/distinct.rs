//! A quad's distinct lines: all that a cache has to be asked where the quad's own accesses change
//! nothing in it but the order of last use.
//!
//! A quad is cut into *segments* of so many footprints that a word has a bit for each. In a segment,
//! each line of each cell is listed once, with the footprints that use it.

use super::QuadLines;
use super::lines::Tag;

/// Footprints of a segment at most, repeats counted: four lanes of three trilinear textures.
const FOOTPRINTS: u32 = 24;

/// Buckets of the table; a power of two, far more than a segment has lines.
const BUCKETS: usize = 512;

/// Who uses a distinct line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Use {
    bits: u32,
    /// Its cell within the view, and a bit.
    cell: u32,
}

impl Use {
    const LAST: u32 = 1 << 31;

    /// First lines are below this.
    pub const FIRST_LINES: usize = 1 << (31 - FOOTPRINTS);

    /// Bits of `cell` that name none.
    const LISTED: u32 = Tag::CELLS as u32;

    fn new(footprints: u32, first_line: u32, cell: u32) -> Self {
        Self {
            bits: footprints | first_line << FOOTPRINTS,
            cell,
        }
    }

    /// Its cell within the view.
    #[inline(always)]
    pub(super) fn cell(self) -> u32 {
        self.cell & (Self::LISTED - 1)
    }

    /// True if the quad may have listed the line already: for another cell, or in another segment.
    #[inline(always)]
    #[must_use]
    pub fn may_be_listed(self) -> bool {
        self.cell & Self::LISTED != 0
    }

    /// A bit for each footprint of the segment, repeats counted.
    #[inline(always)]
    #[must_use]
    pub fn footprints(self) -> u32 {
        self.bits & ((1 << FOOTPRINTS) - 1)
    }

    /// Where it stands first among the segment's lines.
    #[inline(always)]
    #[must_use]
    pub fn first_line(self) -> usize {
        ((self.bits & !Self::LAST) >> FOOTPRINTS) as usize
    }

    /// True for the last distinct line of a segment.
    #[inline(always)]
    fn ends_segment(self) -> bool {
        self.bits & Self::LAST != 0
    }
}

impl<'a> QuadLines<'a> {
    /// True if all its footprints fit into one segment.
    #[inline(always)]
    #[must_use]
    pub fn is_one_segment(&self) -> bool {
        self.footprints <= FOOTPRINTS
    }

    /// Where the distinct lines of each segment end.
    #[inline(always)]
    pub fn segments(self) -> impl Iterator<Item = usize> + use<'a> {
        let mut start = 0;
        std::iter::from_fn(move || {
            let uses = &self.uses[start..];
            start += if self.is_one_segment() && !uses.is_empty() {
                // All of them fit into one.
                uses.len()
            } else {
                1 + uses.iter().position(|of| of.ends_segment())?
            };
            Some(start)
        })
    }
}

/// A distinct line of the segment at hand.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    line: u32,
    footprints: u32,
    /// And [`Use::LISTED`].
    cell: u32,
    first_line: u32,
}

/// Finds the distinct lines of one quad after another.
#[derive(Debug)]
pub(super) struct Distinct {
    /// Open addressing: the segment that wrote it, and the index in `seen`. What other segments
    /// wrote is empty.
    buckets: Vec<(u32, u32)>,
    segment: u32,
    /// [`Use::LISTED`] for all but a quad's first segment.
    listed: u32,
    /// So many are in use.
    distinct: u32,
    seen: [Seen; Use::FIRST_LINES],
    /// Index in `seen` of each line.
    indexes: [u8; Use::FIRST_LINES],
}

/// A footprint has four lines at most.
const _: () = assert!(4 * FOOTPRINTS as usize <= Use::FIRST_LINES);

impl Default for Distinct {
    fn default() -> Self {
        Self {
            buckets: vec![(0, 0); BUCKETS],
            segment: 0,
            listed: 0,
            distinct: 0,
            seen: [Seen::default(); Use::FIRST_LINES],
            indexes: [0; Use::FIRST_LINES],
        }
    }
}

impl Distinct {
    /// Appends the distinct lines and their uses of a quad of so many footprints, repeats counted.
    pub(super) fn list(
        &mut self,
        footprints: u32,
        mut lines: &[u32],
        mut tags: &[Tag],
        distinct: &mut Vec<u32>,
        uses: &mut Vec<Use>,
    ) {
        let mut again = false;
        while !lines.is_empty() {
            let end = match footprints <= FOOTPRINTS {
                true => lines.len(),
                false => segment_end(tags),
            };
            self.begin(again);
            let mut bits = 0_u32;
            for (at, (&line, tag)) in lines[..end].iter().zip(tags).enumerate() {
                // No branches: how many lines a footprint has is a coin toss to the processor.
                let next = u32::BITS - bits.leading_zeros();
                let of_next = ((2 << tag.repeats()) - 1) << next;
                bits = select(tag.is_first(), of_next, bits);
                self.add(line, tag.cell(), bits, at);
            }
            self.finish(end, distinct, uses);
            (lines, tags) = (&lines[end..], &tags[end..]);
            again = true;
        }
    }

    fn begin(&mut self, again: bool) {
        self.listed = if again { Use::LISTED } else { 0 };
        self.segment = self.segment.wrapping_add(1);
        if self.segment == 0 {
            // Numbers start again: what was written with them is forgotten.
            self.buckets.fill((0, 0));
            self.segment = 1;
        }
        self.distinct = 0;
    }

    /// Adds a line of some footprints.
    #[inline(always)]
    fn add(&mut self, line: u32, cell: u32, footprints: u32, at: usize) {
        let bucket = bucket(line);
        let (segment, index) = self.buckets[bucket];
        // No branches: whether a line is new is a coin toss to the processor.
        let new = segment != self.segment;
        let index = select(new, self.distinct, index);
        let seen = &mut self.seen[index as usize % Use::FIRST_LINES];
        let same = (seen.line == line) & (seen.cell & !Use::LISTED == cell);
        if !(new | same) {
            self.add_beside(bucket, line, cell, footprints, at);
            return;
        }
        *seen = Seen {
            line,
            footprints: footprints | select(new, 0, seen.footprints),
            cell: select(new, cell | self.listed, seen.cell),
            first_line: select(new, at as u32, seen.first_line),
        };
        self.buckets[bucket] = (self.segment, index);
        self.distinct += u32::from(new);
        self.indexes[at % Use::FIRST_LINES] = index as u8;
    }

    /// Adds a line whose bucket another one has, or the same line of another cell.
    #[inline(never)]
    fn add_beside(&mut self, first: usize, line: u32, cell: u32, footprints: u32, at: usize) {
        let mut bucket = first;
        let mut listed = self.listed;
        let index = loop {
            let (segment, index) = self.buckets[bucket];
            if segment != self.segment {
                let index = self.distinct;
                self.buckets[bucket] = (self.segment, index);
                self.seen[index as usize] = Seen {
                    line,
                    footprints: 0,
                    cell: cell | listed,
                    first_line: at as u32,
                };
                self.distinct += 1;
                break index;
            }
            let seen = &self.seen[index as usize];
            if seen.line == line {
                if seen.cell & !Use::LISTED == cell {
                    break index;
                }
                listed = Use::LISTED;
            }
            bucket = (bucket + 1) % BUCKETS;
        };
        self.seen[index as usize].footprints |= footprints;
        self.indexes[at] = index as u8;
    }

    /// Appends what was added, so many lines, in the order of last use.
    fn finish(&mut self, lines: usize, distinct: &mut Vec<u32>, uses: &mut Vec<Use>) {
        let mut left = self.distinct as usize;
        let first = distinct.len();
        distinct.resize(first + left, 0);
        uses.resize(first + left, Use::default());
        let (distinct, uses) = (&mut distinct[first..], &mut uses[first..]);
        for &index in self.indexes[..lines].iter().rev() {
            // No branches on whether a line comes up for the first time: then it keeps its slot, else the
            // next one takes it.
            let Some(slot) = left.checked_sub(1) else {
                break;
            };
            let seen = &mut self.seen[usize::from(index)];
            let footprints = std::mem::take(&mut seen.footprints);
            distinct[slot] = seen.line;
            uses[slot] = Use::new(footprints, seen.first_line, seen.cell);
            left -= usize::from(footprints != 0);
        }
        if let Some(last) = uses.last_mut() {
            last.bits |= Use::LAST;
        }
    }
}

/// Where the first segment of a quad ends.
fn segment_end(tags: &[Tag]) -> usize {
    let mut footprints = 0;
    let ends = |tag: &Tag| {
        footprints += if tag.is_first() { 1 + tag.repeats() } else { 0 };
        footprints > FOOTPRINTS
    };
    tags.iter().position(ends).unwrap_or(tags.len())
}

#[inline(always)]
fn bucket(line: u32) -> usize {
    line.wrapping_mul(0x9e37_79b1) as usize >> (u32::BITS - BUCKETS.ilog2())
}

#[inline(always)]
fn select(yes: bool, this: u32, that: u32) -> u32 {
    std::hint::select_unpredictable(yes, this, that)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::lines::{QuadEnd, TileLines};
    use proptest::prelude::*;
    use std::collections::HashMap;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        /// Footprints of up to four lines of a cell, with repeats; lines shared by cells.
        #[test]
        fn segments_say_of_each_line_who_uses_it_and_in_which_order(
            quads in prop::collection::vec(prop::collection::vec(
                (0_u32..3, 0_u32..4, prop::collection::vec(0_u32..30, 1..5)), 0..40,
            ), 1..4),
        ) {
            // Segments' numbers start again.
            let mut distinct = Distinct { segment: u32::MAX - 1, ..Distinct::default() };
            let mut tile = TileLines::default();
            for footprints in &quads {
                let start = tile.lines.len();
                for (cell, repeats, lines) in footprints {
                    let [first, other] = Tag::of_footprint(*cell, *repeats);
                    for (index, line) in lines.iter().enumerate() {
                        tile.lines.push(*line);
                        tile.tags.push(if index == 0 { first } else { other });
                    }
                }
                let (lines, tags) = (&tile.lines[start..], &tile.tags[start..]);
                let all = footprints.iter().map(|(_, repeats, _)| 1 + repeats).sum();
                distinct.list(all, lines, tags, &mut tile.distinct, &mut tile.uses);
                tile.quads.push(QuadEnd {
                    end: tile.lines.len() as u32,
                    distinct_end: tile.distinct.len() as u32,
                    footprints: footprints.iter().map(|(_, repeats, _)| 1 + repeats).sum(),
                });
            }
            for index in 0..quads.len() {
                let quad = tile.quad(index);
                let (mut begin, mut first_line) = (0, 0);
                for segment_end in quad.segments() {
                    let listed = begin..segment_end;
                    let all = |all, of: &Use| all | of.footprints();
                    let mut footprints = quad.uses[listed.clone()].iter().fold(0, all).count_ones();
                    let mut end = first_line;
                    while footprints > 0 {
                        footprints -= 1 + quad.tags[end].repeats();
                        end = quad.end_of_footprint(end);
                    }
                    // Footprints and last position by line and cell.
                    let mut plain: HashMap<(u32, u32), (u32, usize, usize)> = HashMap::new();
                    let (mut bit, mut bits) = (0, 0);
                    for at in first_line..end {
                        if quad.tags[at].is_first() {
                            let times = 1 + quad.tags[at].repeats();
                            bits = ((1 << times) - 1) << bit;
                            bit += times;
                        }
                        let key = (quad.lines[at], quad.tags[at].cell());
                        let first = at - first_line;
                        let entry = plain.entry(key).or_insert((0, first, 0));
                        *entry = (entry.0 | bits, entry.1, at);
                    }
                    prop_assert!(bit <= FOOTPRINTS);
                    begin = segment_end;
                    prop_assert_eq!(listed.len(), plain.len());
                    let other_cell = |line, cell, first| {
                        let earlier = |(key, of): (&(u32, u32), &(u32, usize, usize))| {
                            key.0 == line && key.1 != cell && of.1 < first
                        };
                        plain.iter().any(earlier)
                    };
                    let mut before = 0;
                    for (line, of) in quad.distinct[listed.clone()].iter().zip(&quad.uses[listed]) {
                        let (footprints, first, last) = plain[&(*line, of.cell())];
                        prop_assert_eq!((of.footprints(), of.first_line()), (footprints, first));
                        let listed = first_line > 0 || other_cell(*line, of.cell(), first);
                        prop_assert_eq!(of.may_be_listed(), listed);
                        prop_assert!(before <= last);
                        before = last;
                    }
                    first_line = end;
                }
                prop_assert_eq!((begin, first_line), (quad.distinct.len(), quad.lines.len()));
            }
        }
    }
}
