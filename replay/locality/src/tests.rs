//! Compares the analysis with plain twins that use lists, sets and full look-ahead.

mod plain;

use super::*;
use formats::textrace::Pass;
use formats::view::Eye;
use proptest::prelude::*;
use sim::config::{BetweenFrames, LevelConfig, Levels, Mode, Order, Replacement, RunConfig};
use sim::engine::replay;
use sim::stream::MemoryTrace;
use sim::stream::testing::Synthetic;

/// A look-up, with everything known about it.
#[derive(Clone, Copy, Debug)]
struct Access {
    frame: u32,
    place: Place,
    line: u32,
}

/// Streams of items in several frames, some of them pairs whose tiles alternate.
fn streams() -> impl Strategy<Value = Vec<Access>> {
    let line = prop_oneof![4 => 0..12_u32, 2 => 0..60_u32, 1 => 0..4000_u32];
    let eye = prop_oneof![Just(None), Just(Some(Eye::Left)), Just(Some(Eye::Right))];
    let item = (
        proptest::collection::vec((line, any::<bool>()), 1..24),
        any::<bool>(),
        eye,
        prop::bool::weighted(0.15),
    );
    proptest::collection::vec(item, 1..24).prop_map(|items| {
        let (mut stream, mut frame, mut tile) = (Vec::new(), 0, 0);
        for (number, (lines, pair, eye, new_frame)) in (1..).zip(items) {
            frame += u32::from(new_frame);
            for (line, second) in lines {
                let second = pair && second;
                let eye = match (pair, second) {
                    (false, _) => eye,
                    (true, false) => Some(Eye::Left),
                    (true, true) => Some(Eye::Right),
                };
                stream.push(Access {
                    frame,
                    line,
                    place: Place {
                        row: eye.map(|_| (tile + u32::from(second)) % 16 / 4),
                        // Frames show the same tiles again.
                        tile: (tile + u32::from(second)) % 16,
                        eye,
                        item: number,
                        tiles: 1 + u32::from(pair),
                    },
                });
            }
            tile += 1 + u32::from(pair);
        }
        stream
    })
}

fn geometries() -> impl Strategy<Value = LevelConfig> {
    let ways = prop_oneof![Just(1_u32), Just(2), Just(3), Just(4), Just(8)];
    let policy = proptest::sample::select(Replacement::all().collect::<Vec<_>>());
    (0..5_u32, ways, policy)
        .prop_map(|(sets, ways, replacement)| LevelConfig {
            ways: if replacement == Replacement::TREE_PLRU && ways == 3 {
                1
            } else {
                ways
            },
            replacement,
            ..LevelConfig::lru((u64::from(ways) << sets) * 16)
        })
        .prop_filter("sets are powers of two", |cache| {
            cache.sets("L1", 16).is_ok()
        })
}

fn of(cache: &LevelConfig) -> StreamCache {
    StreamCache {
        cache: *cache,
        level: "L1",
        line_bytes: 16,
        seed: 3,
    }
}

/// Analyses a stream on an axis so short that it is renumbered frequently.
fn analysed(stream: &[Access], cache: &LevelConfig) -> Figures {
    let mut profile = Profile::with_axis(of(cache), 64).unwrap();
    let mut frame = None;
    for access in stream {
        if frame.is_some_and(|frame| frame != access.frame) {
            profile.begin_frame();
        }
        frame = Some(access.frame);
        profile.at(&access.place);
        profile.access(access.line);
    }
    profile.finish()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn every_figure_equals_that_of_a_plain_twin(stream in streams(), cache in geometries()) {
        let figures = analysed(&stream, &cache);
        let lines: Vec<u32> = stream.iter().map(|access| access.line).collect();
        let origins = plain::origins(&stream);
        let count = |hits: &[bool]| plain::by_origin(&origins, hits);

        let distances = plain::distances(&lines);
        for (distance, reuses) in figures.distances.iter() {
            let here: Vec<bool> = distances.iter().map(|d| *d == Some(distance)).collect();
            prop_assert_eq!(*reuses, count(&here), "distance {}", distance);
        }
        let reused = distances.iter().flatten().count() as u64;
        prop_assert_eq!(figures.reuses().iter().sum::<u64>(), reused);
        prop_assert_eq!(figures.accesses, lines.len() as u64);
        prop_assert_eq!(figures.unique_lines, figures.accesses - reused);

        let (sets, ways) = (cache.sets("L1", 16).unwrap(), cache.ways);
        for point in &figures.lru {
            let ways = point.ways.unwrap();
            let sets = point.lines as u32 / ways;
            prop_assert_eq!(point.hits, count(&plain::lru(&lines, sets, ways)), "{:?}", point);
        }
        for point in &figures.opt {
            let hits = plain::opt(&lines, 1, point.lines as u32);
            prop_assert_eq!(point.hits, count(&hits), "{:?}", point);
        }
        let opt = plain::opt(&lines, sets, ways);
        prop_assert_eq!(figures.opt_of_geometry, count(&opt));

        let own = plain::policy(&lines, of(&cache));
        let all = plain::lru(&lines, 1, sets * ways);
        let split = plain::split(&origins, &own, &all);
        prop_assert_eq!(figures.split, split);

        prop_assert_eq!(&figures.rows, &plain::rows(&stream));
        let frames: std::collections::HashSet<u32> = stream.iter().map(|a| a.frame).collect();
        prop_assert_eq!(figures.frames, frames.len() as u64);
        let sets = plain::working_sets(&stream);
        prop_assert_eq!(&figures.working_sets, &sets);
        prop_assert_eq!(
            [
                figures.frame_lines,
                figures.frame_lines_of_both_eyes,
                figures.frame_lines_of_earlier_frames,
            ],
            plain::frame_lines(&stream)
        );
    }

    #[test]
    fn sums_and_bounds_hold(stream in streams(), cache in geometries()) {
        let figures = analysed(&stream, &cache);
        let sum = |counts: &ByOrigin| counts.iter().sum::<u64>();
        let split = figures.split;
        prop_assert_eq!(sum(&split.hits()) + split.misses(), figures.accesses);
        let lines = figures.configured_lines;
        let full = figures.distances.hits(lines);
        prop_assert_eq!(figures.misses(&full), split.fully_associative_misses());
        // The forest agrees with the histogram: a cache of one set is fully associative.
        for point in figures.lru.iter().filter(|p| p.ways.map(u64::from) == Some(p.lines)) {
            prop_assert_eq!(point.hits, figures.distances.hits(point.lines));
        }
        for point in &figures.opt {
            prop_assert!(sum(&point.hits) >= sum(&figures.distances.hits(point.lines)));
        }
        prop_assert!(sum(&figures.opt_of_geometry) >= sum(&split.hits()));
        prop_assert!(sum(&figures.opt_of_size()) >= sum(&figures.opt_of_geometry));
        let infinite = figures.distances.hits(figures.distances.enough_lines());
        prop_assert_eq!(figures.misses(&infinite), figures.unique_lines);
    }
}

/// Both levels have the misses of a replay in every order, for every policy and number of cores.
#[test]
fn misses_equal_those_of_a_replay() {
    let trace = Synthetic {
        size_px: [96, 80],
        patch_px: 48,
        layers: 2,
        ..Synthetic::default()
    }
    .generate();
    let orders: Vec<Order> = Order::all().collect();
    let machines = [
        (2, Replacement::LRU, 4, sim::config::Assign::FirstIdle),
        (3, Replacement::FIFO, 2, sim::config::Assign::Static),
        (1, Replacement::RANDOM, 4, sim::config::Assign::FirstIdle),
    ];
    for (cores, replacement, ways, assign) in machines {
        let cache = |size_bytes| LevelConfig {
            ways,
            replacement,
            ..LevelConfig::lru(size_bytes)
        };
        let config = RunConfig {
            mode: sim::config::Mode::Functional,
            cores,
            assign,
            level: Levels::two(cache(2 << 10), cache(16 << 10)),
            ..RunConfig::default()
        };
        let figures = analyse(&trace, &config, &orders, Streams::WithMerged, &|_| ()).unwrap();
        for of_order in figures {
            let Sequence::Order(order) = of_order.order else {
                panic!("traces are analysed in tile orders");
            };
            let result = replay(&trace, &RunConfig { order, ..config }).unwrap();
            for (stream, figures) in &of_order.streams {
                let level = match stream {
                    Stream::L1 => &result.l1,
                    Stream::L2 => &result.l2,
                    Stream::Merged => {
                        assert_eq!(figures.accesses, result.l1.counters.line_lookups);
                        continue;
                    }
                };
                let name = format!("{} of {} cores, {}", stream.title(), cores, order.name());
                assert_eq!(figures.accesses, level.counters.line_lookups, "{name}");
                assert_eq!(figures.split.misses(), level.counters.line_misses, "{name}");
            }
            let (_, merged) = &of_order.streams[2];
            assert_eq!(merged.unique_lines, result.unique_lines);
            assert_eq!(of_order.streams[1].1.unique_lines, result.unique_lines);
        }
    }
}

/// A picture of two eyes whose tiles use lines of their own, the other eye's and the row above's.
fn pictures(columns: u32, rows: u32, lines_of_tile: u32, order: &[(u32, u32, Eye)]) -> Vec<Access> {
    let access = |(item, &(column, row, eye)): (u32, &(u32, u32, Eye))| {
        let tile = row * columns + column;
        let first = tile * lines_of_tile;
        // Half of a tile's lines belong to the tile below as well, and all of them to both eyes.
        let own = first..first + lines_of_tile;
        let above = (row > 0).then(|| {
            first - columns * lines_of_tile..first - columns * lines_of_tile + lines_of_tile / 2
        });
        let lines = own.chain(above.into_iter().flatten());
        lines.map(move |line| Access {
            frame: 0,
            line,
            place: Place {
                tile: tile + if eye == Eye::Left { 0 } else { columns * rows },
                eye: Some(eye),
                row: Some(row),
                item,
                tiles: 1,
            },
        })
    };
    (1..).zip(order).flat_map(access).collect()
}

/// Each closed form equals the smallest LRU cache that finds half of its reuses, which a plain program finds by trying
/// every size.
#[test]
fn both_knees_are_where_their_closed_forms_say() {
    let (columns, rows, lines) = (6, 5, 8);
    let tiles = || (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
    let both = [Eye::Left, Eye::Right];
    let eye_after_eye: Vec<_> = (both.iter())
        .flat_map(|&eye| tiles().map(move |(column, row)| (column, row, eye)))
        .collect();
    let row_of_pairs: Vec<_> = tiles()
        .flat_map(|(column, row)| both.map(|eye| (column, row, eye)))
        .collect();
    let cache = LevelConfig::lru(64 * 16);
    // The smallest LRU cache that hits half of the chosen reuses.
    let smallest = |stream: &[Access], chosen: &dyn Fn(&Access, &Access) -> bool| {
        let numbers: Vec<u32> = stream.iter().map(|access| access.line).collect();
        let mut last = std::collections::HashMap::new();
        let is_chosen: Vec<bool> = (stream.iter())
            .map(|access| {
                last.insert(access.line, *access)
                    .is_some_and(|before| chosen(&before, access))
            })
            .collect();
        let all = is_chosen.iter().filter(|is| **is).count();
        (1..).find(|&size| {
            let hits = plain::lru(&numbers, 1, size);
            2 * hits
                .iter()
                .zip(&is_chosen)
                .filter(|(hit, is)| **hit && **is)
                .count()
                >= all
        })
    };

    let stream = pictures(columns, rows, lines, &eye_after_eye);
    let figures = analysed(&stream, &cache);
    let found = smallest(&stream, &|before, now| before.place.eye != now.place.eye);
    assert_eq!(figures.eye_knee_lines(), found.map(u64::from));
    assert_eq!(figures.eye_lines(), Some(f64::from(columns * rows * lines)));
    assert_eq!(
        figures.eye_knee_lines(),
        Some(u64::from(columns * rows * lines))
    );

    let stream = pictures(columns, rows, lines, &row_of_pairs);
    let figures = analysed(&stream, &cache);
    let found = smallest(&stream, &|before, now| before.place.row != now.place.row);
    assert_eq!(figures.row_knee_lines(), found.map(u64::from));
    // The first row has no lines of a row above it.
    let all = columns * lines * rows + columns * lines / 2 * (rows - 1);
    let of_row = f64::from(all) / f64::from(rows);
    assert_eq!(figures.row_lines(), Some(of_row));
    let ratio = figures.row_knee_lines().unwrap() as f64 / of_row;
    assert!((0.8..=1.25).contains(&ratio), "{ratio}");
    // In pairs, the other eye's lines are found again at once.
    assert_eq!(figures.eye_knee_lines(), Some(u64::from(lines + lines / 2)));
}

/// The L2's figures do not depend on whether the L1 is analysed.
#[test]
fn the_l2_alone_has_the_same_figures() {
    let trace = Synthetic::default().generate();
    let orders = [Order::MORTON, Order::Z2_STA];
    let config = RunConfig {
        mode: Mode::Functional,
        level: Levels::two(LevelConfig::lru(2 << 10), LevelConfig::lru(16 << 10)),
        ..RunConfig::default()
    };
    let of = |streams| analyse(&trace, &config, &orders, streams, &|_| ()).unwrap();
    for (all, alone) in of(Streams::Levels).iter().zip(of(Streams::OnlyL2)) {
        let [(Stream::L2, alone)] = alone.streams.as_slice() else {
            panic!("one stream");
        };
        assert_eq!(all.streams[1].1, *alone);
        assert!(alone.row_lines().is_some());
    }
}

/// The first frame, repeated `frames` times.
fn repeated(trace: &MemoryTrace, frames: u32) -> MemoryTrace {
    let mut out = trace.clone();
    for frame in 1..frames {
        let again = trace.tables.passes.iter();
        out.tables
            .passes
            .extend(again.map(|pass| Pass { frame, ..*pass }));
        out.tiles.extend(trace.tiles.iter().cloned());
    }
    out
}

#[test]
fn with_a_flush_between_frames_each_frame_has_the_figures_of_a_separate_analysis() {
    let one = Synthetic {
        size_px: [64, 48],
        patch_px: 16,
        ..Synthetic::default()
    }
    .generate();
    let three = repeated(&one, 3);
    let orders = [Order::MORTON, Order::Z2_STA];
    for replacement in [Replacement::LRU, Replacement::RANDOM] {
        let cache = |size_bytes| LevelConfig {
            replacement,
            ..LevelConfig::lru(size_bytes)
        };
        let config = RunConfig {
            mode: Mode::Functional,
            between_frames: BetweenFrames::Flush,
            level: Levels::two(cache(2 << 10), cache(16 << 10)),
            ..RunConfig::default()
        };
        let of = |trace: &MemoryTrace| {
            analyse(trace, &config, &orders, Streams::WithMerged, &|_| ()).unwrap()
        };
        for (single, flushed) in of(&one).iter().zip(of(&three)) {
            let Sequence::Order(order) = flushed.order else {
                panic!("traces are analysed in tile orders");
            };
            let result = replay(&three, &RunConfig { order, ..config }).unwrap();
            let levels = [&result.l1, &result.l2];
            for ((_, figures), level) in flushed.streams.iter().zip(levels) {
                assert_eq!(figures.accesses, level.counters.line_lookups);
                assert_eq!(figures.split.misses(), level.counters.line_misses);
            }
            if replacement != Replacement::LRU {
                continue;
            }
            for ((_, alone), (_, figures)) in single.streams.iter().zip(&flushed.streams) {
                let mut expected = alone.clone();
                expected.add(alone);
                expected.add(alone);
                assert_eq!(*figures, expected);
            }
        }
    }
}
