//! The Parallax trace files.
//!
//! Everything that `tracegen` (scene to trace) and `replay` (trace to answer) share is in this
//! crate, and the files it describes are the only joint between the two programs. FORMAT.md in
//! the repository root is the byte-level specification.

pub mod container;
pub mod error;
pub mod footprint;
pub mod interop;
pub mod layout;
pub mod parse;
pub mod raytrace;
pub mod text;
pub mod textrace;
pub mod texture;
pub mod view;

#[cfg(test)]
mod spec;

pub use error::{FormatError, Result};
