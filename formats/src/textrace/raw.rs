//! Encoding 0: runs and records as in memory. For debugging, and as reference in tests of the compact
//! encodings.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{Decoded, PrimitiveRun, QuadRecord, Tile};
use crate::parse::{Cursor, Number};

/// Bytes of a run: primitive, draw, records.
pub const RUN_BYTES: usize = 12;
/// Bytes of a record.
pub const RECORD_BYTES: usize = 36;

pub(super) fn encode(tile: &Tile) -> Vec<u8> {
    let size = tile.runs.len() * RUN_BYTES + tile.records.len() * RECORD_BYTES;
    let mut bytes = Vec::with_capacity(size);
    for run in &tile.runs {
        [run.primitive, run.draw, run.count].put(&mut bytes);
    }
    for record in &tile.records {
        bytes.extend([record.x, record.y, record.mask, record.group]);
        [record.uv, record.dx, record.dy, record.cross].put(&mut bytes);
    }
    bytes
}

pub(super) fn decode<'a>(runs: u32, records: u32, input: &'a [u8], tile: &mut Tile) -> Decoded<'a> {
    let mut input = Cursor::new(input);
    let mut first = 0u32;
    for _ in 0..runs {
        let [primitive, draw, count] = input.fixed("a run of 12 bytes")?;
        tile.runs.push(PrimitiveRun {
            primitive,
            draw,
            first,
            count,
        });
        first = first.saturating_add(count);
    }
    for _ in 0..records {
        let [x, y, mask, group] = input.fixed("a record of 36 bytes")?;
        let [uv, dx, dy, cross] = input.fixed("a record of 36 bytes")?;
        tile.records.push(QuadRecord {
            x,
            y,
            mask,
            group,
            uv,
            dx,
            dy,
            cross,
        });
    }
    Ok((input.rest(), ()))
}
