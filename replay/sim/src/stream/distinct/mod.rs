//! The distinct lines of a quad. They suffice for a cache in which the quad's own accesses only change the
//! order of last use.
//!
//! A quad is divided into *segments*, whose footprints each have one bit of a word. A segment lists each
//! line of each cell once, with the footprints that use it.

mod merge;

use super::footprint::Bundle;
use super::tag::{FOOTPRINTS, Use};
use merge::Merge;

/// Finds the distinct lines of quads.
///
/// Each bundle already lists its own distinct lines. Bundles of a quad rarely share lines, because textures
/// and levels occupy their own lines, except for the smallest. Lines are merged only from the first bundle
/// on whose range of lines overlaps another's.
#[derive(Debug, Default)]
pub(super) struct Distinct {
    /// Footprints of the current segment, and their lines.
    footprints: u32,
    lines: u32,
    /// Start of the segment among all distinct lines, and the first bundle that overlaps another.
    start: usize,
    met: usize,
    /// [`Use::LISTED`] except in a quad's first segment.
    listed: u32,
    bundles: u32,
    /// Range of all bundles of the segment.
    hull: Span,
    /// Ranges of the bundles of the segment.
    spans: [Span; FOOTPRINTS as usize],
    merge: Merge,
}

/// Start of a bundle among all distinct lines, and the range of its lines.
#[derive(Clone, Copy, Debug, Default)]
struct Span {
    start: usize,
    first: u32,
    last: u32,
}

/// A footprint has at most four lines.
const _: () = assert!(4 * FOOTPRINTS as usize <= Use::FIRST_LINES);

impl Distinct {
    /// Starts a quad after `start` distinct lines.
    #[inline(always)]
    pub(super) fn begin(&mut self, start: usize) {
        self.begin_segment(start);
        self.listed = 0;
    }

    #[inline(always)]
    fn begin_segment(&mut self, start: usize) {
        (self.footprints, self.lines, self.bundles) = (0, 0, 0);
        (self.start, self.met) = (start, usize::MAX);
        self.listed = Use::LISTED;
        self.hull = Span {
            first: u32::MAX,
            ..Span::default()
        };
    }

    /// Appends the distinct lines of a bundle, whose lines are relative to `base_line`, and their uses.
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        cell: u32,
        base_line: u32,
        bundle: &Bundle,
        distinct: &mut Vec<u32>,
        uses: &mut Vec<Use>,
    ) {
        if bundle.count == 0 {
            return;
        }
        if self.footprints + u32::from(bundle.count) > FOOTPRINTS {
            self.end(distinct, uses);
            self.begin_segment(distinct.len());
        }
        let own = bundle.distinct();
        let [first, last] = own.span().map(|line| base_line + line);
        let start = distinct.len();
        let span = Span { start, first, last };
        if self.hull.meets(&span) {
            self.meet(&span);
        }
        self.hull.first = self.hull.first.min(first);
        self.hull.last = self.hull.last.max(last);
        self.spans[self.bundles as usize % FOOTPRINTS as usize] = span;
        for (lines, count) in own.chunks() {
            // Copies all four, because the number in use is unpredictable.
            let end = distinct.len() + count;
            distinct.extend_from_slice(&lines.map(|of| base_line.wrapping_add(of.line())));
            distinct.truncate(end);
            uses.extend_from_slice(&lines.map(|of| {
                let footprints = of.users() << self.footprints;
                let first_line = self.lines + of.first();
                Use::new(footprints, first_line, cell | self.listed)
            }));
            uses.truncate(end);
        }
        self.bundles += 1;
        self.footprints += u32::from(bundle.count);
        self.lines += own.listed();
    }

    /// Records which bundle this range overlaps.
    #[inline(never)]
    fn meet(&mut self, span: &Span) {
        let before = &self.spans[..self.bundles as usize % FOOTPRINTS as usize];
        if let Some(other) = before.iter().find(|other| other.meets(span)) {
            self.met = self.met.min(other.start);
        }
    }

    /// Ends the quad or its segment.
    #[inline(always)]
    pub(super) fn end(&mut self, distinct: &mut Vec<u32>, uses: &mut Vec<Use>) {
        if self.met < distinct.len() {
            self.merge.again(self.met, distinct, uses);
        }
        if let Some(last) = uses[self.start..].last_mut() {
            last.bits |= Use::LAST;
        }
    }
}

impl Span {
    #[inline(always)]
    fn meets(&self, other: &Self) -> bool {
        (self.first <= other.last) & (other.first <= self.last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::lines::{QuadEnd, TileLines};
    use crate::stream::tag::Tag;
    use proptest::prelude::*;
    use std::collections::HashMap;

    /// Bundles of up to four footprints: cell, base line, and lines.
    fn bundles() -> impl Strategy<Value = Vec<(u32, u32, Vec<[u32; 4]>)>> {
        let line = || prop_oneof![0_u32..3, 0_u32..30];
        let footprints = prop::collection::vec([line(), line(), line(), line()], 0..5);
        prop::collection::vec((0_u32..3, 0_u32..40, footprints), 0..14)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(512))]

        /// Lines are shared within bundles and between bundles of equal and different cells.
        #[test]
        fn segments_list_the_users_of_each_line_in_order(
            quads in prop::collection::vec(bundles(), 1..4),
        ) {
            // Starts near the largest merge number, so that numbers wrap around.
            let mut distinct = Distinct::default();
            distinct.merge.number = u32::MAX - 1;
            let mut tile = TileLines::default();
            for bundles in &quads {
                distinct.begin(tile.distinct.len());
                let mut footprints = 0;
                for (cell, base, texels) in bundles {
                    let bundle = Bundle::of(texels);
                    footprints += u32::from(bundle.count);
                    let mut lookups = 0;
                    for (index, times) in bundle.runs() {
                        let [first, other] = Tag::of_footprint(*cell, times - 1);
                        for (number, line) in bundle.lines_of(index).iter().enumerate() {
                            tile.lines.push(base + line);
                            tile.tags.push(if number == 0 { first } else { other });
                            lookups += times;
                        }
                    }
                    prop_assert!(bundle.count == 0 || bundle.distinct().lookups() == lookups);
                    distinct.add(*cell, *base, &bundle, &mut tile.distinct, &mut tile.uses);
                }
                distinct.end(&mut tile.distinct, &mut tile.uses);
                tile.quads.push(QuadEnd {
                    end: tile.lines.len() as u32,
                    distinct_end: tile.distinct.len() as u32,
                    footprints,
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
