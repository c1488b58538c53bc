//! The interface of capturers. Implement it to add another driver.

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
    /// The region is complete, and the sink has received its records.
    Complete,
    /// The capturer's memory was too small, and the sink was not called. The region will be captured again in
    /// parts.
    Overflow {
        /// Number of records of the region.
        needed: u64,
    },
}

/// Receives the records of one region.
pub type Sink<'a> = dyn FnMut(RawRecords<'_>) -> Result<(), RecordError> + 'a;

/// Renders one view, region by region, and passes its records to a sink.
///
/// Records may have any order, and so may primitives, including those of alpha-masked draws. Regions may be
/// requested in any order.
pub trait Capturer {
    /// Errors of the capturer, which include those of the sink.
    type Error: From<RecordError>;

    /// Maximum number of records of a region.
    fn record_capacity(&self) -> u64;

    /// Renders a region and calls `sink` once with all its records. `sink` is not called if there are none,
    /// or too many.
    ///
    /// # Errors
    /// The capturer's errors and those of `sink`.
    fn capture(&mut self, region: Region, sink: &mut Sink<'_>) -> Result<Captured, Self::Error>;
}
