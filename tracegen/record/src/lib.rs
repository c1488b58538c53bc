//! From what a capturer hands over to the tiles of a trace.
//!
//! ```text
//! Capturer (any driver) -> Recorder  ─┐ raw quad records, region by region or pass by pass
//! events as they happen -> Recording ─┴─> binning by tile -> in-order depth test -> fixed point
//!                                           -> encoded tiles -> TextraceWriter
//! ```
//!
//! Nothing here knows a driver or a scene. Whoever can draw a region again implements [`Capturer`] and fills
//! `formats::textrace::Tables` first; whoever sees a program draw once pushes what it sees into a [`Recording`].

mod bins;
mod capturer;
mod encode;
mod error;
mod masked;
mod merge;
mod quantise;
mod raw;
mod recorder;
mod recording;
mod regions;
mod tiles;

pub use capturer::{Captured, Capturer, Region, Sink};
pub use encode::Recorded;
pub use error::RecordError;
pub use masked::DepthReplay;
pub use merge::Merged;
pub use raw::{DEPTH_BYTES, RECORD_BYTES, RawDepth, RawRecord, RawRecords};
pub use recorder::Recorder;
pub use recording::Recording;
pub use tiles::CaptureCounts;
