//! Both tiles of a pair on one core, their triangles in turn.

use super::{Queue, SchedulerRow, no_bits};

pub const ROW: SchedulerRow = SchedulerRow {
    name: "z2-sta",
    help: "Morton, both tiles of a pair on one core, their triangles in turn",
    source: "Z2 STA, CVM 2017",
    order: "z2-sta",
    plan: Queue::first_idle,
    uses_last_frame: false,
    priority_warps: false,
    skips_equal: false,
    bits: no_bits,
};
