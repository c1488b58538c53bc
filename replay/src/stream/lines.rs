//! The quads of a tile as lines, which every order, cache and clock reads instead of the trace.

use super::counts::Place;
use super::distinct::Use;
use crate::order::Interleave;

/// The owner of a line: its footprint's cell within the view and, on a footprint's first line, the number
/// of repeats that follow. It fits one word, so that lines and tags are two plain lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tag(u32);

impl Tag {
    /// Number of cells per view that a tag can address.
    pub const CELLS: usize = 1 << 29;
    const FIRST: u32 = 1 << 31;
    const REPEATS_SHIFT: u32 = 29;

    /// Tags of a footprint's first line and of its other lines.
    #[inline(always)]
    pub(super) fn of_footprint(cell: u32, repeats: u32) -> [Self; 2] {
        let other = cell & (Self::CELLS as u32 - 1);
        [
            Self(other | repeats << Self::REPEATS_SHIFT | Self::FIRST),
            Self(other),
        ]
    }

    /// The tag of a footprint of one line.
    #[must_use]
    pub fn of_line(cell: u32) -> Self {
        let [first, _] = Self::of_footprint(cell, 0);
        first
    }

    /// True for a footprint's first line.
    #[inline(always)]
    #[must_use]
    pub fn is_first(self) -> bool {
        self.0 & Self::FIRST != 0
    }

    /// On a footprint's first line: how often the same lines are looked up again (0 to 3).
    #[inline(always)]
    #[must_use]
    pub fn repeats(self) -> u32 {
        (self.0 & !Self::FIRST) >> Self::REPEATS_SHIFT
    }

    /// Cell within the view.
    #[inline(always)]
    #[must_use]
    pub fn cell(self) -> u32 {
        self.0 & (Self::CELLS as u32 - 1)
    }
}

/// A primitive's quads in a tile: from the end of the previous primitive to `end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct QuadRun {
    pub(super) primitive: u32,
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
    pub(super) place: Place,
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
    pub(super) fn begin(&mut self, place: Place) {
        self.place = place;
        self.runs.clear();
        self.quads.clear();
        self.lines.clear();
        self.tags.clear();
        self.distinct.clear();
        self.uses.clear();
    }

    /// Size of the lists in bytes.
    #[must_use]
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

    /// Number of quads.
    #[must_use]
    pub fn quad_count(&self) -> usize {
        self.quads.len()
    }

    /// The quads of a run.
    pub(super) fn run(&self, run: usize) -> std::ops::Range<usize> {
        let end = |run: &QuadRun| run.end as usize;
        let before = run.checked_sub(1).and_then(|before| self.runs.get(before));
        before.map_or(0, end)..self.runs.get(run).map_or(0, end)
    }

    /// A quad.
    #[inline(always)]
    #[must_use]
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

/// The combined rendering order of the primitives of two tiles, as tile and run. The lists hold the
/// primitives of the runs.
pub fn interleaved(
    interleave: Interleave,
    lists: [&mut dyn Iterator<Item = u32>; 2],
    out: &mut Vec<(u8, u32)>,
) {
    out.clear();
    match interleave {
        Interleave::Alternate => {
            let [left, right] = lists;
            for run in 0.. {
                let (l, r) = (left.next(), right.next());
                out.extend(l.map(|_| (0, run)));
                out.extend(r.map(|_| (1, run)));
                if l.or(r).is_none() {
                    break;
                }
            }
        }
        Interleave::Merge => {
            let mut primitives: Vec<(u32, u8, u32)> = Vec::new();
            for (tile, list) in (0..).zip(lists) {
                primitives.extend(
                    (0..)
                        .zip(list)
                        .map(|(run, primitive)| (primitive, tile, run)),
                );
            }
            // A primitive's left run comes before its right one.
            primitives.sort_unstable();
            out.extend(primitives.iter().map(|&(_, tile, run)| (tile, run)));
        }
    }
}

/// A quad's lines.
#[derive(Clone, Copy, Debug)]
pub struct QuadLines<'a> {
    pub(super) place: Place,
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
    #[must_use]
    pub fn of_lines(lines: &'a [u32], tags: &'a [Tag]) -> Self {
        Self {
            place: Place::default(),
            footprints: lines.len() as u32,
            lines,
            tags,
            distinct: &[],
            uses: &[],
        }
    }

    /// Number of its tile (see [`super::Bins`]).
    #[inline(always)]
    #[must_use]
    pub fn tile(&self) -> usize {
        self.place.tile as usize
    }

    /// The cell of the footprint that contains line `index` (see [`super::Bins`]).
    #[inline(always)]
    #[must_use]
    pub fn cell(&self, index: usize) -> usize {
        self.place.first_cell as usize + self.tags[index].cell() as usize
    }

    /// The cell of the footprints that use a distinct line.
    #[inline(always)]
    #[must_use]
    pub fn cell_of(&self, of: Use) -> usize {
        self.place.first_cell as usize + of.cell() as usize
    }

    /// End of the footprint that contains line `index`.
    #[inline(always)]
    #[must_use]
    pub fn end_of_footprint(&self, index: usize) -> usize {
        let mut end = index + 1;
        while end < self.tags.len() && !self.tags[end].is_first() {
            end += 1;
        }
        end
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
