//! What is accessed: the quads of each core as the lines of their footprints.
//!
//! [`Expander`] turns a frame's quads into lines, once; an order gives work items, and [`Cores`]
//! turns those into each core's quads. Who decides which core runs next decides the interleaving:
//! [`interleave`] by footprints alone, the timed machine by its texture units' clocks. A
//! [`Consumer`] of quads is one function: caches without latencies, the tests' plain lists, or
//! whatever else wants the lines.

mod cores;
mod counters;
mod counts;
mod distinct;
mod error;
mod expand;
mod feed;
mod footprint;
mod hsr;
mod interleave;
mod last_used;
mod line_set;
mod lines;
mod regroup;
mod source;
pub mod synthetic;
#[cfg(test)]
pub mod testing;

pub use cores::Cores;
pub use counts::{Bins, Cell, CellAccesses, TileAccesses, TraceCounts};
pub use distinct::Use;
pub use error::StreamError;
pub use expand::{Expander, Frame, LineMemory};
pub use feed::{Quad, for_quads};
pub use hsr::{Shaded, shaded};
pub use interleave::{Consumer, furthest_behind, interleave};
pub use line_set::LineSet;
pub use lines::{Footprint, ListEntry, Listed, QuadLines, Tag, TileLines, interleaved};
pub use regroup::{Rendered, rendered};
pub use source::{MemoryTrace, TileSource};
