//! Regroups the tiles of a trace to another size when they are read.
//!
//! Records keep the order of a trace (`Tile`): primitives in submission order and, within a primitive,
//! quads on the tile's Morton curve.

use super::feed::check;
use super::hsr::{Shaded, shaded};
use super::{StreamError, TileSource};
use crate::config::RunConfig;
use crate::order::TileRef;
use formats::textrace::{PrimitiveRun, QuadRecord, Tables, Tile};
use formats::view::TILE_SIZE_PX;

/// The trace as shaded by a configuration's renderer: hidden surfaces removed, in tiles of its size.
///
/// # Errors
/// The trace does not hold the fragments that the removal needs.
pub fn rendered<'a>(
    source: &'a dyn TileSource,
    config: &RunConfig,
) -> Result<Rendered<'a>, StreamError> {
    let shaded = shaded(source, config.hsr)?;
    let tables = (config.tile_px != TILE_SIZE_PX).then(|| {
        let mut tables = source.tables().clone();
        for pass in &mut tables.passes {
            pass.tiles = pass.size_px.map(|size| size.div_ceil(config.tile_px));
        }
        tables
    });
    Ok(Rendered {
        shaded,
        tables,
        tile_px: config.tile_px,
    })
}

/// See [`rendered`].
pub struct Rendered<'a> {
    shaded: Shaded<'a>,
    /// Present if tiles differ from the recorded ones.
    tables: Option<Tables>,
    tile_px: u32,
}

impl TileSource for Rendered<'_> {
    fn tables(&self) -> &Tables {
        self.tables.as_ref().unwrap_or(self.shaded.tables())
    }

    fn records(&self) -> u64 {
        self.shaded.records()
    }

    fn tile_px(&self) -> u32 {
        self.tile_px
    }

    fn read_tile(&self, pass: u32, index: u32, tile: &mut Tile) -> Result<(), StreamError> {
        let Some(tables) = &self.tables else {
            return self.shaded.read_tile(pass, index, tile);
        };
        let of_pass = tables.passes.get(pass as usize);
        let Some(columns) = of_pass.and_then(|of| (index < of.tile_count()).then_some(of.tiles[0]))
        else {
            return Err(StreamError::Tile {
                pass,
                tile: index,
                message: "no such tile".to_owned(),
            });
        };
        let at = [index % columns, index / columns];
        match self.tile_px < TILE_SIZE_PX {
            true => self.split(pass, at, tile),
            false => self.merge(pass, at, tile),
        }
    }
}

impl Rendered<'_> {
    /// Reads a recorded tile and checks its runs. Returns nothing for a tile outside the picture.
    fn recorded(&self, pass: u32, at: [u32; 2], tile: &mut Tile) -> Result<(), StreamError> {
        let tables = self.shaded.tables();
        let [columns, rows] = tables.passes[pass as usize].tiles;
        if at[0] >= columns || at[1] >= rows {
            tile.clear();
            return Ok(());
        }
        let index = at[1] * columns + at[0];
        self.shaded.read_tile(pass, index, tile)?;
        check(tile, TileRef { pass, tile: index }, tables.draws.len())
    }

    /// Reads the part of a recorded tile that lies in a smaller tile.
    fn split(&self, pass: u32, at: [u32; 2], tile: &mut Tile) -> Result<(), StreamError> {
        let per_edge = TILE_SIZE_PX / self.tile_px;
        let from = at.map(|place| place / per_edge);
        self.recorded(pass, from, tile)?;
        self.check_inside(pass, from, tile)?;
        let edge_quads = (self.tile_px / 2) as u8;
        let part = at.map(|place| (place % per_edge) as u8);
        keep_quads(tile, |record| {
            let is_inside = [record.x / edge_quads, record.y / edge_quads] == part;
            is_inside.then(|| QuadRecord {
                x: record.x % edge_quads,
                y: record.y % edge_quads,
                ..record
            })
        });
        Ok(())
    }

    /// Smaller tiles end at the picture's edge, so quads of a recorded tile outside the picture would be lost.
    fn check_inside(&self, pass: u32, at: [u32; 2], tile: &Tile) -> Result<(), StreamError> {
        let of_pass = &self.shaded.tables().passes[pass as usize];
        let room = [0, 1].map(|axis| {
            let left = of_pass.size_px[axis].saturating_sub(at[axis] * TILE_SIZE_PX);
            left.div_ceil(2)
        });
        let outside =
            |record: &&QuadRecord| u32::from(record.x) >= room[0] || u32::from(record.y) >= room[1];
        match tile.records.iter().find(outside) {
            None => Ok(()),
            Some(record) => Err(StreamError::Tile {
                pass,
                tile: at[1] * of_pass.tiles[0] + at[0],
                message: format!(
                    "expected quads inside the picture, in columns below {} and rows below {}, found column {} and row {}",
                    room[0], room[1], record.x, record.y
                ),
            }),
        }
    }

    /// Reads the recorded tiles in a larger tile, primitive by primitive.
    fn merge(&self, pass: u32, at: [u32; 2], tile: &mut Tile) -> Result<(), StreamError> {
        let per_edge = self.tile_px / TILE_SIZE_PX;
        let edge_quads = (TILE_SIZE_PX / 2) as u8;
        let mut parts = Vec::new();
        for place in morton(per_edge) {
            let mut part = Tile::default();
            let recorded = [0, 1].map(|axis| at[axis] * per_edge + place[axis]);
            self.recorded(pass, recorded, &mut part)?;
            for record in &mut part.records {
                record.x += place[0] as u8 * edge_quads;
                record.y += place[1] as u8 * edge_quads;
            }
            parts.push((0, part));
        }
        tile.clear();
        loop {
            let heads = parts.iter().filter_map(|(next, part)| part.runs.get(*next));
            let Some(&head) = heads.min_by_key(|run| run.primitive) else {
                return Ok(());
            };
            let first = tile.records.len();
            for (next, part) in &mut parts {
                if let Some(run) = part.runs.get(*next)
                    && (run.primitive, run.draw) == (head.primitive, head.draw)
                {
                    let records = run.first as usize..(run.first + run.count) as usize;
                    tile.records.extend_from_slice(&part.records[records]);
                    *next += 1;
                }
            }
            tile.runs.push(PrimitiveRun {
                first: first as u32,
                count: (tile.records.len() - first) as u32,
                ..head
            });
        }
    }
}

/// Keeps the quads of a tile for which `kept` returns a record, as that record.
pub(super) fn keep_quads(tile: &mut Tile, kept: impl Fn(QuadRecord) -> Option<QuadRecord>) {
    let (runs, records) = (std::mem::take(&mut tile.runs), &mut tile.records);
    let mut end = 0;
    for run in runs {
        let first = end;
        for index in run.first as usize..(run.first + run.count) as usize {
            if let Some(record) = kept(records[index]) {
                // The write position never passes the read position, because runs are consecutive.
                records[end] = record;
                end += 1;
            }
        }
        if end > first {
            tile.runs.push(PrimitiveRun {
                first: first as u32,
                count: (end - first) as u32,
                ..run
            });
        }
    }
    records.truncate(end);
}

/// The positions of a square grid along the Morton curve; `edge` is a power of two.
fn morton(edge: u32) -> impl Iterator<Item = [u32; 2]> {
    (0..edge * edge).map(|code| {
        let axis = |shift: u32| {
            let bits = (0..16).map(|bit| (code >> (2 * bit + shift) & 1) << bit);
            bits.sum::<u32>()
        };
        [axis(0), axis(1)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::replay;
    use crate::stream::MemoryTrace;
    use crate::stream::testing::Synthetic;

    fn trace() -> MemoryTrace {
        Synthetic {
            materials: 2,
            seed: 4,
            ..Synthetic::new([160, 80], 17)
        }
        .generate()
    }

    fn config(tile_px: u32) -> RunConfig {
        RunConfig {
            tile_px,
            tile_maps: true,
            ..RunConfig::default()
        }
    }

    /// Every record with its primitive, its draw and its quad in the picture.
    fn records(
        source: &dyn TileSource,
        tile_px: u32,
    ) -> Vec<(u32, [u32; 2], u32, u32, QuadRecord)> {
        let mut all = Vec::new();
        let mut tile = Tile::default();
        for (number, pass) in (0..).zip(&source.tables().passes) {
            for index in 0..pass.tile_count() {
                source.read_tile(number, index, &mut tile).unwrap();
                let corner =
                    [index % pass.tiles[0], index / pass.tiles[0]].map(|i| i * tile_px / 2);
                let mut next = 0;
                let mut before = None;
                for run in &tile.runs {
                    assert_eq!(run.first, next);
                    assert!(before < Some(run.primitive), "ascending");
                    before = Some(run.primitive);
                    next += run.count;
                    let records = &tile.records[run.first as usize..][..run.count as usize];
                    let codes: Vec<u64> = records.iter().map(code).collect();
                    assert!(codes.is_sorted(), "the Morton curve");
                    for record in records {
                        assert!(u32::from(record.x.max(record.y)) < tile_px / 2);
                        let quad = [record.x, record.y].map(u32::from);
                        let quad = [quad[0] + corner[0], quad[1] + corner[1]];
                        let plain = QuadRecord {
                            x: 0,
                            y: 0,
                            ..*record
                        };
                        all.push((number, quad, run.primitive, run.draw, plain));
                    }
                }
                assert_eq!(next as usize, tile.records.len());
            }
        }
        all.sort_by_key(|&(pass, quad, primitive, draw, record)| {
            (pass, primitive, draw, quad, record.group, record.mask)
        });
        all
    }

    fn code(record: &QuadRecord) -> u64 {
        let bits = |value: u8| {
            (0..8)
                .map(|bit| u64::from(value >> bit & 1) << (2 * bit))
                .sum::<u64>()
        };
        bits(record.x) | bits(record.y) << 1
    }

    #[test]
    fn tiles_of_every_size_have_the_same_records_in_capture_order() {
        let trace = trace();
        let expected = records(&trace, 16);
        for tile_px in [8, 16, 32, 64] {
            let rendered = rendered(&trace, &config(tile_px)).unwrap();
            assert_eq!(records(&rendered, tile_px), expected, "{tile_px}");
        }
    }

    #[test]
    fn a_quad_outside_the_picture_is_refused() {
        let mut trace = trace();
        for pass in &mut trace.tables.passes {
            pass.size_px = [156, 80];
        }
        let error = replay(&trace, &config(8)).unwrap_err().to_string();
        assert!(
            error.contains("expected quads inside the picture, in columns below 6"),
            "{error}"
        );
    }

    /// The samples do not depend on the tile size; only the misses do.
    #[test]
    fn replays_with_every_tile_size_shade_the_same_fragments() {
        let trace = trace();
        let recorded = replay(&trace, &config(16)).unwrap();
        let mut misses = vec![recorded.l1.counters.line_misses];
        for tile_px in [8, 32, 64] {
            let other = replay(&trace, &config(tile_px)).unwrap();
            assert_eq!(other.access_hash, recorded.access_hash, "{tile_px}");
            assert_eq!((other.quads, other.lanes), (recorded.quads, recorded.lanes));
            assert_eq!(other.unique_lines, recorded.unique_lines);
            let map = &other.tile_maps[0];
            assert_eq!(map.tiles, [160, 80].map(|size: u32| size.div_ceil(tile_px)));
            // Covered pixels of the pass, from the mean of each tile.
            let covered = |map: &crate::result::TileMap, tile_px: u32| -> f32 {
                let side = |at: u32, size: u32| (size - at * tile_px).min(tile_px);
                let area =
                    |tile: u32| side(tile % map.tiles[0], 160) * side(tile / map.tiles[0], 80);
                (0..)
                    .zip(&map.overdraw)
                    .map(|(tile, mean)| mean * area(tile) as f32)
                    .sum()
            };
            let difference = covered(map, tile_px) - covered(&recorded.tile_maps[0], 16);
            assert!(difference.abs() < 1.0, "{difference}");
            misses.push(other.l1.counters.line_misses);
        }
        misses.dedup();
        assert!(misses.len() > 1);
    }
}
