//! Counts of reuse distances: the distinct other lines used between two uses of a line (LRU stack distance,
//! Mattson et al. 1970). A fully associative LRU cache of `n` lines hits at distances below `n`.

use crate::place::{ByOrigin, Origin, add};
use crate::set_associative::CacheHits;

/// Reuses by distance and by location of the previous use.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Distances(Vec<ByOrigin>);

/// Reuses at the distances of a bin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DistanceBin {
    /// First distance.
    pub from: u64,
    /// Last distance.
    pub to: u64,
    /// Reuses by location of the previous use.
    pub reuses: ByOrigin,
}

impl Distances {
    #[inline(always)]
    pub(crate) fn count(&mut self, distance: u32, origin: usize, times: u64) {
        let distance = distance as usize;
        if distance >= self.0.len() {
            self.0.resize(distance + 1, ByOrigin::default());
        }
        self.0[distance][origin] += times;
    }

    /// Adds the counts of another stream.
    pub(crate) fn add(&mut self, other: &Self) {
        if self.0.len() < other.0.len() {
            self.0.resize(other.0.len(), ByOrigin::default());
        }
        for (to, from) in self.0.iter_mut().zip(&other.0) {
            add(to, from);
        }
    }

    /// All reuses.
    pub(crate) fn total(&self) -> ByOrigin {
        self.below(self.0.len())
    }

    fn below(&self, distance: usize) -> ByOrigin {
        let mut sum = ByOrigin::default();
        for reuses in self.0.iter().take(distance) {
            add(&mut sum, reuses);
        }
        sum
    }

    /// Hits of a fully associative LRU cache.
    pub fn hits(&self, lines: u64) -> ByOrigin {
        self.below(usize::try_from(lines).unwrap_or(usize::MAX))
    }

    /// Reuses of one class, by distance.
    pub(crate) fn of(&self, origin: Origin) -> impl Iterator<Item = u64> + Clone {
        self.0.iter().map(move |reuses| reuses[origin.index()])
    }

    /// The distances that occur, ascending.
    pub fn iter(&self) -> impl Iterator<Item = (u64, &ByOrigin)> {
        let all = (0..).zip(&self.0);
        all.filter(|(_, reuses)| **reuses != ByOrigin::default())
    }

    /// Distance 0, then 1, 2 to 3, 4 to 7 and so on, up to the largest.
    pub fn bins(&self) -> Vec<DistanceBin> {
        let mut bins = Vec::new();
        let mut from = 0;
        while from < self.0.len() {
            let to = (2 * from).max(1);
            let mut reuses = ByOrigin::default();
            for distance in &self.0[from..to.min(self.0.len())] {
                add(&mut reuses, distance);
            }
            bins.push(DistanceBin {
                from: from as u64,
                to: to as u64 - 1,
                reuses,
            });
            from = to;
        }
        bins
    }

    /// Hits of fully associative LRU caches of these sizes in lines, ascending.
    pub fn curve(&self, sizes: &[u64]) -> Vec<CacheHits> {
        let (mut at, mut hits) = (0, ByOrigin::default());
        let point = |&lines: &u64| {
            let end = usize::try_from(lines).map_or(self.0.len(), |n| n.min(self.0.len()));
            for reuses in self.0.get(at..end).unwrap_or(&[]) {
                add(&mut hits, reuses);
            }
            at = at.max(end);
            CacheHits {
                lines,
                ways: None,
                hits,
            }
        };
        sizes.iter().map(point).collect()
    }

    /// The smallest size in lines with the maximum number of hits.
    pub fn enough_lines(&self) -> u64 {
        self.0.len() as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_double_in_width_and_contain_every_reuse() {
        let mut distances = Distances::default();
        for distance in 0..10 {
            distances.count(distance, (distance % 4) as usize, 2);
        }
        let bins = distances.bins();
        let ranges: Vec<_> = bins.iter().map(|bin| (bin.from, bin.to)).collect();
        assert_eq!(ranges, [(0, 0), (1, 1), (2, 3), (4, 7), (8, 15)]);
        let counts: Vec<u64> = bins.iter().map(|bin| bin.reuses.iter().sum()).collect();
        assert_eq!(counts, [2, 2, 4, 8, 4]);
        assert_eq!(distances.total(), [6, 6, 4, 4]);
    }

    #[test]
    fn each_point_of_a_curve_equals_the_result_for_its_size() {
        let mut distances = Distances::default();
        for (distance, origin) in [(0, 0), (3, 1), (3, 2), (9, 3)] {
            distances.count(distance, origin, 1);
        }
        let sizes = [1, 3, 4, 9, 10, 100];
        for point in distances.curve(&sizes) {
            assert_eq!(point.hits, distances.hits(point.lines), "{}", point.lines);
        }
        assert_eq!(distances.hits(4), [1, 1, 1, 0]);
        assert_eq!(distances.enough_lines(), 10);
    }
}
