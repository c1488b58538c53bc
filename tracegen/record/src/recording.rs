//! Writes a trace from events in their order, for capturers that do not know passes, draws or textures in
//! advance.

use crate::encode::{Recorded, write_region};
use crate::masked::DepthReplay;
use crate::regions::TileRect;
use crate::tiles::TileRules;
use crate::{RawDepth, RawRecord, RawRecords, RecordError};
use formats::textrace::{Draw, Pass, TextraceWriter, TraceMeta};
use formats::texture::{Sampler, Texture};
use std::collections::HashMap;
use std::io::{Seek, Write};

/// Takes textures, samplers, draws, passes and their records, in the order in which they come, and writes the trace.
///
/// A draw comes before its records, and its textures and samplers before it. The records of a pass are kept until it
/// ends, as any tile may get more of them.
pub struct Recording<W: Write + Seek> {
    writer: TextraceWriter<W>,
    rules: TileRules,
    samplers: HashMap<Sampler, u16>,
    open: Option<OpenPass>,
}

struct OpenPass {
    number: usize,
    tiles: [u32; 2],
    quads: Vec<RawRecord>,
    /// As long as `quads` as soon as any record came with depths.
    depths: Vec<RawDepth>,
}

impl<W: Write + Seek> Recording<W> {
    /// Starts a trace; the writer's tables grow (see [`TextraceWriter::create_growing`]).
    #[must_use]
    pub fn new(writer: TextraceWriter<W>) -> Self {
        let rules = TileRules::new(writer.tables(), Vec::new());
        Self {
            writer,
            rules,
            samplers: HashMap::new(),
            open: None,
        }
    }

    /// Adds a texture and returns its index.
    ///
    /// # Errors
    /// A full table.
    pub fn texture(&mut self, texture: Texture) -> Result<u32, RecordError> {
        Ok(self.writer.add_texture(texture)?)
    }

    /// Adds a sampler, unless the trace has it, and returns its index.
    ///
    /// # Errors
    /// A full table.
    pub fn sampler(&mut self, sampler: Sampler) -> Result<u16, RecordError> {
        if let Some(&index) = self.samplers.get(&sampler) {
            return Ok(index);
        }
        let index = self.writer.add_sampler(sampler)?;
        self.samplers.insert(sampler, index);
        Ok(index)
    }

    /// Adds a draw and tells its index. Its quads are held to the depth test `replay` among themselves; then their
    /// records come with depths.
    ///
    /// # Errors
    /// A full table.
    pub fn draw(&mut self, draw: Draw, replay: DepthReplay) -> Result<u32, RecordError> {
        self.rules
            .add_draw(&draw, &self.writer.tables().samplers, replay);
        Ok(self.writer.add_draw(draw)?)
    }

    /// Starts a pass and returns its index.
    ///
    /// # Errors
    /// A pass that is open, or one with too many tiles.
    pub fn begin_pass(&mut self, pass: Pass) -> Result<usize, RecordError> {
        if let Some(open) = &self.open {
            return Err(RecordError::Event {
                expected: "no open pass".to_owned(),
                found: format!("pass {}", open.number),
            });
        }
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
    /// No open pass, or depths of another number than the records.
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
    /// No open pass, records that contradict the tables, and errors of writing.
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

    /// The writer, to be finished, with the trace's description.
    ///
    /// # Errors
    /// An open pass.
    pub fn finish(mut self, meta: TraceMeta) -> Result<TextraceWriter<W>, RecordError> {
        if let Some(open) = self.open {
            return Err(RecordError::Event {
                expected: "no open pass".to_owned(),
                found: format!("pass {}", open.number),
            });
        }
        self.writer.set_meta(meta)?;
        Ok(self.writer)
    }
}

fn no_pass() -> RecordError {
    RecordError::Event {
        expected: "an open pass".to_owned(),
        found: "none".to_owned(),
    }
}
