//! Every other frame in reverse, so that a frame begins where the caches still hold the last one.

use super::{Queue, SchedulerRow};

pub const ROW: SchedulerRow = SchedulerRow {
    name: "boustro",
    help: "Morton, every other frame in reverse",
    source: "Boustrophedonic Frames, PACT 2023",
    order: "morton+boustro",
    plan: Queue::first_idle,
    uses_last_frame: false,
    priority_warps: false,
    skips_equal: false,
    bits: |_| 1,
};
