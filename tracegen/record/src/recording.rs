//! Writes a trace from a sequence of events, for capturers that do not know passes, draws or textures in
//! advance.

use crate::encode::{Recorded, write_region};
use crate::masked::DepthReplay;
use crate::regions::TileRect;
use crate::tiles::TileRules;
use crate::{RawDepth, RawRecord, RawRecords, RecordError};
use formats::textrace::{Draw, Pass, TextraceWriter, TraceMeta};
use formats::texture::{Part, Sampler, Texture};
use std::collections::HashMap;
use std::io::{Seek, Write};

/// Receives textures, samplers, draws, passes and their records in order, and writes the trace.
///
/// Textures and samplers must be added before the draws that use them, and draws before their records. The
/// records of a pass are kept in memory until it ends, because any tile may still get more records.
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
    /// Has the length of `quads` once records with depths were added.
    depths: Vec<RawDepth>,
}

impl<W: Write + Seek> Recording<W> {
    /// Starts a trace; the writer's tables grow (see [`TextraceWriter::create_growing`]).
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

    /// Sets the description and returns the writer, which the caller must finish.
    ///
    /// # Errors
    /// A pass is open.
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
