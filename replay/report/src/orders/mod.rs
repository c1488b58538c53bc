//! Reports of a study of tile orders: table, JSON, CSV and HTML page.

mod columns;
mod means;
mod page;

use super::columns::Records;
use super::table::Table;
use columns::LearnedRow;
pub use columns::LearnedTrace;
pub use means::Mean;
use serde::Serialize;
use sim::config::RunConfig;
use sim::model_version::MODEL_VERSION;
use sim::result::{TOOL, TraceId};
use studies::orders_study::Row;

/// Schema of the JSON object.
pub const SCHEMA: &str = "replay.orders/2";

/// The results of a study.
pub struct OrdersReport<'a> {
    /// Rows, trace by trace.
    pub rows: Vec<Row<'a>>,
    /// Results of the learner, by trace and caches; empty unless requested.
    pub learned: Vec<LearnedTrace<'a>>,
    /// The machine, except for the varied settings.
    pub config: RunConfig,
}

#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct Document<'r, 'a> {
    schema: &'a str,
    tool: &'a str,
    model_version: u32,
    config: RunConfig,
    traces: Vec<TraceFacts<'a>>,
    rows: Records<'r, 'a, Row<'a>>,
    means: Records<'r, 'a, Mean<'a>>,
    learned: Records<'r, 'a, LearnedRow<'a>>,
}

#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct TraceFacts<'a> {
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

    fn learned_rows(&self) -> Vec<LearnedRow<'_>> {
        self.learned.iter().flat_map(LearnedTrace::rows).collect()
    }

    /// The means; for a single trace, its rows.
    pub fn text(&self) -> String {
        let means = self.means();
        let keys = columns::SHORT_MEANS.into_iter();
        let table = Table::new(&columns::means(), &means)
            .grouped_by(1)
            .picked(keys);
        let mut text = table.without_empty_columns().text();
        if !self.learned.is_empty() {
            text += "\n";
            text += &Table::new(&columns::learned(), &self.learned_rows()).text();
        }
        text
    }

    /// Every row.
    pub fn table(&self) -> Table {
        Table::new(&columns::rows(), &self.rows).grouped_by(1)
    }

    /// Every row in full precision.
    pub fn csv(&self) -> String {
        self.table().csv()
    }

    /// As one JSON object.
    ///
    /// # Errors
    /// A value that is not finite.
    pub fn json(&self) -> serde_json::Result<String> {
        let mut traces: Vec<TraceFacts<'_>> = Vec::new();
        for row in &self.rows {
            if traces
                .last()
                .is_none_or(|last| last.label != row.subject.label)
            {
                traces.push(TraceFacts {
                    label: &row.subject.label,
                    id: &row.subject.id,
                    frames: row.frames(),
                    offset_tiles: row.offset_tiles,
                });
            }
        }
        serde_json::to_string_pretty(&Document {
            schema: SCHEMA,
            tool: TOOL,
            model_version: MODEL_VERSION,
            config: self.config,
            traces,
            rows: Records {
                columns: &columns::rows(),
                rows: &self.rows,
            },
            means: Records {
                columns: &columns::means(),
                rows: &self.means(),
            },
            learned: Records {
                columns: &columns::learned(),
                rows: &self.learned_rows(),
            },
        })
    }
}

/// The schema of the JSON object.
#[cfg(feature = "testing")]
pub fn schema() -> formats::schemas::Published {
    use crate::schemas::WithRows;
    formats::schemas::Published::of::<Document<'_, '_>>(SCHEMA)
        .rows("rows", &crate::columns::headings(&columns::rows()))
        .rows("means", &crate::columns::headings(&columns::means()))
        .rows("learned", &crate::columns::headings(&columns::learned()))
}
