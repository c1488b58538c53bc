//! Tile orders, one a file: pure functions from the tile grids to a sequence of work.
//!
//! An order is a curve over one grid of tiles and a rule that says how the two views of a stereo
//! pair are combined along it. A new one is a file with a `TileOrder` (its `mod` line below) and a
//! row of the table: configurations, flags, help and plots are derived from the row.

mod hilbert;
mod morton;
mod plan;
mod random;
mod scanline;
mod work;
mod z2_lrta;
mod z2_sta;
mod z2_sta_merge;
mod zig_zag;

pub use plan::{Phase, plan, plan_frame};
pub use work::{Interleave, TileRef, View, WorkItem};

use crate::palette::{BLUE, GREEN, GREY, ORANGE, PURPLE, Rgb, SKY_BLUE, VERMILION, YELLOW};
use crate::registry::{Named, registry};
use hilbert::Hilbert;
use morton::Morton;
use random::Random;
use scanline::Scanline;
use z2_lrta::Z2Lrta;
use z2_sta::Z2Sta;
use z2_sta_merge::Z2StaMerge;
use zig_zag::ZigZag;

registry! { OrderRow:
    // constant     name            title           colour      help                                                                    built from a seed
    SCANLINE =     row("scanline",     "Scanline",     VERMILION, "Rows from left to right",                                      |_| Box::new(Scanline));
    ZIG_ZAG =      row("zig-zag",      "Zig-zag",      PURPLE,    "Rows, every other one from right to left",                     |_| Box::new(ZigZag));
    MORTON =       row("morton",       "Morton",       ORANGE,    "Z-order curve: the paper's baseline",                          |_| Box::new(Morton));
    HILBERT =      row("hilbert",      "Hilbert",      YELLOW,    "Hilbert curve",                                                |_| Box::new(Hilbert));
    Z2_LRTA =      row("z2-lrta",      "Z2 LRTA",      SKY_BLUE,  "Morton, left and right tile in turn",                          |_| Box::new(Z2Lrta));
    Z2_STA =       row("z2-sta",       "Z2 STA",       BLUE,      "Morton, both tiles on one core, their triangles in turn",      |_| Box::new(Z2Sta));
    Z2_STA_MERGE = row("z2-sta-merge", "Z2 STA-merge", GREEN,     "As z2-sta, the triangle lists merged by primitive number",     |_| Box::new(Z2StaMerge));
    RANDOM =       row("random",       "Random",       GREY,      "Shuffled tiles: the control",                                  |seed| Box::new(Random { seed }));
    #[cfg(test)]
    COLUMNS =      row("test-columns", "Columns",      GREY,      "Columns from the top",                                         |_| Box::new(tests::columns::Columns));
}

/// A tile order by name.
pub type Order = Named<OrderRow>;

/// A row of the table of tile orders.
#[derive(Debug)]
pub struct OrderRow {
    name: &'static str,
    /// As the paper writes it.
    title: &'static str,
    color: Rgb,
    help: &'static str,
    build: fn(u64) -> Box<dyn TileOrder>,
}

const fn row(
    name: &'static str,
    title: &'static str,
    color: Rgb,
    help: &'static str,
    build: fn(u64) -> Box<dyn TileOrder>,
) -> OrderRow {
    OrderRow {
        name,
        title,
        color,
        help,
        build,
    }
}

impl Order {
    /// Name in tables and plots.
    #[must_use]
    pub fn title(self) -> &'static str {
        self.row().title
    }

    /// Colour, the same in every plot.
    #[must_use]
    pub fn color(self) -> Rgb {
        self.row().color
    }

    /// The order itself; only random ones need the seed.
    #[must_use]
    pub fn build(self, seed: u64) -> Box<dyn TileOrder> {
        (self.row().build)(seed)
    }
}

/// How the tiles of a stereo pair follow each other along the curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pairing {
    /// The whole left view, then the whole right view.
    ViewByView,
    /// The left tile, then the right tile at the same place.
    InTurn,
    /// Both tiles at a place as one item for one core.
    OneCore(Interleave),
}

/// A tile order.
pub trait TileOrder {
    /// Columns and rows of one view's tiles in the order of traversal: each exactly once.
    fn curve(&self, tiles: [u32; 2]) -> Vec<[u32; 2]>;

    /// How the two views are combined.
    fn pairing(&self) -> Pairing {
        Pairing::ViewByView
    }

    /// Work of one view alone.
    fn mono(&self, view: View) -> Vec<WorkItem> {
        self.curve(view.tiles)
            .into_iter()
            .filter_map(|at| view.tile(at).map(WorkItem::Tile))
            .collect()
    }

    /// Work of a stereo pair. Grids of different sizes are both followed along the curve of the
    /// smallest grid that covers them; a tile without a partner is an item of its own.
    fn stereo(&self, left: View, right: View) -> Vec<WorkItem> {
        let pairing = self.pairing();
        if pairing == Pairing::ViewByView {
            return [self.mono(left), self.mono(right)].concat();
        }
        let covering = [0, 1].map(|axis| left.tiles[axis].max(right.tiles[axis]));
        let mut items = Vec::new();
        for at in self.curve(covering) {
            match (left.tile(at), right.tile(at), pairing) {
                (Some(l), Some(r), Pairing::OneCore(interleave)) => {
                    items.push(WorkItem::Pair(l, r, interleave));
                }
                (l, r, _) => items.extend([l, r].into_iter().flatten().map(WorkItem::Tile)),
            }
        }
        items
    }
}

#[cfg(test)]
mod tests;
