//! The baseline: Morton, the next tile to the first core with room.

use super::{Queue, SchedulerRow, no_bits};

pub const ROW: SchedulerRow = SchedulerRow {
    name: "first-idle",
    help: "Morton, the next tile goes to the first core with room: the baseline",
    source: "baseline of the Z2 paper",
    order: "morton",
    plan: Queue::first_idle,
    uses_last_frame: false,
    priority_warps: false,
    skips_equal: false,
    bits: no_bits,
};
