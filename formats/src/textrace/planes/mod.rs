//! Encoding 3: a plane for each primitive, and what quads leave over.
//!
//! A primitive's texture coordinates are a plane seen in perspective ([`plane`]). Its first quad
//! is coded exactly, as a difference from what an earlier primitive's plane says there ([`parents`]);
//! then how finely the plane through that quad is corrected, and the correction. Every other quad is
//! what the plane says and a residual, mostly 0 or 1 of a fixed-point step ([`mode`], [`residual`]).
//! Sizes of residuals and of a first quad's numbers ([`widths`]), and steps and masks ([`places`]), are coded by
//! prefix codes with fixed lengths ([`lengths`]).
//!
//! A tile is written run by run, from both ends: runs and places from the front, planes and residuals from
//! the back. So a decoder has two chains of codes that do not wait for each other. The encoder fits the
//! planes to the exact records ([`fit`]); a decoder does not need to know how.

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

use super::Tile;
use super::bits::{BitWriter, PADDING_BYTES};
use crate::parse::{Fault, Parsed, ensure};
use codes::Codes;
use decode::Decoder;

/// Fewest bits that a record takes, which bounds the records that a tile's bytes can hold.
pub(super) const MIN_RECORD_BITS: u32 = 1;

/// Number of groups that a record can name.
const GROUPS: usize = 16;

/// What is expected where the bits end.
const SHORT: &str = "more bits";

pub(super) fn encode(tile: &Tile) -> Vec<u8> {
    let bytes = Vec::with_capacity(tile.records.len() * 4 + tile.runs.len() * 16 + 16);
    let (mut front, mut back) = (BitWriter::new(bytes), BitWriter::new(vec![]));
    encode::tile(tile, Codes::get(), &mut front, &mut back);
    let mut bytes = front.finish_unpadded();
    bytes.extend(back.finish_unpadded().iter().rev());
    bytes
}

pub(super) fn decode<'a>(
    runs: u32,
    records: u32,
    input: &'a [u8],
    tile: &mut Tile,
) -> Parsed<'a, ()> {
    // The bytes in both directions, each with padding of its own, so that both are read in words.
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
    outcome.map_err(|expected| {
        let found = format_args!("{} bytes left", rest.len());
        nom::Err::Failure(Fault::new(rest, expected, found))
    })?;
    let read = front.bytes_read() + back.bytes_read();
    ensure(
        rest,
        read == input.len(),
        || format!("{read} bytes, from the front and from the back"),
        format_args!("{}", input.len()),
    )?;
    for left in [front.left_in_byte(), back.left_in_byte()] {
        ensure(
            rest,
            left == 0,
            || "zero bits after the last record".to_owned(),
            format_args!("{left:#b}"),
        )?;
    }
    Ok((&[], ()))
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod train;
