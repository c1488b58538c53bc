//! What each tile of a trace holds in every order: distinct lines, those that the other eye touches as well, and quads
//! by draw.

use formats::textrace::{Pass, Tile};
use sim::config::RunConfig;
use sim::engine::ReplayError;
use sim::order::{TileRef, WorkItem, frames};
use sim::stream::{Cores, Expander, LineMemory, TileSource, TraceCounts, rendered};
use std::collections::{BTreeMap, HashMap};

/// A render pass by tiles, row by row.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PassTiles {
    /// Distinct lines of each tile.
    pub lines: Vec<u32>,
    /// Those of them that a pass of the other eye touches in the same frame.
    pub shared_lines: Vec<u32>,
    /// Quads by draw: number of the tile, and quads.
    pub draws: BTreeMap<u32, Vec<[u32; 2]>>,
}

/// The tiles of every pass, as a configuration samples and stores them.
///
/// # Errors
/// A trace that cannot be replayed with the configuration.
pub fn pass_tiles(
    source: &dyn TileSource,
    config: &RunConfig,
) -> Result<Vec<PassTiles>, ReplayError> {
    let source = rendered(source, config)?;
    let passes = source.tables().passes.clone();
    let expander = Expander::new(&source, config)?.only_distinct_lines();
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let mut out = vec![PassTiles::default(); passes.len()];
    for number in frames(&passes) {
        let mut counts = TraceCounts::new(expander.bins());
        let frame = expander.frame(number, &memory, &mut counts)?;
        let mut cores = Cores::new(&frame, 1);
        let of_frame = || (0..).zip(&passes).filter(|(_, pass)| pass.frame == number);
        // One bit for each eye that touches the line.
        let mut eyes: HashMap<u32, u8> = HashMap::new();
        let mut lists = Vec::new();
        for (pass, of) in of_frame() {
            for tile in 0..of.tile_count() {
                let item = WorkItem::Tile(TileRef { pass, tile });
                let lines = cores.lines_of(&item, usize::MAX)?;
                for line in &lines {
                    *eyes.entry(*line).or_default() |= eye_bit(of);
                }
                lists.push((pass, of, lines));
            }
        }
        for (pass, of, lines) in lists {
            let shared = |line: &&u32| eyes.get(line).is_some_and(|bits| *bits & !eye_bit(of) != 0);
            let out = &mut out[pass as usize];
            out.lines.push(lines.len() as u32);
            let shared = lines.iter().filter(shared).count();
            let is_of_eye = of.eye.is_some();
            out.shared_lines
                .push(if is_of_eye { shared as u32 } else { 0 });
        }
    }
    for (pass, (of, out)) in (0..).zip(passes.iter().zip(&mut out)) {
        let mut decoded = Tile::default();
        for tile in 0..of.tile_count() {
            source.read_tile(pass, tile, &mut decoded)?;
            for (draw, quads) in quads_by_draw(&decoded) {
                out.draws.entry(draw).or_default().push([tile, quads]);
            }
        }
    }
    Ok(out)
}

/// A pass of both eyes belongs to none.
fn eye_bit(pass: &Pass) -> u8 {
    pass.eye.map_or(0, |eye| 1 << eye as u8)
}

/// Consecutive records with the same position are one quad.
fn quads_by_draw(tile: &Tile) -> BTreeMap<u32, u32> {
    let mut draws = BTreeMap::new();
    for run in &tile.runs {
        let first = run.first as usize;
        let records = tile.records.get(first..first + run.count as usize);
        let records = records.unwrap_or_default();
        let quads = records.chunk_by(|a, b| (a.x, a.y) == (b.x, b.y)).count();
        *draws.entry(run.draw).or_default() += quads as u32;
    }
    draws
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::engine::replay;
    use sim::stream::testing::Synthetic;

    #[test]
    fn lines_and_quads_of_tiles_are_those_of_the_replay() {
        let trace = Synthetic {
            size_px: [64, 64],
            patch_px: 16,
            ..Synthetic::default()
        }
        .generate();
        let config = RunConfig::default();
        let passes = pass_tiles(&trace, &config).unwrap();
        let result = replay(&trace, &config).unwrap();
        let quads = passes.iter().flat_map(|pass| pass.draws.values().flatten());
        assert_eq!(
            quads.map(|[_, quads]| u64::from(*quads)).sum::<u64>(),
            result.quads
        );
        for (pass, of) in passes.iter().zip(&trace.tables.passes) {
            assert_eq!(pass.lines.len(), of.tile_count() as usize);
            let pairs = pass.lines.iter().zip(&pass.shared_lines);
            assert!(pairs.clone().all(|(lines, shared)| shared <= lines));
            assert!(pairs.map(|(_, shared)| shared).sum::<u32>() > 0);
        }
        let mut alone = trace.clone();
        alone.tables.passes.truncate(1);
        let alone_tiles = pass_tiles(&alone, &config).unwrap();
        assert!(
            alone_tiles[0]
                .shared_lines
                .iter()
                .all(|&shared| shared == 0)
        );
        assert_eq!(alone_tiles[0].lines, passes[0].lines);
    }
}
