//! Cache misses between the traversal units and memory.
//!
//! If the trace lists the visited addresses, they are simulated in set-associative LRU caches in the order
//! in which rays are traced. Otherwise, configured hit rates apply.

use super::config::{HitRates, SgrtConfig};
use super::order_rules::Count;
use super::work::{BatchWork, RayClass};
use formats::raytrace::{BvhSummary, Visit};
use sim::config::{BetweenFrames, RunConfig};
use sim::memory::{AnyCache, Cache, Caches, Found, Hierarchy, MissPath, OtherWork};

/// Misses of a batch. Traffic depends on lines. Time depends on visits, because a visit requests all lines
/// of its node or triangle at once and waits for the last one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Misses {
    /// Lines that missed in an L1.
    pub l1_lines: f64,
    /// Lines of these that missed in the L2.
    pub l2_lines: f64,
    /// Visits that waited for a line from the L2 or from memory.
    pub l1_visits: f64,
    /// Visits of these that waited for a line from memory.
    pub l2_visits: f64,
}

impl Misses {
    /// Adds another batch's misses.
    pub fn add(&mut self, other: &Self) {
        formats::add_fields!(self, other, l1_lines, l2_lines, l1_visits, l2_visits);
    }

    /// Bytes fetched by the L2.
    pub(super) fn dram_bytes(&self, line_bytes: u64) -> f64 {
        self.l2_lines * line_bytes as f64
    }
}

/// Mean number of lines that a record touches, for records stored consecutively. A record of `b` bytes
/// starts at a multiple of `g = gcd(b, line)`, all multiples equally often, and touches `1 + (b - g) /
/// line` lines on average.
fn lines_per_record(record_bytes: u32, line_bytes: u64) -> f64 {
    let bytes = u64::from(record_bytes).max(1);
    let (mut divisor, mut rest) = (bytes, line_bytes);
    while rest > 0 {
        (divisor, rest) = (rest, divisor % rest);
    }
    1.0 + (bytes - divisor) as f64 / line_bytes as f64
}

/// Misses of a batch by the configured hit rates, which apply per visit: all lines of a visit hit, or all
/// miss. Re-tests count as primary accesses.
pub(super) fn by_rates(work: &BatchWork, bvh: &BvhSummary, config: &SgrtConfig) -> Misses {
    let cache = &config.cache;
    let rate = |rates: &HitRates, class: RayClass| match class {
        RayClass::Primary => rates.primary,
        RayClass::Shadow => rates.shadow,
        RayClass::Secondary => rates.secondary,
    };
    let node_lines = lines_per_record(bvh.bytes_per_node, cache.line_bytes);
    let triangle_lines = lines_per_record(bvh.bytes_per_triangle, cache.line_bytes);
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
        let lines = nodes * node_lines + triangles * triangle_lines;
        misses.add(&Misses {
            l1_lines: lines,
            l2_lines: lines * past_l2,
            l1_visits: nodes + triangles,
            l2_visits: (nodes + triangles) * past_l2,
        });
    }
    misses
}

pub(super) fn lru(bytes: u64, ways: u32, line_bytes: u64) -> Box<dyn Cache> {
    let sets = bytes / (u64::from(ways) * line_bytes);
    AnyCache::lru(sets as u32, ways).into_box()
}

/// The caches of the whole device, simulated by addresses.
pub(super) struct DeviceCaches {
    /// Per unit, the node cache and then the triangle cache.
    caches: Hierarchy<Box<dyn Cache>>,
    units: usize,
    line_bytes: u64,
    /// The tile that [`Self::visit`] counts for.
    pub tile: u32,
    /// By tile, both eyes together; empty if they are not counted.
    counted: Vec<Count>,
}

impl DeviceCaches {
    /// Limit for the lines of nodes and triangles.
    pub const MOST_LINES: u64 = u32::MAX as u64;

    /// Empty caches.
    pub fn new(config: &SgrtConfig) -> Self {
        let c = &config.cache;
        let units = config.tni.units as usize;
        let of_unit = |_| [c.node_l1_bytes, c.triangle_l1_bytes];
        let l1 = (0..units).flat_map(of_unit);
        let caches = Caches {
            l1: l1
                .map(|bytes| lru(bytes, c.l1_ways, c.line_bytes))
                .collect(),
            l2: vec![lru(c.l2_bytes, c.l2_ways, c.line_bytes)],
        };
        Self {
            caches: Hierarchy::new(caches, MissPath::memory_alone()),
            units,
            line_bytes: c.line_bytes,
            tile: 0,
            counted: Vec::new(),
        }
    }

    /// Counts lines by tile from now on.
    pub fn count(&mut self, tiles: u32) {
        self.counted = vec![Count::default(); tiles as usize];
    }

    /// Ends counting.
    pub fn take_counted(&mut self) -> Vec<Count> {
        std::mem::take(&mut self.counted)
    }

    /// Applies what happens to the caches before the frame with this index.
    pub fn between_frames(&mut self, between: BetweenFrames, frame: usize, config: &SgrtConfig) {
        match between {
            BetweenFrames::Keep => {}
            BetweenFrames::Flush => self.caches.clear(),
            BetweenFrames::Lose(percent) => {
                let mut machine = RunConfig::default();
                machine.level.l2.size_bytes = config.cache.l2_bytes;
                machine.line_bytes = config.cache.line_bytes as u32;
                self.caches.lose(OtherWork::after(frame, percent, &machine));
            }
        }
    }

    /// Performs the reads of a visit by a ray on `unit`, and counts the misses. The hierarchy has at most
    /// [`Self::MOST_LINES`] lines.
    pub fn visit(&mut self, unit: usize, visit: Visit, bvh: &BvhSummary, misses: &mut Misses) {
        let first = bvh.address(visit);
        let last = first + u64::from(bvh.visit_bytes(visit)).max(1) - 1;
        let cache = 2 * (unit % self.units) + usize::from(matches!(visit, Visit::Triangle(_)));
        let before = *misses;
        for line in first / self.line_bytes..=last / self.line_bytes {
            let found = self.caches.access(cache, line as u32);
            if let Some(count) = self.counted.get_mut(self.tile as usize) {
                count.read += 1;
                count.fetched += u64::from(matches!(found, Found::Below));
            }
            match found {
                Found::L1 => {}
                Found::L2 => misses.l1_lines += 1.0,
                Found::Below => {
                    misses.l1_lines += 1.0;
                    misses.l2_lines += 1.0;
                }
            }
        }
        misses.l1_visits += f64::from(misses.l1_lines > before.l1_lines);
        misses.l2_visits += f64::from(misses.l2_lines > before.l2_lines);
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::bvh;
    use super::*;

    #[test]
    fn the_first_touch_of_every_line_misses_and_the_second_hits() {
        let mut caches = DeviceCaches::new(&SgrtConfig::default());
        let mut misses = Misses::default();
        for _ in 0..2 {
            for node in 0..64 {
                caches.visit(0, Visit::Node(node), &bvh(), &mut misses);
            }
        }
        let lines = 64.0 * f64::from(bvh().bytes_per_node) / 64.0;
        assert_eq!((misses.l1_lines, misses.l2_lines), (lines, lines));
        assert_eq!(misses.dram_bytes(64), lines * 64.0);
    }

    /// With caches too small for any reuse, hit rates of 0 must give the counts of addresses.
    #[test]
    fn rates_and_addresses_count_lines_and_visits_equally() {
        for (node_bytes, triangle_bytes) in [(64, 48), (256, 48), (80, 36), (32, 64), (100, 7)] {
            let bvh = BvhSummary {
                bytes_per_node: node_bytes,
                bytes_per_triangle: triangle_bytes,
                nodes: 1024,
                ..bvh()
            };
            let mut config = SgrtConfig::default();
            config.tni.units = 1;
            let c = &mut config.cache;
            let lowest = HitRates {
                primary: 0.0,
                shadow: 0.0,
                secondary: 0.0,
            };
            c.node_l1_hit_rate = lowest;
            c.triangle_l1_hit_rate = lowest;
            c.l2_hit_rate = lowest;
            (c.node_l1_bytes, c.triangle_l1_bytes, c.l2_bytes) = (64, 64, 64);
            (c.l1_ways, c.l2_ways) = (1, 1);
            let mut caches = DeviceCaches::new(&config);
            let mut found = Misses::default();
            // 389 is coprime to 1024, and consecutive visits share no line.
            let spread = (0..1024).map(|at| at * 389 % 1024);
            for index in spread {
                caches.visit(0, Visit::Node(index), &bvh, &mut found);
                caches.visit(0, Visit::Triangle(index), &bvh, &mut found);
            }
            let mut work = BatchWork::default();
            work.by_class[0].steps = 1024;
            work.by_class[0].triangle_tests = 1024;
            assert_eq!(by_rates(&work, &bvh, &config), found, "{node_bytes} bytes");
        }
    }

    #[test]
    fn a_loop_larger_than_an_lru_cache_always_misses_it() {
        let mut cache = lru(64 * 8, 8, 64);
        let hits = (0..90).filter(|i| cache.access(i % 9)).count();
        assert_eq!(hits, 0);
        let hits = (0..90).filter(|i| cache.access(100 + i % 8)).count();
        assert_eq!(hits, 82);
    }

    #[test]
    fn units_share_the_l2_but_not_the_l1() {
        let mut caches = DeviceCaches::new(&SgrtConfig::default());
        let mut misses = Misses::default();
        caches.visit(0, Visit::Node(5), &bvh(), &mut misses);
        caches.visit(1, Visit::Node(5), &bvh(), &mut misses);
        assert_eq!((misses.l1_lines, misses.l2_lines), (2.0, 1.0));
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
