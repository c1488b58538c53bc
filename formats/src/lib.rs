//! The Parallax trace files.
//!
//! This crate contains the code that `tracegen` (scene to trace) and `replay` (trace to results) share. The
//! two programs communicate only through the files it describes. FORMAT.md in the repository root is the
//! byte-level specification.

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
pub mod text;
pub mod textrace;
pub mod texture;
mod tiles;
mod trace;
mod varint;
pub mod view;

#[cfg(test)]
mod tests;

pub use error::{Broken, FormatError, Result};
pub use trace::Trace;
