//! Writes captured views to a trace with known tables, for capturers that can render a region again.

use crate::encode::{Recorded, write_region};
use crate::masked::DepthReplay;
use crate::regions::{TileRect, capture_view};
use crate::tiles::TileRules;
use crate::{Capturer, RawRecords, RecordError};
use formats::textrace::{Tables, TextraceWriter};
use std::io::{Seek, Write};

/// Converts the records of capturers to tiles of a trace. If a region overflows the capturer's memory, it is
/// captured again in parts.
pub struct Recorder<'a> {
    tables: &'a Tables,
    rules: TileRules,
    /// Number of regions that the last view needed.
    parts: u32,
}

impl<'a> Recorder<'a> {
    /// Tables of the trace.
    pub const fn tables(&self) -> &'a Tables {
        self.tables
    }

    /// A recorder for a trace with these tables. `replays` has the depth test between the primitives of each
    /// draw. For draws with such a test, the capturer must provide depths.
    pub fn new(tables: &'a Tables, replays: Vec<DepthReplay>) -> Self {
        Self {
            tables,
            rules: TileRules::new(tables, replays),
            parts: 1,
        }
    }

    /// Captures a view as pass `pass` of the trace, in as many regions as its records need.
    ///
    /// # Errors
    /// Errors of the capturer, a tile that overflows alone, records that contradict the tables, and errors of
    /// writing.
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
