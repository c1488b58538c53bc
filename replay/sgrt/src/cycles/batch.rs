//! The input of the simulation: rays and their requests, one batch per tile of an eye.

use formats::view::Eye;
use std::ops::Range;

/// The pipelines that a request goes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Pipeline {
    /// Traversal: a node.
    Traversal,
    /// Intersection: a triangle.
    Intersection,
}

/// A ray's request for a node or a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Request {
    /// First cache line.
    pub first_line: u32,
    /// Number of lines, at least 1.
    pub lines: u32,
    /// What is done with the data.
    pub pipeline: Pipeline,
}

/// A ray, or a warp of rays in lock step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Item {
    /// Its first request in [`Batch::requests`].
    pub first: u32,
    /// End of its requests.
    pub end: u32,
    /// Rays that advance together; 1 for single rays.
    pub rays: u32,
    /// The eye of its rays.
    pub eye: Eye,
}

/// A tile of one eye.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// Requests of all items.
    pub requests: Vec<Request>,
    /// By request, what its ray fetches ahead when it begins the request, as a range of [`Self::prefetches`]; shorter than
    /// [`Self::requests`] if later requests fetch nothing.
    pub ahead: Vec<Range<u32>>,
    /// What is fetched ahead.
    pub prefetches: Vec<Request>,
    /// Items by unit, in order of dispatch.
    pub items: Vec<Vec<Item>>,
    /// Unit cycles that the shader cores spend on the tile.
    pub core_cycles: u64,
    /// Cache lines that the cores and DMA transfer for the tile.
    pub core_lines: u64,
}

impl Batch {
    /// Empties the batch for `units` units and keeps its memory.
    pub fn clear(&mut self, units: usize) {
        self.requests.clear();
        self.ahead.clear();
        self.prefetches.clear();
        self.items.resize_with(units, Vec::new);
        self.items.iter_mut().for_each(Vec::clear);
        (self.core_cycles, self.core_lines) = (0, 0);
    }

    /// Rays of all items.
    pub fn rays(&self) -> u64 {
        let items = self.items.iter().flatten();
        items.map(|item| u64::from(item.rays)).sum()
    }
}

/// A source of batches in order of dispatch.
pub trait BatchSource {
    /// Reason why a batch cannot be read.
    type Error;

    /// Replaces `batch`, cleared for the machine's units, by the next batch. False after the last one.
    ///
    /// # Errors
    /// A batch that cannot be read.
    fn next(&mut self, batch: &mut Batch) -> Result<bool, Self::Error>;
}
