//! Encoding 3: a plane for each primitive, and the residuals of its quads.
//!
//! A primitive's texture coordinates are a plane in perspective ([`plane`]). Its first quad is coded
//! exactly, as a difference from the prediction of an earlier primitive's plane ([`parents`]). Then follow
//! the resolution of the correction of the plane through that quad, and the correction. Every other quad is
//! the plane's prediction and a residual, mostly 0 or 1 fixed-point steps ([`mode`], [`residual`]). Sizes
//! of residuals and of a first quad's numbers ([`widths`]), and steps and masks ([`places`]), have prefix
//! codes with fixed lengths ([`lengths`]).
//!
//! A tile is written run by run from both ends: runs and places from the front, planes and residuals from
//! the back. A decoder thus has two independent chains of codes. The encoder fits the planes to the exact
//! records ([`fit`]); decoding does not depend on the method of fitting.

mod codes;
mod decode;
mod encode;
mod fit;
mod lengths;
mod mode;
mod parents;
mod places;
mod plane;
mod residual;
mod widths;

use super::bits::{BitWriter, PADDING_BYTES};
use super::{Decoded, Tile};
use crate::parse::{Cursor, Fault};
use codes::Codes;
use decode::Decoder;

/// Minimum bits per record, which bounds the number of records in a tile's bytes.
pub(super) const MIN_RECORD_BITS: u32 = 1;

/// Number of groups that a record can name.
const GROUPS: usize = 16;

/// The error for missing bits.
const SHORT: &str = "more bits";

pub(super) fn encode(tile: &Tile) -> Vec<u8> {
    let bytes = Vec::with_capacity(tile.records.len() * 4 + tile.runs.len() * 16 + 16);
    let (mut front, mut back) = (BitWriter::new(bytes), BitWriter::new(vec![]));
    encode::tile(tile, Codes::get(), &mut front, &mut back);
    let mut bytes = front.finish_unpadded();
    bytes.extend(back.finish_unpadded().iter().rev());
    bytes
}

pub(super) fn decode<'a>(runs: u32, records: u32, input: &'a [u8], tile: &mut Tile) -> Decoded<'a> {
    // The bytes in both directions, each with its own padding, so that both can be read in words.
    let padding = [0; PADDING_BYTES];
    let mut both = [input, &padding, input, &padding].concat();
    let (ahead, back) = both.split_at_mut(input.len() + PADDING_BYTES);
    if let Some((back, _)) = back.split_at_mut_checked(input.len()) {
        back.reverse();
    }
    let mut decoder = Decoder::new(ahead, back, runs);
    let outcome = decoder.tile(runs, records, tile);
    let (front, back) = (decoder.front, decoder.back);
    let rest = input.get(front.bytes_read()..).unwrap_or_default();
    outcome.map_err(|expected| Fault::short(rest, expected))?;
    let end = Cursor::new(rest);
    let read = front.bytes_read() + back.bytes_read();
    let expected = format_args!("{read} bytes, from the front and from the back");
    end.check(read == input.len(), expected, input.len())?;
    for left in [front.left_in_byte(), back.left_in_byte()] {
        let expected = "zero bits after the last record";
        end.check(left == 0, expected, format_args!("{left:#b}"))?;
    }
    Ok((&[], ()))
}

#[cfg(test)]
mod tests;
