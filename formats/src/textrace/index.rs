//! The tile index: position, size and encoding of each tile.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::Encoding;
use crate::parse::{Fault, Parsed, ensure};
use crate::tiles::TileSpan;
use nom::Parser;
use nom::error::context;
use nom::number::complete::{le_u32, le_u64};

/// Size of an index entry.
pub const INDEX_ENTRY_BYTES: usize = 32;

/// One entry of the index. For an untouched tile, all fields except the encoding are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct IndexEntry {
    /// Position of the tile.
    pub span: TileSpan,
    /// Quad records.
    pub records: u32,
    /// Primitive runs.
    pub runs: u32,
    /// Encoding of the bytes.
    pub encoding: Encoding,
}

impl IndexEntry {
    /// Position of the tile, if it is touched.
    pub(super) fn touched(&self) -> Option<TileSpan> {
        (self.records > 0).then_some(self.span)
    }

    pub(super) fn write(&self, bytes: &mut Vec<u8>) {
        self.span.write(bytes);
        bytes.extend(self.records.to_le_bytes());
        bytes.extend(self.runs.to_le_bytes());
        bytes.extend((self.encoding as u64).to_le_bytes());
    }

    pub(super) fn parse(input: &[u8]) -> Parsed<'_, Self> {
        let (at_encoding, (span, records, runs)) = context(
            "an index entry of 32 bytes",
            (TileSpan::parse, le_u32, le_u32),
        )
        .parse(input)?;
        let (rest, id) = context("an index entry of 32 bytes", le_u64).parse(at_encoding)?;
        let encoding = Encoding::from_id(id).ok_or_else(|| {
            nom::Err::Failure(Fault::new(at_encoding, "an encoding of 0, 1 or 3", id))
        })?;
        let entry = Self {
            span,
            records,
            runs,
            encoding,
        };
        if records == 0 || runs == 0 || span.bytes == 0 {
            ensure(
                input,
                (span, records, runs) == Default::default(),
                || "an untouched tile's entry to be zero except its encoding".to_owned(),
                format_args!(
                    "{} bytes at {}, {records} records, {runs} runs",
                    span.bytes, span.offset
                ),
            )?;
        }
        ensure(
            input,
            runs <= records && u64::from(records) <= encoding.most_records(span.bytes),
            || format!("counts that {} bytes can hold", span.bytes),
            format_args!("{runs} runs and {records} records"),
        )?;
        Ok((rest, entry))
    }
}
