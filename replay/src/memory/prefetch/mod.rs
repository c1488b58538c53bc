//! Prefetchers of the L2, one a file. A new one is a file with a `Prefetcher` (its `mod` line below) and a row of the table.

mod aligned_block;
mod next_line;
mod next_mip;
mod tile_ahead;

use crate::config::PrefetchConfig;
use crate::registry::{Named, registry};
use aligned_block::AlignedBlock;
use formats::layout::Layout;
use next_line::NextLine;
use next_mip::NextMip;
use std::sync::Arc;
use tile_ahead::TileAhead;

registry! { PrefetchRow:
    // constant        name             help                                                                               lines; usual lines     built from [`Parts`]
    NEXT_LINE =     row("next-line",     "The next lines after each miss and each first use of a prefetched line",         ANY_LINES, 4,          |of| Box::new(NextLine { lines: of.lines }));
    ALIGNED_BLOCK = row("aligned-block", "The other lines of the aligned block of each line that misses",                  POWERS_OF_TWO, 4,      |of| Box::new(AlignedBlock { lines: of.lines }));
    NEXT_MIP =      row("next-mip",      "The same place of the coarser mip levels of each line that misses; textures only",    ANY_LINES, 1,          |of| Box::new(NextMip { levels: of.lines, layout: of.layout, line_bytes: of.line_bytes }));
    TILE_AHEAD =    row("tile-ahead",    "The lines of the next work item when an item starts; not in functional mode",       MANY_LINES, 4096,      |of| Box::new(TileAhead { lines: of.lines }));
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
    build: fn(Parts) -> Box<dyn Prefetcher>,
}

/// What a prefetcher is built from.
pub struct Parts {
    /// The key `lines`.
    lines: u32,
    /// Line size of the L2.
    line_bytes: u64,
    /// Where textures lie; none where lines are no textures.
    layout: Option<Arc<Layout>>,
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
    build: fn(Parts) -> Box<dyn Prefetcher>,
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

    /// True if it must know where textures lie.
    fn needs_layout(&self) -> bool {
        false
    }

    /// Lines of the next work item that are fetched when an item starts, at most.
    fn lines_of_next_item(&self) -> usize {
        0
    }
}

impl PrefetchConfig {
    /// The prefetcher.
    pub(crate) fn build(
        &self,
        line_bytes: u32,
        layout: Option<Arc<Layout>>,
    ) -> Box<dyn Prefetcher> {
        (self.prefetcher.row().build)(Parts {
            lines: self.lines(),
            line_bytes: line_bytes.into(),
            layout,
        })
    }
}
