//! Encoding 1: bit-packed residuals of a linear prediction.
//!
//! Texture coordinates over a primitive are a plane in perspective. A quad's derivatives are predicted from
//! the previous quad's, and its coordinates from both by the trapezoid rule. Small primitives of one draw
//! continue each other, so the first quad of a run is predicted from the run before. All arithmetic wraps,
//! so the encoding is lossless for all numbers.
//!
//! Layout: the runs as bytes, then the records as bits, then [`PADDING_BYTES`] zero bytes.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

mod predict;
mod records;
mod runs;

use super::Tile;
use super::bits::{BitReader, BitWriter, PADDING_BYTES};
use crate::parse::{Cursor, Fault, Parsed};

/// Minimum bits per record, which bounds the number of records in a tile's bytes.
pub const MIN_RECORD_BITS: u32 = records::CONTROL_BITS;

pub(super) fn encode(tile: &Tile) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(tile.records.len() * 12 + tile.runs.len() * 4 + 16);
    runs::encode(&tile.runs, &mut bytes);
    let mut bits = BitWriter::new(bytes);
    records::encode(tile, &mut bits);
    bits.finish()
}

pub(super) fn decode<'a>(
    run_count: u32,
    record_count: u32,
    input: &'a [u8],
    tile: &mut Tile,
) -> Parsed<'a, ()> {
    let (packed, ()) = runs::decode(run_count, record_count, input, &mut tile.runs)?;
    let mut bits = BitReader::new(packed);
    let mut state = records::State::new();
    for run in &tile.runs {
        records::decode_run(run, &mut state, &mut bits, &mut tile.records)
            .ok_or_else(|| Fault::short(bits.rest(), "a record"))?;
    }
    let (end, left) = (Cursor::new(bits.rest()), bits.left_in_byte());
    let expected = "zero bits after the last record";
    end.check(left == 0, expected, format_args!("{left:#b}"))?;
    let is_padding = end.rest() == [0; PADDING_BYTES];
    let expected = format_args!("{PADDING_BYTES} zero bytes after the last record");
    end.check(
        is_padding,
        expected,
        format_args!("{} bytes", end.rest().len()),
    )?;
    Ok((&[], ()))
}

#[cfg(test)]
mod tests;
