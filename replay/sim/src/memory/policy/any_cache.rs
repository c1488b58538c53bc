//! A cache of any policy.

use super::lru::{AnyWays, FourWayLru, Lru, WaysOf};
use crate::memory::cache::Cache;

/// A cache of any policy. The most common kind keeps its concrete type, so that replays can be compiled for it.
pub enum AnyCache {
    /// Four-way LRU.
    FourWayLru(FourWayLru),
    /// Any other cache.
    Other(Box<dyn Cache>),
}

pub(in crate::memory) fn boxed(cache: impl Cache + 'static) -> AnyCache {
    AnyCache::Other(Box::new(cache))
}

impl AnyCache {
    /// An empty LRU cache; `sets` is a power of two.
    pub fn lru(sets: u32, ways: u32) -> Self {
        match ways {
            1 => boxed(Lru::new(sets, WaysOf::<1>)),
            2 => boxed(Lru::new(sets, WaysOf::<2>)),
            4 => Self::FourWayLru(Lru::new(sets, WaysOf)),
            8 => boxed(Lru::new(sets, WaysOf::<8>)),
            _ => boxed(Lru::new(sets, AnyWays(ways as usize))),
        }
    }

    /// Boxes the cache, whatever its kind.
    pub fn into_box(self) -> Box<dyn Cache> {
        match self {
            Self::FourWayLru(cache) => Box::new(cache),
            Self::Other(cache) => cache,
        }
    }
}
