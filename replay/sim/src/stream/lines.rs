//! The quads of a tile as lines, which every order, cache and clock reads instead of the trace.

use super::counts::TileBins;
use super::tag::{FOOTPRINTS, Tag, Use};
use crate::order::Interleave;

/// A primitive's quads in a tile: from the end of the previous primitive to `end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct QuadRun {
    pub(super) primitive: u32,
    /// The first quad of the tile's lower half.
    pub(super) middle: u32,
    pub(super) end: u32,
}

/// A quad: its lines range from the end of the previous quad to `end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct QuadEnd {
    pub(super) end: u32,
    /// End of its distinct lines.
    pub(super) distinct_end: u32,
    /// Number of footprints, repeats included.
    pub(super) footprints: u32,
}

/// A tile's quads in submission order, as the lines of their footprints. Footprints that repeat the one
/// before (another lane, same level of the same texture) are counted, not listed.
#[derive(Clone, Debug, Default)]
pub struct TileLines {
    pub(super) place: TileBins,
    pub(super) runs: Vec<QuadRun>,
    pub(super) quads: Vec<QuadEnd>,
    /// Empty if only distinct lines are requested; the tags likewise.
    pub(super) lines: Vec<u32>,
    pub(super) tags: Vec<Tag>,
    /// Empty unless requested; the uses likewise.
    pub(super) distinct: Vec<u32>,
    pub(super) uses: Vec<Use>,
}

impl TileLines {
    /// Empties the lists but keeps their allocations.
    pub(super) fn begin(&mut self, place: TileBins) {
        self.place = place;
        self.runs.clear();
        self.quads.clear();
        self.lines.clear();
        self.tags.clear();
        self.distinct.clear();
        self.uses.clear();
    }

    /// Size of the lists in bytes.
    pub fn bytes(&self) -> u64 {
        let quads = size_of_val(&*self.runs) + size_of_val(&*self.quads);
        let lines = size_of_val(&*self.lines) + size_of_val(&*self.tags);
        let distinct = size_of_val(&*self.distinct) + size_of_val(&*self.uses);
        (quads + lines + distinct + size_of::<Self>()) as u64
    }

    /// Prefetches the data of the timed machine into the processor's caches, many cache lines at a time
    /// instead of one by one.
    pub(super) fn touch(&self) {
        /// Words per cache line.
        const STEP: usize = 16;
        let distinct = self.distinct.iter().step_by(STEP);
        let uses = self.uses.iter().step_by(STEP / 2);
        let quads = self.quads.iter().step_by(STEP / 3);
        std::hint::black_box((
            distinct.fold(0, |sum, line| sum ^ line),
            uses.fold(0, |sum, of| sum ^ of.footprints()),
            quads.fold(0, |sum, quad| sum ^ quad.end),
        ));
    }

    /// Its primitive list.
    pub(super) fn list(&self) -> impl Iterator<Item = ListEntry> {
        let mut first = 0;
        self.runs.iter().map(move |run| {
            let in_half = [first < run.middle, run.middle < run.end];
            first = run.end;
            ListEntry {
                primitive: run.primitive,
                in_half,
            }
        })
    }

    /// Number of quads.
    pub(super) fn quad_count(&self) -> usize {
        self.quads.len()
    }

    /// The quads of a run, or those in the tile's upper or lower half.
    pub(super) fn run(&self, run: usize, part: TilePart) -> std::ops::Range<usize> {
        let before = run.checked_sub(1).and_then(|before| self.runs.get(before));
        let first = before.map_or(0, |run| run.end as usize);
        let Some(&QuadRun { middle, end, .. }) = self.runs.get(run) else {
            return first..first;
        };
        match part {
            TilePart::Whole => first..end as usize,
            TilePart::Upper => first..middle as usize,
            TilePart::Lower => middle as usize..end as usize,
        }
    }

    /// A quad.
    #[inline(always)]
    pub fn quad(&self, index: usize) -> QuadLines<'_> {
        let (start, distinct_start) = match index.checked_sub(1) {
            None => (0, 0),
            Some(before) => {
                let before = self.quads[before];
                (before.end as usize, before.distinct_end as usize)
            }
        };
        let quad = self.quads[index];
        let distinct = distinct_start..quad.distinct_end as usize;
        QuadLines {
            place: self.place,
            footprints: quad.footprints,
            lines: &self.lines[start..quad.end as usize],
            tags: &self.tags[start..quad.end as usize],
            distinct: &self.distinct[distinct.clone()],
            uses: &self.uses[distinct],
        }
    }
}

/// The part of a run that is rendered: all quads, or those in a half of the tile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TilePart {
    /// All quads.
    #[default]
    Whole,
    /// Quads in the upper half.
    Upper,
    /// Quads in the lower half.
    Lower,
}

/// Quads of one primitive in one of two tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ListedRun {
    /// 0 or 1.
    pub tile: u8,
    /// Number of the run in its tile.
    pub run: u32,
    /// Which of its quads.
    pub part: TilePart,
}

/// A run of a tile's primitive list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ListEntry {
    /// The primitive.
    pub primitive: u32,
    /// True if it has quads in the upper half, and in the lower half.
    pub in_half: [bool; 2],
}

/// The combined rendering order of the primitives of two tiles.
pub fn interleaved(
    interleave: Interleave,
    lists: [&mut dyn Iterator<Item = ListEntry>; 2],
    out: &mut Vec<ListedRun>,
) {
    out.clear();
    let part = TilePart::Whole;
    match interleave {
        Interleave::Alternate => {
            let [left, right] = lists.map(|list| (0..).zip(list));
            alternate(
                left.map(|(run, _)| run),
                right.map(|(run, _)| run),
                part,
                out,
            );
        }
        Interleave::Merge => {
            let mut primitives: Vec<(u32, u8, u32)> = Vec::new();
            for (tile, list) in (0..).zip(lists) {
                primitives.extend((0..).zip(list).map(|(run, of)| (of.primitive, tile, run)));
            }
            // A primitive's left run comes before its right one.
            primitives.sort_unstable();
            out.extend(
                primitives
                    .iter()
                    .map(|&(_, tile, run)| ListedRun { tile, run, part }),
            );
        }
        Interleave::Halves => {
            let lists = lists.map(|list| -> Vec<(u32, ListEntry)> { (0..).zip(list).collect() });
            for (half, part) in [TilePart::Upper, TilePart::Lower].into_iter().enumerate() {
                let [left, right] = lists.each_ref().map(|list| {
                    let inside = list.iter().filter(move |(_, of)| of.in_half[half]);
                    inside.map(|(run, _)| *run)
                });
                alternate(left, right, part, out);
            }
        }
    }
}

/// One of the left, one of the right, in turn; then the rest of the longer list.
fn alternate(
    mut left: impl Iterator<Item = u32>,
    mut right: impl Iterator<Item = u32>,
    part: TilePart,
    out: &mut Vec<ListedRun>,
) {
    loop {
        let (l, r) = (left.next(), right.next());
        out.extend(l.map(|run| ListedRun { tile: 0, run, part }));
        out.extend(r.map(|run| ListedRun { tile: 1, run, part }));
        if l.or(r).is_none() {
            break;
        }
    }
}

/// A quad's lines.
#[derive(Clone, Copy, Debug)]
pub struct QuadLines<'a> {
    pub(super) place: TileBins,
    /// Number of footprints, repeats included.
    pub footprints: u32,
    /// Distinct lines of each footprint, as addresses over the line size.
    pub lines: &'a [u32],
    /// One tag per line.
    pub tags: &'a [Tag],
    /// By segment, each line once, in order of last use. Empty unless requested.
    pub distinct: &'a [u32],
    /// The users of each distinct line.
    pub uses: &'a [Use],
}

impl<'a> QuadLines<'a> {
    /// Lines without a tile, each with its tag.
    pub fn of_lines(lines: &'a [u32], tags: &'a [Tag]) -> Self {
        Self {
            place: TileBins::default(),
            footprints: lines.len() as u32,
            lines,
            tags,
            distinct: &[],
            uses: &[],
        }
    }

    /// Number of its tile (see [`super::Bins`]).
    #[inline(always)]
    pub fn tile(&self) -> usize {
        self.place.tile as usize
    }

    /// The cell of the footprint that contains line `index` (see [`super::Bins`]).
    #[inline(always)]
    pub fn cell(&self, index: usize) -> usize {
        self.place.first_cell as usize + self.tags[index].cell() as usize
    }

    /// The cell of the footprints that use a distinct line.
    #[inline(always)]
    pub fn cell_of(&self, of: Use) -> usize {
        self.place.first_cell as usize + of.cell() as usize
    }

    /// End of the footprint that contains line `index`.
    #[inline(always)]
    pub fn end_of_footprint(&self, index: usize) -> usize {
        let mut end = index + 1;
        while end < self.tags.len() && !self.tags[end].is_first() {
            end += 1;
        }
        end
    }

    /// True if all footprints fit into one segment.
    #[inline(always)]
    pub fn is_one_segment(&self) -> bool {
        self.footprints <= FOOTPRINTS
    }

    /// End of each segment's distinct lines.
    #[inline(always)]
    pub fn segments(self) -> impl Iterator<Item = usize> + use<'a> {
        let mut start = 0;
        std::iter::from_fn(move || {
            let uses = &self.uses[start..];
            start += if self.is_one_segment() && !uses.is_empty() {
                // All footprints fit into one segment.
                uses.len()
            } else {
                1 + uses.iter().position(|of| of.ends_segment())?
            };
            Some(start)
        })
    }

    /// The listed footprints, in order.
    pub fn footprints(self) -> impl Iterator<Item = Footprint<'a>> {
        let mut start = 0;
        std::iter::from_fn(move || {
            let repeats = self.tags.get(start)?.repeats();
            let end = self.end_of_footprint(start);
            let footprint = Footprint {
                cell: self.cell(start),
                lines: &self.lines[start..end],
                repeats,
            };
            start = end;
            Some(footprint)
        })
    }
}

/// A bilinear fetch of one lane at one mip level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Footprint<'a> {
    /// Its cell (see [`super::Bins`]).
    pub cell: usize,
    /// Its one to four distinct lines, in texel order.
    pub lines: &'a [u32],
    /// Number of repeats of the same footprint for further lanes.
    pub repeats: u32,
}
