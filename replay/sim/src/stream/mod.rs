//! The accesses of a trace: the quads of each core as the lines of their footprints.
//!
//! [`Expander`] converts a frame's quads to lines once. An order yields work items, which [`Cores`]
//! converts to the quads of each core. The interleaving depends on how the next core is selected:
//! [`interleave`] counts footprints, the timed machine uses the clocks of its texture units. A [`Consumer`]
//! receives the quads: caches without latencies, or the plain lists of tests.

mod cores;
mod counters;
mod counts;
mod distinct;
mod error;
mod expand;
mod feed;
mod footprint;
mod halved;
mod hsr;
mod interleave;
mod last_used;
mod line_set;
mod lines;
mod regroup;
mod source;
mod tag;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
mod walk;

pub use cores::Cores;
pub use counters::ray_counters;
pub use counts::{Bins, Cell, CellAccesses, TileAccesses, TraceCounts};
pub use error::StreamError;
pub use expand::{Expander, Frame, LineMemory};
pub use feed::{Quad, for_quads};
pub use halved::Halved;
pub use hsr::{Shaded, shaded};
pub use interleave::{Consumer, furthest_behind, interleave};
pub use line_set::LineSet;
pub use lines::{Footprint, ListEntry, ListedRun, QuadLines, TileLines, interleaved};
pub use regroup::{Rendered, rendered};
pub use source::{MemoryTrace, TileSource};
pub use tag::{Tag, Use};
pub use walk::{FramePlan, Walk, plan};
