//! Tile orders: pure functions from the tile grids to a sequence of work.
//!
//! An order consists of a curve over a grid of cells ([`curve`]), a rule that pairs the tiles of the two eyes
//! ([`pairing`]), a way to combine the tiles of a pair, a direction, and an assignment of items to cores
//! ([`assignment`]). A name lists the parts, as in `zig-zag+sta+offset+boustro`. The paper's orders have their
//! own names. A new curve or pairing is a file and a row of its table: configurations, flags, help and plots
//! are derived from the row.

pub mod assignment;
mod composed;
pub mod cost;
pub mod curve;
mod directions;
mod listed;
pub mod pairing;
pub mod parts;
mod plan;
mod plan_inputs;
pub mod rays;
mod work;

pub use listed::{FoundTiles, Listed, NotAnOrder, check_items};
pub use plan::{Phase, Views, frames, plan_frame, views};
pub use plan_inputs::{Counters, PlanInputs, ViewCounters};
pub use work::{Interleave, TileRef, View, WorkItem};

use crate::config::Assign;
use crate::palette::{BLUE, GREEN, GREY, ORANGE, PURPLE, Rgb, SKY_BLUE, VERMILION, YELLOW};
use crate::registry::{Named, registry};
use cost::Cost;
use curve::Curve;
use parts::{Eyes, Parts};

registry! { OrderRow, other = composed_by_name:
    // constant     name            title           colour      help                                                            parts
    SCANLINE =     row("scanline",     "Scanline",     VERMILION, "Rows from left to right",                                  Parts::of(Curve::SCANLINE));
    ZIG_ZAG =      row("zig-zag",      "Zig-zag",      PURPLE,    "Rows, every other one from right to left",                 Parts::of(Curve::ZIG_ZAG));
    MORTON =       row("morton",       "Morton",       ORANGE,    "Z-order curve: the paper's baseline",                      Parts::of(Curve::MORTON));
    HILBERT =      row("hilbert",      "Hilbert",      YELLOW,    "Hilbert curve",                                            Parts::of(Curve::HILBERT));
    Z2_LRTA =      row("z2-lrta",      "Z2 LRTA",      SKY_BLUE,  "Morton, left and right tile in turn",                      Parts::of(Curve::MORTON).with(Eyes::InTurn));
    Z2_STA =       row("z2-sta",       "Z2 STA",       BLUE,      "Morton, both tiles on one core, their triangles in turn",  Parts::of(Curve::MORTON).with(Eyes::OneCore(Interleave::Alternate)));
    Z2_STA_MERGE = row("z2-sta-merge", "Z2 STA-merge", GREEN,     "As z2-sta, the triangle lists merged by primitive number", Parts::of(Curve::MORTON).with(Eyes::OneCore(Interleave::Merge)));
    RANDOM =       row("random",       "Random",       GREY,      "Shuffled tiles: the control",                              Parts::of(Curve::RANDOM));
    #[cfg(test)]
    COLUMNS =      row("test-columns", "Columns",      GREY,      "Columns from the top",                                     Parts::of(Curve::COLUMNS));
}

/// A tile order: a row of the table, or a combination of parts.
pub type Order = Named<OrderRow>;

/// A row of the table of tile orders.
#[derive(Debug)]
pub struct OrderRow {
    name: &'static str,
    /// As the paper writes it.
    title: &'static str,
    color: Rgb,
    help: &'static str,
    parts: Parts,
    /// The items of pairs of views, if they do not follow from the parts.
    listed: Option<&'static Listed>,
}

const fn row(
    name: &'static str,
    title: &'static str,
    color: Rgb,
    help: &'static str,
    parts: Parts,
) -> OrderRow {
    OrderRow {
        name,
        title,
        color,
        help,
        parts,
        listed: None,
    }
}

/// The listed order of that name, or the order whose parts the name lists.
fn composed_by_name(name: &str) -> Result<Order, Option<String>> {
    if let Some(order) = listed::by_name(name) {
        return Ok(order);
    }
    match Parts::parse(name) {
        Ok(parts) => Ok(composed::order(parts)),
        Err(why) => Err(Some(why).filter(|_| Parts::is_composed(name))),
    }
}

impl Order {
    /// Name in tables and plots.
    pub fn title(self) -> &'static str {
        self.row().title
    }

    /// Colour, the same in every plot.
    pub fn color(self) -> Rgb {
        self.row().color
    }

    /// The parts of the order.
    pub fn parts(self) -> Parts {
        self.row().parts
    }

    /// The order with these parts.
    pub fn of(parts: Parts) -> Self {
        composed::order(parts)
    }

    /// The order for an L2 of this size: adds the default number of its curve, if the name has no number.
    #[must_use]
    pub fn resolved(self, l2_bytes: u64) -> Self {
        match self.parts().resolved(l2_bytes) {
            parts if parts == self.parts() => self,
            parts => composed::order(parts),
        }
    }

    /// How items are assigned to cores: by the order if it contains an assignment, otherwise as configured.
    pub fn dispatch(self, configured: Assign) -> Assign {
        let own = self.parts().assignment;
        own.map_or(configured, assignment::Assignment::dispatch)
    }

    /// The work for the pictures of two eyes, passes 0 and 1, which consist of whole tiles.
    pub fn stereo(self, tiles: [u32; 2], inputs: &PlanInputs<'_>) -> Vec<WorkItem> {
        let [left, right] = [0, 1].map(|pass| View::grid(pass, tiles));
        self.parts().stereo(left, right, inputs)
    }

    /// The hardware cost for views of `tiles`.
    #[must_use]
    pub fn cost(self, tiles: [u32; 2], cores: u32) -> Cost {
        match self.row().listed {
            Some(listed) => listed.cost(),
            None => self.parts().cost(tiles, cores),
        }
    }
}

#[cfg(test)]
mod tests;
