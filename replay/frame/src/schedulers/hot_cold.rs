//! Supertiles with many and with few reads from DRAM at the same time, by the counters of the last frame.

use super::{SchedulerRow, both_ends};

pub const ROW: SchedulerRow = SchedulerRow {
    name: "hot-cold",
    help: "Supertiles of up to 4x4 tiles by the last frame's DRAM reads, most and fewest at the same time",
    source: "after LIBRA, MICRO 2024",
    order: "morton",
    plan: both_ends::plan,
    uses_last_frame: true,
    priority_warps: false,
    skips_equal: false,
    bits: |hardware| both_ends::bits(hardware.tiles, hardware.cores),
};
