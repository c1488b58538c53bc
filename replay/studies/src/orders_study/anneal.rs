//! Simulated annealing of an order. Moves bring items next to items that use the same lines or are neighbours.
//! The change in misses decides about each move.
//!
//! The contents of an LRU cache depend only on recent items. To evaluate a move, the items are replayed from
//! the first changed block to the block at whose end the cache contents equal the former ones.

use super::items::{Items, Lru};
use formats::random::Random;

/// Number of items between two stored states of the cache.
const BLOCK: usize = 32;

/// The maximum range of a move. Larger moves would replay most of the order.
const REACH: usize = 1500;

/// The length and the temperatures of annealing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Schedule {
    /// Number of moves to try.
    pub moves: u64,
    /// At the start, a move that adds this number of misses is accepted with a probability of about one third.
    pub from_misses: f64,
    /// The same at the end.
    pub to_misses: f64,
    /// Seed of the moves.
    pub seed: u64,
}

impl Schedule {
    /// Temperatures chosen on the design cameras of docs/results/orders.md.
    pub fn new(moves: u64, seed: u64) -> Self {
        Self {
            moves,
            from_misses: 30.0,
            to_misses: 1.0,
            seed,
        }
    }
}

/// A reversible change of an order.
#[derive(Clone, Copy, Debug)]
enum Move {
    /// Reverses items.
    Reverse(usize, usize),
    /// Rotates the items from the first place to the last one to the left by a distance.
    Rotate(usize, usize, usize),
    /// Exchanges two ranges with this number of items.
    Swap(usize, usize, usize),
}

impl Move {
    fn apply(self, order: &mut [u32]) {
        match self {
            Self::Reverse(first, end) => order[first..end].reverse(),
            Self::Rotate(first, end, by) => order[first..end].rotate_left(by),
            Self::Swap(a, b, count) => (0..count).for_each(|i| order.swap(a + i, b + i)),
        }
    }

    fn undo(self, order: &mut [u32]) {
        match self {
            Self::Rotate(first, end, by) => order[first..end].rotate_right(by),
            Self::Reverse(..) | Self::Swap(..) => self.apply(order),
        }
    }

    /// The places that it changes, ascending.
    fn changed(self) -> [(usize, usize); 2] {
        match self {
            Self::Reverse(first, end) | Self::Rotate(first, end, _) => [(first, end), (end, end)],
            Self::Swap(a, b, count) => [(a, a + count), (b, b + count)],
        }
    }
}

/// An order and the cache contents along it.
struct Walk<'a> {
    items: &'a Items,
    cache: &'a Lru,
    order: Vec<u32>,
    /// Place by item.
    places: Vec<usize>,
    /// The cache contents at the start of each block and at the end of the last one.
    states: Vec<Vec<u32>>,
    /// Misses of each block.
    misses: Vec<u32>,
    /// The replayed blocks of the current move: index, misses, and the cache contents at their end.
    tried: Vec<(usize, u32, Vec<u32>)>,
}

impl<'a> Walk<'a> {
    fn new(items: &'a Items, cache: &'a Lru, order: Vec<u32>) -> Self {
        let mut places = vec![0; items.len()];
        for (place, &item) in order.iter().enumerate() {
            places[item as usize] = place;
        }
        let mut walk = Self {
            items,
            cache,
            places,
            states: vec![cache.empty()],
            misses: Vec::new(),
            tried: Vec::new(),
            order,
        };
        let mut state = cache.empty();
        for block in 0..walk.order.len().div_ceil(BLOCK) {
            let misses = walk.run(block, &mut state);
            walk.misses.push(misses);
            walk.states.push(state.clone());
        }
        walk
    }

    fn run(&self, block: usize, state: &mut [u32]) -> u32 {
        let end = self.order.len().min((block + 1) * BLOCK);
        let items = self.order[block * BLOCK..end].iter();
        items
            .map(|&item| self.cache.run(self.items, item, state))
            .sum()
    }

    fn total(&self) -> u64 {
        self.misses.iter().map(|&misses| u64::from(misses)).sum()
    }

    /// Replays the blocks that a move changes. Returns the difference in misses, or none as soon as it is known
    /// to exceed `limit`.
    fn judge(&mut self, changed: [(usize, usize); 2], limit: i64) -> Option<i64> {
        let mut tried = std::mem::take(&mut self.tried);
        tried.clear();
        let (mut difference, mut next) = (0, 0);
        let last_end = changed[1].1;
        for (first, end) in changed {
            let mut block = (first / BLOCK).max(next);
            if first == end || end <= next * BLOCK {
                continue;
            }
            let mut state = match tried.last() {
                Some((before, _, state)) if before + 1 == block => state.clone(),
                _ => self.states[block].clone(),
            };
            while block < self.misses.len() {
                let misses = self.run(block, &mut state);
                difference += i64::from(misses) - i64::from(self.misses[block]);
                block += 1;
                let settled = block * BLOCK >= end && state == self.states[block];
                tried.push((block - 1, misses, state.clone()));
                if settled {
                    break;
                }
                // Blocks after the last change may save misses again, but rarely this many.
                if block * BLOCK >= last_end && difference > 2 * limit + 64 {
                    self.tried = tried;
                    return None;
                }
            }
            next = block;
        }
        self.tried = tried;
        Some(difference)
    }

    fn keep(&mut self, changed: [(usize, usize); 2]) {
        for (block, misses, state) in self.tried.drain(..) {
            self.misses[block] = misses;
            self.states[block + 1] = state;
        }
        for (first, end) in changed {
            for place in first..end {
                self.places[self.order[place] as usize] = place;
            }
        }
    }

    /// A move that brings items next to one that uses the same lines or is a neighbour.
    fn draw(
        &self,
        beside: &dyn Fn(u32, usize) -> Option<u32>,
        random: &mut Random,
    ) -> Option<Move> {
        let count = self.order.len();
        let (kind, length) = (random.below(10), 1 << random.below(6));
        let place = random.below(count);
        let item = self.order[place];
        let neighbour = if random.below(2) == 0 {
            beside(item, random.below(4))
        } else {
            None
        };
        let partner = neighbour.or_else(|| {
            let lines = &self.items.lines[item as usize];
            let line = *lines.get(random.below(lines.len().max(1)))?;
            let users = &self.items.users[line as usize];
            users.get(random.below(users.len())).copied()
        })?;
        let other = self.places[partner as usize];
        if place.abs_diff(other) > REACH {
            return None;
        }
        let end = (place + length).min(count);
        match kind {
            0..3 => {
                let (first, end) = if place < other {
                    (place + 1, other + 1)
                } else {
                    (other, place)
                };
                (end > first + 1).then_some(Move::Reverse(first, end))
            }
            3..8 if (place..end).contains(&other) => None,
            3..8 if other > place => Some(Move::Rotate(place, other + 1, end - place)),
            3..8 => {
                Some(Move::Rotate(other + 1, end, place - other - 1)).filter(|_| place > other + 1)
            }
            _ => {
                let (a, b) = (place.min(other + 1), place.max(other + 1));
                let length = length.min(count.saturating_sub(b)).min(b - a);
                (length > 0).then_some(Move::Swap(a, b, length))
            }
        }
    }
}

/// Returns the best order found. `beside` returns the neighbour of an item on a side, if there is one.
pub fn anneal(
    items: &Items,
    cache: &Lru,
    start: Vec<u32>,
    schedule: &Schedule,
    beside: &dyn Fn(u32, usize) -> Option<u32>,
) -> Vec<u32> {
    if start.len() < 2 {
        return start;
    }
    let mut walk = Walk::new(items, cache, start);
    let mut random = Random(schedule.seed);
    let mut total = walk.total() as i64;
    let mut best = (total, walk.order.clone());
    let ratio = schedule.to_misses / schedule.from_misses;
    for step in 0..schedule.moves {
        let done = step as f64 / schedule.moves as f64;
        let temperature = schedule.from_misses * ratio.powf(done);
        let Some(change) = walk.draw(beside, &mut random) else {
            continue;
        };
        let limit = (-temperature * (random.unit_f64() + f64::EPSILON / 2.0).ln()) as i64;
        change.apply(&mut walk.order);
        match walk.judge(change.changed(), limit) {
            Some(difference) if difference <= limit => {
                walk.keep(change.changed());
                total += difference;
                if total < best.0 {
                    best.0 = total;
                    best.1.clone_from(&walk.order);
                }
            }
            _ => change.undo(&mut walk.order),
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::super::items::tests::accesses;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Uses enough items for many blocks. Compares every difference with a replay of the whole order.
        #[test]
        fn judged_moves_have_the_misses_of_a_whole_replay(
            parts in prop::collection::vec(accesses(), 8..12), seed in any::<u64>(),
        ) {
            let items = Items::new(&parts.concat());
            let cache = Lru::new(&items, 2, 3);
            let start: Vec<u32> = (0..items.len() as u32).collect();
            let mut walk = Walk::new(&items, &cache, start.clone());
            let mut random = Random(seed);
            let mut kept = 0;
            for _ in 0..200 {
                let Some(change) = walk.draw(&|item, _| item.checked_sub(1), &mut random) else {
                    continue;
                };
                let before = walk.total() as i64;
                change.apply(&mut walk.order);
                let after = items.misses(&walk.order, &cache) as i64;
                match walk.judge(change.changed(), 3) {
                    Some(difference) => {
                        prop_assert_eq!(difference, after - before);
                        walk.keep(change.changed());
                        prop_assert_eq!(walk.total() as i64, after);
                        kept += 1;
                    }
                    None => change.undo(&mut walk.order),
                }
            }
            prop_assert!(kept > 0 || items.distinct_lines() == 0);
            let mut sorted = walk.order.clone();
            sorted.sort_unstable();
            prop_assert_eq!(sorted, start);
        }
    }

    #[test]
    fn annealing_brings_shared_lines_together_and_is_never_worse_than_its_start() {
        // Items i and i + 32 use the same lines. The cache holds the lines of four items.
        let accesses: Vec<Vec<u32>> = (0..64_u32)
            .map(|i| (0..4).map(|n| i % 32 * 4 + n).collect())
            .collect();
        let items = Items::new(&accesses);
        let cache = Lru::new(&items, 1, 16);
        let start: Vec<u32> = (0..64).collect();
        assert_eq!(items.misses(&start, &cache), 256);
        let annealed = |moves| {
            let schedule = Schedule::new(moves, 1);
            anneal(&items, &cache, start.clone(), &schedule, &|_, _| None)
        };
        let found = annealed(20_000);
        assert!(
            items.misses(&found, &cache) < 160,
            "{}",
            items.misses(&found, &cache)
        );
        assert_eq!(annealed(0), start);
    }
}
