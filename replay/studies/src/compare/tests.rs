//! Compares altered captures with known differences.

use super::*;
use formats::textrace::{SUBTEXELS, Surfaces};
use sim::config::{Hsr, Mode};
use sim::engine::replay;
use sim::stream::MemoryTrace;
use sim::stream::testing::Synthetic;

fn small() -> MemoryTrace {
    Synthetic {
        materials: 3,
        textures: 2,
        ..Synthetic::new([64, 48], 20)
    }
    .generate()
}

fn compared(a: &MemoryTrace, b: &MemoryTrace) -> Comparison {
    compare([a, b], &RunConfig::default()).unwrap()
}

fn refused(change: impl FnOnce(&mut MemoryTrace)) -> String {
    let a = small();
    let mut b = a.clone();
    change(&mut b);
    let error = compare([&a, &b], &RunConfig::default()).unwrap_err();
    error.to_string()
}

/// The first tile of the right eye with a fully covered quad, and that record.
fn full_quad(trace: &MemoryTrace) -> (usize, usize) {
    let tiles = trace.tiles[1].iter().enumerate();
    let find = |(tile, t): (usize, &formats::textrace::Tile)| {
        let record = t.records.iter().position(|record| record.mask == 15)?;
        Some((tile, record))
    };
    tiles.filter_map(find).next().unwrap()
}

#[test]
fn a_capture_does_not_differ_from_itself() {
    let trace = small();
    let found = compared(&trace, &trace);
    let lanes = trace.tiles.iter().flatten().flat_map(|tile| &tile.records);
    let lanes: u64 = lanes
        .map(|record| u64::from(record.mask.count_ones()))
        .sum();
    assert_eq!(found.all.fragments_in_both, lanes);
    // Two textures with one or two levels each.
    assert!(found.all.footprints > 2 * lanes && found.all.footprints <= 4 * lanes);
    assert_eq!(found.all.uv_texels.count(), lanes);
    let differences = [
        found.all.fragments_only_in_a,
        found.all.fragments_only_in_b,
        found.all.footprints_that_differ,
        found.all.lanes_sampled_differently,
        found.tiles_that_differ,
    ];
    assert_eq!(differences, [0; 5]);
    assert_eq!(found.all.uv_texels.largest(), 0.0);
    assert_eq!(found.all.intersection_over_union_pct(), 100.0);
}

#[test]
fn compared_fragments_equal_those_shaded_by_a_replay_with_the_same_removal() {
    let mut trace = small();
    trace.tables.meta.surfaces = Some(Surfaces {
        depth_tested: true,
        not_opaque: Vec::new(),
    });
    let mut hidden = trace.clone();
    let (tile, record) = hidden_quad(&hidden);
    hidden.tiles[1][tile].records[record].uv[0] += 5 * SUBTEXELS;
    let with = |hsr| {
        let config = RunConfig {
            hsr,
            mode: Mode::Functional,
            ..RunConfig::default()
        };
        let found = compare([&trace, &hidden], &config).unwrap().all;
        let replayed = replay(&trace, &config).unwrap().lanes;
        assert_eq!(found.fragments_in_both, replayed);
        found
    };
    let (all, seen) = (with(Hsr::EarlyZ), with(Hsr::Deferred));
    assert!(seen.fragments_in_both < all.fragments_in_both);
    // Neither replay shades fragments behind another opaque fragment.
    assert_eq!(
        (all.uv_texels.largest(), seen.uv_texels.largest()),
        (5.0, 0.0)
    );
}

/// The tile and the record of a quad of the right eye that a later one covers.
fn hidden_quad(trace: &MemoryTrace) -> (usize, usize) {
    let find = |(tile, t): (usize, &formats::textrace::Tile)| {
        let covered = |at: usize| {
            let own = &t.records[at];
            let mut later = t.records[at + 1..].iter();
            own.mask == 15 && later.any(|r| (r.x, r.y, r.mask) == (own.x, own.y, 15))
        };
        let record = (0..t.records.len()).find(|&at| covered(at))?;
        Some((tile, record))
    };
    trace.tiles[1].iter().enumerate().find_map(find).unwrap()
}

#[test]
fn lanes_missing_in_one_capture_are_counted_for_that_capture() {
    let a = small();
    let mut b = a.clone();
    let (tile, record) = full_quad(&b);
    b.tiles[1][tile].records[record].mask = 0b0110;
    let found = compared(&a, &b);
    let counts = |t: &Tally| {
        (
            t.fragments_only_in_a,
            t.fragments_only_in_b,
            t.footprints_that_differ,
        )
    };
    assert_eq!(counts(&found.all), (2, 0, 0));
    assert_eq!(counts(&compared(&b, &a).all), (0, 2, 0));
    assert_eq!(found.tiles_that_differ, 1);
    assert_eq!(
        found.by_material.iter().map(|c| counts(&c.tally).0).max(),
        Some(2)
    );
    assert_eq!(
        found
            .by_material
            .iter()
            .map(|c| counts(&c.tally).0)
            .sum::<u64>(),
        2
    );
}

#[test]
fn two_records_of_a_quad_equal_one_record_with_all_their_lanes() {
    let a = small();
    let mut b = a.clone();
    let (tile, record) = full_quad(&b);
    let tile = &mut b.tiles[1][tile];
    let mut part = tile.records[record];
    tile.records[record].mask = 0b1011;
    part.mask = 0b0100;
    tile.records.insert(record + 1, part);
    for run in &mut tile.runs {
        let next = run.first as usize > record;
        let own = !next && run.first as usize + run.count as usize > record;
        run.first += u32::from(next);
        run.count += u32::from(own);
    }
    let itself = compared(&a, &a).all;
    for found in [compared(&a, &b), compared(&b, &a)] {
        assert_eq!(found.tiles_that_differ, 1);
        // Levels of detail are counted per pair of records, so they differ.
        let lod_levels = itself.lod_levels.clone();
        assert_eq!(
            Tally {
                lod_levels,
                ..found.all
            },
            itself
        );
    }
}

#[test]
fn fragments_of_a_primitive_missing_in_one_capture_are_counted_as_missing() {
    let a = small();
    let mut b = a.clone();
    let tile = b.tiles[0].iter().position(|t| !t.runs.is_empty()).unwrap();
    let tile = &mut b.tiles[0][tile];
    let gone = tile.runs.pop().unwrap();
    let gone = tile.records.split_off(gone.first as usize);
    let lanes: u64 = gone.iter().map(|r| u64::from(r.mask.count_ones())).sum();
    assert_eq!(compared(&a, &b).all.fragments_only_in_a, lanes);
}

#[test]
fn moved_coordinates_are_measured_in_texels() {
    let a = small();
    let mut b = a.clone();
    let (tile, record) = full_quad(&b);
    // Moves by three and a half texels of level 0. All footprints on level 0 change; on coarse levels some
    // may stay the same.
    let moved = &mut b.tiles[1][tile].records[record];
    moved.uv[1] += 7 * SUBTEXELS / 2;
    moved.uv[0] -= SUBTEXELS / 4;
    let found = compared(&a, &b).all;
    assert_eq!(found.uv_texels.largest(), 3.5);
    let mean = 4.0 * 3.5 / found.uv_texels.count() as f64;
    assert!((found.uv_texels.mean() - mean).abs() < 1e-12);
    assert_eq!(found.uv_texels.percentile(50.0), 0.0);
    assert_eq!(found.lod_levels.largest(), 0.0);
    assert!(found.footprints_that_differ > 0 && found.footprints_that_differ <= 16);
}

#[test]
fn doubled_derivatives_change_the_level_of_detail_by_one() {
    let a = small();
    let mut b = a.clone();
    let (tile, record) = full_quad(&b);
    let changed = &mut b.tiles[1][tile].records[record];
    changed.dx = changed.dx.map(|d| 2 * d);
    changed.dy = changed.dy.map(|d| 2 * d);
    let found = compared(&a, &b).all;
    assert!((found.lod_levels.largest() - 1.0).abs() < 1e-4);
    assert!(found.footprints_that_differ > 0);
}

#[test]
fn draws_in_another_order_have_the_same_fragments() {
    let a = small();
    let mut b = a.clone();
    b.tables.draws.swap(0, 1);
    for run in b.tiles.iter_mut().flatten().flat_map(|tile| &mut tile.runs) {
        run.draw = [1, 0, 2][run.draw as usize];
    }
    let (found, itself) = (compared(&a, &b), compared(&a, &a));
    assert_eq!(found.all, itself.all);
    let names = |of: &Comparison| -> Vec<String> {
        of.by_material
            .iter()
            .map(|class| class.name.clone())
            .collect()
    };
    assert_eq!(names(&found), ["material 0", "material 1", "material 2"]);
}

#[test]
fn another_texture_makes_samples_differ() {
    let a = small();
    let mut b = a.clone();
    for draw in &mut b.tables.draws {
        draw.groups[0].samples.swap(0, 1);
    }
    let found = compared(&a, &b).all;
    assert_eq!(found.lanes_sampled_differently, found.fragments_in_both);
    assert_eq!(found.footprints, 0);
}

#[test]
fn captures_of_different_views_are_refused_with_the_property() {
    let text = refused(|b| b.tables.passes[1].size_px = [1, 1]);
    assert_eq!(
        text,
        "pass 1, size in pixels: expected the same in both traces, found [64, 48] and [1, 1]"
    );
    let text = refused(|b| {
        b.tables.passes.pop();
    });
    assert_eq!(
        text,
        "number of passes: expected the same in both traces, found 2 and 1"
    );
    let text = refused(|b| b.tables.textures[3].levels = 2);
    assert!(
        text.starts_with("texture 3 (texture 3), levels: expected"),
        "{text}"
    );
    let text = refused(|b| b.tables.draws[0].primitives += 1);
    assert!(text.starts_with("number of primitives: expected"), "{text}");
}
