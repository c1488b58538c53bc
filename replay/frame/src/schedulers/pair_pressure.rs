//! Our own for stereo: pairs of tiles that show the same point at infinity stay together on a core, their neighbours too,
//! and groups with many and with few reads from DRAM are rendered at the same time, by the counters of the last frame at
//! the pair's place.

use super::{SchedulerRow, both_ends};

pub const ROW: SchedulerRow = SchedulerRow {
    name: "pair-pressure",
    help: "Groups of up to 4x4 tile pairs by the last frame's DRAM reads, most and fewest at the same time",
    source: "ours",
    order: "morton+sta+offset",
    plan: both_ends::plan,
    uses_last_frame: true,
    priority_warps: false,
    skips_equal: false,
    bits: |hardware| both_ends::bits(hardware.tiles.div_ceil(2), hardware.cores),
};
