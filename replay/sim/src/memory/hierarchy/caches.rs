//! The caches of the first two levels, with the type that a replay is compiled for.

use crate::config::{ConfigError, LevelConfig, RunConfig};
use crate::memory::{AllocateOnMiss, AnyCache, Cache, Delay, FourWayLru};

/// The caches of the first two levels: per level one cache, or one per core.
pub struct Caches<C> {
    /// First level.
    pub l1: Vec<C>,
    /// Second level.
    pub l2: Vec<C>,
}

impl<C> Caches<C> {
    fn map<D>(self, turn: impl Fn(C) -> D) -> Caches<D> {
        Caches {
            l1: self.l1.into_iter().map(&turn).collect(),
            l2: self.l2.into_iter().map(&turn).collect(),
        }
    }
}

impl<C: Delay> Caches<C> {
    /// Turns the caches into caches with delayed fills; most lines arrive within these latencies.
    pub fn delayed(self, l1_cycles: u64, l2_cycles: u64) -> Caches<C::Delayed> {
        let delayed = |caches: Vec<C>, cycles| {
            let all = caches.into_iter().map(|cache| cache.delayed(cycles));
            all.collect()
        };
        Caches {
            l1: delayed(self.l1, l1_cycles),
            l2: delayed(self.l2, l2_cycles),
        }
    }
}

impl Caches<AnyCache> {
    /// Builds the caches of a configuration. Each has its own seed.
    ///
    /// # Errors
    /// An impossible geometry.
    pub fn build(config: &RunConfig) -> Result<Self, ConfigError> {
        let build = |level: &LevelConfig, name, number: u32| {
            let seed = config.seed.wrapping_add(number.into());
            AnyCache::build(level, name, config.line_bytes, seed)
        };
        let l2 = &config.level.l2;
        let second = |core| build(l2, "L2", if core == 0 { 0 } else { config.cores + core });
        let observed = |mut l2: AnyCache| {
            if config.level.depend_on_evictions() {
                l2 = l2.recording_evictions();
            }
            match config.records_l2() {
                true => l2.recording_changes(),
                false => l2,
            }
        };
        Ok(Self {
            l1: (1..=config.level.l1.caches(config.cores))
                .map(|core| build(&config.level.l1, "L1", core))
                .collect::<Result<_, _>>()?,
            l2: (0..l2.caches(config.cores))
                .map(|core| Ok(observed(second(core)?)))
                .collect::<Result<_, ConfigError>>()?,
        })
    }

    /// Turns the caches into caches that allocate on a miss.
    pub fn allocate_on_miss(self) -> Caches<AllocateOnMiss> {
        self.map(|cache| AllocateOnMiss(cache.into_box()))
    }

    /// Boxes the caches.
    pub fn boxed(self) -> Caches<Box<dyn Cache>> {
        self.map(AnyCache::into_box)
    }

    /// Returns the caches with their concrete type if all are [`FourWayLru`].
    ///
    /// # Errors
    /// Otherwise the boxed caches.
    pub fn all_four_way(self) -> Result<Caches<FourWayLru>, Caches<Box<dyn Cache>>> {
        let is_four_way = |cache: &AnyCache| matches!(cache, AnyCache::FourWayLru(_));
        if !self.l1.iter().chain(&self.l2).all(is_four_way) {
            return Err(self.boxed());
        }
        Ok(self.map(|cache| match cache {
            AnyCache::FourWayLru(cache) => cache,
            AnyCache::Other(_) => unreachable!("all caches are four-way LRU"),
        }))
    }
}
