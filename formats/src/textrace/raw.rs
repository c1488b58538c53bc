//! Encoding 0: runs and records as in memory. For debugging, and as reference in tests of the compact
//! encodings.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{PrimitiveRun, QuadRecord, Tile};
use crate::parse::Parsed;
use nom::Parser;
use nom::error::context;
use nom::number::complete::{le_i32, le_u32, u8};

/// Bytes of a run: primitive, draw, records.
pub const RUN_BYTES: usize = 12;
/// Bytes of a record.
pub const RECORD_BYTES: usize = 36;

pub(super) fn encode(tile: &Tile) -> Vec<u8> {
    let size = tile.runs.len() * RUN_BYTES + tile.records.len() * RECORD_BYTES;
    let mut bytes = Vec::with_capacity(size);
    for run in &tile.runs {
        for number in [run.primitive, run.draw, run.count] {
            bytes.extend(number.to_le_bytes());
        }
    }
    for record in &tile.records {
        bytes.extend([record.x, record.y, record.mask, record.group]);
        for number in [record.uv, record.dx, record.dy, record.cross].as_flattened() {
            bytes.extend(number.to_le_bytes());
        }
    }
    bytes
}

pub(super) fn decode<'a>(
    runs: u32,
    records: u32,
    input: &'a [u8],
    tile: &mut Tile,
) -> Parsed<'a, ()> {
    let mut rest = input;
    let mut first = 0u32;
    for _ in 0..runs {
        let (after, (primitive, draw, count)) =
            context("a run of 12 bytes", (le_u32, le_u32, le_u32)).parse(rest)?;
        tile.runs.push(PrimitiveRun {
            primitive,
            draw,
            first,
            count,
        });
        first = first.saturating_add(count);
        rest = after;
    }
    for _ in 0..records {
        let (after, ((x, y, mask, group), uv, dx, dy, cross)) = context(
            "a record of 36 bytes",
            ((u8, u8, u8, u8), pair, pair, pair, pair),
        )
        .parse(rest)?;
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
        rest = after;
    }
    Ok((rest, ()))
}

fn pair(input: &[u8]) -> Parsed<'_, [i32; 2]> {
    (le_i32, le_i32).map(|(u, v)| [u, v]).parse(input)
}
