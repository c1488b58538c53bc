//! Locality: the distances between uses of lines, and the resulting hits in caches of every size.
//!
//! [`Profile`] analyses a stream of lines, each with its place. [`analyse`] creates the streams of a trace,
//! one per order, and [`analyse_addresses`] those of plain addresses. `docs/models/locality.md` defines every
//! figure.

mod axis;
mod caches;
mod distances;
mod figures;
mod growth;
mod knees;
mod last_use;
mod opt;
mod optimal;
mod orders;
mod place;
mod plain;
mod profile;
mod set_associative;
mod split;
mod stretch;
#[cfg(test)]
mod tests;
mod working_set;

pub use distances::{DistanceBin, Distances};
pub use figures::Figures;
pub use growth::distinct_lines;
pub use knees::Rows;
pub use optimal::{OptMisses, opt_misses};
pub use orders::{OrderFigures, Sequence, Stream, Streams, analyse};
pub use place::{ByOrigin, Origin, Place};
pub use plain::analyse_addresses;
pub use profile::{Profile, StreamCache};
pub use set_associative::CacheHits;
pub use split::MissSplit;
pub use stretch::Reuses;
pub use working_set::WorkingSet;
