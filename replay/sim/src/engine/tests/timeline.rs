//! Tests the record of the tiles that each core works on over time.

use super::*;
use crate::config::Assign;
use crate::result::{Timeline, TimelineItem};

#[test]
fn items_cover_each_core_and_every_tile_once() {
    let trace = small();
    for (order, assign, cores) in [
        (Order::MORTON, Assign::FirstIdle, 2),
        (Order::Z2_STA, Assign::FirstIdle, 3),
        (Order::Z2_LRTA, Assign::Static, 2),
        (Order::RANDOM, Assign::FirstIdle, 1),
    ] {
        let config = RunConfig {
            mode: Mode::Timed,
            assign,
            cores,
            ..functional(order)
        };
        let without = replay(&trace, &config).unwrap();
        let timeline = true;
        let mut with = replay(&trace, &RunConfig { timeline, ..config }).unwrap();
        let timeline: Timeline = with.timeline.take().unwrap();
        assert_eq!(with, without, "{order:?}");
        let cycles = with.cycles.unwrap();

        let mut tiles: Vec<(u32, u32)> = (timeline.items.iter())
            .flat_map(|item| item.tiles.iter().map(|at| (at.pass, at.tile)))
            .collect();
        tiles.sort_unstable();
        let passes = (0..).zip(&trace.tables.passes);
        let all: Vec<(u32, u32)> = passes
            .flat_map(|(pass, p)| (0..p.tile_count()).map(move |tile| (pass, tile)))
            .collect();
        assert_eq!(tiles, all, "{order:?}");

        let mut last = 0;
        for core in 0..cores {
            let of_core = |item: &&TimelineItem| item.core == core;
            let items: Vec<&TimelineItem> = timeline.items.iter().filter(of_core).collect();
            assert_eq!(items[0].start_cycle, 0, "{order:?}");
            for pair in items.windows(2) {
                assert_eq!(pair[0].end_cycle, pair[1].start_cycle, "{order:?}");
            }
            last = last.max(items[items.len() - 1].end_cycle);
        }
        assert_eq!(last, cycles, "{order:?}");

        let useful: u64 = timeline.items.iter().map(|item| item.useful_cycles).sum();
        assert_eq!(useful, with.footprints, "{order:?}");
        let fetched: u64 = timeline.fetched_lines.iter().map(|&n| u64::from(n)).sum();
        assert_eq!(fetched, with.l2.counters.line_misses, "{order:?}");
        let intervals = timeline.fetched_lines.len() as u64;
        assert!(intervals <= cycles / Timeline::INTERVAL_CYCLES + 1);
    }
}
