//! The owners of lines: of each line of a footprint, and of each distinct line of a quad.

use crate::tmu::Pending;

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
    pub fn of_line(cell: u32) -> Self {
        let [first, _] = Self::of_footprint(cell, 0);
        first
    }

    /// True for a footprint's first line.
    #[inline(always)]
    pub fn is_first(self) -> bool {
        self.0 & Self::FIRST != 0
    }

    /// On a footprint's first line: how often the same lines are looked up again (0 to 3).
    #[inline(always)]
    pub fn repeats(self) -> u32 {
        (self.0 & !Self::FIRST) >> Self::REPEATS_SHIFT
    }

    /// Cell within the view.
    #[inline(always)]
    pub fn cell(self) -> u32 {
        self.0 & (Self::CELLS as u32 - 1)
    }
}

/// Maximum footprints per segment, repeats included: four lanes of three trilinear textures.
pub(super) const FOOTPRINTS: u32 = Pending::SEGMENT;

/// The users of a distinct line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Use {
    pub(super) bits: u32,
    /// Cell within the view, and a flag.
    pub(super) cell: u32,
}

impl Use {
    pub(super) const LAST: u32 = 1 << 31;

    /// Upper limit of first-line indices.
    pub const FIRST_LINES: usize = 1 << (31 - FOOTPRINTS);

    /// Flag in `cell`, outside the bits of a cell.
    pub(super) const LISTED: u32 = Tag::CELLS as u32;

    pub(super) fn new(footprints: u32, first_line: u32, cell: u32) -> Self {
        Self {
            bits: footprints | first_line << FOOTPRINTS,
            cell,
        }
    }

    /// Cell within the view.
    #[inline(always)]
    pub(super) fn cell(self) -> u32 {
        self.cell & (Self::LISTED - 1)
    }

    /// True if the quad may already have listed the line, for another cell or in another segment.
    #[inline(always)]
    pub fn may_be_listed(self) -> bool {
        self.cell & Self::LISTED != 0
    }

    /// One bit per footprint of the segment, repeats included.
    #[inline(always)]
    pub fn footprints(self) -> u32 {
        self.bits & ((1 << FOOTPRINTS) - 1)
    }

    /// Index of its first occurrence among the segment's lines.
    #[inline(always)]
    pub fn first_line(self) -> usize {
        ((self.bits & !Self::LAST) >> FOOTPRINTS) as usize
    }

    /// True for the last distinct line of a segment.
    #[inline(always)]
    pub(super) fn ends_segment(self) -> bool {
        self.bits & Self::LAST != 0
    }
}
