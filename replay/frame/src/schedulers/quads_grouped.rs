//! All cores share a tile: each has a rectangle of it, mirrored from tile to tile, so that the rectangles on both sides
//! of an edge belong to one core. Cores do not wait for each other.

use super::{HandOut, Place, Queue, SchedulerRow};

pub const ROW: SchedulerRow = SchedulerRow {
    name: "quads-grouped",
    help: "Hilbert, each core renders its rectangle of each tile, mirrored from tile to tile",
    source: "after DTexL, MICRO 2022",
    order: "hilbert",
    plan: |items, _| Queue {
        items,
        hand_out: HandOut::Dealt(core_of, false),
    },
    uses_last_frame: false,
    priority_warps: false,
    skips_equal: false,
    // The core of each quad of a tile of 8 by 8 quads.
    bits: |hardware| 64 * u64::from(hardware.cores.next_power_of_two().ilog2()),
};

fn core_of(place: &Place, cores: usize) -> usize {
    let rows = (1..=cores).rev();
    let mut rows = rows.filter(|rows| cores.is_multiple_of(*rows) && rows * rows <= cores);
    let rows = rows.next().unwrap_or(1);
    let across = |axis: usize, count: usize| {
        let at = place.quad[axis] as usize * count / place.tile_quads.max(1) as usize;
        match place.tile[axis] % 2 {
            0 => at,
            _ => count - 1 - at,
        }
    };
    across(1, rows) * (cores / rows) + across(0, cores / rows)
}
