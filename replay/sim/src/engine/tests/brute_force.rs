//! Replays compared with plain lists of lines.

use super::*;

/// LRU sets as plain lists, most recently used last.
struct TwinCache(Vec<Vec<u64>>);

impl TwinCache {
    fn new(config: &LevelConfig) -> Self {
        Self(vec![Vec::new(); config.sets("", 16).unwrap() as usize])
    }

    fn access(&mut self, line: u64) -> bool {
        let index = (line % self.0.len() as u64) as usize;
        let set = &mut self.0[index];
        let hit = set.contains(&line);
        set.retain(|&l| l != line);
        set.push(line);
        if set.len() > 4 {
            set.remove(0);
        }
        hit
    }
}

/// A straightforward single-core replay without tables and shortcuts.
fn twin(trace: &MemoryTrace, config: &RunConfig) -> (LevelCounters, LevelCounters, usize) {
    let (mut c1, mut c2) = (LevelCounters::default(), LevelCounters::default());
    let (mut l1, mut l2) = (
        TwinCache::new(&config.level.l1),
        TwinCache::new(&config.level.l2),
    );
    let mut seen = HashSet::new();
    let layout = Layout::new(&trace.tables.textures, &config.layout).unwrap();
    let phases = plan(trace, config).unwrap();
    for item in phases.iter().flatten() {
        let WorkItem::Tile(at) = item else {
            panic!("single-view orders only")
        };
        let tile = &trace.tiles[at.pass as usize][at.tile as usize];
        for run in &tile.runs {
            let records = &tile.records[run.first as usize..][..run.count as usize];
            for (record, operands) in with_operands(records) {
                record_footprints(
                    &trace.tables,
                    run.draw,
                    record,
                    operands,
                    &config.sampling,
                    |sample, f| {
                        let mut lines: Vec<u64> = Vec::new();
                        for texel in f.texels() {
                            let at = layout.address(
                                sample.texture,
                                f.layer.into(),
                                f.level.into(),
                                texel,
                            );
                            let line = at.unwrap() / 16;
                            if !lines.contains(&line) {
                                lines.push(line);
                            }
                        }
                        seen.extend(lines.iter().copied());
                        c1.footprints += 1;
                        c1.line_lookups += lines.len() as u64;
                        let missing: Vec<u64> =
                            lines.into_iter().filter(|&l| !l1.access(l)).collect();
                        let misses = missing.iter().filter(|&&l| !l2.access(l)).count() as u64;
                        c1.footprint_misses += u64::from(!missing.is_empty());
                        c1.line_misses += missing.len() as u64;
                        c2.footprints += u64::from(!missing.is_empty());
                        c2.line_lookups += missing.len() as u64;
                        c2.line_misses += misses;
                        c2.footprint_misses += u64::from(misses > 0);
                    },
                );
            }
        }
    }
    (c1, c2, seen.len())
}

#[test]
fn one_core_equals_a_brute_force_replay() {
    let trace = small();
    for order in [Order::SCANLINE, Order::HILBERT, Order::RANDOM] {
        let config = RunConfig {
            cores: 1,
            ..functional(order)
        };
        let result = replay(&trace, &config).unwrap();
        let (l1, l2, unique) = twin(&trace, &config);
        assert_eq!(result.l1.counters, l1);
        assert_eq!(result.l2.counters, l2);
        assert_eq!(result.unique_lines, unique as u64);
        assert!(
            l2.line_misses > unique as u64,
            "the caches are too large to test anything"
        );
    }
}

#[test]
fn several_cores_equal_brute_force_caches_on_the_recorded_stream() {
    let trace = small();
    for assign in [Assign::FirstIdle, Assign::Static] {
        for order in Order::all() {
            let config = RunConfig {
                assign,
                cores: 3,
                ..functional(order)
            };
            let sent = sent(&trace, &config);
            let mut l1: Vec<TwinCache> = (0..3).map(|_| TwinCache::new(&config.level.l1)).collect();
            let mut l2 = TwinCache::new(&config.level.l2);
            let (mut l1_lines, mut l2_lines) = (0, 0);
            for (core, _, lines) in &sent {
                for &line in lines {
                    if !l1[*core].access(line.into()) {
                        l1_lines += 1;
                        l2_lines += u64::from(!l2.access(line.into()));
                    }
                }
            }
            let result = replay(&trace, &config).unwrap();
            assert_eq!(sent.len() as u64, result.footprints);
            assert_eq!(
                (
                    result.l1.counters.line_misses,
                    result.l2.counters.line_misses
                ),
                (l1_lines, l2_lines)
            );
        }
    }
}

#[test]
fn caches_accept_lines_outside_a_trace() {
    let config = functional(Order::MORTON);
    let bins = Bins::new(&testing::tables(&[[64, 64]]), CountBy::Texture).unwrap();
    let hierarchy = Hierarchy::build(&config).unwrap();
    let mut caches = Functional::new(hierarchy, CacheCounts::new(&bins, false));
    let (mut l1, mut l2) = (
        TwinCache::new(&config.level.l1),
        TwinCache::new(&config.level.l2),
    );
    let (mut l1_lines, mut l2_lines) = (0, 0);
    for step in 0..10_000_u64 {
        let line = step * step % 1009 + step % 7;
        let tile = testing::tile_lines(&[&[&[line as u32]]]);
        caches.quad(0, tile.quad(0));
        if !l1.access(line) {
            l1_lines += 1;
            l2_lines += u64::from(!l2.access(line));
        }
    }
    let counted = caches.outcome(&config).counts.cells[0];
    assert_eq!((counted.l1.lines, counted.l2.lines), (l1_lines, l2_lines));
    assert!(l1_lines > l2_lines && l2_lines > 1009);
}
