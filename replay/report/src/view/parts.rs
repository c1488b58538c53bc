//! Counts by eye, mip level, texture and draw, and the texels that textures and draws read.

use super::pack::{Packed, runs};
use formats::Broken;
use formats::layout::Layout;
use formats::textrace::Tables;
use serde::Serialize;
use sim::config::RunConfig;
use sim::result::{Part, RunResult};
use std::collections::BTreeMap;
use studies::experiment::{BOTH_EYES, FrameTiles, LevelReads, Read, ResultRow, level_reads};

/// The parts of a kind; lists have a number for each.
#[derive(Debug, Serialize)]
pub(super) struct Parts {
    kind: &'static str,
    names: Vec<String>,
    footprints: Vec<u64>,
    /// Distinct lines of each frame, and those that both eyes touch.
    lines: Vec<u64>,
    shared_lines: Vec<u64>,
    runs: Vec<PartsRun>,
}

/// Misses in an order.
#[derive(Debug, Serialize)]
struct PartsRun {
    l1_misses: Vec<u64>,
    l2_misses: Vec<u64>,
}

/// A level of a texture: texture, level, size in texels, lines, blocks read and all blocks, cells, shares of the cells.
#[derive(Debug, Serialize)]
pub(super) struct LevelMap(u32, u32, [u32; 2], u32, [u32; 2], [u32; 2], Packed);

/// The maps of each texture and of each draw.
#[derive(Debug, Serialize)]
pub(super) struct Maps {
    texture: Vec<Vec<LevelMap>>,
    draw: Vec<Vec<LevelMap>>,
}

/// Distinct lines by part, and those of both eyes.
type Lines = BTreeMap<u32, [u64; 2]>;

/// Sums over the frames of a trace.
#[derive(Default)]
pub(super) struct PartSums {
    eyes: Lines,
    levels: Lines,
    textures: Lines,
    draws: Lines,
    reads: Vec<Read>,
}

impl PartSums {
    pub fn add(&mut self, frame: &mut FrameTiles) {
        for bits in frame.eyes.values() {
            for eye in [0, 1] {
                if bits >> eye & 1 != 0 {
                    add(&mut self.eyes, eye, *bits);
                }
            }
        }
        let count = |sums: &mut Lines, part: fn(&Read) -> u32| {
            let reads = frame.reads.iter();
            let mut pairs: Vec<(u32, u32)> = reads.map(|read| (part(read), read.line)).collect();
            pairs.sort_unstable();
            pairs.dedup();
            for (part, line) in pairs {
                add(sums, part, frame.eyes.get(&line).copied().unwrap_or(0));
            }
        };
        count(&mut self.levels, |read| read.level);
        count(&mut self.textures, |read| read.texture);
        count(&mut self.draws, |read| read.draw);
        self.reads.append(&mut frame.reads);
        self.reads.sort_unstable();
        self.reads.dedup();
    }

    /// The parts of each kind. `draws` are the rows that count by draw.
    pub fn parts(&self, rows: &[ResultRow<'_>], draws: &[ResultRow<'_>]) -> Vec<Parts> {
        type Of = fn(&RunResult) -> &[Part];
        // Passes of both eyes have no lines of an eye.
        let kinds: [(&str, &[ResultRow<'_>], Of, &Lines); 4] = [
            ("eye", rows, |result| &result.by_view, &self.eyes),
            ("mip level", rows, |result| &result.by_level, &self.levels),
            ("texture", rows, |result| &result.by_texture, &self.textures),
            ("draw", draws, |result| &result.by_draw, &self.draws),
        ];
        let parts = kinds.map(|(kind, rows, of, lines)| {
            let first = rows.first().map_or(&[][..], |row| of(row.result));
            let of_lines = |which: usize| -> Vec<u64> {
                let parts = (0..first.len() as u32).map(|part| lines.get(&part));
                parts.map(|of| of.map_or(0, |of| of[which])).collect()
            };
            Parts {
                kind,
                names: first.iter().map(|part| part.name.clone()).collect(),
                footprints: first.iter().map(|part| part.l1.footprints).collect(),
                lines: of_lines(0),
                shared_lines: of_lines(1),
                runs: rows
                    .iter()
                    .map(|row| {
                        let parts = of(row.result).iter();
                        PartsRun {
                            l1_misses: parts.clone().map(|of| of.l1.footprint_misses).collect(),
                            l2_misses: parts.map(|of| of.l2.line_misses).collect(),
                        }
                    })
                    .collect(),
            }
        });
        parts.into()
    }

    /// Which texels are read in all frames.
    ///
    /// # Errors
    /// Textures that cannot be laid out.
    pub fn maps(&self, tables: &Tables, config: &RunConfig) -> Result<Maps, Broken> {
        let layout = Layout::new(&tables.textures, &config.layout)?;
        let maps = |reads: &[Read]| level_reads(reads, &layout, config.line_bytes);
        let mut draw: Vec<Vec<LevelMap>> = tables.draws.iter().map(|_| Vec::new()).collect();
        for reads in self.reads.chunk_by(|a, b| a.draw == b.draw) {
            draw[reads[0].draw as usize] = maps(reads).into_iter().map(LevelMap::from).collect();
        }
        let of_any = |read: &Read| Read { draw: 0, ..*read };
        let mut reads: Vec<Read> = self.reads.iter().map(of_any).collect();
        reads.sort_unstable();
        reads.dedup();
        let mut texture: Vec<Vec<LevelMap>> = tables.textures.iter().map(|_| Vec::new()).collect();
        for map in maps(&reads) {
            texture[map.texture as usize].push(map.into());
        }
        Ok(Maps { texture, draw })
    }
}

fn add(sums: &mut Lines, part: u32, eyes: u8) {
    let [lines, shared] = sums.entry(part).or_default();
    *lines += 1;
    *shared += u64::from(eyes == BOTH_EYES);
}

impl From<LevelReads> for LevelMap {
    fn from(of: LevelReads) -> Self {
        Self(
            of.texture,
            of.level,
            of.size,
            of.lines,
            of.blocks,
            of.cells,
            runs(&of.shares),
        )
    }
}
