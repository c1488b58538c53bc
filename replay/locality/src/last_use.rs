//! Time and place of the last use of each used line.

use crate::knees::NO_ROW;
use crate::place::TileOfEye;

/// No time.
pub(crate) const NEVER: u32 = u32::MAX;

/// The last use of a line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LastUse {
    /// Time on the axis of the stream; [`NEVER`] for an unused line.
    pub(crate) time: u32,
    /// Tile and eye.
    pub(crate) place: TileOfEye,
    /// Row of tiles, or [`NO_ROW`].
    pub(crate) row: u32,
    /// Work item of the last use by any eye, by the left and by the right; zero for never.
    pub(crate) span: Span,
    pub(crate) span_of_eye: [Span; 2],
}

/// A work item on the clock of tiles: its first tile, counted from 1, and its number of tiles. Zero stands
/// for none. Later items compare as larger.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Span(u32);

impl Span {
    /// Maximum number of tiles of a stream.
    pub(crate) const MOST_TILES: u32 = (1 << 31) - 2;

    /// `tiles` is 1 or 2.
    pub(crate) fn new(first: u32, tiles: u32) -> Self {
        Self(first << 1 | u32::from(tiles > 1))
    }

    pub(crate) fn is_none(self) -> bool {
        self.0 == 0
    }

    pub(crate) fn first(self) -> u32 {
        self.0 >> 1
    }

    /// Number of tiles after the first.
    pub(crate) fn beyond(self) -> u32 {
        self.0 & 1
    }
}

impl LastUse {
    const NONE: Self = Self {
        time: NEVER,
        place: TileOfEye::NONE,
        row: NO_ROW,
        span: Span(0),
        span_of_eye: [Span(0); 2],
    };
}

/// Lines per page.
const PAGE: usize = 64;

/// Last uses by line. Pages without a used line take no memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct LastUses {
    /// Page number, counted from 1; zero for no page.
    directory: Vec<u32>,
    pages: Vec<[LastUse; PAGE]>,
}

impl LastUses {
    #[inline(always)]
    pub(crate) fn of(&mut self, line: u32) -> &mut LastUse {
        let (page, slot) = (line as usize / PAGE, line as usize % PAGE);
        let number = match self.directory.get(page) {
            Some(&number) if number != 0 => number,
            _ => self.add_page(page),
        };
        &mut self.pages[number as usize - 1][slot]
    }

    #[cold]
    fn add_page(&mut self, page: usize) -> u32 {
        if self.directory.len() <= page {
            self.directory.resize(page + 1, 0);
        }
        self.pages.push([LastUse::NONE; PAGE]);
        // Lines are below 2^32, so pages are below 2^26.
        self.directory[page] = self.pages.len() as u32;
        self.directory[page]
    }

    /// The lines used so far.
    pub(crate) fn used(&mut self) -> impl Iterator<Item = &mut LastUse> {
        let lines = self.pages.iter_mut().flatten();
        lines.filter(|line| line.time != NEVER)
    }
}
