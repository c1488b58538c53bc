//! Captured views into a trace whose tables are known, for capturers that can draw a region again.

use crate::encode::{Recorded, write_region};
use crate::masked::DepthReplay;
use crate::regions::{TileRect, capture_view};
use crate::tiles::TileRules;
use crate::{Capturer, RawRecords, RecordError};
use formats::textrace::{Tables, TextraceWriter};
use std::io::{Seek, Write};

/// Turns what capturers hand over into the tiles of one trace. A region that overflows the capturer's memory is asked
/// for again in parts.
pub struct Recorder<'a> {
    tables: &'a Tables,
    rules: TileRules,
    /// Regions that the last view needed.
    parts: u32,
}

impl<'a> Recorder<'a> {
    /// The trace's tables.
    #[must_use]
    pub const fn tables(&self) -> &'a Tables {
        self.tables
    }

    /// For a trace with these tables; `replays` tells of each draw which depth test its primitives are held to among
    /// themselves. The capturer hands over depths for those of them that are.
    #[must_use]
    pub fn new(tables: &'a Tables, replays: Vec<DepthReplay>) -> Self {
        Self {
            tables,
            rules: TileRules::new(tables, replays),
            parts: 1,
        }
    }

    /// Captures a view as pass `pass` of the trace, in as many regions as its records require.
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
        let mut sink = |rect: &TileRect, records: RawRecords<'_>| {
            recorded += write_region(&self.rules, pass, rect, records, writer)?;
            Ok(())
        };
        let parts = capture_view(capturer, shape.size_px, self.parts, &mut sink)?;
        self.parts = parts;
        recorded.regions = parts;
        Ok(recorded)
    }
}
