//! Encoding 2: a plane for each primitive, and what quads leave over.
//!
//! A primitive's texture coordinates are a plane seen in perspective ([`plane`]). Its first quad
//! is told exactly, as a difference from what an earlier primitive's plane says there; then how
//! finely the plane through that quad is corrected, and the correction. Every other quad is what the
//! plane says and a residual, mostly 0 or 1 of a fixed-point step. Sizes of residuals, and steps
//! and masks, are told by prefix codes with fixed lengths ([`lengths`]).
//!
//! The encoder fits the planes to the exact records ([`fit`]); a decoder does not need to know how.

mod codes;
mod decode;
mod encode;
mod fit;
mod lengths;
mod mode;
mod plane;
mod residual;
mod state;

use super::Tile;
use super::bits::BitWriter;
use crate::parse::{Fault, Parsed, ensure};
use codes::Codes;
use decode::Decoder;

/// Fewest bits that a record takes, which bounds the records that a tile's bytes can hold.
pub(super) const MIN_RECORD_BITS: u32 = 2;

/// Masks of a quad.
const MASKS: u32 = 15;
/// Steps along the curve that have symbols, 1 to this; the last symbol stands for all from here on,
/// and the step follows.
const STEPS: u32 = 7;
/// The symbol after which step, mask and group follow as numbers.
const ESCAPE_PLACE: u32 = STEPS * MASKS;
/// The symbol after which the classes follow as a number.
const ESCAPE_SIZES: u32 = 256;

/// Which code tells the level of a run's corrections; `None` where there are none.
fn level_context(records: u32) -> Option<usize> {
    match records {
        0 | 1 => None,
        2 | 3 => Some(0),
        4..=7 => Some(1),
        8..=15 => Some(2),
        _ => Some(3),
    }
}

/// Which code tells the sizes of a run's second quad: the third where the plane is uncorrected.
fn first_noise(level: u32) -> usize {
    if level == 0 { 3 } else { 2 }
}

pub(super) fn encode(tile: &Tile) -> Vec<u8> {
    let bytes = Vec::with_capacity(tile.records.len() * 4 + tile.runs.len() * 16 + 16);
    let mut bits = BitWriter::new(bytes);
    encode::tile(tile, Codes::get(), &mut bits);
    bits.finish_unpadded()
}

pub(super) fn decode<'a>(
    runs: u32,
    records: u32,
    input: &'a [u8],
    tile: &mut Tile,
) -> Parsed<'a, ()> {
    let mut decoder = Decoder::new(input);
    let outcome = decoder.tile(runs, records, tile);
    let bits = decoder.bits();
    let rest = bits.rest();
    outcome.map_err(|expected| {
        let found = format_args!("{} bytes left", rest.len());
        nom::Err::Failure(Fault::new(rest, expected, found))
    })?;
    ensure(
        rest,
        bits.left_in_byte() == 0,
        || "zero bits after the last record".to_owned(),
        format_args!("{:#b}", bits.left_in_byte()),
    )?;
    ensure(
        rest,
        rest.is_empty(),
        || "no bytes after the last record".to_owned(),
        format_args!("{}", rest.len()),
    )?;
    Ok((&[], ()))
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod train;
