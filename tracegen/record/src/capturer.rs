//! The contract of a capturer, through which another driver can be added.

use crate::{RawRecords, RecordError};

/// A rectangle of a view in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Left and top edge.
    pub origin_px: [u32; 2],
    /// Width and height.
    pub size_px: [u32; 2],
}

/// Result of capturing a region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Captured {
    /// The region is complete, and its records were handed over.
    Complete,
    /// The capturer's memory was too small. Nothing was handed over; the region will be asked for
    /// again in parts.
    Overflow {
        /// Records that the region produces.
        needed: u64,
    },
}

/// Takes the records of one region.
pub type Sink<'a> = dyn FnMut(RawRecords<'_>) -> Result<(), RecordError> + 'a;

/// Renders one view, region by region, and hands over what its fragments sampled.
///
/// Records may come in any order, and so may primitives, those of alpha-masked draws too. Regions
/// may be asked for in any order.
pub trait Capturer {
    /// Its errors, including those of the sink.
    type Error: From<RecordError>;

    /// Records that one region may produce.
    fn record_capacity(&self) -> u64;

    /// Renders a region and calls `sink` once with all its records, or not at all where there
    /// are none or too many.
    ///
    /// # Errors
    /// Its own, and what `sink` returns.
    fn capture(&mut self, region: Region, sink: &mut Sink<'_>) -> Result<Captured, Self::Error>;
}
