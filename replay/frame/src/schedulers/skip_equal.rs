//! Tiles whose quads, draws and coordinates equal the last frame's are not rendered. A signature per tile is kept.

use super::{Queue, SchedulerRow};

pub const ROW: SchedulerRow = SchedulerRow {
    name: "skip-equal",
    help: "Tiles whose quads equal the last frame's are not rendered",
    source: "after Rendering Elimination, arXiv 1807.09449",
    order: "morton",
    plan: Queue::first_idle,
    uses_last_frame: false,
    priority_warps: false,
    skips_equal: true,
    bits: |hardware| 32 * hardware.tiles,
};
