//! The offline greedy order, with full or limited look-ahead.

use super::items::{Items, Lru, NONE};

/// Added to the number of an item's lines, so that the smallest of several small items does not always come
/// first.
const LINES_MORE: u64 = 8;

/// Always takes the item with the largest share of its lines in the cache. If shares are equal, the first item
/// in `start` wins, so the order begins there. Considers only the first `ahead` remaining items.
pub fn greedy(items: &Items, cache: &Lru, start: &[u32], ahead: usize) -> Vec<u32> {
    let mut state = cache.empty();
    // Number of lines of each item in the cache.
    let mut held = vec![0_u32; items.len()];
    let mut left: Vec<u32> = start.to_vec();
    let mut order = Vec::with_capacity(left.len());
    while !left.is_empty() {
        // Compares shares without division: a/b < c/d if a*d < c*b.
        let mut best = 0;
        for at in 1..left.len().min(ahead) {
            let share = |at: usize| {
                let item = left[at] as usize;
                let lines = items.lines[item].len() as u64;
                // Items without lines cost nothing, so they come first.
                match lines {
                    0 => (1, 0),
                    lines => (u64::from(held[item]), lines + LINES_MORE),
                }
            };
            let ((a, b), (c, d)) = (share(best), share(at));
            if a * d < c * b {
                best = at;
            }
        }
        let item = left.remove(best);
        order.push(item);
        for &line in &items.lines[item as usize] {
            let Some(evicted) = cache.access(line, &mut state) else {
                continue;
            };
            if evicted != NONE {
                for &user in &items.users[evicted as usize] {
                    held[user as usize] -= 1;
                }
            }
            for &user in &items.users[line as usize] {
                held[user as usize] += 1;
            }
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::super::items::tests::accesses;
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn items_with_lines_in_the_cache_come_first() {
        // Items 0 and 3 have the same lines, and so do items 1 and 2. The cache holds the lines of one item.
        let set = |first: u32| (first..first + 4).collect::<Vec<u32>>();
        let items = Items::new(&[set(0), set(8), set(8), set(0), vec![]]);
        let cache = Lru::new(&items, 1, 4);
        let order = greedy(&items, &cache, &[0, 1, 2, 3, 4], usize::MAX);
        // Item 4 has no lines and costs nothing.
        assert_eq!(order, [4, 0, 3, 1, 2]);
        assert_eq!(items.misses(&order, &cache), items.distinct_lines());
        // Without look-ahead the order stays as it is. With two items, the item in the cache is too far ahead.
        assert_eq!(greedy(&items, &cache, &[0, 1, 2, 3, 4], 1), [0, 1, 2, 3, 4]);
        assert_eq!(greedy(&items, &cache, &[0, 1, 2, 3, 4], 2), [0, 1, 2, 4, 3]);
    }

    proptest! {
        #[test]
        fn greedy_orders_are_permutations(accesses in accesses(), ahead in 1_usize..30) {
            let items = Items::new(&accesses);
            let start: Vec<u32> = (0..items.len() as u32).collect();
            let mut order = greedy(&items, &Lru::new(&items, 2, 2), &start, ahead);
            order.sort_unstable();
            prop_assert_eq!(order, start);
        }
    }
}
