//! Bounds on the lines that an L2 fetches in a frame.
//!
//! - **Infinite cache**: fetches each distinct line once. It is a lower bound for every order and every
//!   replacement policy.
//! - **OPT**: the fewest misses of any replacement policy for the requests of one order (Belady). Other orders
//!   may have fewer.
//! - **Windows**: divide the run of any order into windows in which a cache of *M* lines misses *M* times. The
//!   lines used in a window were in the cache at its start or are fetched in it, so there are at most 2*M* of
//!   them. They have at most as many uses as the 2*M* lines with the most uses. This limits the uses per
//!   window, and therefore gives a minimum number of windows (Hong & Kung 1981). The bound holds for every
//!   order of the items and every replacement policy.

use super::Items;
use super::stream::l2_stream;
use locality::{OptMisses, opt_misses};
use sim::config::{Order, RunConfig};
use sim::engine::ReplayError;
use sim::stream::{Expander, LineMemory, TileSource, Walk, rendered};

/// The minimum number of lines that any order of the items fetches into a cache of this many lines, by windows.
pub fn windows(items: &Items, cache_lines: u64) -> u64 {
    let mut uses: Vec<u64> = items.users.iter().map(|users| users.len() as u64).collect();
    uses.sort_unstable_by_key(|&uses| std::cmp::Reverse(uses));
    let all: u64 = uses.iter().sum();
    let most = usize::try_from(2 * cache_lines).unwrap_or(usize::MAX);
    let of_stretch: u64 = uses.iter().take(most).sum();
    let stretches = all.div_ceil(of_stretch.max(1));
    cache_lines * stretches.saturating_sub(1)
}

/// The misses of OPT for the requests of a frame in an order, per configuration. The configurations may differ
/// only in their caches.
///
/// # Errors
/// An impossible configuration, or an unreadable trace.
pub fn opt(
    trace: &dyn TileSource,
    order: Order,
    frame: u32,
    configs: &[RunConfig],
) -> Result<Vec<OptMisses>, ReplayError> {
    let Some(first) = configs.first() else {
        return Ok(Vec::new());
    };
    let rendered = rendered(trace, first)?;
    let expander = Expander::new(&rendered, first)?;
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let mut walk = Walk::new(&expander, &memory, first, [order]);
    let expanded = walk.expand(frame)?;
    let plan = walk.plan(&expanded)?;
    // L2 caches below equal L1 caches receive the same requests, if the order is the same.
    let mut streams: Vec<(u64, Order, Vec<u32>)> = Vec::new();
    let mut misses = Vec::with_capacity(configs.len());
    for config in configs {
        let resolved = order.resolved(config.level.l2.size_bytes);
        let l1_bytes = config.level.l1.size_bytes;
        let known =
            |(bytes, of, _): &&(u64, Order, Vec<u32>)| (*bytes, *of) == (l1_bytes, resolved);
        if streams.iter().find(known).is_none() {
            let config = RunConfig { order, ..*config };
            let stream = l2_stream(&expanded, &plan.phases(&config), &config)?;
            streams.push((l1_bytes, resolved, stream));
        }
        let stream = streams
            .iter()
            .find(known)
            .map_or(&[][..], |(.., stream)| stream);
        misses.push(opt_misses(stream, &config.level.l2, config.line_bytes)?);
    }
    Ok(misses)
}

#[cfg(test)]
mod tests {
    use super::super::items::Lru;
    use super::super::items::tests::accesses;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_order_has_fewer_misses_than_the_window_bound(accesses in accesses(), order in any::<u64>()) {
            let items = Items::new(&accesses);
            let mut permuted: Vec<u32> = (0..items.len() as u32).collect();
            permuted.sort_unstable_by_key(|&item| u64::from(item).wrapping_mul(order | 1));
            for lines in [1, 2, 4, 8] {
                let misses = items.misses(&permuted, &Lru::new(&items, 1, lines));
                prop_assert!(windows(&items, lines.into()) <= misses);
            }
        }
    }

    #[test]
    fn items_without_shared_lines_need_one_window_per_cache_size() {
        let accesses: Vec<Vec<u32>> = (0..10_u32)
            .map(|i| (0..4).map(|n| 4 * i + n).collect())
            .collect();
        // 40 uses with 16 per window need three windows, of which the last may be incomplete.
        assert_eq!(windows(&Items::new(&accesses), 8), 16);
    }
}
