//! Properties of every combination of parts.

use super::super::assignment::Assignment;
use super::super::curve::Ground;
use super::super::pairing::Pairing;
use super::super::parts::Direction;
use super::*;
use crate::config::BetweenFrames;
use crate::engine::replay_all;
use crate::stream::LineMemory;
use crate::stream::testing::Synthetic;
use crate::stream::testing::repeated;
use proptest::prelude::*;
use std::collections::HashSet;
use std::sync::Mutex;

/// Tests take one combination in `STRIDE`, because all of them take seven times as long.
const STRIDE: usize = 7;

/// Every combination of parts. Curves that accept a number appear without one and with `size`.
fn all(size: u32) -> Vec<Order> {
    let mut orders = Vec::new();
    for curve in Curve::all() {
        let sizes = curve.size_unit().map(|_| Some(size));
        for size in std::iter::once(None).chain(sizes) {
            for eyes in Eyes::ALL {
                for pairing in Pairing::all() {
                    for direction in Direction::ALL {
                        let assignments = Assignment::ALL.map(Some);
                        for assignment in std::iter::once(None).chain(assignments) {
                            let parts = Parts {
                                curve,
                                size,
                                eyes,
                                pairing,
                                direction,
                                assignment,
                            };
                            // Parts that cannot be combined have no name.
                            if Parts::parse(&parts.to_string()).is_ok() {
                                orders.push(Order::of(parts));
                            }
                        }
                    }
                }
            }
        }
    }
    orders
}

#[test]
fn all_combinations_of_parts_are_orders_with_distinct_names() {
    let orders = all(3);
    // Curves, with and without a number; view by view three directions, else two and all pairings; six assignments.
    let curves = Curve::all().len() + 3;
    let combined = 3 + 4 * 5 * 2;
    assert_eq!(orders.len(), curves * combined * 6);
    let names: HashSet<&str> = orders.iter().map(|order| order.name()).collect();
    assert_eq!(names.len(), orders.len());
    for &order in &orders {
        assert_eq!(Order::find(order.name()), Some(order));
        assert_eq!(Order::of(order.parts()), order);
        let json = serde_json::to_string(&order).unwrap();
        assert_eq!(serde_json::from_str::<Order>(&json).unwrap(), order);
    }
}

/// A display with eyes that are turned outwards and see further on the outside.
fn canted(angle: f32) -> TraceMeta {
    let mut views = FrameViews::default();
    let (sine, cosine) = (
        angle / (1.0 + angle * angle).sqrt(),
        1.0 / (1.0 + angle * angle).sqrt(),
    );
    for (eye, side) in views.eyes.iter_mut().zip([1.0, -1.0]) {
        eye.world_to_eye[0] = [cosine, 0.0, side * sine, 0.0];
        eye.world_to_eye[2] = [-side * sine, 0.0, cosine, 0.0];
        eye.eye_to_clip[2] = [-0.3 * side, 0.0, -1.0, -1.0];
    }
    TraceMeta {
        frames: vec![views],
        ..TraceMeta::default()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn every_curve_visits_every_cell_once(
        columns in 0_u32..50, rows in 0_u32..50, size in 1_u32..60, bytes in 0_u64..4 << 20,
    ) {
        let mut expected: Vec<[u32; 2]> = (0..rows).flat_map(|y| (0..columns).map(move |x| [x, y])).collect();
        expected.sort_unstable();
        for curve in Curve::all() {
            let ground = Ground { grid: [columns, rows], size, seed: 5, frame_bytes: Some(bytes) };
            let mut cells = curve.path().cells(&ground);
            cells.sort_unstable();
            prop_assert_eq!(&cells, &expected, "{}", curve.name());
        }
    }

    #[test]
    fn every_combination_is_a_permutation_of_the_tiles_of_all_draws(
        columns in 1_u32..24, rows in 1_u32..24, other in 1_u32..24, shadow in 1_u32..8, size in 1_u32..12,
        cores in 1_u32..9, angle in 0.0_f32..1.2, shifts in prop::collection::vec(-9_i32..9, 24),
        bytes in 0_u64..4 << 20, start in 0..STRIDE,
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
        let rows = rows as usize;
        let last = Counters {
            views: vec![ViewCounters {
                view: View { number: 1, ..View::grid(6, [columns, rows as u32]) },
                bytes,
                primitive_shift: shifts[..rows].to_vec(),
                line_shift: shifts.iter().rev().take(rows).copied().collect(),
            }],
        };
        let meta = canted(angle);
        let inputs = PlanInputs { cores, meta: Some(&meta), last: Some(&last), l2_bytes: 16 << 10, ..INPUTS };
        for order in all(size).into_iter().skip(start).step_by(STRIDE) {
            let phases = plan(order, &inputs, &passes);
            let mut found: Vec<TileRef> = phases.iter().flatten().flat_map(WorkItem::tiles).collect();
            found.sort_unstable();
            prop_assert_eq!(&found, &expected, "{}", order.name());
            let cost = order.cost([columns, rows as u32], cores);
            prop_assert!(cost.is_buildable() && cost.state_bytes > 0 && cost.decision_cycles > 0);
        }
    }
}

/// All orders replay the same accesses in every mode, and a cache that holds all lines misses each of them
/// once.
#[test]
fn every_combination_conserves_the_accesses() {
    let trace = Synthetic::one_layer([56, 40], 120).generate();
    let trace = repeated(&trace, 2);
    let mut configs = Vec::new();
    for (number, order) in (0_u32..).zip(all(2).into_iter().step_by(STRIDE)) {
        let mut config = RunConfig {
            mode: Mode::Functional,
            order,
            cores: 1 + number % 3,
            between_frames: BetweenFrames::Keep,
            ..RunConfig::default()
        };
        config.level.l2.size_bytes = 16 << 20;
        configs.push(config);
    }
    let results = Mutex::new(Vec::new());
    let keep = |index: usize, result| results.lock().unwrap().push((index, result));
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    replay_all(&trace, &configs, &memory, &keep)
        .map_err(|(_, error)| error)
        .unwrap();
    let results: Vec<(usize, crate::result::RunResult)> = results.into_inner().unwrap();
    assert_eq!(results.len(), configs.len());
    let first = &results[0].1;
    assert!(first.unique_lines > 0);
    for (index, result) in &results {
        let name = configs[*index].order.name();
        assert_eq!(result.access_hash, first.access_hash, "{name}");
        assert_eq!(result.footprints, first.footprints, "{name}");
        assert_eq!(
            result.l2.counters.line_misses, result.unique_lines,
            "{name}"
        );
    }
}
