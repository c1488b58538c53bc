//! Every line look-up of a trace in replay order, with its origin, as columns.
//!
//! The order is that of functional mode: each footprint takes one unit of time. Timed mode has the same
//! look-ups per core in the same order, but other interleavings of the cores.

use crate::config::{CountBy, RunConfig};
use crate::order::TileRef;
use crate::stream::{
    Bins, Consumer, Cores, Expander, LineMemory, QuadLines, StreamError, TileSource, TraceCounts,
    Walk, interleave, rendered,
};
use formats::textrace::Tables;
use formats::view::Eye;

/// Eye of a look-up in a pass that both eyes share.
pub const NO_EYE: u8 = u8::MAX;

/// The look-ups, column by column. All columns have the same length.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LineList {
    /// Byte address of the line.
    pub address: Vec<u64>,
    /// Index of the pass.
    pub pass: Vec<u32>,
    /// Tile of the pass.
    pub tile: Vec<u32>,
    /// 0 left, 1 right, or [`NO_EYE`].
    pub eye: Vec<u8>,
    /// Core that renders the tile.
    pub core: Vec<u8>,
    /// Index into the texture table.
    pub texture: Vec<u32>,
    /// Mip level.
    pub level: Vec<u8>,
}

/// All look-ups of a trace. Uses the order, the cores, the sampling, the layout and the line size of the
/// configuration.
///
/// # Errors
/// An unreadable tile, or textures that are too large.
pub fn line_list(source: &dyn TileSource, config: &RunConfig) -> Result<LineList, StreamError> {
    let config = &RunConfig {
        count_by: CountBy::Texture,
        ..*config
    };
    let rendered = rendered(source, config)?;
    let tables = rendered.tables();
    let expander = Expander::new(&rendered, config)?;
    let memory = LineMemory::new(LineMemory::USUAL_BYTES);
    let mut walk = Walk::new(&expander, &memory, config, [config.order]);
    let mut collector = Collector::new(tables, expander.bins(), config.line_bytes);
    for number in walk.frames() {
        let frame = walk.expand(number)?;
        collector.reserve(walk.counts());
        let phases = walk.plan(&frame)?.phases(config);
        let mut cores = Cores::new(&frame, config.cores as usize);
        interleave(&mut cores, &phases, config.dispatch(), &mut collector)?;
    }
    Ok(collector.list)
}

/// Appends the look-ups of quads.
struct Collector {
    list: LineList,
    line_bytes: u64,
    /// Place and eye by tile number.
    tiles: Vec<(TileRef, u8)>,
    /// Texture and level by cell.
    cells: Vec<(u32, u8)>,
}

impl Collector {
    fn new(tables: &Tables, bins: &Bins, line_bytes: u32) -> Self {
        let tiles = (0..).zip(&tables.passes).flat_map(|(pass, of)| {
            let eye = match of.eye {
                Some(Eye::Left) => 0,
                Some(Eye::Right) => 1,
                None => NO_EYE,
            };
            (0..of.tile_count()).map(move |tile| (TileRef { pass, tile }, eye))
        });
        let cells = (0..bins.cells()).map(|cell| {
            let cell = bins.meaning(cell);
            (cell.part as u32, cell.level as u8)
        });
        Self {
            list: LineList::default(),
            line_bytes: line_bytes.into(),
            tiles: tiles.collect(),
            cells: cells.collect(),
        }
    }

    /// Allocates room for all look-ups counted so far.
    fn reserve(&mut self, counts: &TraceCounts) {
        let lookups: u64 = counts.cells.iter().map(|cell| cell.line_lookups).sum();
        let more = (lookups as usize).saturating_sub(self.list.address.len());
        let list = &mut self.list;
        list.address.reserve_exact(more);
        list.pass.reserve_exact(more);
        list.tile.reserve_exact(more);
        list.eye.reserve_exact(more);
        list.core.reserve_exact(more);
        list.texture.reserve_exact(more);
        list.level.reserve_exact(more);
    }
}

impl Consumer for Collector {
    fn quad(&mut self, core: usize, quad: QuadLines<'_>) {
        let list = &mut self.list;
        let (at, eye) = self.tiles[quad.tile()];
        for footprint in quad.footprints() {
            let (texture, level) = self.cells[footprint.cell];
            for _ in 0..=footprint.repeats {
                let lines = footprint.lines.iter();
                (list.address).extend(lines.map(|&line| u64::from(line) * self.line_bytes));
            }
            let end = list.address.len();
            list.texture.resize(end, texture);
            list.level.resize(end, level);
        }
        let end = list.address.len();
        list.pass.resize(end, at.pass);
        list.tile.resize(end, at.tile);
        list.eye.resize(end, eye);
        list.core.resize(end, core as u8);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Mode, Order};
    use crate::engine::replay;
    use crate::memory::AnyCache;
    use crate::stream::testing::Synthetic;

    /// Counts the misses of the list in LRU caches, one per core.
    fn misses(list: &LineList, config: &RunConfig) -> u64 {
        let sets = (config.level.l1.size_bytes / 16 / 4) as u32;
        let new = |_| AnyCache::lru(sets, 4).into_box();
        let mut caches: Vec<_> = (0..config.cores).map(new).collect();
        let lines = list.address.iter().zip(&list.core);
        lines
            .map(|(&address, &core)| {
                let line = (address / u64::from(config.line_bytes)) as u32;
                u64::from(!caches[usize::from(core)].access(line))
            })
            .sum()
    }

    #[test]
    fn plain_caches_have_the_replays_misses_for_the_line_list() {
        let trace = Synthetic::new([72, 56], 120).generate();
        for order in [Order::MORTON, Order::Z2_LRTA, Order::Z2_STA_MERGE] {
            let mut config = RunConfig {
                mode: Mode::Functional,
                order,
                ..RunConfig::default()
            };
            config.level.l1.size_bytes = 1 << 10;
            let list = line_list(&trace, &config).unwrap();
            let result = replay(&trace, &config).unwrap();
            assert!(result.l1.counters.line_misses > 100);
            assert_eq!(list.address.len() as u64, result.l1.counters.line_lookups);
            assert_eq!(misses(&list, &config), result.l1.counters.line_misses);
            let lengths = [
                list.pass.len(),
                list.tile.len(),
                list.eye.len(),
                list.core.len(),
                list.texture.len(),
                list.level.len(),
            ];
            assert_eq!(lengths, [list.address.len(); 6]);
            for (eye, of_eye) in result.by_view.iter().take(2).enumerate() {
                let found = list
                    .eye
                    .iter()
                    .filter(|&&of| usize::from(of) == eye)
                    .count();
                assert_eq!(found as u64, of_eye.l1.line_lookups);
            }
        }
    }
}
