//! Prefetchers of the L2, one per file. A new prefetcher is a file with a `Prefetcher` (its `mod`
//! line below) and a row of the table.

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
    // constant        name             help
    // lines; default lines   built from [`PrefetchParameters`]
    NEXT_LINE =     row("next-line",     "The next lines after each miss and each first use of a prefetched line",         ANY_LINES, 4,          |of| Box::new(NextLine { lines: of.lines }));
    ALIGNED_BLOCK = row("aligned-block", "The other lines of the aligned block of each line that misses",                  POWERS_OF_TWO, 4,      |of| Box::new(AlignedBlock { lines: of.lines }));
    NEXT_MIP =      row("next-mip",      "The same place of the coarser mip levels of each line that misses; textures only",    ANY_LINES, 1,          |of| Box::new(NextMip { levels: of.lines, layout: of.layout, line_bytes: of.line_bytes }));
    TILE_AHEAD =    row("tile-ahead",    "The lines of the next work item when an item starts; not in functional mode",       MANY_LINES, 4096,      |of| Box::new(TileAhead { lines: of.lines }));
}

/// A named prefetcher.
pub type Prefetching = Named<PrefetchRow>;

/// A row of the table of prefetchers.
#[derive(Debug)]
pub struct PrefetchRow {
    name: &'static str,
    help: &'static str,
    lines: LinesRule,
    usual_lines: u32,
    build: fn(PrefetchParameters) -> Box<dyn Prefetcher>,
}

/// Parameters of a prefetcher.
pub struct PrefetchParameters {
    /// The key `lines`.
    lines: u32,
    /// Line size of the L2 in bytes.
    line_bytes: u64,
    /// Location of textures, if lines belong to textures.
    layout: Option<Arc<Layout>>,
}

/// The values of `lines` that a prefetcher supports, as text and as a test.
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
    build: fn(PrefetchParameters) -> Box<dyn Prefetcher>,
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
    /// The values of `lines` that the prefetcher supports.
    pub(crate) fn lines_rule(self) -> LinesRule {
        self.row().lines
    }

    /// The default number of lines.
    pub(crate) fn usual_lines(self) -> u32 {
        self.row().usual_lines
    }
}

/// The outcome of a demand request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Demand {
    /// The line was neither resident nor in flight.
    Miss,
    /// First request of a prefetched line that is resident or in flight.
    FirstUse,
    /// Any other hit, or a request merged with a fetch in flight.
    Hit,
}

/// A prefetching algorithm.
pub trait Prefetcher: Send {
    /// Observes a demand request of the L2 and appends the lines to prefetch, first one first. The
    /// caller skips lines that are resident or in flight.
    fn observe(&mut self, line: u32, demand: Demand, lines: &mut Vec<u32>);

    /// True if it needs the location of textures.
    fn needs_layout(&self) -> bool {
        false
    }

    /// Maximum number of lines of the next work item to prefetch when an item starts.
    fn lines_of_next_item(&self) -> usize {
        0
    }
}

impl PrefetchConfig {
    /// Builds the prefetcher.
    pub(crate) fn build(
        &self,
        line_bytes: u32,
        layout: Option<Arc<Layout>>,
    ) -> Box<dyn Prefetcher> {
        (self.prefetcher.row().build)(PrefetchParameters {
            lines: self.lines(),
            line_bytes: line_bytes.into(),
            layout,
        })
    }
}
