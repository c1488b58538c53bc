//! A trace as if its pictures were half as wide and high.
//!
//! Of each 2x2 quads one is kept. Its pixels stand twice as far apart, so its derivatives double and its samples read the
//! next coarser level, as those of a quad of the smaller picture do. Coordinates are those of the kept quad.

use super::regroup::{Rendered, keep_quads, rendered};
use super::{StreamError, TileSource};
use crate::config::RunConfig;
use formats::textrace::{QuadRecord, Tables, Tile};
use formats::view::TILE_SIZE_PX;

/// See the module.
pub struct Halved<'a> {
    source: Rendered<'a>,
    tables: Tables,
}

impl<'a> Halved<'a> {
    /// The smaller pictures of a trace, with the fragments that are shaded under `config`.
    ///
    /// # Errors
    /// The trace does not hold the fragments that the removal of hidden surfaces needs.
    pub fn new(source: &'a dyn TileSource, config: &RunConfig) -> Result<Self, StreamError> {
        let config = RunConfig {
            tile_px: 2 * TILE_SIZE_PX,
            ..*config
        };
        let source = rendered(source, &config)?;
        let mut tables = source.tables().clone();
        for pass in &mut tables.passes {
            pass.size_px = pass.size_px.map(|side| side.div_ceil(2));
        }
        Ok(Self { source, tables })
    }
}

impl TileSource for Halved<'_> {
    fn tables(&self) -> &Tables {
        &self.tables
    }

    fn records(&self) -> u64 {
        self.source.records()
    }

    fn read_tile(&self, pass: u32, index: u32, tile: &mut Tile) -> Result<(), StreamError> {
        self.source.read_tile(pass, index, tile)?;
        keep_quads(tile, |record| {
            ((record.x | record.y) & 1 == 0).then(|| QuadRecord {
                x: record.x / 2,
                y: record.y / 2,
                dx: record.dx.map(|d| d.saturating_mul(2)),
                dy: record.dy.map(|d| d.saturating_mul(2)),
                cross: record.cross.map(|c| c.saturating_mul(4)),
                ..record
            })
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::testing::Synthetic;
    use std::collections::BTreeSet;

    /// Every record of a trace with its primitive and its quad in the picture.
    fn records(source: &dyn TileSource) -> Vec<(u32, [u32; 2], u32, QuadRecord)> {
        let (mut all, mut tile) = (Vec::new(), Tile::default());
        for (number, pass) in (0..).zip(&source.tables().passes) {
            for index in 0..pass.tile_count() {
                source.read_tile(number, index, &mut tile).unwrap();
                let at = [index % pass.tiles[0], index / pass.tiles[0]];
                for run in &tile.runs {
                    for record in &tile.records[run.first as usize..][..run.count as usize] {
                        assert!(record.x.max(record.y) < 8);
                        let quad = [record.x, record.y].map(u32::from);
                        let quad = [0, 1].map(|axis| at[axis] * TILE_SIZE_PX / 2 + quad[axis]);
                        all.push((number, quad, run.primitive, *record));
                    }
                }
            }
        }
        all
    }

    #[test]
    fn a_quad_of_four_is_kept_with_pixels_twice_as_far_apart() {
        let trace = Synthetic {
            materials: 2,
            seed: 9,
            ..Synthetic::new([160, 80], 17)
        }
        .generate();
        let halved = Halved::new(&trace, &RunConfig::default()).unwrap();
        for (half, whole) in halved.tables().passes.iter().zip(&trace.tables.passes) {
            assert_eq!(half.size_px, whole.size_px.map(|side| side / 2));
            assert_eq!(
                half.tiles,
                half.size_px.map(|side| side.div_ceil(TILE_SIZE_PX))
            );
        }
        let of = |(pass, quad, primitive, record): &(u32, [u32; 2], u32, QuadRecord)| {
            (
                *pass,
                *quad,
                *primitive,
                record.group,
                record.uv,
                record.lane_uv(3),
            )
        };
        let found: BTreeSet<_> = records(&halved).iter().map(of).collect();
        let kept = records(&trace).into_iter();
        let kept = kept.filter(|(_, quad, ..)| quad.iter().all(|at| at % 2 == 0));
        let expected: BTreeSet<_> = kept
            .map(|(pass, quad, primitive, record)| {
                // The lane that is two columns and two rows away.
                let far = [0, 1].map(|axis| {
                    record.uv[axis]
                        + 2 * record.dx[axis]
                        + 2 * record.dy[axis]
                        + 4 * record.cross[axis]
                });
                (
                    pass,
                    quad.map(|at| at / 2),
                    primitive,
                    record.group,
                    record.uv,
                    far,
                )
            })
            .collect();
        assert!(expected.len() > 100);
        assert!(found == expected);
    }
}
