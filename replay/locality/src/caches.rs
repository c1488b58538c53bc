//! The caches that a stream is looked up in: the configured one, LRU caches of several sizes and ways, and OPT.

use crate::axis::{Renumbering, TimeSet};
use crate::figures::Figures;
use crate::opt;
use crate::place::{ByOrigin, add};
use crate::profile::StreamCache;
use crate::set_associative::{CacheHits, SetAssociative};
use crate::split::MissSplit;
use sim::config::ConfigError;
use sim::memory::{AnyCache, Cache};

/// Associativities in the curves.
const WAYS: [u32; 5] = [1, 2, 4, 8, 16];

/// Sizes in the curves: from 1/8 to 16 times the configured size, as powers of two.
const SIZES: std::ops::RangeInclusive<i32> = -3..=4;

/// The caches that a stream is looked up in.
pub(crate) struct Caches {
    pub(crate) configured: Box<dyn Cache>,
    split: MissSplit,
    lru: SetAssociative,
    opt: Vec<opt::FullyAssociative>,
    opt_of_geometry: opt::OptSets,
}

impl Caches {
    /// Largest size in the curves over the configured size rounded up to a power of two.
    pub(crate) const LARGEST_OVER_CONFIGURED: u64 = 1 << *SIZES.end();

    pub(crate) fn new(of: &StreamCache, times: u32) -> Result<Self, ConfigError> {
        let sets = of.cache.sets(of.level, of.line_bytes)?;
        let ways = of.cache.ways;
        let lines = sets * ways;
        let mut sizes: Vec<u32> = SIZES
            .filter_map(|power| match power {
                0.. => lines.next_power_of_two().checked_shl(power as u32),
                _ => Some(lines.next_power_of_two() >> -power),
            })
            .filter(|&size| size > 0)
            .chain([lines])
            .collect();
        sizes.sort_unstable();
        sizes.dedup();
        let geometry = |size: u32, ways: u32| {
            let fits = size.is_multiple_of(ways) && (size / ways).is_power_of_two();
            fits.then(|| (size / ways, ways))
        };
        let of_sizes = sizes.iter().flat_map(|&size| {
            let all = WAYS.into_iter().chain([ways]);
            all.filter_map(move |ways| geometry(size, ways))
        });
        let opt = sizes.iter();
        Ok(Self {
            configured: AnyCache::build(&of.cache, of.level, of.line_bytes, of.seed)?.into_box(),
            split: MissSplit::default(),
            lru: SetAssociative::new(of_sizes.chain([(sets, ways)]).collect()),
            opt: opt
                .map(|&size| opt::FullyAssociative::new(size, times))
                .collect(),
            opt_of_geometry: opt::OptSets::new(sets, ways),
        })
    }

    pub(crate) fn first_use(&mut self, line: u32, now: u32) {
        self.lru.access(line, None);
        self.opt_of_geometry.access(line, None, now);
        self.split.compulsory += 1;
    }

    /// A line is used again. `hits` are those of the configured cache and of a fully associative one of its size.
    #[inline(always)]
    pub(crate) fn reuse(
        &mut self,
        line: u32,
        origin: usize,
        [before, now]: [u32; 2],
        hits: [bool; 2],
    ) {
        self.split.count(origin, hits[0], hits[1]);
        self.lru.access(line, Some(origin));
        for opt in &mut self.opt {
            let kept = before + 1 == now || opt.reuse(before, now);
            opt.hits[origin] += u64::from(kept);
        }
        let kept = self.opt_of_geometry.access(line, Some(before), now);
        self.opt_of_geometry.hits[origin] += u64::from(kept);
    }

    pub(crate) fn opt_times(&self) -> impl Iterator<Item = &TimeSet> {
        self.opt.iter().map(opt::FullyAssociative::times)
    }

    pub(crate) fn renumber(&mut self, numbers: &Renumbering, times: u32) {
        for opt in &mut self.opt {
            opt.renumber(numbers, times);
        }
        self.opt_of_geometry.renumber(numbers);
    }

    /// Hits of the caches, with those of immediate reuses, which hit in all of them.
    pub(crate) fn figures(self, at_once: &ByOrigin) -> Figures {
        let with_front = |hits: &ByOrigin| {
            let mut hits = *hits;
            add(&mut hits, at_once);
            hits
        };
        let opt = self.opt.iter().map(|opt| CacheHits {
            lines: opt.lines.into(),
            ways: None,
            hits: with_front(&opt.hits),
        });
        let lru = self.lru.hits().into_iter().map(|cache| CacheHits {
            hits: with_front(&cache.hits),
            ..cache
        });
        let mut split = self.split;
        add(&mut split.hits_of_both, at_once);
        Figures {
            split,
            lru: lru.collect(),
            opt: opt.collect(),
            opt_of_geometry: with_front(&self.opt_of_geometry.hits),
            ..Figures::default()
        }
    }
}
