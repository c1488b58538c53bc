//! The plots of a scene's techniques.

use crate::plots::SeriesStyle;
use crate::plots::boxes::{BoxChart, BoxRow};
use crate::plots::lines::{Axis, Doublings, LineChart, LineSeries};
use crate::plots::scatter::{NamedPoint, ScatterChart};
use studies::techniques::{Measured, Measures, Spread};

/// Largest number of lines that a chart can distinguish.
const MOST_LINES: usize = 6;

/// Colour by type of technique: lossless, lossy, or baseline.
fn style(measured: &Measured) -> SeriesStyle {
    let index = match (measured.is_baseline(), measured.row.lossless) {
        (true, _) => 7,
        (false, true) => 3,
        (false, false) => 4,
    };
    SeriesStyle::nth(&measured.row.technique, index)
}

/// Run time against error.
pub fn pareto(measures: &Measures) -> ScatterChart {
    let label = "median frame time, \u{d7} the baseline's";
    let times = |of: fn(f64, f64) -> f64| {
        let all = measures.rows.iter().map(|m| m.timing.ratio.median);
        all.reduce(of).unwrap_or(1.0)
    };
    ScatterChart {
        title: format!("{}: run time against error", measures.scene),
        x: match times(f64::max) > 2.0 * times(f64::min) {
            true => Axis::doublings(label, Doublings::Numbers),
            false => Axis::linear(label),
        },
        y: Axis::from_zero(
            "mean FLIP inside the lens",
            measures.rows.iter().map(|m| m.pictures.flip_mean),
        ),
        kinds: ["not dominated".to_owned(), "dominated".to_owned()],
        points: measures
            .rows
            .iter()
            .map(|m| NamedPoint {
                style: style(m),
                at: (m.timing.ratio.median, m.pictures.flip_mean),
                dominated: m.dominated,
            })
            .collect(),
    }
}

/// Distribution of frame times over the baseline's.
pub fn ratios(measures: &Measures) -> BoxChart {
    let values = |s: &Spread| [s.p1, s.q1, s.median, s.q3, s.p99];
    BoxChart {
        title: format!("{}: frame time over the baseline's", measures.scene),
        note: "whiskers 1 and 99 %, box quartiles, mark and number median".to_owned(),
        x: Axis::linear("frame time over that of the baseline measured next to it"),
        rows: measures
            .rows
            .iter()
            .map(|m| BoxRow {
                style: style(m),
                values: values(&m.timing.ratio),
            })
            .collect(),
        reference: Some(1.0),
        decimals: 3,
    }
}

/// The baseline and techniques that are not dominated, at most [`MOST_LINES`].
fn chosen<'m, 'a>(measures: &'m Measures<'a>) -> Vec<(&'m Measured<'a>, SeriesStyle)> {
    let (baseline, others): (Vec<_>, Vec<_>) = measures.rows.iter().partition(|m| m.is_baseline());
    let best = others.into_iter().filter(|m| !m.dominated);
    let styled = |(index, m): (usize, &'m Measured<'a>)| {
        // The neutral colour is reserved for the baseline.
        let index = if m.is_baseline() { 7 } else { index - 1 };
        (m, SeriesStyle::nth(&m.row.technique, index))
    };
    let all = baseline.into_iter().chain(best);
    all.take(MOST_LINES).enumerate().map(styled).collect()
}

fn over_frames(
    measures: &Measures,
    title: &str,
    y: &str,
    of: impl Fn(&Measured) -> Vec<f64>,
) -> LineChart {
    let series = |(m, style): (&Measured, SeriesStyle)| {
        let numbers = m.row.frames.iter().map(|f| f64::from(f.frame));
        LineSeries::line(style, numbers.zip(of(m)))
    };
    LineChart {
        title: format!("{}: {title}", measures.scene),
        x: Axis::linear("frame"),
        y: Axis::linear(y),
        series: chosen(measures).into_iter().map(series).collect(),
    }
}

/// Frame times along the path.
pub(super) fn frame_times(measures: &Measures) -> LineChart {
    over_frames(
        measures,
        "frame time along the path",
        "median of each frame's repeats, ms",
        |m| m.timing.frames_ms.clone(),
    )
}

/// Errors along the path; `None` without errors.
pub fn errors(measures: &Measures) -> Option<LineChart> {
    let chart = over_frames(
        measures,
        "error along the path",
        "mean FLIP of both eyes inside the lens",
        |m| m.pictures.by_frame.clone(),
    );
    let mut points = chart.series.iter().flat_map(|s| &s.points);
    points.any(|p| p.1 > 0.0).then_some(chart)
}
