//! Schedulers: in which order tiles are rendered, and which core gets what. One a file, each a row of the table.

mod both_ends;
mod boustro;
mod first_idle;
mod hot_cold;
mod pair_pressure;
mod priority_warps;
mod quads_grouped;
mod quads_in_turn;
mod skip_equal;
mod static_turns;
mod z2_lrta;
mod z2_sta;

use sim::config::{Order, RunConfig};
use sim::order::{TileRef, WorkItem};
use sim::registry::Named;
use std::collections::HashMap;
use std::ops::Range;

/// A row of the table of schedulers.
#[derive(Debug)]
pub struct SchedulerRow {
    /// Name.
    pub name: &'static str,
    /// One line of help.
    pub help: &'static str,
    /// Where the idea is from.
    pub source: &'static str,
    /// The order of its items.
    pub order: &'static str,
    /// How the items of a phase reach the cores.
    pub plan: fn(Vec<WorkItem>, &Inputs<'_>) -> Queue,
    /// True if it uses the counters of the last frame.
    pub uses_last_frame: bool,
    /// True if some warps of a tile start first.
    pub priority_warps: bool,
    /// True if it leaves out tiles that equal those of the last frame.
    pub skips_equal: bool,
    /// Bits of state and tables beside those of the order.
    pub bits: fn(&Hardware) -> u64,
}

/// A scheduler.
pub type Scheduler = Named<SchedulerRow>;

macro_rules! table {
    ($($row:ident)+) => {
        sim::rows! { SchedulerRow: $(Scheduler::new(&$row::ROW);)+ }
    };
}

table! {
    first_idle static_turns boustro z2_lrta z2_sta quads_in_turn quads_grouped hot_cold priority_warps skip_equal
    pair_pressure
}

/// What a scheduler's hardware depends on.
#[derive(Clone, Copy, Debug)]
pub struct Hardware {
    /// Tiles of a frame.
    pub tiles: u64,
    /// Cores.
    pub cores: u64,
    /// Warps in flight per core.
    pub warps: u64,
}

/// The hardware of a scheduler in bits: its own, and that of its order.
pub fn bits(scheduler: Scheduler, hardware: &Hardware, eye_tiles: [u32; 2]) -> u64 {
    let row = scheduler.row();
    let order = order_of(scheduler).cost(eye_tiles, hardware.cores as u32);
    (row.bits)(hardware) + 8 * (u64::from(order.state_bytes) + order.table_bytes)
}

/// The order of a scheduler's items.
///
/// # Panics
/// Never: a test finds the order of every row.
pub fn order_of(scheduler: Scheduler) -> Order {
    Order::find(scheduler.row().order).expect("an order of the table")
}

/// What a scheduler knows.
pub struct Inputs<'a> {
    /// The configuration.
    pub config: &'a RunConfig,
    /// The counters of the last frame.
    pub last: &'a Pressure,
}

/// Lines that each tile of the last frame read from DRAM, by the pass's place in its frame and by tile.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pressure {
    lines: HashMap<(u32, u32), f64>,
    /// First pass of the frame that is planned.
    pub first_pass: u32,
}

impl Pressure {
    /// No lines, of a frame whose first pass is this one.
    pub fn new(first_pass: u32) -> Self {
        Self {
            first_pass,
            ..Self::default()
        }
    }

    /// Lines of an item's tiles.
    pub fn of(&self, item: &WorkItem) -> f64 {
        let lines = |at: TileRef| self.lines.get(&(at.pass - self.first_pass, at.tile));
        item.tiles().filter_map(lines).sum()
    }

    /// Adds the lines of an item; its tiles have equal shares.
    pub fn add(&mut self, item: &WorkItem, lines: u64) {
        let tiles = item.tiles().count() as f64;
        for at in item.tiles() {
            let place = (at.pass - self.first_pass, at.tile);
            *self.lines.entry(place).or_default() += lines as f64 / tiles;
        }
    }
}

/// The items of a phase.
#[derive(Clone, Debug)]
pub struct Queue {
    /// In order.
    pub items: Vec<WorkItem>,
    /// How cores get them.
    pub hand_out: HandOut,
}

impl Queue {
    /// Items for whichever core has a free slot.
    pub fn first_idle(items: Vec<WorkItem>, _: &Inputs<'_>) -> Self {
        Self {
            items,
            hand_out: HandOut::FirstIdle,
        }
    }
}

/// How cores get items.
#[derive(Clone, Debug)]
pub enum HandOut {
    /// The next item goes to the core with the fewest tiles.
    FirstIdle,
    /// Round robin.
    Static,
    /// Groups of items. Cores with even numbers take the next group from the front, the others from the back.
    BothEnds(Vec<Range<usize>>),
    /// The quads of each item are dealt to all cores. True if cores wait for each other after each item.
    Dealt(fn(&Place, usize) -> usize, bool),
}

/// Where a quad is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Column and row in its tile.
    pub quad: [u32; 2],
    /// Column and row of its tile.
    pub tile: [u32; 2],
    /// Quads along the edge of a tile.
    pub tile_quads: u32,
}

/// No hardware beside the order's.
fn no_bits(_: &Hardware) -> u64 {
    0
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_scheduler_has_an_order_and_a_name_of_its_own() {
        let names: BTreeSet<&str> = Scheduler::all().map(Scheduler::name).collect();
        assert_eq!(names.len(), Scheduler::all().len());
        for scheduler in Scheduler::all() {
            assert!(
                Order::find(scheduler.row().order).is_some(),
                "{scheduler:?}"
            );
        }
    }

    #[test]
    fn quads_are_dealt_to_every_core() {
        for cores in 1..9 {
            for row in [&quads_in_turn::ROW, &quads_grouped::ROW] {
                let config = RunConfig::default();
                let inputs = Inputs {
                    config: &config,
                    last: &Pressure::default(),
                };
                let HandOut::Dealt(core_of, _) = (row.plan)(Vec::new(), &inputs).hand_out else {
                    panic!("{} deals no quads", row.name);
                };
                let mut quads = vec![0; cores];
                for at in 0..64 {
                    let place = Place {
                        quad: [at % 8, at / 8],
                        tile: [1, 2],
                        tile_quads: 8,
                    };
                    quads[core_of(&place, cores)] += 1;
                }
                assert!(quads.iter().all(|&quads| quads > 0), "{} {cores}", row.name);
            }
        }
    }
}
