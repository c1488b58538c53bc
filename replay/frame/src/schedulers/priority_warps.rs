//! Every eighth warp of a tile starts first and is issued first, so that its misses prefetch for the others.

use super::{Queue, SchedulerRow};

pub const ROW: SchedulerRow = SchedulerRow {
    name: "priority-warps",
    help: "Morton, every eighth warp of a tile starts first and has priority",
    source: "after WaSP, arXiv 2404.06156",
    order: "morton",
    plan: Queue::first_idle,
    uses_last_frame: false,
    priority_warps: true,
    skips_equal: false,
    bits: |hardware| hardware.cores * hardware.warps,
};
