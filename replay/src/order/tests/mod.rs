pub mod columns;

use super::*;
use crate::config::{Mode, RunConfig};
use crate::engine::replay;
use crate::stream::synthetic::Synthetic;
use clap::ValueEnum;
use formats::textrace::{Pass, PassKind};
use formats::view::Eye;
use proptest::prelude::*;
use std::path::Path;

fn pass(kind: PassKind, frame: u32, eye: Option<Eye>, tiles: [u32; 2]) -> Pass {
    Pass {
        frame,
        kind,
        eye,
        layer: 0,
        size_px: tiles.map(|t| t * 16),
        tiles,
    }
}

fn visited(order: Order, passes: &[Pass]) -> Vec<TileRef> {
    plan(&*order.build(7), passes)
        .iter()
        .flatten()
        .flat_map(WorkItem::tiles)
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_order_is_a_permutation_of_the_tiles_of_all_passes(
        columns in 1_u32..40, rows in 1_u32..40, other in 1_u32..40, shadow in 1_u32..20,
    ) {
        let layer = |layer, eye, tiles| Pass { layer, ..pass(PassKind::Layer, 1, eye, tiles) };
        let passes = [
            layer(3, Some(Eye::Left), [columns, rows]),
            layer(3, Some(Eye::Right), [columns, rows]),
            layer(0, None, [other, rows]),
            layer(1, Some(Eye::Right), [other, 1]),
            layer(1, Some(Eye::Left), [other, 2]),
            pass(PassKind::Shadow, 0, None, [shadow, shadow]),
            pass(PassKind::Main, 0, Some(Eye::Left), [columns, rows]),
            pass(PassKind::Main, 0, Some(Eye::Right), [other, rows]),
            pass(PassKind::Main, 1, Some(Eye::Right), [columns, rows]),
        ];
        let mut expected: Vec<TileRef> = passes
            .iter()
            .enumerate()
            .flat_map(|(i, p)| (0..p.tile_count()).map(move |tile| TileRef { pass: i as u32, tile }))
            .collect();
        expected.sort_unstable();
        for order in Order::all() {
            let mut found = visited(order, &passes);
            found.sort_unstable();
            prop_assert_eq!(&found, &expected, "{}", order.name());
        }
    }
}

fn tiles_of(order: Order, tiles: [u32; 2]) -> Vec<[u32; 2]> {
    order.build(3).curve(tiles)
}

#[test]
fn morton_draws_a_z_and_skips_what_lies_outside() {
    assert_eq!(
        tiles_of(Order::MORTON, [3, 2]),
        [[0, 0], [1, 0], [0, 1], [1, 1], [2, 0], [2, 1]]
    );
}

#[test]
fn zig_zag_turns_at_every_row() {
    assert_eq!(
        tiles_of(Order::ZIG_ZAG, [2, 2]),
        [[0, 0], [1, 0], [1, 1], [0, 1]]
    );
}

#[test]
fn hilbert_and_zig_zag_step_to_neighbours_only() {
    for (order, tiles) in [(Order::HILBERT, [16, 16]), (Order::ZIG_ZAG, [7, 5])] {
        for step in tiles_of(order, tiles).windows(2) {
            let distance = step[0][0].abs_diff(step[1][0]) + step[0][1].abs_diff(step[1][1]);
            assert_eq!(distance, 1, "{}: {step:?}", order.name());
        }
    }
}

#[test]
fn lrta_takes_left_and_right_tiles_in_turn() {
    let left = View {
        pass: 0,
        tiles: [2, 1],
    };
    let right = View {
        pass: 1,
        tiles: [2, 1],
    };
    let tile = |pass, tile| WorkItem::Tile(TileRef { pass, tile });
    assert_eq!(
        Z2Lrta.stereo(left, right),
        [tile(0, 0), tile(1, 0), tile(0, 1), tile(1, 1)]
    );
}

#[test]
fn single_view_orders_finish_the_left_view_first() {
    let passes = [
        pass(PassKind::Main, 0, Some(Eye::Left), [4, 4]),
        pass(PassKind::Main, 0, Some(Eye::Right), [4, 4]),
    ];
    for order in [
        Order::SCANLINE,
        Order::ZIG_ZAG,
        Order::MORTON,
        Order::HILBERT,
    ] {
        let visited = visited(order, &passes);
        assert!(
            visited[..16].iter().all(|t| t.pass == 0),
            "{}",
            order.name()
        );
    }
}

#[test]
fn left_and_right_layers_of_a_number_and_size_pair_and_others_run_alone() {
    let layer = |layer, eye, tiles| Pass {
        layer,
        ..pass(PassKind::Layer, 0, eye, tiles)
    };
    let (left, right) = (Some(Eye::Left), Some(Eye::Right));
    let passes = [
        layer(0, left, [1, 1]),
        layer(1, left, [1, 1]),
        layer(1, right, [1, 1]),
        layer(0, right, [1, 1]),
        layer(0, None, [1, 1]),
        layer(2, left, [1, 1]),
        layer(2, right, [1, 2]),
        pass(PassKind::Shadow, 0, None, [1, 1]),
    ];
    let tile = |pass, tile| TileRef { pass, tile };
    let pair = |left, right| WorkItem::Pair(tile(left, 0), tile(right, 0), Interleave::Alternate);
    let expected = [
        vec![WorkItem::Tile(tile(7, 0))],
        vec![pair(0, 3)],
        vec![pair(1, 2)],
        vec![WorkItem::Tile(tile(4, 0))],
        vec![WorkItem::Tile(tile(5, 0))],
        vec![WorkItem::Tile(tile(6, 0)), WorkItem::Tile(tile(6, 1))],
    ];
    assert_eq!(plan(&*Order::Z2_STA.build(0), &passes), expected);
}

#[test]
fn monoscopic_passes_come_before_the_stereo_pair_of_their_frame() {
    let passes = [
        pass(PassKind::Main, 0, Some(Eye::Left), [1, 1]),
        pass(PassKind::Main, 0, Some(Eye::Right), [1, 1]),
        pass(PassKind::Shadow, 0, None, [1, 1]),
        pass(PassKind::Shadow, 1, None, [1, 1]),
    ];
    let order: Vec<u32> = visited(Order::Z2_STA, &passes)
        .iter()
        .map(|t| t.pass)
        .collect();
    assert_eq!(order, [2, 0, 1, 3]);
}

#[test]
fn the_random_order_follows_its_seed() {
    assert_eq!(
        Random { seed: 1 }.curve([9, 9]),
        Random { seed: 1 }.curve([9, 9])
    );
    assert_ne!(
        Random { seed: 1 }.curve([9, 9]),
        Random { seed: 2 }.curve([9, 9])
    );
}

#[test]
fn a_file_and_a_row_are_all_that_an_order_takes() {
    let order = Order::COLUMNS;
    assert_eq!(serde_json::to_value(order).unwrap(), "test-columns");
    assert_eq!(Order::from_str("test-columns", false).unwrap(), order);
    let config: RunConfig =
        toml::from_str("order = \"test-columns\"\nmode = \"functional\"").unwrap();
    let trace = Synthetic {
        size_px: [72, 56],
        ..Synthetic::default()
    }
    .generate();
    let scanline = RunConfig {
        mode: Mode::Functional,
        order: Order::SCANLINE,
        ..RunConfig::default()
    };
    let [ours, theirs] = [config, scanline].map(|config| replay(&trace, &config).unwrap());
    assert_eq!(ours.access_hash, theirs.access_hash);
    assert_ne!(ours.l1.counters, theirs.l1.counters);
    assert_eq!(tiles_of(order, [2, 2]), [[0, 0], [0, 1], [1, 0], [1, 1]]);
}

#[test]
fn an_unknown_order_is_named_with_the_known_ones() {
    let error = toml::from_str::<RunConfig>("order = \"spiral\"").unwrap_err();
    let known: Vec<String> = Order::all().map(|o| format!("`{}`", o.name())).collect();
    let expected = format!(
        "unknown variant `spiral`, expected one of {}",
        known.join(", ")
    );
    assert!(error.to_string().contains(&expected), "{error}");
}

#[test]
fn names_are_unique() {
    for order in Order::all() {
        assert_eq!(Order::find(order.name()).unwrap().title(), order.title());
    }
}

/// An order that no paper's table needs is named by its own file and its row alone.
#[test]
fn nothing_outside_the_table_names_an_order() {
    fn scan(folder: &Path, found: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if path.is_dir() && name != "tests" {
                scan(&path, found);
            } else if name.ends_with(".rs") && !name.contains("test") {
                let text = std::fs::read_to_string(&path).unwrap();
                let code = text.split("#[cfg(test)]\nmod tests").next().unwrap();
                if code.to_lowercase().contains("hilbert") {
                    found.push(name);
                }
            }
        }
    }
    let mut found = Vec::new();
    scan(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("src"),
        &mut found,
    );
    found.sort_unstable();
    assert_eq!(found, ["hilbert.rs", "mod.rs"]);
}
