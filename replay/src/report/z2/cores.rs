//! Tiles on cores over time, as the Z2 paper's Fig. 3 shows them for an example.

use super::model::PaperReport;
use crate::experiment::ResultRow;
use crate::report::html::{Section, figures};
use crate::report::plots::spans::{Span, SpanChart};
use crate::report::plots::{PlotError, SeriesStyle};
use crate::result::{Timeline, TimelineItem};
use formats::textrace::Pass;
use formats::view::Eye;
use maud::html;

/// Items of a core that a chart shows.
const ITEMS: usize = 14;

/// The section; none where nothing was recorded.
pub fn section(report: &PaperReport) -> Result<Option<Section>, PlotError> {
    let mut charts = Vec::new();
    for info in &report.traces {
        for row in report.details(&info.label) {
            if let Some(timeline) = &row.result.timeline {
                charts.push((chart(row, timeline).svg()?, info.label.clone()));
            }
        }
    }
    if charts.is_empty() {
        return Ok(None);
    }
    let note = "Work items from the middle of the frame, with the number of their tile. The texture unit decides how long an item takes.";
    let body = html! { p { (note) } (figures(&charts)) };
    Ok(Some(Section::new(
        "Tiles on cores over time (Fig. 3)",
        body,
    )))
}

/// The items around the middle of a replay.
fn chart(row: &ResultRow, timeline: &Timeline) -> SpanChart {
    let passes = &row.subject.source.tables().passes;
    let cores = row.point.config.cores;
    let end = timeline.items.iter().map(|item| item.end_cycle).max();
    let middle = end.unwrap_or(0) / 2;
    let of_core = |core: u32| {
        let items = timeline.items.iter().filter(move |item| item.core == core);
        items
            .skip_while(move |item| item.end_cycle <= middle)
            .take(ITEMS)
    };
    // Until the first core has shown its items.
    let ends = (0..cores).filter_map(|core| of_core(core).last().map(|item| item.end_cycle));
    let last = ends.min().unwrap_or(middle + 1).max(middle + 1);
    let span = |item: &TimelineItem| Span {
        range: item.start_cycle as f64..item.end_cycle as f64,
        kinds: item.tiles.iter().map(|at| kind(passes, at.pass)).collect(),
        label: item
            .tiles
            .first()
            .map_or_else(String::new, |at| at.tile.to_string()),
    };
    SpanChart {
        title: row.point.config.order.title().to_owned(),
        value_label: "cycles".to_owned(),
        kinds: vec![
            SeriesStyle::nth("left eye", 0),
            SeriesStyle::nth("right eye", 1),
            SeriesStyle::nth("both", 2),
        ],
        rows: (0..cores)
            .map(|core| (format!("core {core}"), of_core(core).map(span).collect()))
            .collect(),
        range: middle as f64..last as f64,
    }
}

fn kind(passes: &[Pass], pass: u32) -> usize {
    match passes.get(pass as usize).and_then(|pass| pass.eye) {
        Some(Eye::Left) => 0,
        Some(Eye::Right) => 1,
        None => 2,
    }
}
