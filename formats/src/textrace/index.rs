//! The tile index: where each tile's bytes are and what they hold.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::Encoding;
use crate::parse::{Fault, Parsed, ensure};
use nom::Parser;
use nom::error::context;
use nom::number::complete::{le_u32, le_u64};

/// Size of an index entry.
pub const INDEX_ENTRY_BYTES: usize = 32;

/// One entry of the index; all zero for a tile that nothing touched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct IndexEntry {
    /// Offset in the tile chunk.
    pub offset: u64,
    /// Encoded size.
    pub bytes: u32,
    /// CRC-32 of the encoded bytes.
    pub crc32: u32,
    /// Quad records.
    pub records: u32,
    /// Primitive runs.
    pub runs: u32,
    /// How the bytes are encoded.
    pub encoding: Encoding,
}

impl IndexEntry {
    pub(super) fn write(&self, bytes: &mut Vec<u8>) {
        bytes.extend(self.offset.to_le_bytes());
        for number in [self.bytes, self.crc32, self.records, self.runs] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend((self.encoding as u64).to_le_bytes());
    }

    pub(super) fn parse(input: &[u8]) -> Parsed<'_, Self> {
        let (at_encoding, (offset, bytes, crc32, records, runs)) = context(
            "an index entry of 32 bytes",
            (le_u64, le_u32, le_u32, le_u32, le_u32),
        )
        .parse(input)?;
        let (rest, id) = context("an index entry of 32 bytes", le_u64).parse(at_encoding)?;
        let encoding = Encoding::from_id(id).ok_or_else(|| {
            nom::Err::Failure(Fault::new(at_encoding, "an encoding of 0 or 1", id))
        })?;
        let entry = Self {
            offset,
            bytes,
            crc32,
            records,
            runs,
            encoding,
        };
        if records == 0 || runs == 0 || bytes == 0 {
            let expected = || "an untouched tile's entry to be zero".to_owned();
            ensure(
                input,
                entry == Self::default(),
                expected,
                format_args!("{entry:?}"),
            )?;
        }
        ensure(
            input,
            runs <= records && u64::from(records) <= encoding.most_records(bytes),
            || format!("counts that {bytes} bytes can hold"),
            format_args!("{runs} runs and {records} records"),
        )?;
        Ok((rest, entry))
    }
}
