//! Converts the records of a capturer to the tiles of a trace.
//!
//! ```text
//! Capturer (any driver) -> Recorder  ─┐ raw quad records, region by region or pass by pass
//! events as they happen -> Recording ─┴─> binning by tile -> in-order depth test -> fixed point
//!                                           -> encoded tiles -> TextraceWriter
//! ```
//!
//! This crate depends neither on a driver nor on a scene. A capturer that can render a region again
//! implements [`Capturer`], with `formats::textrace::Tables` known in advance. A capturer that observes a
//! program passes its events to a [`Recording`].

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
