//! Consecutive frames of a trace, as a trace of their own.

use formats::textrace::{Tables, Tile};
use sim::order::frames;
use sim::stream::{StreamError, TileSource};

/// A run of consecutive frames, without geometry.
pub struct Run<'t> {
    trace: &'t dyn TileSource,
    tables: Tables,
    /// The pass of the trace, by the run's own.
    passes: Vec<u32>,
}

impl<'t> Run<'t> {
    /// The longest runs of a trace, in order.
    pub fn all(trace: &'t dyn TileSource) -> Vec<Self> {
        let numbers = frames(&trace.tables().passes);
        let runs = numbers.chunk_by(|a, b| a + 1 == *b);
        runs.map(|run| Self::new(trace, run)).collect()
    }

    /// Runs with some frames of a trace, and the frame before each run, which fills its caches.
    pub fn around(trace: &'t dyn TileSource, wanted: &[u32]) -> Vec<Self> {
        let is_wanted = |number: &u32| wanted.binary_search(number).is_ok();
        let mut numbers = frames(&trace.tables().passes);
        numbers.retain(|number| is_wanted(number) || is_wanted(&(number + 1)));
        let runs = numbers.chunk_by(|a, b| a + 1 == *b);
        runs.map(|run| Self::new(trace, run)).collect()
    }

    fn new(trace: &'t dyn TileSource, numbers: &[u32]) -> Self {
        let mut tables = trace.tables().clone();
        let of_run = (0..).zip(std::mem::take(&mut tables.passes));
        let (passes, kept) = of_run
            .filter(|(_, pass)| numbers.binary_search(&pass.frame).is_ok())
            .unzip();
        tables.passes = kept;
        Self {
            trace,
            tables,
            passes,
        }
    }

    fn pass(&self, pass: u32, tile: u32) -> Result<u32, StreamError> {
        let found = self.passes.get(pass as usize).copied();
        found.ok_or_else(|| StreamError::Tile {
            pass,
            tile,
            message: "no such pass".to_owned(),
        })
    }
}

impl TileSource for Run<'_> {
    fn tables(&self) -> &Tables {
        &self.tables
    }

    fn records(&self) -> u64 {
        // A measure of work, of which the whole trace is the bound.
        self.trace.records()
    }

    fn tile_px(&self) -> u32 {
        self.trace.tile_px()
    }

    fn read_tile(&self, pass: u32, index: u32, tile: &mut Tile) -> Result<(), StreamError> {
        self.trace.read_tile(self.pass(pass, index)?, index, tile)
    }
}
