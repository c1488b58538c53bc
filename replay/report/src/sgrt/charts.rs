//! Charts of reprojection results.

use super::Entry;
use crate::html::figures;
use crate::plots::bars::{BarChart, BarGroup};
use crate::plots::lines::{Axis, LineChart, LineSeries};
use crate::plots::{PlotError, SeriesStyle};
use maud::Markup;
use sgrt::compose::Reuse;
use sgrt::result::{Outcome, Report};
use sim::paper::sgrt::PaperValues;

/// The paper's figure 3: relative performance and relative energy, with the published values as marks.
pub fn ratios(entries: &[Entry]) -> Result<Markup, PlotError> {
    let performance = performance(entries);
    let energy = chart(
        entries,
        "Relative energy",
        "energy over tracing both eyes",
        |o| o.relative_energy,
        |p| p.relative_energy,
    );
    Ok(figures(&[
        (performance.svg()?, "Paper: figure 3, left.".to_owned()),
        (energy.svg()?, "Paper: figure 3, right.".to_owned()),
    ]))
}

/// Frames per second over those of tracing both eyes.
pub fn performance(entries: &[Entry]) -> BarChart {
    chart(
        entries,
        "Relative performance",
        "frames per second over tracing both eyes",
        |o| o.relative_performance,
        |p| p.relative_performance,
    )
}

fn chart(
    entries: &[Entry],
    title: &str,
    value_label: &str,
    ours: impl Fn(&Outcome) -> f64,
    paper: impl Fn(&PaperValues) -> f64,
) -> BarChart {
    let groups: Vec<BarGroup> = entries
        .iter()
        .map(|entry| {
            let report = &entry.report;
            let mark = report.paper.as_ref().map(&paper);
            BarGroup {
                label: super::tables::scene_name(report),
                values: vec![Some(ours(&report.result)), Some(ours(&report.plain))],
                marks: vec![mark, mark],
                ..BarGroup::default()
            }
        })
        .collect();
    let any_mark = entries.iter().any(|e| e.report.paper.is_some());
    BarChart {
        title: title.to_owned(),
        value_label: value_label.to_owned(),
        group_label: String::new(),
        series: SeriesStyle::list(&[("chosen rule", 2), ("plain reuse", 1)]),
        groups,
        mark_name: any_mark.then(|| "paper".to_owned()),
        reference: Some(1.0),
        decimals: Some(2),
    }
}

/// Unit cycles saved against image error: one point cloud per level of reuse.
pub fn curve(report: &Report) -> Result<Markup, PlotError> {
    let name = |reuse| match reuse {
        Reuse::Primary => "primary hits reused",
        Reuse::Shadow => "and shadow rays",
        Reuse::Color => "and diffuse colour",
        Reuse::Pixel => "and reflections",
    };
    let series = |reuse, index, x: &dyn Fn(&sgrt::result::CurvePoint) -> f64| {
        let mut points: Vec<(f64, f64)> = report
            .curve
            .iter()
            .filter(|p| p.reuse == reuse)
            .map(|p| (x(p), p.tni_reduction_pct))
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        LineSeries::dots(SeriesStyle::nth(name(reuse), index), points)
    };
    // Colour reuse saves no more unit cycles than shadow reuse, and looks the same.
    let levels = [(Reuse::Primary, 2), (Reuse::Shadow, 0)];
    let of = |x: &dyn Fn(&sgrt::result::CurvePoint) -> f64| {
        levels
            .map(|(reuse, index)| series(reuse, index, x))
            .to_vec()
    };
    let chart = |title: &str, label: &str, series| LineChart {
        title: title.to_owned(),
        x: Axis::linear(label),
        y: Axis::linear("unit cycles saved, % of both eyes in full"),
        series,
    };
    let flip = chart(
        "Cycles saved against FLIP",
        "mean FLIP of the right image",
        of(&|p| p.flip_mean),
    );
    let wrong = chart(
        "Cycles saved against wrong pixels",
        "right pixels on a wrong object, %",
        of(&|p| p.wrong_object_pct),
    );
    Ok(figures(&[
        (
            flip.svg()?,
            "One dot per rule; the table below names them.".to_owned(),
        ),
        (wrong.svg()?, String::new()),
    ]))
}
