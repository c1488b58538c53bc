//! The assignment of items to cores.
//!
//! The configuration has two rules: first idle and round robin. The other rules permute the items of each
//! round, which has one item per core, so that items go to the cores with the best locality.

use super::cost::Cost;
use super::{TileRef, WorkItem};
use crate::config::Assign;

/// A rule that may be part of an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Assignment {
    /// The next item goes to the core that becomes idle first.
    FirstIdle,
    /// Round robin.
    Static,
    /// In each round, an item goes to the core whose last tile is nearest.
    Affinity,
    /// Cores have fixed places in groups of tiles. Adjacent groups are mirrored, so that the tiles on both
    /// sides of their common edge belong to one core (as DTexL does for quads, Joseph et al., MICRO 2022).
    Quads,
    /// Each core takes four consecutive items, so that most neighbours along the curve belong to one core.
    Runs,
}

/// Consecutive items of a core under [`Assignment::Runs`].
const RUN: usize = 4;

impl Assignment {
    /// All values.
    pub const ALL: [Self; 5] = [
        Self::FirstIdle,
        Self::Static,
        Self::Affinity,
        Self::Quads,
        Self::Runs,
    ];

    /// Name in an order's name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::FirstIdle => "first-idle",
            Self::Static => "static",
            Self::Affinity => "affinity",
            Self::Quads => "quads",
            Self::Runs => "runs",
        }
    }

    /// The rule of the configuration that distributes the permuted items.
    pub(super) const fn dispatch(self) -> Assign {
        match self {
            Self::FirstIdle => Assign::FirstIdle,
            Self::Static | Self::Affinity | Self::Quads | Self::Runs => Assign::Static,
        }
    }

    /// Its hardware cost.
    pub(super) fn cost(self, cores: u32) -> Cost {
        match self {
            Self::FirstIdle | Self::Static => Cost::state(0),
            // The last tile of each core, which is compared with each item of the round.
            Self::Affinity => Cost::state(4 * cores)
                .looking_ahead(cores)
                .deciding_in(cores),
            Self::Quads => Cost::state(0).looking_ahead(cores).deciding_in(1),
            // A position per core.
            Self::Runs => Cost::state(4 * cores)
                .looking_ahead(cores * RUN as u32)
                .deciding_in(1),
        }
    }

    /// Permutes the items of each round into the order of their cores. `column_counts` returns the tile columns
    /// of a pass.
    pub(super) fn deal(
        self,
        items: Vec<WorkItem>,
        cores: u32,
        column_counts: &dyn Fn(u32) -> u32,
    ) -> Vec<WorkItem> {
        let cores = cores.max(1) as usize;
        if cores == 1 || matches!(self, Self::FirstIdle | Self::Static) {
            return items;
        }
        if self == Self::Runs {
            return runs(&items, cores);
        }
        let place = |item: &WorkItem| {
            let TileRef { pass, tile } = first_tile(item);
            let columns = column_counts(pass).max(1);
            [tile % columns, tile / columns]
        };
        let mut last: Vec<Option<[u32; 2]>> = vec![None; cores];
        let mut dealt = Vec::with_capacity(items.len());
        for round in items.chunks(cores) {
            let places: Vec<[u32; 2]> = round.iter().map(place).collect();
            let wish = |core: usize, [x, y]: [u32; 2]| -> u32 {
                if self == Self::Quads {
                    return u32::from(core_at([x, y], cores) != core);
                }
                last[core].map_or(u32::MAX / 2, |at| at[0].abs_diff(x) + at[1].abs_diff(y))
            };
            let mut choices: Vec<(u32, usize, usize)> = Vec::with_capacity(cores * cores);
            for (item, &at) in places.iter().enumerate() {
                choices.extend((0..round.len()).map(|core| (wish(core, at), item, core)));
            }
            choices.sort_unstable();
            let mut item_of: Vec<Option<usize>> = vec![None; round.len()];
            let mut is_dealt = vec![false; round.len()];
            for (_, item, core) in choices {
                if item_of[core].is_none() && !is_dealt[item] {
                    (item_of[core], is_dealt[item]) = (Some(item), true);
                }
            }
            for (core, item) in item_of.into_iter().enumerate() {
                let Some(item) = item else { continue };
                last[core] = Some(places[item]);
                dealt.push(round[item]);
            }
        }
        dealt
    }
}

/// Divides the items into groups with one run per core. A group lists the first item of every run, then the
/// second items, and so on.
fn runs(items: &[WorkItem], cores: usize) -> Vec<WorkItem> {
    let mut dealt = Vec::with_capacity(items.len());
    for stretch in items.chunks(cores * RUN) {
        // The last group has shorter runs: all rounds except the last are full.
        let rounds = stretch.len().div_ceil(cores);
        let longer = stretch.len() - (rounds - 1) * cores;
        let first = |core: usize| core * (rounds - 1) + core.min(longer);
        for round in 0..rounds {
            let cores = if round + 1 < rounds { cores } else { longer };
            dealt.extend((0..cores).map(|core| stretch[first(core) + round]));
        }
    }
    dealt
}

fn first_tile(item: &WorkItem) -> TileRef {
    match *item {
        WorkItem::Tile(tile) | WorkItem::Pair(tile, ..) => tile,
    }
}

/// The core at a tile. The cores form a rectangle with nearly equal sides, which is mirrored at its edges.
fn core_at([x, y]: [u32; 2], cores: usize) -> usize {
    let rows = (1..=cores)
        .rev()
        .find(|rows| cores.is_multiple_of(*rows) && rows * rows <= cores)
        .unwrap_or(1);
    let columns = cores / rows;
    let mirrored = |at: u32, count: usize| {
        let at = at as usize % (2 * count);
        at.min(2 * count - 1 - at)
    };
    mirrored(y, rows) * columns + mirrored(x, columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLUMNS: u32 = 8;

    fn row(tiles: impl IntoIterator<Item = u32>) -> Vec<WorkItem> {
        let tile = |tile| WorkItem::Tile(TileRef { pass: 0, tile });
        tiles.into_iter().map(tile).collect()
    }

    fn dealt(assignment: Assignment, cores: u32, tiles: impl IntoIterator<Item = u32>) -> Vec<u32> {
        let items = assignment.deal(row(tiles), cores, &|_| COLUMNS);
        items.iter().map(|item| first_tile(item).tile).collect()
    }

    #[test]
    fn both_sides_of_a_group_boundary_belong_to_one_core() {
        // Core 0 has columns 0, 3, 4 and 7. Core 1 has columns 1, 2, 5 and 6.
        assert_eq!(dealt(Assignment::Quads, 2, 0..8), [0, 1, 3, 2, 4, 5, 7, 6]);
        let cores: Vec<usize> = (0..4).map(|x| core_at([x, 1], 4)).collect();
        assert_eq!(cores, [2, 3, 3, 2]);
        assert_eq!(core_at([0, 2], 4), 2);
    }

    #[test]
    fn an_item_goes_to_the_core_whose_last_tile_is_nearest() {
        // Core 0 had column 0, core 1 column 7.
        assert_eq!(
            dealt(Assignment::Affinity, 2, [0, 7, 6, 1, 5]),
            [0, 7, 1, 6, 5]
        );
    }

    #[test]
    fn cores_take_runs_of_consecutive_items() {
        assert_eq!(
            dealt(Assignment::Runs, 2, 0..13),
            [0, 4, 1, 5, 2, 6, 3, 7, 8, 11, 9, 12, 10]
        );
    }

    #[test]
    fn the_last_round_may_have_fewer_items_than_cores() {
        for assignment in Assignment::ALL {
            let mut dealt = dealt(assignment, 16, 0..37);
            dealt.sort_unstable();
            assert!(dealt.into_iter().eq(0..37), "{assignment:?}");
        }
    }
}
