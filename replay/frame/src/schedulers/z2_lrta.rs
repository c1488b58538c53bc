//! Left and right tile in turn.

use super::{Queue, SchedulerRow, no_bits};

pub const ROW: SchedulerRow = SchedulerRow {
    name: "z2-lrta",
    help: "Morton, left and right tile in turn",
    source: "Z2 LRTA, CVM 2017",
    order: "z2-lrta",
    plan: Queue::first_idle,
    uses_last_frame: false,
    priority_warps: false,
    skips_equal: false,
    bits: no_bits,
};
