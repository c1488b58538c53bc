//! Tiles on cores over time, like Fig. 3 of the Z2 paper.

use super::model::PaperReport;
use crate::html::{Section, figures};
use crate::plots::spans::{Span, SpanChart};
use crate::plots::{PlotError, SeriesStyle};
use formats::textrace::Pass;
use formats::view::Eye;
use maud::html;
use sim::result::{Timeline, TimelineItem};
use studies::experiment::ResultRow;

/// Number of work items per core in the chart.
const ITEMS: usize = 14;

/// The section; `None` if no timeline was recorded.
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
    let note = "Work items from the middle of the frame, labelled with their tile. Their lengths follow from the texture unit.";
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
    // The chart ends when the first core has shown its items.
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
        kinds: SeriesStyle::list(&[("left eye", 0), ("right eye", 1), ("both", 2)]),
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
