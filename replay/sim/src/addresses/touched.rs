//! The set of accessed lines, whose size equals the misses of an infinite cache.

/// Lines per page, one bit each.
const PAGE_LINES: usize = 1 << 15;

/// A set of lines, stored in pages of 4 KiB for 32,768 neighbouring lines.
#[derive(Default)]
pub(super) struct Touched {
    pages: Vec<Option<Box<[u64; PAGE_LINES / 64]>>>,
    count: u64,
}

impl Touched {
    /// Adds lines.
    pub(super) fn insert_all(&mut self, lines: &[u32]) {
        for &line in lines {
            let (page, within) = (line as usize / PAGE_LINES, line as usize % PAGE_LINES);
            if page >= self.pages.len() {
                self.pages.resize_with(page + 1, || None);
            }
            let words = self.pages[page].get_or_insert_with(|| Box::new([0; PAGE_LINES / 64]));
            let (word, bit) = (&mut words[within / 64], 1 << (within % 64));
            self.count += u64::from(*word & bit == 0);
            *word |= bit;
        }
    }

    /// Number of lines.
    pub fn count(&self) -> u64 {
        self.count
    }
}
