//! The memory system below the texture units: caches, their hierarchy, and DRAM.
//!
//! | folder | contents |
//! | --- | --- |
//! | `policy/` | tags and replacement, one policy per file |
//! | `in_flight/` | delayed fills: MSHRs, allocation on fill or on miss |
//! | `prefetch/` | prefetchers of the L2, one per file |
//! | `hierarchy/` | the levels of a configuration, connected |
//! | `dram/` | channels, banks and rows: counts |
//! | `calendar` | events by cycle, of lines and of ray-tracing units |
//! | `simple_memory` | memory as time sees it: latency and bandwidth |
//! | `server` | servers with a fixed interval between items |
//! | `fast/` | accelerated LRU caches, which tests hold equal to the plain ones |

mod access;
mod build;
mod busy_days;
mod cache;
mod calendar;
pub mod dram;
mod fast;
mod hashed_index;
mod hierarchy;
mod in_flight;
mod policy;
mod prefetch;
mod recorded;
mod sectored;
mod server;
mod simple_memory;
mod victim;

pub use access::{Access, Client};
pub use cache::{Cache, EMPTY};
pub use calendar::Calendar;
pub use fast::Forest;
pub(crate) use hashed_index::hashed;
pub use hierarchy::{Answer, Caches, Found, Hierarchy, MissPath, OtherWork, SecondLevel};
pub use in_flight::{AllocateOnMiss, Delay, DelayedFill, LimitedMshrs, NOT_IN_FLIGHT};
pub use policy::{AnyCache, AnyWays, FourWayLru, Lru, MakePolicy, Policy, Replacement, WaysOf};
pub use prefetch::Prefetching;
pub use recorded::Change;
pub use server::{Served, Servers, TICKS, ticks};
pub use simple_memory::SimpleMemory;

#[cfg(test)]
mod tests;
