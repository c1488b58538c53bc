//! The memory system below the texture units: caches, their hierarchy, and DRAM.
//!
//! | folder | contents |
//! | --- | --- |
//! | `policy/` | tags and replacement, one policy per file |
//! | `in_flight/` | delayed fills: MSHRs, allocation on fill or on miss |
//! | `prefetch/` | prefetchers of the L2, one per file |
//! | `hierarchy/` | the levels of a configuration, connected |
//! | `dram/` | channels, banks and rows |
//! | `fast/` | accelerated LRU caches, which tests hold equal to the plain ones |

mod access;
mod build;
mod busy_days;
mod cache;
pub mod dram;
mod fast;
mod hierarchy;
mod in_flight;
mod policy;
mod prefetch;
mod sectored;
mod victim;
mod watched;

pub use access::{Access, Client};
pub use busy_days::BusyDays;
pub use cache::Cache;
pub use fast::Forest;
pub use hierarchy::{Answer, Caches, Found, Hierarchy, MissPath, OtherWork, SecondLevel};
pub use in_flight::{AllocateOnMiss, Delay, DelayedFill, LimitedMshrs, NOT_IN_FLIGHT};
pub use policy::{AnyCache, AnyWays, FourWayLru, Lru, MakePolicy, Policy, Replacement, WaysOf};
pub use prefetch::Prefetching;

#[cfg(test)]
mod tests;
