//! The columns of the tables, one per line.

use super::Mean;
use crate::columns::{Column, Columns, Kind, Value, columns_of};
use sim::config::Order;
use sim::figure::{Because, Figure};
use studies::orders_study::learn::{Learned, Learner};
use studies::orders_study::{OrderRow, RowKind};

/// Keys of the means' changes and rates.
pub(super) const CHANGES: [&str; 8] = [
    "over_morton_pct",
    "change_pct",
    "worst_trace",
    "worst_trace_change_pct",
    "closed_pct",
    "l1_footprint_miss_pct",
    "utilization_pct",
    "cycles_change_pct",
];

/// Keys of the means that fit a terminal.
pub(super) const TERMINAL: [&str; 9] = [
    "between_frames",
    "order",
    "buildable",
    "over_morton_pct",
    "change_pct",
    "worst_pct",
    "closed_pct",
    "cycles_change_pct",
    "state_bytes",
];

/// Keys of the sizes of an order's tables.
pub(super) const SIZES: [&str; 3] = ["state_bytes", "table_bytes", "tile_buffers"];

/// A figure whose ends are shown if they are bounds; a plain number if it is exact.
fn bounded(figure: Option<Figure>) -> Value {
    match figure {
        Some(Figure {
            value,
            because: Because::Exact,
            ..
        }) => Value::Real(value),
        figure => figure.into(),
    }
}

fn kib(bytes: u64) -> f64 {
    bytes as f64 / 1024.0
}

/// A part of an order; none for searched orders and bounds.
fn part(row: &OrderRow<'_>, of: fn(Order) -> String) -> Option<String> {
    match row.of {
        RowKind::Order(order) => Some(of(order)),
        RowKind::Searched(_) | RowKind::Bound(_) => None,
    }
}

/// Columns of the rows.
#[rustfmt::skip]
pub fn rows<'a>() -> Vec<Column<'a, OrderRow<'a>>> {
    columns_of::<OrderRow<'a>>()
        .text("trace", "trace", |r| r.subject.id.name.clone())
        .text("camera", "camera", |r| r.subject.id.camera.clone())
        .text("display", "display", |r| r.subject.id.display.clone())
        .real("offset_tiles", "offset", "tiles", 0, |r| f64::from(r.offset_tiles)).about("columns of tiles by which infinity lies apart in the two pictures")
        .text("order", "order", |r| r.name())
        .text("curve", "curve", |r| part(r, |order| order.parts().curve.name().to_owned()))
        .text("eyes", "eyes", |r| part(r, |order| order.parts().eyes.name().to_owned()))
        .text("pairing", "pairing", |r| part(r, |order| order.parts().pairing.name().to_owned()))
        .text("direction", "direction", |r| part(r, |order| order.parts().direction.name().to_owned()))
        .text("assign", "assignment", |r| part(r, |order| order.parts().assignment.map_or("as configured", sim::order::assignment::Assignment::name).to_owned()))
        .text("buildable", "buildable", |r| r.is_buildable()).about("no part of it needs accesses that are not made yet")
        .text("information", "information", |r| r.information()).about("what the order decides by: the grid, constants of the display, counters of the last frame, the future; or a bound")
        .whole("state_bytes", "state", "bytes", |r| r.cost.map(|c| c.state_bytes)).about("registers")
        .whole("table_bytes", "tables", "bytes", |r| r.cost.map(|c| c.table_bytes))
        .whole("look_ahead_items", "look-ahead", "items", |r| r.cost.map(|c| c.look_ahead_items))
        .whole("tile_buffers", "tile buffers", "per core", |r| r.cost.map(|c| c.tile_buffers))
        .whole("decision_cycles", "decision", "cycles", |r| r.cost.map(|c| c.decision_cycles)).about("until the next item is known")
        .text("mode", "mode", |r| r.config.mode.name())
        .whole("cores", "cores", "", |r| r.config.cores)
        .whole("line_bytes", "line", "bytes", |r| r.config.line_bytes)
        .real("l1_kib", "L1", "KiB", 0, |r| kib(r.config.level.l1.size_bytes))
        .real("l2_kib", "L2", "KiB", 0, |r| kib(r.config.level.l2.size_bytes))
        .whole("frames", "frames", "", |r| r.frames())
        .text("between_frames", "between frames", |r| r.config.between_frames.to_string())
        .whole("external_bytes", "traffic", "bytes", |r| r.external_bytes).about("between the L2 and memory, all frames together")
        .real("external_mb_per_frame", "traffic", "MB/frame", 3, |r| bounded(Some(r.megabytes()))).change_last(|column| column.kind(Kind::Real))
        .real("change_pct", "against Z2 STA", "%", 2, |r| bounded(r.change_pct())).change_last(|column| column.kind(Kind::Real)).about("bytes against those of z2-sta with the same caches")
        .real("closed_pct", "of the way to greedy", "%", 1, |r| r.closed_pct()).about("of the distance from z2-sta to the offline greedy order")
        .whole("distinct_bytes", "distinct", "bytes", |r| r.distinct_bytes).about("traffic of an infinite cache")
        .real("l1_footprint_miss_pct", "L1 misses", "% of footprints", 3, |r| l1_footprint_miss_rate(r).map(|rate| 100.0 * rate)).about("of footprints")
        .real("l2_line_miss_pct", "L2 misses", "% of lines", 2, |r| l2_line_miss_rate(r).map(|rate| 100.0 * rate)).about("of L2 look-ups")
        .real("utilization_pct", "utilisation", "%", 2, |r| utilization(r).map(|rate| 100.0 * rate)).about("of the texture units, in timed mode")
        .whole("cycles", "cycles", "", |r| r.result.as_ref().and_then(|result| result.cycles))
        .real("cycles_change_pct", "cycles against Z2 STA", "%", 2, |r| r.cycles_ratio().map(|ratio| 100.0 * (ratio - 1.0)))
        .real("dram_row_hit_pct", "DRAM row hits", "%", 2, |r| row_hit_rate(r).map(|rate| 100.0 * rate))
        .real("dram_energy_mj", "DRAM energy", "mJ", 4, |r| Some(r.result.as_ref()?.memory.dram.as_ref()?.energy_mj))
        .whole("whole_frame_bytes", "whole frame", "bytes", |r| {
            let clients = &r.result.as_ref()?.clients;
            (!clients.is_empty()).then(|| clients.iter().map(|client| client.read_bytes + client.write_bytes).sum::<u64>())
        }).about("traffic of all clients of memory, where the configuration has a [frame]")
}

fn l1_footprint_miss_rate(row: &OrderRow<'_>) -> Option<f64> {
    row.result
        .as_ref()
        .map(|result| result.l1.footprint_miss_rate)
}

fn l2_line_miss_rate(row: &OrderRow<'_>) -> Option<f64> {
    row.result.as_ref().map(|result| result.l2.line_miss_rate)
}

fn utilization(row: &OrderRow<'_>) -> Option<f64> {
    Some(row.result.as_ref()?.tmu.as_ref()?.utilization)
}

fn row_hit_rate(row: &OrderRow<'_>) -> Option<f64> {
    Some(row.result.as_ref()?.memory.dram.as_ref()?.row_hit_rate)
}

/// Columns of the means.
#[rustfmt::skip]
pub fn means<'a>() -> Vec<Column<'a, Mean<'a>>> {
    let information = |mean: &Mean<'a>| mean.rows.first().map(|row| Value::from(row.information())).unwrap_or_default();
    columns_of::<Mean<'a>>()
        .text("between_frames", "between frames", |m| m.between.to_string())
        .text("order", "order", |m| m.name())
        .text("buildable", "buildable", |m| m.cost().is_some_and(|cost| cost.is_buildable()))
        .text("information", "information", information)
        .whole("rows", "rows", "", |m| m.count()).about("traces times caches, without those in which the baseline fetches each line once; means are over these rows, or over all if there are none")
        .real("change_pct", "against Z2 STA", "%", 2, |m| bounded(m.change())).change_last(|column| column.kind(Kind::Real)).about("geometric mean of bytes over those of z2-sta")
        .real("over_morton_pct", "against Morton", "%", 2, |m| bounded(m.over_morton())).change_last(|column| column.kind(Kind::Real)).about("the same over those of morton")
        .text("worst_trace", "worst trace", |m| m.worst_trace().map(|(label, _)| label.to_owned())).about("by the geometric mean over its caches")
        .real("worst_trace_change_pct", "there", "%", 2, |m| m.worst_trace().map(|(_, change)| change))
        .real("worst_pct", "worst row", "% of Z2 STA", 2, Mean::worst_pct).about("change against z2-sta of a trace with a pair of caches")
        .real("closed_pct", "of the way to greedy", "%", 1, Mean::closed_pct).about("of the distance from z2-sta to the offline greedy order, by geometric means")
        .real("l1_footprint_miss_pct", "L1 misses", "% of footprints", 3, |m| m.rate_pct(l1_footprint_miss_rate)).about("mean, of footprints")
        .real("utilization_pct", "utilisation", "%", 2, |m| m.rate_pct(utilization))
        .real("cycles_change_pct", "cycles", "%", 2, Mean::cycles_change_pct).about("geometric mean of cycles over those of z2-sta")
        .real("dram_row_hit_pct", "DRAM row hits", "%", 2, |m| m.rate_pct(row_hit_rate))
        .whole("state_bytes", "state", "bytes", |m| m.cost().map(|c| c.state_bytes))
        .whole("table_bytes", "tables", "bytes", |m| m.cost().map(|c| c.table_bytes))
        .whole("look_ahead_items", "look-ahead", "items", |m| m.cost().map(|c| c.look_ahead_items))
        .whole("tile_buffers", "tile buffers", "per core", |m| m.cost().map(|c| c.tile_buffers))
        .whole("decision_cycles", "decision", "cycles", |m| m.cost().map(|c| c.decision_cycles))
}

/// The results of the learner for a trace and a pair of caches.
pub struct LearnedTrace<'a> {
    /// The trace's file.
    pub file: &'a str,
    /// The configuration.
    pub config: sim::config::RunConfig,
    /// The results.
    pub learned: Learned,
}

/// A fixed order, or the learner.
pub(super) struct LearnedRow<'a> {
    of: &'a LearnedTrace<'a>,
    /// Index of the order; none for the learner.
    order: Option<usize>,
}

impl LearnedTrace<'_> {
    pub(super) fn rows(&self) -> Vec<LearnedRow<'_>> {
        let orders = (0..self.learned.orders.len()).map(Some);
        let all = orders.chain([None]);
        all.map(|order| LearnedRow { of: self, order }).collect()
    }
}

impl LearnedRow<'_> {
    fn frames(&self) -> &[u64] {
        let learned = &self.of.learned;
        self.order
            .map_or(&learned.learned, |order| &learned.fixed[order])
    }

    fn bytes(&self) -> u64 {
        self.frames().iter().sum()
    }
}

/// Columns of the learner's results.
#[rustfmt::skip]
pub fn learned<'a>() -> Vec<Column<'a, LearnedRow<'a>>> {
    columns_of::<LearnedRow<'a>>()
        .text("trace", "trace", |r| r.of.file)
        .real("l1_kib", "L1", "KiB", 0, |r| kib(r.of.config.level.l1.size_bytes))
        .real("l2_kib", "L2", "KiB", 0, |r| kib(r.of.config.level.l2.size_bytes))
        .text("between_frames", "between frames", |r| r.of.config.between_frames.to_string())
        .text("order", "order", |r| r.order.map_or("learned", |order| r.of.learned.orders[order].name()))
        .whole("frames", "frames", "", |r| r.frames().len() as u64)
        .whole("external_bytes", "traffic", "bytes", LearnedRow::bytes)
        .real("regret_pct", "over the best fixed", "%", 2, |r| r.of.learned.regret_pct(r.bytes())).about("bytes over those of the order that is best throughout")
        .real("frame_best_pct", "best of each frame", "%", 2, |r| r.order.is_none().then(|| r.of.learned.frame_best_pct()).flatten())
            .about("what choosing the best order of each frame would save over the best fixed one")
        .whole("state_bytes", "state of the learner", "bytes", |r| r.order.is_none().then(|| u64::from(Learner::state_bytes(r.of.learned.orders.len() as u32))))
}
