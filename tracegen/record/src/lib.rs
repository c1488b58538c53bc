//! From what a capturer hands over to the tiles of a trace.
//!
//! ```text
//! Capturer (any driver) -> raw quad records, one region at a time
//!   -> binning by tile -> in-order alpha test -> fixed point -> encoded tiles -> TextraceWriter
//! ```
//!
//! Nothing here knows a driver or a scene: whoever implements [`Capturer`] and fills
//! `formats::textrace::Tables` can write a trace.

mod bins;
mod capturer;
mod error;
mod masked;
mod merge;
mod quantise;
mod raw;
mod recorder;
mod regions;
mod tiles;

pub use capturer::{Captured, Capturer, Region, Sink};
pub use error::RecordError;
pub use merge::Merged;
pub use raw::{DEPTH_BYTES, RECORD_BYTES, RawDepth, RawRecord, RawRecords};
pub use recorder::{Recorded, Recorder};
pub use tiles::CaptureCounts;
