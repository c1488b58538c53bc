//! All cores share a tile: neighbouring quads go to different cores, which wait for each other after each tile. The
//! baseline of DTexL.

use super::{HandOut, Place, Queue, SchedulerRow, no_bits};

pub const ROW: SchedulerRow = SchedulerRow {
    name: "quads-in-turn",
    help: "Morton, neighbouring quads of a tile go to different cores, which wait for each other",
    source: "baseline of DTexL, MICRO 2022",
    order: "morton",
    plan: |items, _| Queue {
        items,
        hand_out: HandOut::Dealt(core_of, true),
    },
    uses_last_frame: false,
    priority_warps: false,
    skips_equal: false,
    bits: no_bits,
};

fn core_of(place: &Place, cores: usize) -> usize {
    let [x, y] = place.quad.map(|at| at as usize);
    // Two steps a row, so that the quads of a square of two by two go to four cores.
    (x + 2 * y) % cores
}
