//! The counts of a replay.

use super::*;

#[test]
fn every_order_and_mode_replays_the_same_accesses() {
    let trace = small();
    let conserved = |mode, assign, order| {
        let config = RunConfig {
            mode,
            assign,
            ..functional(order)
        };
        let r = replay(&trace, &config).unwrap();
        (
            r.access_hash,
            r.unique_lines,
            r.footprints,
            r.l1.counters.line_lookups,
            r.quads,
            r.lanes,
        )
    };
    let expected = conserved(Mode::Functional, Assign::Static, Order::SCANLINE);
    for order in Order::all() {
        for mode in [Mode::Functional, Mode::Timed] {
            for assign in [Assign::Static, Assign::FirstIdle] {
                assert_eq!(
                    conserved(mode, assign, order),
                    expected,
                    "{} {mode:?}",
                    order.name()
                );
            }
        }
    }
}

#[test]
fn the_access_hash_sees_a_single_changed_access() {
    let mut trace = small();
    let config = functional(Order::MORTON);
    let before = replay(&trace, &config).unwrap().access_hash;
    let tile = trace.tiles[0]
        .iter_mut()
        .find(|t| !t.records.is_empty())
        .unwrap();
    tile.records[0].uv[0] += 64 * formats::textrace::SUBTEXELS;
    assert_ne!(replay(&trace, &config).unwrap().access_hash, before);
}

#[test]
fn parts_add_up_to_the_whole() {
    let trace = small();
    for mode in [Mode::Functional, Mode::Timed] {
        let config = RunConfig {
            mode,
            tile_maps: true,
            ..functional(Order::Z2_LRTA)
        };
        let r = replay(&trace, &config).unwrap();
        for parts in [&r.by_view, &r.by_texture, &r.by_level] {
            let mut sum = (LevelCounters::default(), LevelCounters::default());
            for part in parts {
                sum.0.add(&part.l1);
                sum.1.add(&part.l2);
            }
            assert_eq!(sum, (r.l1.counters, r.l2.counters));
        }
        let total = |pick: &dyn Fn(&crate::result::TileMap) -> &Vec<u32>| -> u64 {
            r.tile_maps
                .iter()
                .flat_map(|m| pick(m).iter().map(|&n| u64::from(n)))
                .sum()
        };
        assert_eq!(total(&|m| &m.footprints), r.footprints);
        assert_eq!(total(&|m| &m.l1_misses), r.l1.counters.footprint_misses);
        assert_eq!(total(&|m| &m.l2_misses), r.l2.counters.line_misses);
    }
}

#[test]
fn tile_overdraw_counts_pixels_inside_the_image_only() {
    let trace = Synthetic::one_layer([40, 40], 40).generate();
    let config = RunConfig {
        tile_maps: true,
        ..functional(Order::MORTON)
    };
    let result = replay(&trace, &config).unwrap();
    let left = &result.tile_maps[0];
    assert_eq!(left.tiles, [3, 3]);
    // One layer of patches covers the left eye's image and the parts of cut tiles beyond it.
    assert!(
        left.overdraw[..2].iter().all(|&o| o == 1.0),
        "{:?}",
        left.overdraw
    );
}

#[test]
fn a_trace_without_textures_has_no_footprints() {
    let mut trace = small();
    trace.tables.textures.clear();
    trace.tables.draws.iter_mut().for_each(|d| d.groups.clear());
    for mode in [Mode::Functional, Mode::Timed] {
        let result = replay(
            &trace,
            &RunConfig {
                mode,
                ..RunConfig::default()
            },
        )
        .unwrap();
        assert_eq!((result.footprints, result.l1.footprint_miss_rate), (0, 0.0));
        assert!(result.quads > 0);
    }
}

#[test]
fn unique_lines_do_not_depend_on_the_caches() {
    let trace = small();
    let touched = LineSet::new(1 << 24);
    let sent = sent(&trace, &functional(Order::SCANLINE));
    let lines = sent.iter().flat_map(|(.., lines)| lines);
    lines.for_each(|&line| touched.insert(line));
    assert!(touched.count() > 0);
    for mode in [Mode::Functional, Mode::Timed] {
        for l1 in [64, 1 << 10, 1 << 20] {
            let config = RunConfig {
                mode,
                level: Levels::two(LevelConfig::lru(l1), LevelConfig::lru(8 << 10)),
                ..functional(Order::Z2_STA)
            };
            let result = replay(&trace, &config).unwrap();
            assert_eq!(result.unique_lines, touched.count());
        }
    }
}

/// Each material of the trace has its own textures, so counts by draw are sums of counts by texture.
#[test]
fn counts_by_draw_equal_those_of_its_textures() {
    let trace = small();
    for time in [AT_ONCE, LOOPING, FIRST_MISS] {
        let config = in_time(time, functional(Order::Z2_STA));
        let by_texture = replay(&trace, &config).unwrap();
        let by_draw = RunConfig {
            count_by: CountBy::Draw,
            ..config
        };
        let mut by_draw = replay(&trace, &by_draw).unwrap();
        let parts = std::mem::take(&mut by_draw.by_draw);
        assert_eq!(parts.len(), trace.tables.draws.len());
        assert!(by_draw.by_texture.is_empty() && by_draw.by_level.is_empty());
        by_draw.by_texture.clone_from(&by_texture.by_texture);
        by_draw.by_level.clone_from(&by_texture.by_level);
        assert_eq!(by_draw, by_texture, "{time:?}");
        let textures_of = |draw: &formats::textrace::Draw| {
            let samples = draw.groups.iter().flat_map(|group| &group.samples);
            samples
                .map(|sample| sample.texture)
                .collect::<HashSet<u32>>()
        };
        let mut by_textures: HashMap<Vec<u32>, [LevelCounters; 2]> = HashMap::new();
        for (draw, part) in trace.tables.draws.iter().zip(&parts) {
            let mut textures: Vec<u32> = textures_of(draw).into_iter().collect();
            textures.sort_unstable();
            let [l1, l2] = by_textures.entry(textures).or_default();
            l1.add(&part.l1);
            l2.add(&part.l2);
        }
        assert!(by_textures.len() > 1);
        for (textures, levels) in by_textures {
            let mut expected = [LevelCounters::default(); 2];
            for texture in textures {
                let part = &by_texture.by_texture[texture as usize];
                expected[0].add(&part.l1);
                expected[1].add(&part.l2);
            }
            // A footprint counts once per draw, and so does a look-up of a line shared by several of its textures.
            assert_eq!(levels, expected, "{time:?}");
        }
    }
}
