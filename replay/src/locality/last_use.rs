//! When and where each line was used last, for the lines that were used at all.

use super::place::TileOfEye;

/// No time.
pub(super) const NEVER: u32 = u32::MAX;

/// The last use of a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct LastUse {
    /// On the axis of the stream; [`NEVER`] for a line that was not used yet.
    pub(super) time: u32,
    /// Where.
    pub(super) place: TileOfEye,
    /// When on the tiles' clock, by any eye, the left and the right; zero for never.
    pub(super) span: Span,
    pub(super) span_of_eye: [Span; 2],
}

/// A work item on the clock of tiles: its first tile, counted from 1, and how many it has. Zero
/// stands for none. Later items are larger.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Span(u32);

impl Span {
    /// Tiles that a stream may have.
    pub(super) const MOST_TILES: u32 = (1 << 31) - 2;

    /// `tiles` is 1 or 2.
    pub(super) fn new(first: u32, tiles: u32) -> Self {
        Self(first << 1 | u32::from(tiles > 1))
    }

    pub(super) fn is_none(self) -> bool {
        self.0 == 0
    }

    pub(super) fn first(self) -> u32 {
        self.0 >> 1
    }

    /// Tiles beyond the first.
    pub(super) fn beyond(self) -> u32 {
        self.0 & 1
    }
}

impl LastUse {
    const NONE: Self = Self {
        time: NEVER,
        place: TileOfEye::NONE,
        span: Span(0),
        span_of_eye: [Span(0); 2],
    };
}

/// Lines of a page.
const PAGE: usize = 64;

/// Last uses by line; pages without a used line take no memory.
#[derive(Clone, Debug, Default)]
pub(super) struct LastUses {
    /// Number of the page, counted from 1; zero where there is none.
    directory: Vec<u32>,
    pages: Vec<[LastUse; PAGE]>,
}

impl LastUses {
    #[inline(always)]
    pub(super) fn of(&mut self, line: u32) -> &mut LastUse {
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

    /// Lines that were used.
    pub(super) fn used(&mut self) -> impl Iterator<Item = &mut LastUse> {
        let lines = self.pages.iter_mut().flatten();
        lines.filter(|line| line.time != NEVER)
    }
}
