//! The result of a replay: sums of trace counts and cache counts.

use super::counts::{CacheCounts, CellMisses, Misses};
use crate::config::{CountBy, RunConfig};
use crate::result::{LevelCounters, LevelResult, Part, RunResult, TileMap};
use crate::stream::{Bins, Cell, CellAccesses, TraceCounts};
use formats::textrace::{Pass, Tables};

/// Computes the sums. The configuration determines the line size and whether tile maps are included.
/// Texture unit and cycles are not set.
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
    let (by_texture, by_level, by_draw) = match config.count_by {
        CountBy::Texture => {
            let names = tables.textures.iter().map(|t| t.name.clone()).collect();
            let levels = sums(level_names.collect(), |c| c.level);
            (sums(names, |c| c.part), levels, Vec::new())
        }
        CountBy::Draw => {
            let draws = sums(draw_names(tables), |c| c.part);
            (Vec::new(), Vec::new(), draws)
        }
    };
    RunResult {
        quads: trace.quads,
        lanes: trace.lanes,
        footprints: all.l1.footprints,
        l1: LevelResult::new(all.l1),
        l2: LevelResult::new(all.l2),
        external_bytes: all.l2.line_misses * u64::from(config.line_bytes),
        unique_lines: trace.unique_lines,
        access_hash: format!("{:016x}", trace.hash),
        by_view,
        by_texture,
        by_level,
        by_draw,
        tile_maps: if config.tile_maps {
            tile_maps(tables, bins, trace, caches, config.tile_px)
        } else {
            Vec::new()
        },
        ..RunResult::default()
    }
}

/// Number of each draw and name of its material.
fn draw_names(tables: &Tables) -> Vec<String> {
    let draws = tables.draws.iter().enumerate();
    draws
        .map(|(index, draw)| format!("draw {index}: {}", draw.material))
        .collect()
}

/// A cell's counters of both levels. L1 misses are the L2's look-ups.
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

fn tile_maps(
    tables: &Tables,
    bins: &Bins,
    trace: &TraceCounts,
    caches: &CacheCounts,
    tile_px: u32,
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
                    .map(|(tile, t)| t.lanes as f32 / pixels(pass, tile, tile_px) as f32)
                    .collect(),
                footprints: accesses.iter().map(|t| t.footprints).collect(),
                l1_misses: misses.iter().map(|t| t.l1_footprints).collect(),
                l2_misses: misses.iter().map(|t| t.l2_lines).collect(),
            }
        })
        .collect()
}

/// Pixels of a tile inside the image, whose edges cut the last tiles.
fn pixels(pass: &Pass, tile: u32, tile_px: u32) -> u32 {
    let at = [tile % pass.tiles[0], tile / pass.tiles[0]];
    let side = |axis: usize| {
        pass.size_px[axis]
            .saturating_sub(at[axis] * tile_px)
            .min(tile_px)
    };
    (side(0) * side(1)).max(1)
}

#[cfg(test)]
mod tests {
    use super::super::counts::FootprintMisses;
    use super::*;
    use crate::stream::Expander;
    use crate::stream::testing::Synthetic;

    /// Uses counts as large as those of a trace of many hours.
    #[test]
    fn counters_beyond_32_bits_keep_every_digit_in_sums_rates_bytes_and_json() {
        const MANY: u64 = 1 << 40;
        let trace = Synthetic::one_layer([32, 32], 120).generate();
        let config = RunConfig::default();
        let expander = Expander::new(&trace, &config).unwrap();
        let bins = expander.bins();
        let mut accesses = TraceCounts::new(bins);
        let mut caches = CacheCounts::new(bins, false);
        for (cell, misses) in accesses.cells.iter_mut().zip(&mut caches.cells) {
            (cell.footprints, cell.line_lookups) = (8 * MANY, 9 * MANY);
            let level = |lines| Misses {
                footprints: 2 * MANY,
                lines,
                secondary: 0,
            };
            (misses.l1, misses.l2) = (level(4 * MANY), level(MANY));
        }
        let miss = FootprintMisses {
            l1_lines: 3,
            l2_lines: 1,
            ..FootprintMisses::default()
        };
        caches.footprint(0, 0, &miss);
        let cells = bins.cells() as u64;
        let result = summary(&trace.tables, bins, &accesses, &caches, &config);
        assert_eq!(result.footprints, 8 * MANY * cells);
        assert_eq!(result.l1.counters.line_misses, 4 * MANY * cells + 3);
        assert_eq!(result.l2.counters.line_lookups, 4 * MANY * cells + 3);
        assert_eq!(result.external_bytes, (MANY * cells + 1) * 16);
        assert!((result.l1.footprint_miss_rate - 0.25).abs() < 1e-12);
        assert!((result.l2.line_miss_rate - 0.25).abs() < 1e-12);
        let of_parts: u64 = result.by_level.iter().map(|p| p.l2.line_misses).sum();
        assert_eq!(of_parts, MANY * cells + 1);
        let json = serde_json::to_string(&result).unwrap();
        assert_eq!(serde_json::from_str::<RunResult>(&json).unwrap(), result);
    }
}
