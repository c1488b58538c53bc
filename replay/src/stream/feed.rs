//! What a core works on: the quads of its work item, one after another.

use super::{StreamError, TileSource};
use crate::order::{Interleave, TileRef, WorkItem};
use formats::textrace::{PrimitiveRun, QuadRecord, Tile};

/// One quad of one primitive: the unit that a shader core runs as a thread.
#[derive(Clone, Copy, Debug)]
pub struct Quad<'a> {
    /// Tile that it belongs to.
    pub at: TileRef,
    /// Index of its draw.
    pub draw: u32,
    /// Global number of its primitive.
    pub primitive: u32,
    /// Its records, one a uv group (and one a shadow cascade).
    pub records: &'a [QuadRecord],
}

impl Quad<'_> {
    /// Covered lanes, whatever they sample.
    #[must_use]
    pub fn lanes(&self) -> u32 {
        self.records
            .iter()
            .fold(0, |all, r| all | r.mask & 15)
            .count_ones()
    }
}

/// A work item's decoded tiles and the position in them.
#[derive(Debug, Default)]
pub struct Feed {
    tiles: [Tile; 2],
    at: [Option<TileRef>; 2],
    /// Runs left to do in order: which tile, which run.
    runs: Vec<(u8, u32)>,
    next_run: usize,
    /// Records of the current run that are left: tile, first, end, draw.
    slot: usize,
    next: usize,
    end: usize,
    draw: u32,
    primitive: u32,
}

impl Feed {
    /// Reads the tiles of the next item. Whatever was left of the last one is dropped.
    ///
    /// # Errors
    /// A tile cannot be read, or its runs point outside its records.
    pub fn load<S: TileSource + ?Sized>(
        &mut self,
        source: &S,
        item: &WorkItem,
    ) -> Result<(), StreamError> {
        self.at = [None; 2];
        self.runs.clear();
        (self.next_run, self.next, self.end) = (0, 0, 0);
        for (slot, at) in item.tiles().enumerate() {
            let tile = &mut self.tiles[slot];
            source.read_tile(at.pass, at.tile, tile)?;
            check(tile, at, source.tables().draws.len())?;
            self.at[slot] = Some(at);
        }
        let count = |slot: usize| self.tiles[slot].runs.len() as u32;
        match item {
            WorkItem::Tile(_) => self.runs.extend((0..count(0)).map(|run| (0, run))),
            WorkItem::Pair(_, _, Interleave::Alternate) => {
                let (left, right) = (count(0), count(1));
                for run in 0..left.max(right) {
                    self.runs.extend((run < left).then_some((0, run)));
                    self.runs.extend((run < right).then_some((1, run)));
                }
            }
            WorkItem::Pair(_, _, Interleave::Merge) => {
                self.runs.extend(
                    (0..2).flat_map(|slot| (0..count(slot)).map(move |run| (slot as u8, run))),
                );
                // Stable: a primitive's left run stays before its right one.
                let tiles = &self.tiles;
                self.runs.sort_by_key(|&(slot, run)| {
                    tiles[usize::from(slot)].runs[run as usize].primitive
                });
            }
        }
        Ok(())
    }

    /// The next quad, until the item is done.
    #[inline]
    pub fn next_quad(&mut self) -> Option<Quad<'_>> {
        while self.next == self.end {
            let &(slot, run) = self.runs.get(self.next_run)?;
            self.next_run += 1;
            self.slot = usize::from(slot);
            let run: PrimitiveRun = self.tiles[self.slot].runs[run as usize];
            self.next = run.first as usize;
            self.end = run.first as usize + run.count as usize;
            self.draw = run.draw;
            self.primitive = run.primitive;
        }
        let left = &self.tiles[self.slot].records[self.next..self.end];
        let position = |r: &QuadRecord| (r.x, r.y);
        let first = position(&left[0]);
        let count = left.iter().take_while(|r| position(r) == first).count();
        self.next += count;
        Some(Quad {
            at: self.at[self.slot]?,
            draw: self.draw,
            primitive: self.primitive,
            records: &left[..count],
        })
    }
}

/// Refuses runs that a damaged or hand-made trace might hold.
fn check(tile: &Tile, at: TileRef, draws: usize) -> Result<(), StreamError> {
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
    fn order(item: WorkItem) -> Vec<u32> {
        let mut feed = Feed::default();
        feed.load(&trace(), &item).unwrap();
        std::iter::from_fn(|| feed.next_quad().map(|q| q.at.pass)).collect()
    }

    #[test]
    fn alternating_lists_take_a_triangle_of_each_in_turn() {
        assert_eq!(
            order(WorkItem::Pair(LEFT, RIGHT, Interleave::Alternate)),
            [0, 0, 1, 0, 1, 0]
        );
    }

    #[test]
    fn merged_lists_put_the_same_triangle_side_by_side() {
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
        let mut feed = Feed::default();
        feed.load(&trace, &WorkItem::Tile(LEFT)).unwrap();
        let counts: Vec<usize> =
            std::iter::from_fn(|| feed.next_quad().map(|q| q.records.len())).collect();
        assert_eq!(counts, [2, 1]);
    }

    #[test]
    fn a_run_outside_the_records_is_refused() {
        let mut trace = trace();
        trace.tiles[0][0].runs[2].count = 7;
        let error = Feed::default()
            .load(&trace, &WorkItem::Tile(LEFT))
            .unwrap_err();
        assert!(error.to_string().contains("records 3 + 7"), "{error}");
    }
}
