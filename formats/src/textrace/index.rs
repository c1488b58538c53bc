//! The tile index: position, size and encoding of each tile.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::{Encoding, TILE_INDEX, TILES};
use crate::parse::Taken;
use crate::records::{Codec, Record};
use crate::tiles::{TileChunk, TileSpan};

/// Size of an index entry.
pub const INDEX_ENTRY_BYTES: usize = 32;

/// The tiles and their index.
pub(super) const TILE_CHUNK: TileChunk = TileChunk {
    tiles: TILES,
    index: TILE_INDEX,
    entry_bytes: INDEX_ENTRY_BYTES,
};

/// One entry of the index. For an untouched tile, all fields except the encoding are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
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
}

impl Record for IndexEntry {
    fn fields<'a>(&mut self, codec: &mut Codec<'a>) -> Taken<'a> {
        codec.record = "an index entry of 32 bytes";
        self.span.fields(codec)?;
        codec.number(&mut self.records)?;
        codec.number(&mut self.runs)?;
        codec.id(
            "an encoding of 0, 1 or 3",
            &Encoding::IDS,
            &mut self.encoding,
        )?;
        let Self {
            span,
            records,
            runs,
            encoding,
        } = *self;
        let is_empty = (span, records, runs) == Default::default();
        codec.check(
            is_empty || (records > 0 && runs > 0 && span.bytes > 0),
            "an untouched tile's entry to be zero except its encoding",
            format_args!(
                "{} bytes at {}, {records} records, {runs} runs",
                span.bytes, span.offset
            ),
        )?;
        codec.check(
            runs <= records && u64::from(records) <= encoding.most_records(span.bytes),
            format_args!("counts that {} bytes can hold", span.bytes),
            format_args!("{runs} runs and {records} records"),
        )
    }
}
