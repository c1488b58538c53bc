//! What is accessed: the quads of each core as the lines of their footprints, whatever takes them.
//!
//! An order gives work items, [`Feed`] turns an item into quads, [`Footprints`] a quad into lines,
//! and a [`Consumer`] takes those: caches in functional or timed mode, a set of the lines touched,
//! or whatever else wants them. A new consumer is one file with the trait's two functions. Who
//! decides which core runs next decides the interleaving: [`interleave`] by footprints alone, the
//! timed machine by its texture units' clocks.

mod counts;
mod error;
mod feed;
mod footprint;
mod interleave;
mod line_set;
mod source;
pub mod synthetic;
#[cfg(test)]
pub mod testing;

pub use counts::{Bins, Cell, CellAccesses, TraceCounts};
pub use error::StreamError;
pub use feed::{Feed, Quad};
pub use interleave::interleave;
pub use line_set::LineSet;
pub use source::{MemoryTrace, TileSource};

use crate::config::RunConfig;
use crate::order::WorkItem;
use footprint::{Bundle, Footprints, SampleRef, Scratch};

/// Takes the lines of a trace in the order in which the cores ask for them.
pub trait Consumer {
    /// A quad of tile `tile` begins on `core`; the footprints up to the next call are its.
    fn quad(&mut self, core: usize, tile: usize);

    /// A footprint asks for its lines; it counts in `cell` (see [`Bins`]).
    ///
    /// True promises that the same lines once more, right after, would find everything there and
    /// change nothing. Such repeats, which dominate texture traffic, are then counted but not sent.
    fn footprint(&mut self, cell: usize, lines: Lines<'_>) -> bool;
}

/// The one to four distinct lines of a footprint, in the order in which its texels ask for them.
#[derive(Clone, Copy, Debug)]
pub struct Lines<'a> {
    base: u32,
    relative: &'a [u32],
}

impl<'a> Lines<'a> {
    /// Lines that are `base` and `relative` summed.
    #[inline(always)]
    #[must_use]
    pub fn new(base: u32, relative: &'a [u32]) -> Self {
        Self { base, relative }
    }

    /// Their number.
    #[inline(always)]
    #[must_use]
    pub fn count(self) -> u32 {
        self.relative.len() as u32
    }

    /// The line of a footprint that has one.
    #[inline(always)]
    #[must_use]
    pub fn only(self) -> Option<u32> {
        match self.relative {
            [relative] => Some(self.base + relative),
            _ => None,
        }
    }

    /// Sum of the lines' [`access_hash`]. One and two lines are written out: a loop over them would
    /// be compiled to vectors, which cost more than they save.
    #[inline(always)]
    fn hash(self) -> u64 {
        let hash = |relative: &u32| access_hash(self.base + relative);
        match self.relative {
            [only] => hash(only),
            [first, second] => hash(first).wrapping_add(hash(second)),
            lines => lines.iter().map(hash).fold(0, u64::wrapping_add),
        }
    }

    /// Line numbers: addresses over the line size.
    #[inline(always)]
    pub fn iter(self) -> impl Iterator<Item = u32> + 'a {
        self.relative
            .iter()
            .map(move |relative| self.base + relative)
    }
}

/// The quads of all cores, and the counts of what they access.
pub struct Stream<'a, S: ?Sized> {
    source: &'a S,
    footprints: Footprints,
    scratch: Scratch,
    feeds: Vec<Feed>,
    /// Where accesses count.
    pub bins: Bins,
    /// What has been accessed.
    pub counts: TraceCounts,
}

impl<'a, S: TileSource + ?Sized> Stream<'a, S> {
    /// A stream with idle cores. Of the configuration it needs the number of cores, sampling,
    /// layout and line size, and whether tiles are counted.
    ///
    /// # Errors
    /// Tables that refer to what is not there, or too large an address space.
    pub fn new(source: &'a S, config: &RunConfig) -> Result<Self, StreamError> {
        let tables = source.tables();
        let footprints = Footprints::new(tables, config)?;
        let bins = Bins::new(tables, config.tile_maps);
        Ok(Self {
            source,
            scratch: footprints.scratch(),
            footprints,
            feeds: (0..config.cores).map(|_| Feed::default()).collect(),
            counts: TraceCounts::new(&bins),
            bins,
        })
    }

    /// Number of cores.
    #[must_use]
    pub fn cores(&self) -> usize {
        self.feeds.len()
    }

    /// Lines of the whole address space.
    #[must_use]
    pub fn lines(&self) -> u64 {
        self.footprints.lines()
    }

    /// Gives a core its next work item.
    ///
    /// # Errors
    /// A tile that cannot be read.
    pub fn load(&mut self, core: usize, item: &WorkItem) -> Result<(), StreamError> {
        self.feeds[core].load(self.source, item)
    }

    /// Sends the core's next quad to `consumer`: the number of its footprints, or `None` if the
    /// item is done.
    #[inline]
    pub fn next_quad(&mut self, core: usize, consumer: &mut impl Consumer) -> Option<u32> {
        let quad = self.feeds[core].next_quad()?;
        let place = self.bins.place(quad.at);
        self.counts.quad(place.tile, quad.lanes());
        consumer.quad(core, place.tile);
        let mut footprints = 0;
        let (bins, counts) = (&self.bins, &mut self.counts);
        self.footprints.for_quad(
            quad.draw,
            quad.records,
            &mut self.scratch,
            |sample, bundle| {
                let cell = bins.cell(place, sample.texture, bundle.level);
                let accesses = send(cell, sample, bundle, consumer);
                counts.footprints(cell, place.tile, &accesses);
                footprints += accesses.footprints;
            },
        );
        Some(footprints)
    }
}

/// Accesses of a quad to one level of one texture.
struct Accesses {
    footprints: u32,
    line_lookups: u32,
    /// Sum of [`access_hash`].
    hash: u64,
}

/// Sends the footprints of a bundle.
#[inline(always)]
fn send(cell: usize, sample: SampleRef, bundle: &Bundle, consumer: &mut impl Consumer) -> Accesses {
    let (mut line_lookups, mut hash, mut last_hash) = (0, 0_u64, 0_u64);
    let mut repeats_are_idle = false;
    for index in 0..usize::from(bundle.count) {
        let lines = Lines::new(sample.base_line, bundle.lines_of(index));
        line_lookups += lines.count();
        if !(bundle.repeats(index) && repeats_are_idle) {
            last_hash = lines.hash();
            repeats_are_idle = consumer.footprint(cell, lines);
        }
        hash = hash.wrapping_add(last_hash);
    }
    Accesses {
        footprints: bundle.count.into(),
        line_lookups,
        hash,
    }
}

/// Hash of one line access; accesses are summed, so their order does not matter.
#[inline(always)]
fn access_hash(line: u32) -> u64 {
    let mixed = (u64::from(line) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ mixed >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93)
}
