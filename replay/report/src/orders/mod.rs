//! Reports of a study of tile orders: table, JSON, CSV and HTML page.

mod columns;
mod means;
mod page;

use super::answers;
use super::document::Document;
use super::lists::unique;
use super::table::{Style, Table};
use columns::LearnedRow;
pub use columns::LearnedTrace;
pub use means::Mean;
use serde::Serialize;
use sim::config::RunConfig;
use sim::result::TraceId;
use studies::orders_study::OrderRow;

/// The results of a study.
pub struct OrdersReport<'a> {
    /// Rows, trace by trace.
    pub rows: Vec<OrderRow<'a>>,
    /// Results of the learner, by trace and caches; empty unless requested.
    pub learned: Vec<LearnedTrace<'a>>,
    /// The machine, except for the varied settings.
    pub config: RunConfig,
}

/// The JSON object.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct OrdersJson<'a> {
    config: RunConfig,
    traces: Vec<OrdersTrace<'a>>,
    rows: Table,
    means: Table,
    learned: Table,
}

#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct OrdersTrace<'a> {
    label: &'a str,
    #[serde(flatten)]
    id: &'a TraceId,
    frames: u32,
    offset_tiles: i32,
}

impl<'a> OrdersReport<'a> {
    /// Means over traces and caches, fewest bytes first.
    pub fn means(&self) -> Vec<Mean<'_>> {
        means::means(&self.rows)
    }

    fn learned_table(&self) -> Table {
        let rows: Vec<LearnedRow<'_>> = self.learned.iter().flat_map(LearnedTrace::rows).collect();
        Table::new(&columns::learned(), &rows)
    }
}

impl Document for OrdersReport<'_> {
    const SCHEMA: &'static str = "replay.orders/2";
    const HAS_DETAILS: bool = true;

    fn content(&self) -> impl Serialize {
        let mut traces: Vec<OrdersTrace<'_>> = Vec::new();
        for row in &self.rows {
            if traces
                .last()
                .is_none_or(|last| last.label != row.subject.label)
            {
                traces.push(OrdersTrace {
                    label: &row.subject.label,
                    id: &row.subject.id,
                    frames: row.frames(),
                    offset_tiles: row.offset_tiles,
                });
            }
        }
        OrdersJson {
            config: self.config,
            traces,
            rows: self.rows(),
            means: Table::new(&columns::means(), &self.means()),
            learned: self.learned_table(),
        }
    }

    fn rows(&self) -> Table {
        Table::new(&columns::rows(), &self.rows).grouped_by(1)
    }

    #[cfg(feature = "testing")]
    fn tables() -> Vec<(&'static str, Table)> {
        vec![
            ("rows", Table::new(&columns::rows(), &[])),
            ("means", Table::new(&columns::means(), &[])),
            ("learned", Table::new(&columns::learned(), &[])),
        ]
    }

    fn answer(&self) -> Vec<String> {
        let caches = self.rows.iter().map(|row| {
            let level = &row.config.level;
            [level.l1.size_bytes, level.l2.size_bytes]
        });
        let frames = unique(
            self.rows
                .iter()
                .map(|row| (&row.subject.label, row.frames())),
        );
        let frames: Vec<u32> = frames.into_iter().map(|(_, frames)| frames).collect();
        let mut out = page::sentences(&self.means());
        out.insert(1, answers::machine(&self.config, caches, &frames));
        out
    }

    /// The means.
    fn text(&self, style: Style) -> String {
        let of_orders = self.means();
        let means = Table::new(&columns::means(), &of_orders).grouped_by(1);
        let treatments = unique(self.rows.iter().map(|row| row.config.between_frames)).len();
        // The worst of one row is that row.
        let has_worst = of_orders.iter().any(|mean| mean.rows.len() > 1);
        let keys = columns::TERMINAL
            .into_iter()
            .skip(usize::from(treatments < 2));
        let table = means.picked(keys.filter(|key| has_worst || *key != "worst_pct"));
        let mut text = table.without_empty_columns().styled(style);
        if !self.learned.is_empty() {
            text += &format!("\n{}", self.learned_table().styled(style));
        }
        text
    }

    fn details(&self, style: Style) -> String {
        let means = Table::new(&columns::means(), &self.means()).grouped_by(1);
        let names = ["between_frames", "order", "buildable"].into_iter();
        let table = means.picked(names.chain(columns::CHANGES).chain(columns::SIZES));
        table.without_empty_columns().styled(style)
    }
}
