//! Converts the records of a capturer to the tiles of a trace.
//!
//! ```text
//! Capturer (any driver), region by region ─┐
//! events as they happen, pass by pass ─────┴─> Recorder: raw quad records -> binning by tile
//!     -> in-order depth test -> fixed point -> encoded tiles -> TextraceWriter
//! ```
//!
//! This crate depends neither on a driver nor on a scene. A capturer that can render a region again
//! implements [`Capturer`], with `formats::textrace::Tables` known in advance. A capturer that observes a
//! program passes its events to the same [`Recorder`].

mod bins;
mod capturer;
mod encode;
mod error;
mod masked;
mod merge;
mod quantise;
mod raw;
mod recorder;
mod regions;
mod tiles;

pub use capturer::{Captured, Capturer, Region, Sink};
pub use encode::Recorded;
pub use error::RecordError;
pub use masked::DepthReplay;
pub use merge::MergedQuads;
pub use raw::{DEPTH_BYTES, RECORD_BYTES, RawDepth, RawRecord, RawRecords};
pub use recorder::Recorder;
pub use tiles::CaptureCounts;
