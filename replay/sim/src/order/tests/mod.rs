pub mod columns;
mod combinations;

use super::curve::Ground;
use super::*;
use crate::config::{Mode, RunConfig};
use crate::engine::replay;
use crate::stream::testing::Synthetic;
use formats::textrace::{Pass, PassKind, TraceMeta};
use formats::view::{Eye, FrameViews};
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

const INPUTS: PlanInputs<'_> = PlanInputs {
    seed: 7,
    cores: 2,
    tile_px: 16,
    l2_bytes: 128 << 10,
    line_bytes: 16,
    meta: None,
    last: None,
};

/// All work of a trace, with the same counters for all frames.
fn plan(order: Order, inputs: &PlanInputs<'_>, passes: &[Pass]) -> Vec<Phase> {
    let plan = |frame| plan_frame(order, inputs, passes, frame);
    frames(passes).into_iter().flat_map(plan).collect()
}

fn visited(order: Order, passes: &[Pass]) -> Vec<TileRef> {
    plan(order, &INPUTS, passes)
        .iter()
        .flatten()
        .flat_map(WorkItem::tiles)
        .collect()
}

fn cells_of(curve: Curve, grid: [u32; 2], size: u32) -> Vec<[u32; 2]> {
    curve.path().cells(&Ground {
        grid,
        size,
        seed: 3,
        frame_bytes: None,
    })
}

fn order(name: &str) -> Order {
    Order::by_name(name).unwrap_or_else(|why| panic!("{name}: {why:?}"))
}

#[test]
fn morton_follows_a_z_and_skips_cells_outside_the_grid() {
    assert_eq!(
        cells_of(Curve::MORTON, [3, 2], 0),
        [[0, 0], [1, 0], [0, 1], [1, 1], [2, 0], [2, 1]]
    );
}

#[test]
fn zig_zag_turns_at_every_row() {
    assert_eq!(
        cells_of(Curve::ZIG_ZAG, [2, 2], 0),
        [[0, 0], [1, 0], [1, 1], [0, 1]]
    );
}

#[test]
fn hilbert_and_zig_zag_step_to_neighbours_only() {
    for (curve, grid) in [(Curve::HILBERT, [16, 16]), (Curve::ZIG_ZAG, [7, 5])] {
        let steps = far_steps(&cells_of(curve, grid, 0));
        assert_eq!(steps, 0, "{}", curve.name());
    }
}

/// Counts steps that do not go to one of the eight neighbours.
fn far_steps(cells: &[[u32; 2]]) -> usize {
    let distance =
        |step: &[[u32; 2]]| step[0][0].abs_diff(step[1][0]) + step[0][1].abs_diff(step[1][1]);
    cells.windows(2).filter(|step| distance(step) > 1).count()
}

#[test]
fn the_generalised_hilbert_curve_steps_to_neighbours_except_for_one_diagonal() {
    for columns in 1..40 {
        for rows in 1..40 {
            let cells = cells_of(Curve::GILBERT, [columns, rows], 0);
            let far = far_steps(&cells);
            let odd = columns.max(rows) % 2 == 1 && columns.min(rows) % 2 == 0;
            assert!(far <= usize::from(odd), "{columns}x{rows}: {far}");
            assert_eq!(cells[0], [0, 0]);
        }
    }
}

#[test]
fn the_number_of_strips_is_odd_and_every_other_strip_runs_upwards() {
    // Four columns with two columns per strip are three strips with one, one and two columns.
    assert_eq!(
        cells_of(Curve::STRIP, [4, 2], 2),
        [
            [0, 0],
            [0, 1],
            [1, 1],
            [1, 0],
            [2, 0],
            [3, 0],
            [3, 1],
            [2, 1]
        ]
    );
    assert_eq!(
        cells_of(Curve::STRIP, [4, 3], 4),
        cells_of(Curve::ZIG_ZAG, [4, 3], 0)
    );
}

#[test]
fn bands_run_column_by_column_in_alternating_directions() {
    assert_eq!(
        cells_of(Curve::BAND, [2, 3], 2),
        [[0, 0], [0, 1], [1, 1], [1, 0], [1, 2], [0, 2]]
    );
    assert_eq!(
        cells_of(Curve::BAND, [4, 3], 1),
        cells_of(Curve::ZIG_ZAG, [4, 3], 0)
    );
}

#[test]
fn rows_that_exceed_the_l2_become_bands_whose_height_falls_with_the_lines() {
    let path = Curve::ADAPTIVE.path();
    let rows_of_first_columns = |frame_kib: Option<u64>| -> Vec<u32> {
        let cells = path.cells(&Ground {
            grid: [60, 10],
            size: 100,
            seed: 0,
            frame_bytes: frame_kib.map(|kib| kib << 10),
        });
        cells
            .iter()
            .take_while(|cell| cell[0] == 0)
            .map(|cell| cell[1])
            .collect()
    };
    assert_eq!(rows_of_first_columns(None), [0]);
    // A row of 100 KiB fits into the L2.
    assert_eq!(rows_of_first_columns(Some(1000)), [0]);
    // The L2 holds 40, 20 and 6 columns of a row.
    assert_eq!(rows_of_first_columns(Some(1500)), [0, 1, 2, 3, 4, 5]);
    assert_eq!(rows_of_first_columns(Some(3000)), [0, 1, 2]);
    assert_eq!(rows_of_first_columns(Some(10_000)), [0, 1, 2]);
    assert_eq!(rows_of_first_columns(Some(1001)), [0, 1, 2, 3, 4, 5, 6, 7]);
}

fn pair_of(tiles: [u32; 2]) -> [Pass; 2] {
    [Eye::Left, Eye::Right].map(|eye| pass(PassKind::Main, 0, Some(eye), tiles))
}

#[test]
fn lrta_alternates_left_and_right_tiles() {
    let tile = |pass, tile| WorkItem::Tile(TileRef { pass, tile });
    assert_eq!(
        plan(Order::Z2_LRTA, &INPUTS, &pair_of([2, 1])),
        [[tile(0, 0), tile(1, 0), tile(0, 1), tile(1, 1)]]
    );
}

/// A display with pictures of 64x32 pixels. A point at infinity lies this many pixels further left in the right
/// picture.
fn shifted_by(pixels: f32) -> TraceMeta {
    let mut views = FrameViews::default();
    for (eye, side) in views.eyes.iter_mut().zip([1.0, -1.0]) {
        eye.eye_to_clip[2] = [-side * pixels / 64.0, 0.0, -1.0, -1.0];
    }
    TraceMeta {
        frames: vec![views],
        ..TraceMeta::default()
    }
}

#[test]
fn tiles_pair_at_infinity_and_tiles_without_a_partner_keep_their_place() {
    let meta = shifted_by(17.0);
    let inputs = PlanInputs {
        meta: Some(&meta),
        ..INPUTS
    };
    let passes = pair_of([4, 1]);
    let tile = |pass, tile| TileRef { pass, tile };
    let pair = |left, right| WorkItem::Pair(tile(0, left), tile(1, right), Interleave::Alternate);
    let expected = vec![
        WorkItem::Tile(tile(0, 0)),
        pair(1, 0),
        pair(2, 1),
        pair(3, 2),
        WorkItem::Tile(tile(1, 3)),
    ];
    for name in ["zig-zag+sta+offset", "zig-zag+sta+infinity"] {
        assert_eq!(
            plan(order(name), &inputs, &passes),
            std::slice::from_ref(&expected),
            "{name}"
        );
    }
    // Layers have their own projections.
    let layers = passes.map(|pass| Pass {
        kind: PassKind::Layer,
        ..pass
    });
    let plans =
        ["zig-zag+sta+offset", "zig-zag+sta"].map(|name| plan(order(name), &inputs, &layers));
    assert_eq!(plans[0], plans[1]);
}

#[test]
fn rows_pair_at_the_shifts_of_the_last_frame() {
    let last = Counters {
        views: vec![ViewCounters {
            view: View::grid(0, [2, 2]),
            bytes: 0,
            primitive_shift: vec![0, 1],
            line_shift: vec![1, 0],
        }],
    };
    let inputs = PlanInputs {
        last: Some(&last),
        ..INPUTS
    };
    let pairs = |name| -> Vec<(u32, u32)> {
        let phases = plan(order(name), &inputs, &pair_of([2, 2]));
        let pair = |item: &WorkItem| match *item {
            WorkItem::Pair(left, right, _) => Some((left.tile, right.tile)),
            WorkItem::Tile(_) => None,
        };
        phases[0].iter().filter_map(pair).collect()
    };
    assert_eq!(
        pairs("scanline+sta+row-primitives"),
        [(0, 0), (1, 1), (3, 2)]
    );
    assert_eq!(pairs("scanline+sta+row-lines"), [(1, 0), (2, 2), (3, 3)]);
}

#[test]
fn directions_reverse_frames_or_the_right_view() {
    let frame = |frame| pair_of([2, 1]).map(|pass| Pass { frame, ..pass });
    let passes = [frame(0), frame(1)].concat();
    let tiles = |name| -> Vec<(u32, u32)> {
        let tiles = visited(order(name), &passes);
        tiles.iter().map(|at| (at.pass, at.tile)).collect()
    };
    assert_eq!(
        tiles("scanline+boustro"),
        [
            (0, 0),
            (0, 1),
            (1, 0),
            (1, 1),
            (3, 1),
            (3, 0),
            (2, 1),
            (2, 0)
        ]
    );
    assert_eq!(
        tiles("scanline+right-reversed"),
        [
            (0, 0),
            (0, 1),
            (1, 1),
            (1, 0),
            (2, 0),
            (2, 1),
            (3, 1),
            (3, 0)
        ]
    );
    assert_eq!(
        tiles("scanline+lrta+boustro")[4..],
        [(3, 1), (2, 1), (3, 0), (2, 0)]
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
fn left_and_right_layers_with_equal_number_and_size_are_paired() {
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
    assert_eq!(plan(Order::Z2_STA, &INPUTS, &passes), expected);
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
    let tiles = |seed| Order::RANDOM.stereo([9, 9], &PlanInputs { seed, ..INPUTS });
    assert_eq!(tiles(1), tiles(1));
    assert_ne!(tiles(1), tiles(2));
}

#[test]
fn a_new_order_needs_only_a_file_and_a_row() {
    let order = Order::COLUMNS;
    assert_eq!(order.parts().curve, Curve::COLUMNS);
    assert_eq!(serde_json::to_value(order).unwrap(), "test-columns");
    assert_eq!(Order::find("test-columns").unwrap(), order);
    let config: RunConfig =
        toml::from_str("order = \"test-columns\"\nmode = \"functional\"").unwrap();
    let trace = Synthetic::one_layer([72, 56], 120).generate();
    let scanline = RunConfig {
        mode: Mode::Functional,
        order: Order::SCANLINE,
        ..RunConfig::default()
    };
    let [ours, theirs] = [config, scanline].map(|config| replay(&trace, &config).unwrap());
    assert_eq!(ours.access_hash, theirs.access_hash);
    assert_ne!(ours.l1.counters, theirs.l1.counters);
    assert_eq!(
        cells_of(Curve::COLUMNS, [2, 2], 0),
        [[0, 0], [0, 1], [1, 0], [1, 1]]
    );
}

#[test]
fn the_error_for_an_unknown_order_lists_the_known_ones() {
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

/// Only the file of a curve, its row, and the row of its order mention it.
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
    assert_eq!(
        found,
        ["generalised_hilbert.rs", "hilbert.rs", "mod.rs", "mod.rs"]
    );
}
