//! A replay's result: counts of the trace and counts of the caches summed up.

use super::counts::{CacheCounts, CellMisses, Misses};
use crate::config::RunConfig;
use crate::result::{LevelCounters, LevelResult, Part, RunResult, TileMap};
use crate::stream::{Bins, Cell, CellAccesses, TraceCounts};
use formats::textrace::{Pass, Tables};
use formats::view::TILE_SIZE_PX;

/// Sums everything up; the configuration says what a line is and whether tiles are wanted. Texture
/// unit and cycles are left out.
pub fn summary(
    tables: &Tables,
    bins: &Bins,
    trace: &TraceCounts,
    caches: &CacheCounts,
    config: &RunConfig,
) -> RunResult {
    let sums = |names: Vec<String>, bin: fn(Cell) -> usize| {
        let part = |name| Part {
            name,
            ..Part::default()
        };
        let mut parts: Vec<Part> = names.into_iter().map(part).collect();
        for (index, (accesses, misses)) in trace.cells.iter().zip(&caches.cells).enumerate() {
            if let Some(part) = parts.get_mut(bin(bins.meaning(index))) {
                let (l1, l2) = levels(accesses, misses);
                part.l1.add(&l1);
                part.l2.add(&l2);
            }
        }
        parts
    };
    let all = sums(vec![String::new()], |_| 0).remove(0);
    let deepest = tables.textures.iter().map(|t| t.levels as usize).max();
    let level_names = (0..deepest.unwrap_or(0)).map(|l| format!("level {l}"));
    let mut by_view = sums(bins.view_names().map(str::to_owned).to_vec(), |c| c.view);
    let mut shown = (0..).map(|view| bins.has_view(view));
    by_view.retain(|_| shown.next() == Some(true));
    RunResult {
        quads: trace.quads,
        lanes: trace.lanes,
        footprints: all.l1.footprints,
        l1: LevelResult {
            miss_rate: rate(all.l1.footprint_misses, all.l1.footprints),
            misses: all.l1.line_misses,
            counters: all.l1,
        },
        l2: LevelResult {
            miss_rate: rate(all.l2.line_misses, all.l2.line_lookups),
            misses: all.l2.line_misses,
            counters: all.l2,
        },
        external_bytes: all.l2.line_misses * u64::from(config.line_bytes),
        unique_lines: trace.unique_lines,
        access_hash: format!("{:016x}", trace.hash),
        tmu: None,
        cycles: None,
        first_lookups: None,
        by_view,
        by_texture: sums(
            tables.textures.iter().map(|t| t.name.clone()).collect(),
            |c| c.texture,
        ),
        by_level: sums(level_names.collect(), |c| c.level),
        tile_maps: if config.tile_maps {
            tile_maps(tables, bins, trace, caches)
        } else {
            Vec::new()
        },
    }
}

/// A cell's counters of both levels: what misses the L1 is what comes to the L2.
fn levels(accesses: &CellAccesses, misses: &CellMisses) -> (LevelCounters, LevelCounters) {
    let counters = |footprints, line_lookups, misses: &Misses| LevelCounters {
        footprints,
        footprint_misses: misses.footprints,
        line_lookups,
        line_misses: misses.lines,
        secondary_misses: misses.secondary,
    };
    let CellMisses { l1, l2 } = misses;
    (
        counters(accesses.footprints, accesses.line_lookups, l1),
        counters(l1.footprints, l1.lines, l2),
    )
}

fn rate(part: u64, whole: u64) -> f64 {
    if whole == 0 {
        0.0
    } else {
        part as f64 / whole as f64
    }
}

fn tile_maps(
    tables: &Tables,
    bins: &Bins,
    trace: &TraceCounts,
    caches: &CacheCounts,
) -> Vec<TileMap> {
    let passes = tables.passes.iter().zip(bins.first_tiles()).enumerate();
    passes
        .map(|(index, (pass, &first))| {
            let tiles = first..first + pass.tile_count() as usize;
            let (accesses, misses) = (&trace.tiles[tiles.clone()], &caches.tiles[tiles]);
            TileMap {
                pass: index as u32,
                tiles: pass.tiles,
                overdraw: (0..)
                    .zip(accesses)
                    .map(|(tile, t)| t.lanes as f32 / pixels(pass, tile) as f32)
                    .collect(),
                footprints: accesses.iter().map(|t| t.footprints).collect(),
                l1_misses: misses.iter().map(|t| t.l1_footprints).collect(),
                l2_misses: misses.iter().map(|t| t.l2_lines).collect(),
            }
        })
        .collect()
}

/// Pixels of a tile inside the image, which cuts the last ones.
fn pixels(pass: &Pass, tile: u32) -> u32 {
    let at = [tile % pass.tiles[0], tile / pass.tiles[0]];
    let side = |axis: usize| {
        pass.size_px[axis]
            .saturating_sub(at[axis] * TILE_SIZE_PX)
            .min(TILE_SIZE_PX)
    };
    (side(0) * side(1)).max(1)
}
