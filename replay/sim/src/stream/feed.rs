//! Iterates over the quads of work items with their records.

use super::lines::{ListEntry, ListedRun, TilePart, interleaved};
use super::{StreamError, TileSource};
use crate::order::{TileRef, WorkItem};
use formats::textrace::{PrimitiveRun, QuadRecord, Tile};

/// A quad of a primitive, which a shader core runs as one thread.
#[derive(Clone, Copy, Debug)]
pub struct Quad<'a> {
    /// Its tile.
    pub at: TileRef,
    /// Index of its draw.
    pub draw: u32,
    /// Global number of its primitive.
    pub primitive: u32,
    /// Its records: one per uv group (and one per shadow cascade).
    pub records: &'a [QuadRecord],
}

/// Passes the quads of a work item to `send`, in a core's order.
///
/// # Errors
/// An unreadable tile, runs outside its records, or an error of `send`.
pub fn for_quads<E: From<StreamError>>(
    source: &dyn TileSource,
    item: &WorkItem,
    mut send: impl FnMut(Quad<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let mut tiles = Vec::new();
    for at in item.tiles() {
        let mut tile = Tile::default();
        read(source, at, &mut tile)?;
        tiles.push((at, tile));
    }
    let mut runs = Vec::new();
    let half = half_rows(source);
    match (*item, &*tiles) {
        (WorkItem::Pair(_, _, interleave), [(_, left), (_, right)]) => {
            let mut lists = [left, right].map(|tile| {
                tile.runs.iter().map(move |run| ListEntry {
                    primitive: run.primitive,
                    in_half: [false, true].map(|lower| {
                        let mut records = records(tile, run).iter();
                        records.any(|of| is_lower(of, half) == lower)
                    }),
                })
            });
            let [left, right] = &mut lists;
            interleaved(interleave, [left, right], &mut runs);
        }
        _ => runs.extend(
            (0..)
                .zip(tiles.iter().flat_map(|(_, tile)| &tile.runs))
                .map(|(run, _)| ListedRun {
                    tile: 0,
                    run,
                    part: TilePart::Whole,
                }),
        ),
    }
    for ListedRun { tile, run, part } in runs {
        let (at, tile) = &tiles[usize::from(tile)];
        let run = &tile.runs[run as usize];
        let is_in_part = |records: &&[QuadRecord]| {
            let lower = records.first().is_some_and(|of| is_lower(of, half));
            match part {
                TilePart::Whole => true,
                TilePart::Upper => !lower,
                TilePart::Lower => lower,
            }
        };
        for records in quads(tile, run).filter(is_in_part) {
            send(Quad {
                at: *at,
                draw: run.draw,
                primitive: run.primitive,
                records,
            })?;
        }
    }
    Ok(())
}

/// Reads a tile and checks it against the trace's tables.
pub(super) fn read(
    source: &dyn TileSource,
    at: TileRef,
    tile: &mut Tile,
) -> Result<(), StreamError> {
    source.read_tile(at.pass, at.tile, tile)?;
    check(tile, at, source.tables().draws.len())
}

fn records<'a>(tile: &'a Tile, run: &PrimitiveRun) -> &'a [QuadRecord] {
    &tile.records[run.first as usize..][..run.count as usize]
}

/// The quads of a run: consecutive records at the same position.
pub(super) fn quads<'a>(
    tile: &'a Tile,
    run: &PrimitiveRun,
) -> impl Iterator<Item = &'a [QuadRecord]> {
    let records = records(tile, run);
    records.chunk_by(|a, b| (a.x, a.y) == (b.x, b.y))
}

/// Rows of quads in the upper half of a tile.
pub(super) fn half_rows(source: &dyn TileSource) -> u32 {
    source.tile_px() / 4
}

/// True for a quad of the tile's lower half.
pub(super) fn is_lower(record: &QuadRecord, half_rows: u32) -> bool {
    u32::from(record.y) >= half_rows
}

/// Covered lanes of a quad, whatever they sample.
#[inline]
pub(super) fn lanes(records: &[QuadRecord]) -> u32 {
    let all = records.iter().fold(0, |all, r| all | r.mask & 15);
    all.count_ones()
}

/// Refuses invalid runs of damaged or hand-made traces.
pub(super) fn check(tile: &Tile, at: TileRef, draws: usize) -> Result<(), StreamError> {
    let records = tile.records.len() as u64;
    let bad = tile.runs.iter().find(|run| {
        u64::from(run.first) + u64::from(run.count) > records || run.draw as usize >= draws
    });
    bad.map_or(Ok(()), |run| {
        Err(StreamError::Tile {
            pass: at.pass,
            tile: at.tile,
            message: format!(
                "primitive {}: expected a draw below {draws} and records below {records}, found draw {} and records {} + {}",
                run.primitive, run.draw, run.first, run.count
            ),
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::MemoryTrace;
    use super::*;
    use crate::order::Interleave;
    use crate::stream::testing::{record, tables, tile};

    fn trace() -> MemoryTrace {
        MemoryTrace {
            tables: tables(&[[64, 64]]),
            tiles: vec![
                vec![tile(&[(1, 2), (4, 1), (9, 1)])],
                vec![tile(&[(4, 1), (8, 1)])],
            ],
        }
    }

    const LEFT: TileRef = TileRef { pass: 0, tile: 0 };
    const RIGHT: TileRef = TileRef { pass: 1, tile: 0 };

    /// Pass and number of records of each quad, in order.
    fn quads(trace: &MemoryTrace, item: WorkItem) -> Result<Vec<(u32, usize)>, StreamError> {
        let mut quads = Vec::new();
        let send = |quad: Quad<'_>| -> Result<(), StreamError> {
            quads.push((quad.at.pass, quad.records.len()));
            Ok(())
        };
        for_quads(trace, &item, send).map(|()| quads)
    }

    fn order(item: WorkItem) -> Vec<u32> {
        let quads = quads(&trace(), item).unwrap();
        quads.iter().map(|(pass, _)| *pass).collect()
    }

    #[test]
    fn alternate_interleaving_alternates_the_triangles_of_both_lists() {
        assert_eq!(
            order(WorkItem::Pair(LEFT, RIGHT, Interleave::Alternate)),
            [0, 0, 1, 0, 1, 0]
        );
    }

    #[test]
    fn merged_lists_place_equal_triangles_next_to_each_other() {
        assert_eq!(
            order(WorkItem::Pair(LEFT, RIGHT, Interleave::Merge)),
            [0, 0, 0, 1, 1, 0]
        );
    }

    #[test]
    fn records_at_one_position_are_one_quad() {
        let mut trace = trace();
        let tile = &mut trace.tiles[0][0];
        tile.records = vec![record(0, 0), record(0, 0), record(1, 0)];
        tile.runs.truncate(1);
        tile.runs[0].count = 3;
        let quads = quads(&trace, WorkItem::Tile(LEFT)).unwrap();
        assert_eq!(quads, [(0, 2), (0, 1)]);
    }

    #[test]
    fn a_run_outside_the_records_is_refused() {
        let mut trace = trace();
        trace.tiles[0][0].runs[2].count = 7;
        let error = quads(&trace, WorkItem::Tile(LEFT)).unwrap_err();
        assert!(error.to_string().contains("records 3 + 7"), "{error}");
    }

    /// A tile whose primitives have quads in rows 0 to 7 as given.
    fn halves(runs: &[(u32, &[u8])]) -> Tile {
        let mut tile = Tile::default();
        for &(primitive, rows) in runs {
            tile.runs.push(PrimitiveRun {
                primitive,
                draw: 0,
                first: tile.records.len() as u32,
                count: rows.len() as u32,
            });
            tile.records.extend(rows.iter().map(|&y| record(0, y)));
        }
        tile
    }

    #[test]
    fn halves_alternate_the_upper_quads_of_both_tiles_then_the_lower_ones() {
        let trace = MemoryTrace {
            tables: tables(&[[64, 64]]),
            tiles: vec![
                vec![halves(&[(1, &[0, 3, 4]), (2, &[7]), (3, &[2])])],
                vec![halves(&[(1, &[5]), (4, &[1, 6])])],
            ],
        };
        let pair = WorkItem::Pair(LEFT, RIGHT, Interleave::Halves);
        let mut sent = Vec::new();
        for_quads(&trace, &pair, |quad| {
            sent.push((quad.at.pass, quad.primitive, quad.records[0].y));
            Ok::<_, StreamError>(())
        })
        .unwrap();
        let upper = [(0, 1, 0), (0, 1, 3), (1, 4, 1), (0, 3, 2)];
        let lower = [(0, 1, 4), (1, 1, 5), (0, 2, 7), (1, 4, 6)];
        assert_eq!(sent, [upper, lower].concat());
        // The lists of lines are taken in the same order.
        let config = crate::config::RunConfig::default();
        let expander = crate::stream::Expander::new(&trace, &config).unwrap();
        let memory = crate::stream::LineMemory::new(1 << 20);
        let mut counts = crate::stream::TraceCounts::new(expander.bins());
        let frame = expander.frame(0, &memory, &mut counts).unwrap();
        let mut cores = crate::stream::Cores::new(&frame, 1);
        cores.load(0, &pair).unwrap();
        let mut tiles = Vec::new();
        while let Some(quad) = cores.next_quad(0) {
            tiles.push(quad.tile() as u32);
        }
        let expected: Vec<u32> = sent.iter().map(|&(pass, ..)| pass).collect();
        assert_eq!(tiles, expected);
    }
}
