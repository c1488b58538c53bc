//! Rules that pair the tiles of the two eyes, one per file.
//!
//! A rule places the tiles of both eyes on one grid of cells, which a curve then visits. Tiles in the same cell
//! are rendered together or one after the other.

mod index;
mod infinity;
mod offset;
mod row;

use super::cost::Cost;
use super::{PlanInputs, View};
use crate::registry::{Named, registry};
use index::Index;
use infinity::Infinity;
use offset::Offset;
use row::{LINES, PRIMITIVES};

registry! { PairingRow:
    // constant           name              help                                                                                          the rule
    INDEX =          row("index",          "Tiles of the same column and row",                                                           &Index);
    OFFSET =         row("offset",         "The right eye's tiles shifted so that points at infinity straight ahead coincide", &Offset);
    INFINITY =       row("infinity",       "Tiles that see the same direction, also for eyes that are turned outwards",                   &Infinity);
    ROW_PRIMITIVES = row("row-primitives", "Each row shifted so that the last frame's tiles have most primitives in common",      &PRIMITIVES);
    ROW_LINES =      row("row-lines",      "Each row shifted so that the last frame's tiles have most lines in common",           &LINES);
}

/// A pairing by name.
pub(super) type Pairing = Named<PairingRow>;

/// A row of the table of pairings.
#[derive(Debug)]
pub struct PairingRow {
    name: &'static str,
    help: &'static str,
    rule: &'static (dyn Rule + Sync),
}

const fn row(
    name: &'static str,
    help: &'static str,
    rule: &'static (dyn Rule + Sync),
) -> PairingRow {
    PairingRow { name, help, rule }
}

impl Pairing {
    /// The rule.
    pub(super) fn rule(self) -> &'static dyn Rule {
        self.row().rule
    }
}

/// The placement of the tiles of both eyes on one grid.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Placement {
    /// Columns and rows of cells.
    pub grid: [u32; 2],
    /// The cell of each tile, by eye and tile.
    pub cells: [Vec<[u32; 2]>; 2],
}

impl Placement {
    /// Shifts arbitrary cells so that the first column and row are zero.
    pub(super) fn new(cells: [Vec<[i32; 2]>; 2]) -> Self {
        let least = [0, 1].map(|axis: usize| {
            let all = cells.iter().flatten().map(|cell| cell[axis]);
            all.min().unwrap_or(0)
        });
        let cells = cells.map(|cells| -> Vec<[u32; 2]> {
            let shifted = |cell: [i32; 2]| [0, 1].map(|axis| cell[axis].abs_diff(least[axis]));
            cells.into_iter().map(shifted).collect()
        });
        let grid = [0, 1].map(|axis: usize| {
            let all = cells.iter().flatten().map(|cell| cell[axis] + 1);
            all.max().unwrap_or(0)
        });
        Self { grid, cells }
    }
}

/// Columns and rows of a view's tiles, in the order of their numbers.
pub(super) fn tiles(view: View) -> impl Iterator<Item = [u32; 2]> {
    let [columns, rows] = view.tiles;
    (0..rows).flat_map(move |y| (0..columns).map(move |x| [x, y]))
}

/// A rule that pairs tiles.
pub trait Rule: std::fmt::Debug {
    /// Places the tiles of a left and a right view on one grid.
    fn place(&self, eyes: [View; 2], inputs: &PlanInputs<'_>) -> Placement;

    /// Its hardware cost.
    fn cost(&self, grid: [u32; 2]) -> Cost;
}
