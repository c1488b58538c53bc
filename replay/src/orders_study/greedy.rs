//! The offline greedy order: always the item of which the cache holds the largest share; and what is left of it with a
//! short look-ahead.

use super::items::{Items, Lru, NONE};

/// Added to an item's lines, so that among small items not the smallest is always first.
const LINES_MORE: u64 = 8;

/// The order that takes next what has the largest share of its lines in the cache; of equals, what comes first in `start`,
/// which also says where it begins. Of the items that are left only the first `ahead` are looked at.
#[must_use]
pub fn greedy(items: &Items, cache: &Lru, start: &[u32], ahead: usize) -> Vec<u32> {
    let mut state = cache.empty();
    // Lines of each item that the cache holds.
    let mut held = vec![0_u32; items.len()];
    let mut left: Vec<u32> = start.to_vec();
    let mut order = Vec::with_capacity(left.len());
    while !left.is_empty() {
        // The largest share without division: a/b < c/d if a*d < c*b.
        let mut best = 0;
        for at in 1..left.len().min(ahead) {
            let share = |at: usize| {
                let item = left[at] as usize;
                let lines = items.lines[item].len() as u64;
                // Items without lines are free, and out of the way.
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
    fn what_is_in_the_cache_comes_before_what_is_not() {
        // Items 0 and 3 share their lines, so do 1 and 2; the cache holds one item's.
        let set = |first: u32| (first..first + 4).collect::<Vec<u32>>();
        let items = Items::new(&[set(0), set(8), set(8), set(0), vec![]]);
        let cache = Lru::new(&items, 1, 4);
        let order = greedy(&items, &cache, &[0, 1, 2, 3, 4], usize::MAX);
        // What has no lines costs nothing.
        assert_eq!(order, [4, 0, 3, 1, 2]);
        assert_eq!(items.misses(&order, &cache), items.distinct_lines());
        // Without a look-ahead it is the start, with one of two items what is in the cache is too far away.
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
