//! The memory system below the texture units: caches, their hierarchy, and DRAM.
//!
//! | folder | holds |
//! | --- | --- |
//! | `policy/` | tags and replacement, a policy a file |
//! | `in_flight/` | lines that arrive later: MSHRs, allocation on a fill or on a miss |
//! | `prefetch/` | prefetchers of the L2, one a file |
//! | `hierarchy/` | the levels of a configuration, wired up |
//! | `dram/` | channels, banks and rows |
//! | `fast/` | LRU caches in one pass, sets filled one by one: equal to the plain ones, as tests hold |

mod access;
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
pub use cache::{AnyCache, Cache};
pub use fast::Forest;
pub use hierarchy::{Answer, Caches, Found, Hierarchy, MissPath, SecondLevel};
pub use in_flight::{AllocateOnMiss, Delay, DelayedFill, NOT_IN_FLIGHT};
pub use policy::{AnyWays, FourWayLru, Lru, Replacement, WaysOf};
pub use prefetch::Prefetching;

use policy::EMPTY;

#[cfg(test)]
mod tests;
