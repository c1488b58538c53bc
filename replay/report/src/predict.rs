//! What orders save at a size that was not captured (`replay.predict/1`).

use super::columns::{Columns, columns_of};
use super::document::Document;
use super::table::{Style, Table};
use serde::Serialize;
use sim::config::RunConfig;
use studies::predict::{Answer, Predicted};

/// The JSON object.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct PredictJson {
    /// The machine, without the sizes that the rows have.
    config: RunConfig,
    /// The order that savings are over.
    baseline: String,
    /// Picture per eye, in pixels: captured and wanted.
    sizes_px: [[u32; 2]; 2],
    /// Figures.
    #[cfg_attr(
        feature = "testing",
        schemars(with = "Vec<serde_json::Map<String, serde_json::Value>>")
    )]
    rows: Table,
}

/// Predictions by caches and order.
#[derive(Clone, Debug)]
pub struct PredictReport {
    /// The machine.
    pub config: RunConfig,
    /// The order that savings are over.
    pub baseline: String,
    /// Picture per eye, in pixels: captured and wanted.
    pub sizes_px: [[u32; 2]; 2],
    /// Rows.
    pub rows: Vec<Predicted>,
}

fn caches(row: &Predicted) -> String {
    let (l1, l2) = row.caches_bytes;
    format!("{}/{}", l1 >> 10, l2 >> 10)
}

impl PredictReport {
    fn wanted(&self) -> String {
        let [width, height] = self.sizes_px[1];
        format!("{width}x{height}")
    }
}

impl Document for PredictReport {
    const SCHEMA: &'static str = "replay.predict/1";

    fn content(&self) -> impl Serialize {
        PredictJson {
            config: self.config,
            baseline: self.baseline.clone(),
            sizes_px: self.sizes_px,
            rows: self.rows(),
        }
    }

    #[rustfmt::skip]
    fn rows(&self) -> Table {
        let full_size = format!("inside a knee: capture at {}", self.wanted());
        let columns = columns_of::<Predicted>()
            .text("caches", "L1/L2", caches)
            .text("order", "order", |r| r.order.name())
            .real("saving_pct", "saving", "%", 1, Predicted::figure)
                .about("bytes saved against the baseline, with the largest error on other scenes as its interval; empty without an interval")
            .real("stretched_pct", "without interval", "%", 1, |r| r.saving_pct)
                .about("the same saving, also where it has no interval")
            .real("low_near_pct", "lowest near this L2", "%", 1, |r| r.around_pct[0])
                .about("lowest saving with an L2 of half to twice this size")
            .real("high_near_pct", "highest near this L2", "%", 1, |r| r.around_pct[1])
                .about("highest saving with such an L2")
            .whole("external_bytes_per_frame", "external", "bytes per frame", |r| r.frame_bytes.round() as u64)
                .about("bytes between the L2 and memory; no errors were measured")
            .text("answer", "answer", move |r| match r.answer {
                Answer::Interval => "interval".to_owned(),
                Answer::InsideKnee => full_size.clone(),
                Answer::Unmeasured(why) => format!("no interval: {why}"),
            });
        Table::new(&columns, &self.rows)
    }

    fn answer(&self) -> Vec<String> {
        let wanted = self.wanted();
        let with_interval = self
            .rows
            .iter()
            .filter_map(|row| Some((row, row.figure()?)));
        let best = with_interval.max_by(|a, b| a.1.value.total_cmp(&b.1.value));
        let knees = self
            .rows
            .iter()
            .filter(|row| row.answer == Answer::InsideKnee)
            .count();
        let found = best.map(|(row, figure)| {
            format!(
                "At {wanted}, {} saves {:.1} % ({:.1} to {:.1} %) of the external bytes of {} with L1/L2 {} KiB: predicted, {}.",
                row.order.name(), figure.value, figure.low, figure.high, self.baseline, caches(row), figure.because
            )
        });
        let inside = (knees > 0).then(|| {
            format!(
                "{knees} of {} predictions are inside a knee; a capture at {wanted} answers them.",
                self.rows.len()
            )
        });
        found.into_iter().chain(inside).collect()
    }

    fn text(&self, style: Style) -> String {
        let keys = ["caches", "order", "saving_pct", "stretched_pct", "answer"];
        self.rows().picked(keys).styled(style)
    }
}
