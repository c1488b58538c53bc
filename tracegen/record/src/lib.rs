//! From what a capturer hands over to the tiles of a trace.
//!
//! Raw quad records and the depths of masked draws are binned by tile, sorted, put through the
//! in-order alpha test and brought to fixed point. Nothing here knows a driver or a scene.

mod bin;
mod masked;
mod quantise;
mod raw;
mod tiles;

pub use bin::{Bins, TileRect};
pub use raw::{DEPTH_BYTES, RECORD_BYTES, RawDepth, RawRecord, RawRecords};
pub use tiles::{CaptureCounts, Scratch, TileRules};
