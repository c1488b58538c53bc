//! Prefetchers of the L2, one a file. A new one is a file with a `Prefetcher` (its `mod` line below) and a row of the table.

mod aligned_block;
mod next_line;
mod tile_ahead;

use crate::config::PrefetchConfig;
use crate::registry::{Named, registry};
use aligned_block::AlignedBlock;
use next_line::NextLine;
use tile_ahead::TileAhead;

registry! { PrefetchRow:
    // constant        name             help                                                                               lines; usual lines     built from `lines`
    NEXT_LINE =     row("next-line",     "The next lines after each miss and each first use of a prefetched line",         ANY_LINES, 4,          |lines| Box::new(NextLine { lines }));
    ALIGNED_BLOCK = row("aligned-block", "The other lines of the aligned block of each line that misses",                  POWERS_OF_TWO, 4,      |lines| Box::new(AlignedBlock { lines }));
    TILE_AHEAD =    row("tile-ahead",    "The lines of the next work item when an item starts; not in functional mode",       MANY_LINES, 4096,      |lines| Box::new(TileAhead { lines }));
}

/// A prefetcher by name.
pub type Prefetching = Named<PrefetchRow>;

/// A row of the table of prefetchers.
#[derive(Debug)]
pub struct PrefetchRow {
    name: &'static str,
    help: &'static str,
    lines: LinesRule,
    usual_lines: u32,
    build: fn(u32) -> Box<dyn Prefetcher>,
}

/// Which values of `lines` a prefetcher can have: in words, and as a test.
type LinesRule = (&'static str, fn(u32) -> bool);

const ANY_LINES: LinesRule = ("1 to 64", |lines| matches!(lines, 1..=64));
const POWERS_OF_TWO: LinesRule = ("a power of two from 1 to 64", |lines| {
    lines.is_power_of_two() && lines <= 64
});

const MANY_LINES: LinesRule = ("1 to 65536", |lines| matches!(lines, 1..=65_536));

const fn row(
    name: &'static str,
    help: &'static str,
    lines: LinesRule,
    usual_lines: u32,
    build: fn(u32) -> Box<dyn Prefetcher>,
) -> PrefetchRow {
    PrefetchRow {
        name,
        help,
        lines,
        usual_lines,
        build,
    }
}

impl Prefetching {
    /// The values of `lines` that the prefetcher can have.
    pub(crate) fn lines_rule(self) -> LinesRule {
        self.row().lines
    }

    /// The number of lines where a configuration gives none.
    pub(crate) fn usual_lines(self) -> u32 {
        self.row().usual_lines
    }
}

/// How a demand request was answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Demand {
    /// The line was neither there nor in flight.
    Miss,
    /// The line was there or in flight because it had been prefetched, and was not requested since.
    FirstUse,
    /// Any other hit, or a request merged with another's fetch.
    Hit,
}

/// Decides what is prefetched.
pub trait Prefetcher: Send {
    /// Sees a demand request of the L2, and appends the lines to fetch, the first one first. Lines that are there or in
    /// flight are skipped afterwards.
    fn observe(&mut self, line: u32, demand: Demand, lines: &mut Vec<u32>);

    /// Lines of the next work item that are fetched when an item starts, at most.
    fn lines_of_next_item(&self) -> usize {
        0
    }
}

impl PrefetchConfig {
    /// The prefetcher.
    pub(crate) fn build(&self) -> Box<dyn Prefetcher> {
        (self.prefetcher.row().build)(self.lines())
    }
}
