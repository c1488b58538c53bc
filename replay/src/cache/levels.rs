//! The caches of one machine, and the choice of the type that its replay is compiled for.

use super::{AllocateOnMiss, AnyCache, Cache, Delay, FourWayLru};
use crate::config::{CacheConfig, ConfigError, RunConfig};

/// First-level caches, one a core, and the shared second level.
pub struct Levels<C> {
    /// By core.
    pub l1: Vec<C>,
    /// Shared.
    pub l2: C,
}

impl<C: Delay> Levels<C> {
    /// The caches as ones that fill later; most lines arrive within so many cycles.
    #[must_use]
    pub fn delayed(self, l1_cycles: u64, l2_cycles: u64) -> Levels<C::Delayed> {
        let l1 = self.l1.into_iter().map(|cache| cache.delayed(l1_cycles));
        Levels {
            l1: l1.collect(),
            l2: self.l2.delayed(l2_cycles),
        }
    }
}

impl Levels<AnyCache> {
    /// Builds the caches of a configuration. Each has a seed of its own.
    ///
    /// # Errors
    /// A geometry that cannot be built.
    pub fn build(config: &RunConfig) -> Result<Self, ConfigError> {
        let build = |cache: &CacheConfig, level, number: u32| {
            let seed = config.seed.wrapping_add(number.into());
            AnyCache::build(cache, level, config.line_bytes, seed)
        };
        Ok(Self {
            l1: (1..=config.cores)
                .map(|core| build(&config.l1, "L1", core))
                .collect::<Result<_, _>>()?,
            l2: match build(&config.l2, "L2", 0)? {
                l2 if config.levels_depend_on_evictions() => l2.watched(),
                l2 => l2,
            },
        })
    }

    /// The caches as ones that allocate on a miss.
    #[must_use]
    pub fn allocate_on_miss(self) -> Levels<AllocateOnMiss> {
        let allocate = |cache: AnyCache| AllocateOnMiss(cache.into_box());
        Levels {
            l1: self.l1.into_iter().map(allocate).collect(),
            l2: allocate(self.l2),
        }
    }

    /// The caches as what they are, if all are [`FourWayLru`].
    ///
    /// # Errors
    /// If not, the caches behind pointers.
    pub fn all_four_way(self) -> Result<Levels<FourWayLru>, Levels<Box<dyn Cache>>> {
        let four_way = |cache| match cache {
            AnyCache::FourWayLru(cache) => Some(cache),
            AnyCache::Other(_) => None,
        };
        let is_four_way = |cache: &AnyCache| matches!(cache, AnyCache::FourWayLru(_));
        match self.l2 {
            AnyCache::FourWayLru(l2) if self.l1.iter().all(is_four_way) => Ok(Levels {
                l1: self.l1.into_iter().filter_map(four_way).collect(),
                l2,
            }),
            l2 => Err(Levels {
                l1: self.l1.into_iter().map(AnyCache::into_box).collect(),
                l2: l2.into_box(),
            }),
        }
    }
}
