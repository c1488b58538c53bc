//! Sorts the records of a region by tile, primitive, quad and group.
//!
//! Records arrive in the driver's order, which depends on its threads. Each record of a region has a unique
//! sort key, so the result does not depend on that order.

use super::raw::RawRecord;
use super::regions::TileRect;
use formats::textrace::quad_morton;
use rayon::prelude::*;
use std::ops::Range;

/// A record's sort key within its tile, and its index.
pub(crate) type Entry = (u64, u32);

/// A region's records by tile.
pub(crate) struct Bins {
    chunks: Vec<Chunk>,
}

struct Chunk {
    /// Start of each tile's entries; has one element more than there are tiles.
    starts: Vec<u32>,
    entries: Vec<Entry>,
}

impl Bins {
    /// Counting sort by tile, in parallel over chunks of the records. Records outside `rect` are left out.
    pub fn new(records: &[RawRecord], rect: &TileRect) -> Self {
        let chunk_len = records
            .len()
            .div_ceil(4 * rayon::current_num_threads())
            .max(4096);
        let chunks = records
            .par_chunks(chunk_len)
            .enumerate()
            .map(|(number, records)| Chunk::new(records, (number * chunk_len) as u32, rect))
            .collect();
        Self { chunks }
    }

    /// Writes the sorted entries of a tile to `order`.
    pub fn sorted(&self, tile: usize, order: &mut Vec<Entry>) {
        order.clear();
        for chunk in &self.chunks {
            order.extend_from_slice(&chunk.entries[chunk.range(tile)]);
        }
        // If the driver draws a tile in one thread, its primitives are already in order, and only the quads
        // of each primitive must be sorted.
        let primitive = |entry: &Entry| entry.0 >> 32;
        if order.is_sorted_by_key(primitive) {
            for quads in order.chunk_by_mut(|a, b| primitive(a) == primitive(b)) {
                quads.sort_unstable();
            }
        } else {
            order.sort_unstable();
        }
    }
}

impl Chunk {
    fn new(records: &[RawRecord], first: u32, rect: &TileRect) -> Self {
        let mut starts = vec![0_u32; rect.count() + 1];
        // Tile index per record, four bytes each. Records outside have the index after the last tile.
        let outside = rect.count() as u32;
        let tile = |r: &RawRecord| rect.index(r).map_or(outside, |tile| tile as u32);
        let tiles: Vec<u32> = records.iter().map(tile).collect();
        for &tile in tiles.iter().filter(|&&tile| tile < outside) {
            starts[tile as usize + 1] += 1;
        }
        for tile in 0..rect.count() {
            starts[tile + 1] += starts[tile];
        }
        let mut next = starts.clone();
        let mut entries = vec![(0, 0); starts.last().map_or(0, |&count| count as usize)];
        for ((index, tile), record) in (first..).zip(tiles).zip(records) {
            if tile < outside {
                let place = &mut next[tile as usize];
                entries[*place as usize] = (sort_key(record), index);
                *place += 1;
            }
        }
        Self { starts, entries }
    }

    fn range(&self, tile: usize) -> Range<usize> {
        self.starts[tile] as usize..self.starts[tile + 1] as usize
    }
}

/// Sort key within a tile: primitive, Morton position of the quad, group, mask. A primitive that was clipped
/// into several triangles may cover a quad twice, with disjoint masks. Operands have the group of the record
/// after them. Entries with equal keys are sorted by index, so operands stay directly before their record.
fn sort_key(record: &RawRecord) -> u64 {
    let morton = quad_morton((record.qx() & 7) as u8, (record.qy() & 7) as u8);
    let group = record.group() + u8::from(record.is_operands());
    u64::from(record.primitive) << 32
        | u64::from(morton) << 8
        | u64::from(group) << 4
        | u64::from(record.mask())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn records(count: u32) -> Vec<RawRecord> {
        let mut state = 7_u32;
        (0..count)
            .map(|i| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                RawRecord {
                    header: RawRecord::pack(state >> 8 & 63, state >> 16 & 31, 15, 0),
                    primitive: i,
                    ..RawRecord::default()
                }
            })
            .collect()
    }

    #[test]
    fn every_record_is_in_its_tile_once() {
        let records = records(20_000);
        let rect = TileRect {
            origin: [0, 0],
            size: [8, 4],
        };
        let bins = Bins::new(&records, &rect);
        let mut seen = vec![0; records.len()];
        let mut order = Vec::new();
        for tile in 0..rect.count() {
            let [column, row] = rect.tile(tile);
            bins.sorted(tile, &mut order);
            assert!(order.is_sorted());
            for &(key, i) in &order {
                let r = &records[i as usize];
                assert_eq!(key, sort_key(r));
                assert_eq!([r.qx() / 8, r.qy() / 8], [column, row]);
                seen[i as usize] += 1;
            }
        }
        assert!(seen.iter().all(|&n| n == 1));
    }

    #[test]
    fn records_outside_the_rectangle_are_left_out() {
        let records = records(20_000);
        let rect = TileRect {
            origin: [2, 1],
            size: [3, 2],
        };
        let bins = Bins::new(&records, &rect);
        let mut order = Vec::new();
        let mut found = 0;
        for tile in 0..rect.count() {
            bins.sorted(tile, &mut order);
            found += order.len();
        }
        let inside =
            |r: &&RawRecord| (2..5).contains(&(r.qx() / 8)) && (1..3).contains(&(r.qy() / 8));
        assert_eq!(found, records.iter().filter(inside).count());
    }

    #[test]
    fn keys_order_primitives_then_quads_then_groups() {
        let key = |primitive, qx, qy, group| {
            sort_key(&RawRecord {
                header: RawRecord::pack(qx, qy, 1, group),
                primitive,
                ..RawRecord::default()
            })
        };
        assert!(key(1, 7, 7, 15) < key(2, 0, 0, 0));
        assert!(key(1, 1, 0, 15) < key(1, 0, 1, 0));
        assert!(key(1, 8, 0, 0) < key(1, 9, 0, 0));
        assert!(key(1, 3, 3, 2) < key(1, 3, 3, 3));
        let operands = RawRecord {
            header: RawRecord::pack(3, 3, 1, 2),
            primitive: 1,
            passing: RawRecord::OPERANDS,
            ..RawRecord::default()
        };
        assert_eq!(sort_key(&operands), key(1, 3, 3, 3));
    }
}
