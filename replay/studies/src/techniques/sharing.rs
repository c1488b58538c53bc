//! Counts the lines that each eye touches and that both touch. Only shared lines can be saved by an order
//! that renders the eyes' tiles together.

use formats::textrace::{Pass, Tables, Tile};
use formats::view::Eye;
use sim::config::{Mode, RunConfig};
use sim::engine::{ReplayError, replay};
use sim::stream::{StreamError, TileSource};

/// Distinct lines of a trace by eye; passes of both eyes are left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sharing {
    /// Lines that the left eye touches, and the right.
    pub eyes: [u64; 2],
    /// Lines that at least one eye touches.
    pub either: u64,
}

impl Sharing {
    /// Lines that both eyes touch, percent of those that at least one touches; `None` if there are none.
    pub(super) fn shared_pct(&self) -> Option<f64> {
        let both = (self.eyes[0] + self.eyes[1]).checked_sub(self.either)?;
        (self.either > 0).then(|| 100.0 * both as f64 / self.either as f64)
    }
}

/// Counts the lines of a trace with a configuration's sampling and layout.
///
/// # Errors
/// A trace that cannot be replayed.
pub fn sharing(source: &dyn TileSource, config: &RunConfig) -> Result<Sharing, ReplayError> {
    let config = RunConfig {
        mode: Mode::Functional,
        tile_maps: false,
        ..*config
    };
    let lines = |keep: fn(&Pass) -> bool| {
        let part = SomePasses { source, keep };
        replay(&part, &config).map(|result| result.unique_lines)
    };
    Ok(Sharing {
        eyes: [
            lines(|pass| pass.eye == Some(Eye::Left))?,
            lines(|pass| pass.eye == Some(Eye::Right))?,
        ],
        either: lines(|pass| pass.eye.is_some())?,
    })
}

/// A trace with only some of its passes.
struct SomePasses<'a> {
    source: &'a dyn TileSource,
    keep: fn(&Pass) -> bool,
}

impl TileSource for SomePasses<'_> {
    fn tables(&self) -> &Tables {
        self.source.tables()
    }

    fn records(&self) -> u64 {
        self.source.records()
    }

    fn read_tile(&self, pass: u32, index: u32, tile: &mut Tile) -> Result<(), StreamError> {
        let passes = &self.tables().passes;
        if passes
            .get(pass as usize)
            .is_some_and(|pass| !(self.keep)(pass))
        {
            tile.clear();
            return Ok(());
        }
        self.source.read_tile(pass, index, tile)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::textrace::PrimitiveRun;
    use sim::stream::MemoryTrace;
    use sim::stream::testing::Synthetic;
    use sim::stream::testing::{record, tables};

    /// A quad of each eye, at these texels of an uncompressed texture's first row.
    fn trace(texels: [i32; 2]) -> MemoryTrace {
        let tile = |texel: i32| {
            let mut record = record(0, 0);
            record.uv[0] += texel * formats::textrace::SUBTEXELS;
            let run = PrimitiveRun {
                count: 1,
                ..PrimitiveRun::default()
            };
            vec![Tile {
                runs: vec![run],
                records: vec![record],
            }]
        };
        MemoryTrace {
            tables: tables(&[[1024, 1024]]),
            tiles: texels.map(tile).into(),
        }
    }

    #[test]
    fn eyes_share_all_lines_of_equal_texels_and_none_of_different_ones() {
        let config = RunConfig::default();
        let shared = |texels| sharing(&trace(texels), &config).unwrap().shared_pct();
        assert_eq!(shared([0, 0]), Some(100.0));
        assert_eq!(shared([0, 512]), Some(0.0));
    }

    #[test]
    fn lines_per_eye_equal_those_of_single_eye_traces() {
        let trace = Synthetic::one_layer([64, 64], 16).generate();
        let config = RunConfig::default();
        let found = sharing(&trace, &config).unwrap();
        for eye in [0, 1] {
            let mut alone = trace.clone();
            alone.tables.passes = vec![trace.tables.passes[eye]];
            alone.tiles = vec![trace.tiles[eye].clone()];
            let lines = replay(&alone, &config).unwrap().unique_lines;
            assert_eq!(found.eyes[eye], lines);
        }
        assert!(found.either < found.eyes[0] + found.eyes[1]);
        assert_eq!(found.either, replay(&trace, &config).unwrap().unique_lines);
    }
}
