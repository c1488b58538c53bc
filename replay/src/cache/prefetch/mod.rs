//! Prefetchers of the L2, one a file. A new one is a file with a `Prefetcher` (its `mod` line below) and a row of the table.

mod aligned_block;
mod next_line;

use crate::config::PrefetchConfig;
use crate::registry::{Named, registry};
use aligned_block::AlignedBlock;
use next_line::NextLine;

registry! { PrefetchRow:
    // constant        name             help                                                                               lines          built from `lines`
    NEXT_LINE =     row("next-line",     "The next lines after each miss and each first use of a prefetched line",         ANY_LINES,     |lines| Box::new(NextLine { lines }));
    ALIGNED_BLOCK = row("aligned-block", "The other lines of the aligned block of each line that misses",                  POWERS_OF_TWO, |lines| Box::new(AlignedBlock { lines }));
}

/// A prefetcher by name.
pub type Prefetching = Named<PrefetchRow>;

/// A row of the table of prefetchers.
#[derive(Debug)]
pub struct PrefetchRow {
    name: &'static str,
    help: &'static str,
    lines: LinesRule,
    build: fn(u32) -> Box<dyn Prefetcher>,
}

/// Which values of `lines` a prefetcher can have: in words, and as a test.
type LinesRule = (&'static str, fn(u32) -> bool);

const ANY_LINES: LinesRule = ("1 to 64", |lines| matches!(lines, 1..=64));
const POWERS_OF_TWO: LinesRule = ("a power of two from 1 to 64", |lines| {
    lines.is_power_of_two() && lines <= 64
});

const fn row(
    name: &'static str,
    help: &'static str,
    lines: LinesRule,
    build: fn(u32) -> Box<dyn Prefetcher>,
) -> PrefetchRow {
    PrefetchRow {
        name,
        help,
        lines,
        build,
    }
}

impl Prefetching {
    /// The values of `lines` that the prefetcher can have.
    pub(crate) fn lines_rule(self) -> LinesRule {
        self.row().lines
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
}

impl PrefetchConfig {
    /// The prefetcher.
    pub(super) fn build(&self) -> Box<dyn Prefetcher> {
        (self.prefetcher.row().build)(self.lines)
    }
}
