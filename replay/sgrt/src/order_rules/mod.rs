//! Rules that choose the tile order of the next frame from what the last one recorded. One a file, each a row of the
//! table.

mod sampled;

use super::config::SgrtConfig;
use formats::raytrace::RaytraceTables;
use sim::config::Order;
use sim::order::TileRef;
use sim::order::rays::RayPlan;
use sim::registry::Named;

/// A row of the table of rules.
#[derive(Debug)]
pub struct RuleRow {
    /// Name.
    pub name: &'static str,
    /// One line of help.
    pub help: &'static str,
    /// The L2's sets per set that is recorded.
    pub stride: fn(&SgrtConfig) -> u32,
    /// The order for the next frame.
    pub choose: fn(&LastFrame<'_>) -> Order,
}

/// A rule.
pub type OrderRule = Named<RuleRow>;

sim::rows! { RuleRow: OrderRule::new(&sampled::ROW); }

/// The last frame, and the machine.
pub struct LastFrame<'a> {
    /// The lines that it recorded.
    pub recorded: &'a Recorded,
    /// The tile grids.
    pub tables: &'a RaytraceTables,
    /// The machine.
    pub config: &'a SgrtConfig,
    /// True if caches keep lines between frames.
    pub keeps_lines: bool,
    /// The items of an order.
    pub plan: &'a dyn Fn(Order) -> RayPlan,
}

/// Accesses to recorded sets of the L2, by tile. They pass a filter of the tile's last lines instead of an L1, so that
/// they do not depend on the order of tiles.
#[derive(Clone, Debug, Default)]
pub struct Recorded {
    stride: u32,
    /// Pixel and line.
    tiles: [Vec<Vec<(u16, u32)>>; 2],
}

impl Recorded {
    /// Bytes of an access: two of the line's number, which tell the lines of a set apart, and the pixel.
    const ENTRY_BYTES: u64 = 3;
    /// Lines of the filter.
    const FILTER: usize = 32;

    /// Nothing recorded yet of the tiles of a trace.
    pub fn new(stride: u32, tables: &RaytraceTables) -> Self {
        let tiles = vec![Vec::new(); tables.tile_count() as usize];
        Self {
            stride: stride.max(1),
            tiles: [tiles.clone(), tiles],
        }
    }

    /// Adds an access of a pixel of a tile.
    pub fn add(&mut self, at: TileRef, pixel: usize, line: u32) {
        if line.is_multiple_of(self.stride) {
            let list = &mut self.tiles[at.pass as usize][at.tile as usize];
            let mut last = list.iter().rev().take(Self::FILTER);
            if last.all(|(_, known)| *known != line) {
                list.push((pixel as u16, line));
            }
        }
    }

    /// Pixels and lines of a tile, in order of pixels.
    pub fn of(&self, at: TileRef) -> &[(u16, u32)] {
        &self.tiles[at.pass as usize][at.tile as usize]
    }

    /// Bytes that recording writes and choosing reads.
    pub fn traffic_bytes(&self) -> u64 {
        let lines: usize = self.tiles.iter().flatten().map(Vec::len).sum();
        2 * Self::ENTRY_BYTES * lines as u64
    }
}
