//! Converts a region's raw records to encoded tiles of the trace.

use crate::bins::Bins;
use crate::regions::TileRect;
use crate::tiles::{CaptureCounts, Scratch, TileRules};
use crate::{RawRecords, RecordError};
use formats::textrace::{EncodedTile, TextraceWriter, encode_tile_as};
use rayon::prelude::*;
use std::io::{Seek, Write};
use std::ops::AddAssign;
use std::time::{Duration, Instant};

/// Result of capturing a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Recorded {
    /// Counts of the records.
    pub counts: CaptureCounts,
    /// Number of regions in which the view was captured, without those that overflowed.
    pub regions: u32,
    /// Time for sorting, encoding and writing.
    pub sorting: Duration,
}

impl AddAssign for Recorded {
    fn add_assign(&mut self, other: Self) {
        formats::add_fields!(self, other, counts, regions, sorting);
    }
}

/// Bins, sorts, filters, quantises and encodes the records of a complete region, with tiles in parallel, and
/// appends its tiles to the trace.
pub(crate) fn write_region<W: Write + Seek>(
    rules: &TileRules,
    pass: usize,
    rect: &TileRect,
    records: RawRecords<'_>,
    writer: &mut TextraceWriter<W>,
) -> Result<Recorded, RecordError> {
    let start = Instant::now();
    let bins = Bins::new(records.quads, rect);
    let (encoding, tables) = (writer.encoding(), writer.tables());
    let columns = tables.passes.get(pass).map_or(0, |pass| pass.tiles[0]);
    let mut encoded: Vec<(usize, EncodedTile, CaptureCounts)> = (rect.by_blocks())
        .into_par_iter()
        .map_init(Scratch::default, |scratch, number| {
            let mut counts = rules.build(records, &bins, number, scratch)?;
            let tile = encode_tile_as(encoding, tables, &scratch.tile)?;
            counts.tile_bytes = tile.size_bytes() as u64;
            Ok((number, tile, counts))
        })
        .collect::<Result<_, RecordError>>()?;
    encoded.sort_unstable_by_key(|(number, ..)| *number);
    let mut counts = CaptureCounts::default();
    for (number, tile, of_tile) in encoded {
        let [column, row] = rect.tile(number);
        writer.append(
            pass,
            row as usize * columns as usize + column as usize,
            tile,
        )?;
        counts += of_tile;
    }
    Ok(Recorded {
        counts,
        regions: 1,
        sorting: start.elapsed(),
    })
}
