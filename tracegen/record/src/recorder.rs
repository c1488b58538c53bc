//! Writes the records of capturers to a trace, whose tables are known in advance or grow.

use crate::encode::{Recorded, write_region};
use crate::masked::DepthReplay;
use crate::regions::{TileRect, capture_view};
use crate::tiles::TileRules;
use crate::{Capturer, RawDepth, RawRecord, RawRecords, RecordError};
use formats::textrace::{Draw, Pass, Tables, TextraceWriter};
use formats::texture::{Part, Sampler, Texture};
use std::collections::HashMap;
use std::io::{Seek, Write};

/// Converts records to the tiles of a trace.
///
/// A capturer that can render a region again captures a pass at once ([`Self::capture_pass`]). One that observes a
/// program adds textures and samplers before the draws that use them, draws before their records, and records to
/// the open pass. These are kept in memory until the pass ends, because any tile may still get more records.
pub struct Recorder<W: Write + Seek> {
    writer: TextraceWriter<W>,
    rules: TileRules,
    samplers: HashMap<Sampler, u16>,
    open: Option<OpenPass>,
    /// Number of passes of the tables that were captured.
    captured: usize,
    /// Number of regions that the last of them needed.
    parts: u32,
}

struct OpenPass {
    number: usize,
    tiles: [u32; 2],
    quads: Vec<RawRecord>,
    /// Has the length of `quads` once records with depths were added.
    depths: Vec<RawDepth>,
}

impl<W: Write + Seek> Recorder<W> {
    /// A recorder for the writer's tables. `replays` has the depth test between the primitives of each of their
    /// draws. For draws with such a test, the capturer must provide depths.
    pub fn new(writer: TextraceWriter<W>, replays: Vec<DepthReplay>) -> Self {
        let tables = writer.tables();
        Self {
            rules: TileRules::new(tables, replays),
            samplers: tables.samplers.iter().copied().zip(0..).collect(),
            open: None,
            captured: 0,
            parts: 1,
            writer,
        }
    }

    /// Tables of the trace.
    pub fn tables(&self) -> &Tables {
        self.writer.tables()
    }

    /// The writer.
    pub fn writer(&mut self) -> &mut TextraceWriter<W> {
        &mut self.writer
    }

    /// Index of the pass that [`Self::capture_pass`] captures next.
    pub fn next_pass(&self) -> usize {
        self.captured
    }

    /// Captures the next pass of the tables, in as many regions as its records need. A region that overflows the
    /// capturer's memory is captured again in parts.
    ///
    /// # Errors
    /// Errors of the capturer, a tile that overflows alone, records that contradict the tables, and errors of
    /// writing.
    pub fn capture_pass<C: Capturer>(&mut self, capturer: &mut C) -> Result<Recorded, C::Error> {
        let pass = self.captured;
        let passes = &self.writer.tables().passes;
        let Some(&Pass { size_px, .. }) = passes.get(pass) else {
            return Err(C::Error::from(RecordError::Invalid {
                expected: format!("a pass below {}", passes.len()),
                found: pass.to_string(),
            }));
        };
        let mut recorded = Recorded::default();
        let mut sink = |rect: &TileRect, records: RawRecords<'_>| {
            recorded += write_region(&self.rules, pass, rect, records, &mut self.writer)?;
            Ok(())
        };
        self.parts = capture_view(capturer, size_px, self.parts, &mut sink)?;
        recorded.regions = self.parts;
        self.captured += 1;
        Ok(recorded)
    }

    /// Adds a texture and returns its index.
    ///
    /// # Errors
    /// The table is full.
    pub fn texture(&mut self, texture: Texture) -> Result<u32, RecordError> {
        Ok(self.writer.add_texture(texture)?)
    }

    /// Makes a texture a part of another one.
    ///
    /// # Errors
    /// There is no such texture.
    pub fn part(&mut self, texture: u32, part: Part) -> Result<(), RecordError> {
        Ok(self.writer.set_part(texture, Some(part))?)
    }

    /// Adds a sampler, unless the trace already has it, and returns its index.
    ///
    /// # Errors
    /// The table is full.
    pub fn sampler(&mut self, sampler: Sampler) -> Result<u16, RecordError> {
        if let Some(&index) = self.samplers.get(&sampler) {
            return Ok(index);
        }
        let index = self.writer.add_sampler(sampler)?;
        self.samplers.insert(sampler, index);
        Ok(index)
    }

    /// Adds a draw and returns its index. With a depth test `replay` between its quads, its records must have
    /// depths.
    ///
    /// # Errors
    /// The table is full.
    pub fn draw(&mut self, draw: Draw, replay: DepthReplay) -> Result<u32, RecordError> {
        self.rules
            .add_draw(&draw, &self.writer.tables().samplers, replay);
        Ok(self.writer.add_draw(draw)?)
    }

    /// Starts a pass and returns its index.
    ///
    /// # Errors
    /// Another pass is open, or the pass has too many tiles.
    pub fn begin_pass(&mut self, pass: Pass) -> Result<usize, RecordError> {
        self.check_closed()?;
        let number = self.writer.add_pass(pass)?;
        self.open = Some(OpenPass {
            number,
            tiles: pass.tiles,
            quads: Vec::new(),
            depths: Vec::new(),
        });
        Ok(number)
    }

    /// Adds records to the open pass, in any order.
    ///
    /// # Errors
    /// No pass is open, or the numbers of depths and records differ.
    pub fn records(&mut self, records: RawRecords<'_>) -> Result<(), RecordError> {
        let open = self.open.as_mut().ok_or_else(no_pass)?;
        let (quads, depths) = (records.quads.len(), records.depths.len());
        if depths != 0 && depths != quads {
            return Err(RecordError::Event {
                expected: format!("no depths or {quads}"),
                found: depths.to_string(),
            });
        }
        if depths != 0 {
            open.depths.resize(open.quads.len(), RawDepth::default());
            open.depths.extend_from_slice(records.depths);
        }
        open.quads.extend_from_slice(records.quads);
        if !open.depths.is_empty() {
            open.depths.resize(open.quads.len(), RawDepth::default());
        }
        Ok(())
    }

    /// Ends the open pass and writes its tiles.
    ///
    /// # Errors
    /// No pass is open, records contradict the tables, or writing failed.
    pub fn end_pass(&mut self) -> Result<Recorded, RecordError> {
        let open = self.open.take().ok_or_else(no_pass)?;
        let whole = TileRect {
            origin: [0, 0],
            size: open.tiles,
        };
        let records = RawRecords {
            quads: &open.quads,
            depths: &open.depths,
        };
        write_region(&self.rules, open.number, &whole, records, &mut self.writer)
    }

    /// The writer, which the caller must finish.
    ///
    /// # Errors
    /// A pass is open.
    pub fn into_writer(self) -> Result<TextraceWriter<W>, RecordError> {
        self.check_closed()?;
        Ok(self.writer)
    }

    fn check_closed(&self) -> Result<(), RecordError> {
        match &self.open {
            None => Ok(()),
            Some(open) => Err(RecordError::Event {
                expected: "no open pass".to_owned(),
                found: format!("pass {}", open.number),
            }),
        }
    }
}

fn no_pass() -> RecordError {
    RecordError::Event {
        expected: "an open pass".to_owned(),
        found: "none".to_owned(),
    }
}
