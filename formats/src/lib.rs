//! The Parallax trace files: what `tracegen` (scene or program to trace) writes and `replay` (trace to results)
//! reads. FORMAT.md in the repository root is the byte-level specification.
//!
//! | to | use |
//! | --- | --- |
//! | read a file of either kind | [`Trace::open`] |
//! | read texture coordinates of quads (`.textrace`) | [`Textrace`], tile by tile from any thread |
//! | write them | [`TextraceWriter`] |
//! | read rays (`.raytrace`) | [`Raytrace`] |
//! | write them | [`RaytraceWriter`] |
//! | compute which texels a quad reads, and at which addresses | [`footprint`], [`layout`] |
//! | pass accesses to other tools, or read theirs | [`interop`] |
//!
//! Every error names the file, the place, what was expected and what was found ([`FormatError`]).
//!
//! # Example
//!
//! A reader of its own (`examples/read_trace.rs`):
//! ```no_run
#![doc = include_str!("../examples/read_trace.rs")]
//! ```

pub mod bounded_folder;
mod chunk_tag;
pub mod container;
pub mod error;
pub mod footprint;
pub mod interop;
mod json;
pub mod layout;
mod parse;
pub mod random;
pub mod raytrace;
mod records;
#[cfg(feature = "testing")]
pub mod schemas;
mod sums;
pub mod technique_study;
pub mod text;
pub mod textrace;
pub mod texture;
mod tiles;
mod trace;
mod varint;
pub mod view;

#[cfg(test)]
mod tests;

pub use error::{Broken, FormatError, Result, UnknownName};
pub use raytrace::{Raytrace, RaytraceWriter};
pub use textrace::{Textrace, TextraceWriter};
pub use trace::Trace;
