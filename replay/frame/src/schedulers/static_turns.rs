//! Round robin.

use super::{HandOut, Queue, SchedulerRow, no_bits};

pub const ROW: SchedulerRow = SchedulerRow {
    name: "static",
    help: "Morton, tiles round robin",
    source: "",
    order: "morton",
    plan: |items, _| Queue {
        items,
        hand_out: HandOut::Static,
    },
    uses_last_frame: false,
    priority_warps: false,
    skips_equal: false,
    bits: no_bits,
};
