//! Results of comparing two captures (`replay.compare/2`).

use super::columns::{Column, Columns, Row, Value, columns_of};
use super::document::Document;
use super::table::{Style, Table};
use formats::textrace::TraceMeta;
use serde::Serialize;
use sim::config::{Order, RunConfig};
use sim::result::{RunResult, TraceId};
use studies::compare::{Class, Comparison, Tally};

/// Materials that the terminal's table shows.
const MATERIALS: usize = 12;

/// A capture.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Side<'a> {
    /// Scene and checksum.
    pub trace: &'a TraceId,
    /// Description.
    #[cfg_attr(feature = "testing", schemars(with = "sim::schemas::Meta"))]
    pub meta: &'a TraceMeta,
}

/// The results of both captures in one order.
pub struct Replayed<'a> {
    /// The order.
    pub order: Order,
    /// Results of the first and the second capture.
    pub results: [&'a RunResult; 2],
    /// The same in Morton order, if it was replayed.
    pub morton: Option<[&'a RunResult; 2]>,
}

/// A comparison of two captures.
pub struct CompareReport<'a> {
    /// The captures.
    pub sides: [Side<'a>; 2],
    /// The machine; each row has its own order.
    pub config: RunConfig,
    /// Differences between the captures.
    pub comparison: &'a Comparison,
    /// Cache results by order.
    pub replayed: Vec<Replayed<'a>>,
}

/// External traffic saved against Morton order, percent, by capture.
fn saved_pct(row: &Replayed, side: usize) -> Option<f64> {
    let morton = row.morton?[side].external_bytes;
    let rest = row.results[side].external_bytes as f64 / morton as f64;
    (morton > 0 && row.order != Order::MORTON).then_some(100.0 * (1.0 - rest))
}

/// Relative difference of the second value to the first, percent.
fn over_pct(values: [f64; 2]) -> Option<f64> {
    (values[0] > 0.0).then(|| 100.0 * (values[1] / values[0] - 1.0))
}

impl Row for Replayed<'_> {
    #[rustfmt::skip]
    fn columns() -> Vec<Column<'static, Self>> {
        let bytes = |r: &Self, side: usize| r.results[side].external_bytes;
        columns_of::<Self>()
            .text("order", "order", |r| Value::Named(r.order.name(), r.order.title()))
            .real("a.l1_footprint_miss_pct", "A: L1", "% of footprints", 3, |r| 100.0 * r.results[0].l1.footprint_miss_rate)
            .real("a.l2_line_miss_pct", "A: L2", "% of lines", 3, |r| 100.0 * r.results[0].l2.line_miss_rate)
            .whole("a.external_bytes", "A: external", "bytes", move |r| bytes(r, 0))
            .real("a.reduction_pct", "A: saved", "% of Morton", 2, |r| saved_pct(r, 0))
            .real("b.l1_footprint_miss_pct", "B: L1", "% of footprints", 3, |r| 100.0 * r.results[1].l1.footprint_miss_rate)
            .real("b.l2_line_miss_pct", "B: L2", "% of lines", 3, |r| 100.0 * r.results[1].l2.line_miss_rate)
            .whole("b.external_bytes", "B: external", "bytes", move |r| bytes(r, 1))
            .real("b.reduction_pct", "B: saved", "% of Morton", 2, |r| saved_pct(r, 1))
            .real("l1_miss_over_pct", "L1 miss", "B/A \u{2212} 1, %", 3, |r| over_pct(r.results.map(|x| x.l1.footprint_miss_rate)))
            .real("l2_miss_over_pct", "L2 miss", "B/A \u{2212} 1, %", 3, |r| over_pct(r.results.map(|x| x.l2.line_miss_rate)))
            .real("external_over_pct", "external", "B/A \u{2212} 1, %", 3, |r| over_pct(r.results.map(|x| x.external_bytes as f64)))
    }
}

impl Row for Class {
    #[rustfmt::skip]
    fn columns() -> Vec<Column<'static, Self>> {
        columns_of::<Self>()
            .text("name", "fragments", |c| c.name.clone())
            .whole("fragments_in_both", "in both", "", |c| c.tally.fragments_in_both)
            .whole("fragments_only_in_a", "only A", "", |c| c.tally.fragments_only_in_a)
            .whole("fragments_only_in_b", "only B", "", |c| c.tally.fragments_only_in_b)
            .real("iou_pct", "both / either", "%", 4, |c| c.tally.intersection_over_union_pct())
            .real("uv_mean", "uv mean", "texels", 5, |c| c.tally.uv_texels.mean())
            .real("uv_99", "uv 99 %", "texels", 4, |c| c.tally.uv_texels.percentile(99.0))
            .real("uv_largest", "uv largest", "texels", 3, |c| c.tally.uv_texels.largest())
            .real("lod_mean", "LOD mean", "levels", 5, |c| c.tally.lod_levels.mean())
            .real("lod_largest", "LOD largest", "levels", 3, |c| c.tally.lod_levels.largest())
            .real("footprints_pct", "footprints", "% differ", 3, |c| c.tally.footprints_that_differ_pct())
            .whole("sampled_differently", "other sample", "lanes", |c| c.tally.lanes_sampled_differently)
    }
}

/// The JSON object.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct CompareJson<'a> {
    a: &'a Side<'a>,
    b: &'a Side<'a>,
    config: &'a RunConfig,
    intersection_over_union_pct: f64,
    #[serde(flatten)]
    comparison: &'a Comparison,
    replayed: Table,
}

impl Document for CompareReport<'_> {
    const SCHEMA: &'static str = "replay.compare/2";

    fn content(&self) -> impl Serialize {
        let [a, b] = &self.sides;
        CompareJson {
            a,
            b,
            config: &self.config,
            intersection_over_union_pct: self.comparison.all.intersection_over_union_pct(),
            comparison: self.comparison,
            replayed: self.rows(),
        }
    }

    fn rows(&self) -> Table {
        Table::new(&Replayed::columns(), &self.replayed)
    }

    #[cfg(feature = "testing")]
    fn tables() -> Vec<(&'static str, Table)> {
        vec![("replayed", Table::new(&Replayed::columns(), &[]))]
    }

    fn text(&self, style: Style) -> String {
        let mut text = String::new();
        for (name, side) in ["A", "B"].iter().zip(&self.sides) {
            let Side { trace, meta } = side;
            text += &format!(
                "{name}: {} ({}), {}, {}, {}\n",
                trace.scene, trace.checksum, meta.tool, meta.backend, meta.driver
            );
        }
        let of = self.comparison;
        text += &format!(
            "{} of {} tiles differ\n\n{}\n",
            of.tiles_that_differ,
            of.tiles,
            self.classes().styled(style)
        );
        let materials = self.materials();
        if !materials.rows.is_empty() {
            text += &format!("Materials that differ most\n{}\n", materials.styled(style));
        }
        text + &self.rows().without_empty_columns().styled(style)
    }
}

impl CompareReport<'_> {
    /// All fragments, and opaque fragments separately from the others.
    fn classes(&self) -> Table {
        let all = Class {
            name: "all".to_owned(),
            tally: self.comparison.all.clone(),
        };
        let classes = std::iter::once(&all).chain(&self.comparison.by_opacity);
        Table::new(&Class::columns(), classes)
    }

    /// The materials with the most different footprints and fragments.
    fn materials(&self) -> Table {
        let differing = |tally: &Tally| {
            let apart = tally.fragments_only_in_a + tally.fragments_only_in_b;
            apart + tally.footprints_that_differ + tally.lanes_sampled_differently
        };
        let mut classes: Vec<&Class> = (self.comparison.by_material.iter())
            .filter(|class| differing(&class.tally) > 0)
            .collect();
        classes.sort_by_key(|class| std::cmp::Reverse(differing(&class.tally)));
        classes.truncate(MATERIALS);
        Table::new(&Class::columns(), classes)
    }
}
