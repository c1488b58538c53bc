//! Caches between the traversal units and memory: how many accesses of a batch miss.
//!
//! Where the trace lists the visited addresses, they run through set-associative LRU caches in the
//! order that the rays are traced; else stated hit rates decide.

use super::config::{HitRates, SgrtConfig};
use super::work::{BatchWork, RayClass};
use crate::cache::{self, AnyWays};
use formats::raytrace::{BvhSummary, Visit};

/// Misses of a batch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Misses {
    /// Look-ups that missed an L1.
    pub l1: f64,
    /// Of those, look-ups that missed the L2.
    pub l2: f64,
    /// Bytes that the L2 fetched.
    pub dram_bytes: f64,
}

impl Misses {
    /// Adds another batch's misses.
    pub fn add(&mut self, other: &Self) {
        self.l1 += other.l1;
        self.l2 += other.l2;
        self.dram_bytes += other.dram_bytes;
    }
}

/// Misses of a batch by the stated hit rates. Re-tests count as primary accesses.
#[must_use]
pub fn by_rates(work: &BatchWork, bvh: &BvhSummary, config: &SgrtConfig) -> Misses {
    let cache = &config.cache;
    let rate = |rates: &HitRates, class: RayClass| match class {
        RayClass::Primary => rates.primary,
        RayClass::Shadow => rates.shadow,
        RayClass::Secondary => rates.secondary,
    };
    let fill_bytes = |bytes: u32| {
        let lines = u64::from(bytes).div_ceil(cache.line_bytes).max(1);
        (lines * cache.line_bytes) as f64
    };
    let (node_bytes, triangle_bytes) = (
        fill_bytes(bvh.bytes_per_node),
        fill_bytes(bvh.bytes_per_triangle),
    );
    let mut misses = Misses::default();
    for class in RayClass::ALL {
        let w = &work.by_class[class as usize];
        let retests = if class == RayClass::Primary {
            work.retest_tests
        } else {
            0
        };
        let nodes = w.steps as f64 * (1.0 - rate(&cache.node_l1_hit_rate, class));
        let triangles =
            (w.triangle_tests + retests) as f64 * (1.0 - rate(&cache.triangle_l1_hit_rate, class));
        let past_l2 = 1.0 - rate(&cache.l2_hit_rate, class);
        misses.add(&Misses {
            l1: nodes + triangles,
            l2: (nodes + triangles) * past_l2,
            dram_bytes: (nodes * node_bytes + triangles * triangle_bytes) * past_l2,
        });
    }
    misses
}

/// Node and triangle addresses may need more than 32 bits of line number.
type Lru = cache::Lru<AnyWays, u64>;

fn lru(bytes: u64, ways: u32, line_bytes: u64) -> Lru {
    let sets = bytes / (u64::from(ways) * line_bytes);
    Lru::new(sets as u32, AnyWays(ways as usize))
}

/// The caches of the whole device, fed with addresses.
#[derive(Clone, Debug)]
pub struct Hierarchy {
    nodes: Vec<Lru>,
    triangles: Vec<Lru>,
    l2: Lru,
    line_bytes: u64,
}

impl Hierarchy {
    /// Empty caches.
    #[must_use]
    pub fn new(config: &SgrtConfig) -> Self {
        let c = &config.cache;
        let units = config.tni.units as usize;
        Self {
            nodes: vec![lru(c.node_l1_bytes, c.l1_ways, c.line_bytes); units],
            triangles: vec![lru(c.triangle_l1_bytes, c.l1_ways, c.line_bytes); units],
            l2: lru(c.l2_bytes, c.l2_ways, c.line_bytes),
            line_bytes: c.line_bytes,
        }
    }

    /// Reads what a visit of a ray on `unit` reads and counts what misses.
    pub fn visit(&mut self, unit: usize, visit: Visit, bvh: &BvhSummary, misses: &mut Misses) {
        let first = bvh.address(visit);
        let last = first + u64::from(bvh.visit_bytes(visit)).max(1) - 1;
        let unit = unit % self.nodes.len();
        for line in first / self.line_bytes..=last / self.line_bytes {
            let l1 = match visit {
                Visit::Node(_) => &mut self.nodes[unit],
                Visit::Triangle(_) => &mut self.triangles[unit],
            };
            if l1.access(line) {
                continue;
            }
            misses.l1 += 1.0;
            if !self.l2.access(line) {
                misses.l2 += 1.0;
                misses.dram_bytes += self.line_bytes as f64;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::bvh;
    use super::*;

    #[test]
    fn the_first_touch_of_every_line_misses_and_the_second_hits() {
        let mut caches = Hierarchy::new(&SgrtConfig::default());
        let mut misses = Misses::default();
        for _ in 0..2 {
            for node in 0..64 {
                caches.visit(0, Visit::Node(node), &bvh(), &mut misses);
            }
        }
        let lines = 64.0 * f64::from(bvh().bytes_per_node) / 64.0;
        assert_eq!((misses.l1, misses.l2), (lines, lines));
        assert_eq!(misses.dram_bytes, lines * 64.0);
    }

    #[test]
    fn a_loop_larger_than_an_lru_cache_always_misses_it() {
        let mut cache = lru(64 * 8, 8, 64);
        let hits = (0..90u64).filter(|i| cache.access(i % 9)).count();
        assert_eq!(hits, 0);
        let hits = (0..90u64).filter(|i| cache.access(100 + i % 8)).count();
        assert_eq!(hits, 82);
    }

    #[test]
    fn units_share_the_l2_but_not_the_l1() {
        let mut caches = Hierarchy::new(&SgrtConfig::default());
        let mut misses = Misses::default();
        caches.visit(0, Visit::Node(5), &bvh(), &mut misses);
        caches.visit(1, Visit::Node(5), &bvh(), &mut misses);
        assert_eq!((misses.l1, misses.l2), (2.0, 1.0));
    }

    #[test]
    fn perfect_hit_rates_leave_nothing_to_fetch() {
        let mut config = SgrtConfig::default();
        let perfect = HitRates {
            primary: 1.0,
            shadow: 1.0,
            secondary: 1.0,
        };
        config.cache.node_l1_hit_rate = perfect;
        config.cache.triangle_l1_hit_rate = perfect;
        let mut work = BatchWork::default();
        work.by_class[2].steps = 1000;
        work.retest_tests = 7;
        assert_eq!(by_rates(&work, &bvh(), &config), Misses::default());
    }
}
