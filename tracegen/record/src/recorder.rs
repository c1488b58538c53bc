//! Appends captured views to a trace.

use crate::bins::Bins;
use crate::regions::{TileRect, capture_view};
use crate::tiles::{CaptureCounts, Scratch, TileRules};
use crate::{Capturer, RawRecords, RecordError};
use formats::textrace::{EncodedTile, Encoding, Tables, TextraceWriter, encode_tile_as};
use rayon::prelude::*;
use std::io::{Seek, Write};
use std::time::{Duration, Instant};

/// Turns what capturers hand over into the tiles of one trace.
pub struct Recorder<'a> {
    tables: &'a Tables,
    rules: TileRules,
    /// Regions that the last view needed.
    parts: u32,
}

/// What became of one pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Recorded {
    /// What was counted.
    pub counts: CaptureCounts,
    /// Regions that the view was captured in, those that overflowed left out.
    pub regions: u32,
    /// Time of sorting, encoding and writing.
    pub sorting: Duration,
}

impl<'a> Recorder<'a> {
    /// The trace's tables.
    #[must_use]
    pub const fn tables(&self) -> &'a Tables {
        self.tables
    }

    /// For a trace with these tables; `masked` tells of each draw whether the capturer hands over
    /// depths for it (see [`crate::RawDepth`]).
    #[must_use]
    pub fn new(tables: &'a Tables, masked: Vec<bool>) -> Self {
        Self {
            tables,
            rules: TileRules::new(tables, masked),
            parts: 1,
        }
    }

    /// Captures a view as pass `pass` of the trace, in as many regions as its records need.
    ///
    /// # Errors
    /// The capturer's errors, a tile that overflows alone, records that contradict the tables,
    /// and errors of writing.
    pub fn record_pass<C: Capturer, W: Write + Seek>(
        &mut self,
        capturer: &mut C,
        pass: usize,
        writer: &mut TextraceWriter<W>,
    ) -> Result<Recorded, C::Error> {
        let Some(shape) = self.tables.passes.get(pass) else {
            return Err(C::Error::from(RecordError::Invalid {
                expected: format!("a pass below {}", self.tables.passes.len()),
                found: pass.to_string(),
            }));
        };
        let mut recorded = Recorded::default();
        let encoding = writer.encoding();
        let mut sink = |rect: &TileRect, records: RawRecords<'_>| {
            let start = Instant::now();
            let (tiles, counts) = self.encode_region(encoding, rect, records)?;
            recorded.counts += counts;
            for (number, tile) in tiles.into_iter().enumerate() {
                let [column, row] = rect.tile(number);
                let index = row as usize * shape.tiles[0] as usize + column as usize;
                writer.append(pass, index, tile)?;
            }
            recorded.sorting += start.elapsed();
            Ok(())
        };
        let parts = capture_view(capturer, shape.size_px, self.parts, &mut sink)?;
        self.parts = parts;
        recorded.regions = parts;
        Ok(recorded)
    }

    /// Bins, sorts, filters, quantises and encodes a region's records, tiles in parallel.
    fn encode_region(
        &self,
        encoding: Encoding,
        rect: &TileRect,
        records: RawRecords<'_>,
    ) -> Result<(Vec<EncodedTile>, CaptureCounts), RecordError> {
        let bins = Bins::new(records.quads, rect);
        let mut encoded: Vec<(usize, EncodedTile, CaptureCounts)> = (rect.by_blocks())
            .into_par_iter()
            .map_init(Scratch::default, |scratch, number| {
                let mut counts = self.rules.build(records, &bins, number, scratch)?;
                let tile = encode_tile_as(encoding, self.tables, &scratch.tile)?;
                counts.tile_bytes = tile.size_bytes() as u64;
                Ok((number, tile, counts))
            })
            .collect::<Result<_, RecordError>>()?;
        encoded.sort_unstable_by_key(|(number, ..)| *number);
        let mut counts = CaptureCounts::default();
        let tiles = encoded
            .into_iter()
            .map(|(_, tile, of_tile)| {
                counts += of_tile;
                tile
            })
            .collect();
        Ok((tiles, counts))
    }
}
