//! Cycle-level simulation of the traversal and intersection (T&I) units, beside the closed form of
//! [`super::tni`].
//!
//! | file | contents |
//! | --- | --- |
//! | `machine` | the configuration in whole cycles |
//! | `batch` | the input: rays and their requests, per tile of an eye |
//! | `warp` | rays in lock step, merged into one sequence of requests |
//! | [`sim::memory`] | the calendar of events, pipelines and ports as servers, and the channel that the L2 and the cores share |
//! | `memory` | L1 caches, L2, and their MSHRs |
//! | `unit` | ray slots, pipelines, return of rays, stall causes |
//! | `cores` | tile buffers and the shader cores |
//! | `event` | events and their order within a cycle |
//! | `rays` | the way of a ray: requests, waits, pipelines |
//! | `device` | the event loop |
//! | `counts` | counters, and the conservation of rays and requests |
//!
//! In each cycle, these phases follow each other:
//!
//! 1. The cores finish a tile, which frees its buffer.
//! 2. Rays that wait for an MSHR of the L2 try again, in order of arrival.
//! 3. For each unit in order: rays that wait for an MSHR of its node cache, then of its triangle cache, try again;
//!    then each ray that left a pipeline or whose lines arrived continues, by slot number.
//! 4. Finished rays return through the unit's output port, and complete tiles go to the cores.
//! 5. Each unit accepts rays into its lowest free slots.
//!
//! A ray that continues requests all lines of its next node or triangle. If all are in the L1, it queues for a pipeline.
//! Otherwise it waits, outside the pipelines, for the last line (the ray accumulation unit of Nah et al., "T&I
//! Engine", SIGGRAPH Asia 2011), and then queues. A ray whose miss finds all MSHRs in use waits for a free one.

mod batch;
mod cores;
mod counts;
mod device;
mod event;
mod machine;
mod memory;
mod rays;
mod unit;
mod warp;

pub use batch::{Batch, BatchSource, Item, Pipeline, Request};
pub use counts::{Counts, LineCounts, PrefetchCounts};
pub use device::{BatchTiming, Simulated, SimulationError, simulate};
pub use machine::Machine;
pub(super) use warp::merge;

#[cfg(test)]
mod tests;
