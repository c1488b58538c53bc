//! What each tile of a frame reads in every order: distinct lines, those that the other eye touches as well, and its
//! share of draws, textures and mip levels.

use formats::textrace::{Pass, Tile};
use rayon::prelude::*;
use sim::config::{CountBy, RunConfig};
use sim::engine::ReplayError;
use sim::order::{TileRef, WorkItem, frames};
use sim::stream::{
    Bins, Cores, Expander, Frame, LineMemory, StreamError, TileSource, TraceCounts, rendered,
};
use std::collections::{BTreeMap, HashMap};

/// By part: number of the tile, and quads or lines.
pub type Counts = BTreeMap<u32, Vec<[u32; 2]>>;

/// A render pass by tiles, row by row.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PassTiles {
    /// Distinct lines of each tile, ascending.
    pub lines: Vec<Vec<u32>>,
    /// Number of those that a pass of the other eye touches in the same frame.
    pub shared_lines: Vec<u32>,
    /// Quads by draw.
    pub draws: Counts,
    /// Distinct lines by texture.
    pub textures: Counts,
    /// Distinct lines by mip level.
    pub levels: Counts,
}

/// A line that a draw reads of a level of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Read {
    /// Index of the draw.
    pub draw: u32,
    /// Index of the texture.
    pub texture: u32,
    /// Mip level.
    pub level: u32,
    /// Number of the line.
    pub line: u32,
}

/// The tiles of a frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameTiles {
    /// Number of the frame.
    pub number: u32,
    /// By pass, with its index in the trace.
    pub passes: Vec<(u32, PassTiles)>,
    /// All different reads, ascending.
    pub reads: Vec<Read>,
    /// By line, one bit for each eye that touches it.
    pub eyes: HashMap<u32, u8>,
}

/// The bits of both eyes.
pub const BOTH_EYES: u8 = 0b11;

/// Calls `each` with the tiles of every frame, as a configuration samples and stores them.
///
/// # Errors
/// A trace that cannot be replayed with the configuration, or an error of `each`.
pub fn frame_tiles<E: From<ReplayError>>(
    source: &dyn TileSource,
    config: &RunConfig,
    mut each: impl FnMut(FrameTiles) -> Result<(), E>,
) -> Result<(), E> {
    let of_stream = |error: StreamError| E::from(ReplayError::from(error));
    let config = RunConfig {
        count_by: CountBy::Texture,
        ..*config
    };
    let source = rendered(source, &config).map_err(of_stream)?;
    let passes = &source.tables().passes;
    let expander = Expander::new(&source, &config).map_err(of_stream)?;
    let expander = expander.only_distinct_lines();
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    for number in frames(passes) {
        let mut counts = TraceCounts::new(expander.bins());
        let frame = expander
            .frame(number, &memory, &mut counts)
            .map_err(of_stream)?;
        let of_frame = (0..).zip(passes).filter(|(_, pass)| pass.frame == number);
        let tiles = FrameTiles::of(number, of_frame, &frame, expander.bins(), &source);
        each(tiles.map_err(of_stream)?)?;
    }
    Ok(())
}

impl FrameTiles {
    fn of<'p>(
        number: u32,
        passes: impl Iterator<Item = (u32, &'p Pass)>,
        frame: &Frame<'_>,
        bins: &Bins,
        source: &dyn TileSource,
    ) -> Result<Self, StreamError> {
        let mut out = Self {
            number,
            ..Self::default()
        };
        for (pass, of) in passes {
            let tiles: Vec<u32> = (0..of.tile_count()).collect();
            let chunks = tiles.par_chunks(Expander::CHUNK).map(|tiles| {
                let mut chunk = Chunk::default();
                let mut cores = Cores::new(frame, 1);
                for &tile in tiles {
                    chunk.add(TileRef { pass, tile }, &mut cores, bins, source)?;
                }
                chunk.reads.sort_unstable();
                chunk.reads.dedup();
                Ok(chunk)
            });
            let mut all = PassTiles::default();
            for chunk in chunks.collect::<Result<Vec<_>, StreamError>>()? {
                all.lines.extend(chunk.tiles.lines);
                let PassTiles {
                    draws,
                    textures,
                    levels,
                    ..
                } = chunk.tiles;
                for (to, from) in [
                    (&mut all.draws, draws),
                    (&mut all.textures, textures),
                    (&mut all.levels, levels),
                ] {
                    for (part, counts) in from {
                        to.entry(part).or_default().extend(counts);
                    }
                }
                out.reads.extend(chunk.reads);
            }
            for line in all.lines.iter().flatten() {
                *out.eyes.entry(*line).or_default() |= eye_bit(of);
            }
            out.passes.push((pass, all));
        }
        out.reads.sort_unstable();
        out.reads.dedup();
        let pass_eyes = |pass: u32| source.tables().passes[pass as usize].eye;
        for (pass, tiles) in &mut out.passes {
            let is_shared = |line: &&u32| out.eyes.get(line) == Some(&BOTH_EYES);
            let shared = |lines: &Vec<u32>| lines.iter().filter(is_shared).count() as u32;
            let has_eye = pass_eyes(*pass).is_some();
            let shared = |lines| if has_eye { shared(lines) } else { 0 };
            tiles.shared_lines = tiles.lines.iter().map(shared).collect();
        }
        Ok(out)
    }
}

/// Some tiles of a pass.
#[derive(Default)]
struct Chunk {
    tiles: PassTiles,
    reads: Vec<Read>,
    decoded: Tile,
}

impl Chunk {
    fn add(
        &mut self,
        at: TileRef,
        cores: &mut Cores<'_>,
        bins: &Bins,
        source: &dyn TileSource,
    ) -> Result<(), StreamError> {
        source.read_tile(at.pass, at.tile, &mut self.decoded)?;
        cores.load(0, &WorkItem::Tile(at))?;
        let mut reads = Vec::new();
        for (draw, quads) in quads_by_run(&self.decoded) {
            let counts = self.tiles.draws.entry(draw).or_default();
            match counts.last_mut() {
                Some([tile, sum]) if *tile == at.tile => *sum += quads,
                _ => counts.push([at.tile, quads]),
            }
            for _ in 0..quads {
                let Some(quad) = cores.next_quad(0) else {
                    break;
                };
                for (&line, of) in quad.distinct.iter().zip(quad.uses) {
                    let cell = bins.meaning(quad.cell_of(*of));
                    reads.push(Read {
                        draw,
                        texture: cell.part as u32,
                        level: cell.level as u32,
                        line,
                    });
                }
            }
        }
        reads.sort_unstable();
        reads.dedup();
        let count = |counts: &mut Counts, part: fn(&Read) -> u32| {
            let mut pairs: Vec<[u32; 2]> = reads.iter().map(|r| [part(r), r.line]).collect();
            pairs.sort_unstable();
            pairs.dedup();
            for of_part in pairs.chunk_by(|a, b| a[0] == b[0]) {
                let counts = counts.entry(of_part[0][0]).or_default();
                counts.push([at.tile, of_part.len() as u32]);
            }
        };
        count(&mut self.tiles.textures, |read| read.texture);
        count(&mut self.tiles.levels, |read| read.level);
        let mut lines: Vec<u32> = reads.iter().map(|read| read.line).collect();
        lines.sort_unstable();
        lines.dedup();
        self.tiles.lines.push(lines);
        self.reads.append(&mut reads);
        Ok(())
    }
}

/// A pass of both eyes belongs to none.
fn eye_bit(pass: &Pass) -> u8 {
    pass.eye.map_or(0, |eye| 1 << eye as u8)
}

/// Draw and quads of each run. Consecutive records with the same position are one quad.
fn quads_by_run(tile: &Tile) -> impl Iterator<Item = (u32, u32)> {
    tile.runs.iter().map(|run| {
        let first = run.first as usize;
        let records = tile.records.get(first..first + run.count as usize);
        let records = records.unwrap_or_default();
        let quads = records.chunk_by(|a, b| (a.x, a.y) == (b.x, b.y)).count();
        (run.draw, quads as u32)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::engine::replay;
    use sim::stream::testing::Synthetic;

    fn all(source: &dyn TileSource) -> Vec<FrameTiles> {
        let mut out = Vec::new();
        frame_tiles(source, &RunConfig::default(), |tiles| {
            out.push(tiles);
            Ok::<(), ReplayError>(())
        })
        .unwrap();
        out
    }

    fn sum(counts: &Counts) -> u64 {
        let counts = counts.values().flatten();
        counts.map(|[_, count]| u64::from(*count)).sum()
    }

    #[test]
    fn lines_and_quads_of_tiles_are_those_of_the_replay() {
        let trace = Synthetic::one_layer([64, 64], 16).generate();
        let result = replay(&trace, &RunConfig::default()).unwrap();
        let frames = all(&trace);
        let [frame] = frames.as_slice() else {
            panic!("one frame")
        };
        let quads: u64 = frame.passes.iter().map(|(_, of)| sum(&of.draws)).sum();
        assert_eq!(quads, result.quads);
        assert_eq!(frame.eyes.len() as u64, result.unique_lines);
        let mut lines: Vec<u32> = frame.reads.iter().map(|read| read.line).collect();
        lines.sort_unstable();
        lines.dedup();
        assert_eq!(lines.len() as u64, result.unique_lines);
        for ((_, pass), of) in frame.passes.iter().zip(&trace.tables.passes) {
            assert_eq!(pass.lines.len(), of.tile_count() as usize);
            let pairs = pass.lines.iter().zip(&pass.shared_lines);
            assert!(
                pairs
                    .clone()
                    .all(|(lines, shared)| *shared as usize <= lines.len())
            );
            assert!(pairs.map(|(_, shared)| shared).sum::<u32>() > 0);
            let lines: usize = pass.lines.iter().map(Vec::len).sum();
            assert!(sum(&pass.textures) >= lines as u64 && sum(&pass.levels) >= lines as u64);
        }
        let mut alone = trace.clone();
        alone.tables.passes.truncate(1);
        let alone = &all(&alone)[0].passes[0].1;
        assert!(alone.shared_lines.iter().all(|&shared| shared == 0));
        assert_eq!(alone.lines, frame.passes[0].1.lines);
    }
}
