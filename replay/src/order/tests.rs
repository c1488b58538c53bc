use super::*;
use proptest::prelude::*;

fn pass(kind: PassKind, frame: u32, eye: Option<Eye>, tiles: [u32; 2]) -> Pass {
    Pass {
        frame,
        kind,
        eye,
        size_px: tiles.map(|t| t * 16),
        tiles,
    }
}

fn visited(kind: OrderKind, passes: &[Pass]) -> Vec<TileRef> {
    plan(&*by_kind(kind, 7), passes)
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
        let passes = [
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
        for kind in OrderKind::ALL {
            let mut found = visited(kind, &passes);
            found.sort_unstable();
            prop_assert_eq!(&found, &expected, "{}", kind.name());
        }
    }
}

fn tiles_of(kind: OrderKind, tiles: [u32; 2]) -> Vec<[u32; 2]> {
    by_kind(kind, 3).curve(tiles)
}

#[test]
fn morton_draws_a_z_and_skips_what_lies_outside() {
    assert_eq!(
        tiles_of(OrderKind::Morton, [3, 2]),
        [[0, 0], [1, 0], [0, 1], [1, 1], [2, 0], [2, 1]]
    );
}

#[test]
fn zig_zag_turns_at_every_row() {
    assert_eq!(
        tiles_of(OrderKind::ZigZag, [2, 2]),
        [[0, 0], [1, 0], [1, 1], [0, 1]]
    );
}

#[test]
fn hilbert_and_zig_zag_step_to_neighbours_only() {
    for (kind, tiles) in [(OrderKind::Hilbert, [16, 16]), (OrderKind::ZigZag, [7, 5])] {
        for step in tiles_of(kind, tiles).windows(2) {
            let distance = step[0][0].abs_diff(step[1][0]) + step[0][1].abs_diff(step[1][1]);
            assert_eq!(distance, 1, "{}: {step:?}", kind.name());
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
    for kind in [
        OrderKind::Scanline,
        OrderKind::ZigZag,
        OrderKind::Morton,
        OrderKind::Hilbert,
    ] {
        let order = visited(kind, &passes);
        assert!(order[..16].iter().all(|t| t.pass == 0), "{}", kind.name());
    }
}

#[test]
fn monoscopic_passes_come_before_the_stereo_pair_of_their_frame() {
    let passes = [
        pass(PassKind::Main, 0, Some(Eye::Left), [1, 1]),
        pass(PassKind::Main, 0, Some(Eye::Right), [1, 1]),
        pass(PassKind::Shadow, 0, None, [1, 1]),
        pass(PassKind::Shadow, 1, None, [1, 1]),
    ];
    let order: Vec<u32> = visited(OrderKind::Z2Sta, &passes)
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
