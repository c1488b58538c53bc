//! The table of the cycle-level model beside the closed form.

use super::Entry;
use super::tables::scene_name;
use crate::columns::{Column, Show};
use crate::table::Table;
use sgrt::cycles::PrefetchCounts;
use sgrt::timing::FrameTiming;

/// Title of the table.
pub const TITLE: &str = "Units cycle by cycle, and the closed form";

/// Title of the table of prefetches.
pub const PREFETCH_TITLE: &str = "Lines that the units fetched ahead";

/// A simulation.
struct UnitsRow<'a> {
    scene: String,
    run: &'static str,
    timing: &'a FrameTiming,
}

/// The simulations of all traces; none if the closed form was used.
fn runs(entries: &[Entry]) -> Vec<UnitsRow<'_>> {
    let mut rows = Vec::new();
    for Entry { report, .. } in entries {
        let (Some(chosen), Some(plain)) = (&report.result.cycles, &report.plain.cycles) else {
            continue;
        };
        let runs = [
            ("left eye alone", &chosen.left),
            ("right eye alone", &chosen.right),
            ("both eyes in full", &chosen.reference),
            ("chosen", &chosen.reprojected),
            ("plain", &plain.reprojected),
        ];
        rows.extend(runs.map(|(run, timing)| UnitsRow {
            scene: scene_name(report),
            run,
            timing,
        }));
    }
    rows
}

/// One row per simulation with a prefetcher; `None` without one.
#[rustfmt::skip]
pub fn prefetches(entries: &[Entry]) -> Option<Table> {
    let of = |r: &UnitsRow| r.timing.prefetch.unwrap_or_default();
    let lines = |key, name, value: fn(&PrefetchCounts) -> u64| {
        Column::new(key, name, "", Show::Whole, move |r: &UnitsRow| value(&of(r).counts))
    };
    let columns = [
        Column::text("scene", "scene", |r: &UnitsRow| r.scene.clone()),
        Column::text("run", "run", |r: &UnitsRow| r.run),
        lines("requested", "lines to prefetch", |p| p.requested),
        lines("held", "held", |p| p.held),
        lines("dropped", "dropped", |p| p.dropped),
        lines("issued", "issued", |p| p.issued),
        lines("useful", "useful", |p| p.useful),
        lines("late", "late", |p| p.late),
        lines("useless", "useless", |p| p.useless),
        Column::real("accuracy_pct", "accuracy", "%", 1, move |r: &UnitsRow| of(r).accuracy_pct),
        Column::real("covered_pct", "misses covered", "%", 1, move |r: &UnitsRow| of(r).covered_pct),
        lines("prefetched_dram_lines", "from DRAM", |p| p.dram_lines),
        lines("of_other_eye", "of the other eye", |p| p.of_other_eye),
    ];
    let mut rows = runs(entries);
    rows.retain(|row| row.timing.prefetch.is_some());
    table(&columns, &rows, PREFETCH_TITLE)
}

fn table<'a>(
    columns: &[Column<'_, UnitsRow<'a>>],
    rows: &[UnitsRow<'a>],
    title: &'static str,
) -> Option<Table> {
    (!rows.is_empty()).then(|| {
        let mut table = Table::new(columns, rows).grouped_by(1);
        table.caption = title;
        table
    })
}

/// One row per simulation; `None` if the closed form was used.
#[rustfmt::skip]
pub fn units(entries: &[Entry]) -> Option<Table> {
    let pct = |key, name, value: fn(&FrameTiming) -> f64| {
        Column::real(key, name, "%", 1, move |r: &UnitsRow| value(r.timing))
    };
    let cycles = |key, name, value: fn(&FrameTiming) -> u64| {
        Column::new(key, name, "M", Show::Millions(3), move |r: &UnitsRow| value(r.timing))
    };
    let columns = [
        Column::text("scene", "scene", |r: &UnitsRow| r.scene.clone()),
        Column::text("run", "run", |r: &UnitsRow| r.run),
        cycles("cycles", "unit cycles", |t| t.cycles),
        cycles("closed_form_cycles", "closed form", |t| t.closed_form_cycles),
        pct("closed_form_error_pct", "off by", |t| t.closed_form_error_pct),
        Column::text("closed_form_bottleneck", "its bottleneck", |r: &UnitsRow| r.timing.closed_form_bottleneck.clone()),
        pct("traversal_utilisation_pct", "traversal used", |t| t.traversal_utilisation_pct),
        pct("intersection_utilisation_pct", "intersection used", |t| t.intersection_utilisation_pct),
        pct("idle_no_ray_pct", "idle: no ray", |t| t.idle.no_ray),
        pct("idle_mshr_pct", "MSHRs full", |t| t.idle.mshr),
        pct("idle_dram_pct", "DRAM", |t| t.idle.dram),
        pct("idle_l2_pct", "L2", |t| t.idle.l2),
        pct("idle_latency_pct", "pipeline latency", |t| t.idle.latency),
        Column::real("mean_ray_cycles", "cycles per ray", "", 0, |r: &UnitsRow| r.timing.mean_ray_cycles),
        pct("node_l1_hit_pct", "node L1 hits", |t| t.node_l1_hit_pct),
        pct("triangle_l1_hit_pct", "triangle L1 hits", |t| t.triangle_l1_hit_pct),
        pct("l2_hit_pct", "L2 hits", |t| t.l2_hit_pct),
        cycles("rays", "rays", |t| t.rays_left),
        cycles("requests", "requests", |t| t.requests),
    ];
    table(&columns, &runs(entries), TITLE)
}
