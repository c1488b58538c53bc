//! The experiment's plots, built from the rows and details of the report.

use super::model::{PaperReport, TraceInfo};
use super::tables::busiest;
use crate::columns::{Column, pick};
use crate::figures::{figure, number};
use crate::plots::axis;
use crate::plots::bars::{BarChart, BarGroup};
use crate::plots::contours::{ContourChart, PointSeries};
use crate::plots::hbars::HBarChart;
use crate::plots::heatmap::{HeatMap, Panel};
use crate::plots::lines::{Axis, LineChart, LineSeries};
use crate::plots::paths::{PathPlot, stops};
use crate::plots::{PlotError, SeriesStyle};
use crate::theme;
use sim::config::Order;
use sim::order::{PlanInputs, WorkItem};
use sim::paper::z2;
use sim::result::{Part, TileMap};
use sim::tmu::closed_form as closed_form_utilization;
use studies::experiment::ResultRow;

fn style(order: Order) -> SeriesStyle {
    SeriesStyle {
        name: order.title().to_owned(),
        color: theme::color(order.color()),
    }
}

/// Bars of a figure over cache configurations, one series per order.
fn by_caches(
    report: &PaperReport,
    scene: &str,
    title: &str,
    key: &str,
    mark_name: &str,
    mark: impl Fn(&ResultRow) -> Option<f64>,
) -> BarChart {
    let orders = report.orders();
    let groups: Vec<BarGroup> = report
        .caches()
        .into_iter()
        .map(|caches| {
            let row = |order: &Order| report.row(scene, &caches, *order);
            BarGroup {
                values: orders.iter().map(|o| number(row(o)?, key)).collect(),
                marks: orders.iter().map(|o| mark(row(o)?)).collect(),
                label: caches,
                ..BarGroup::default()
            }
        })
        .collect();
    let marked = groups.iter().any(|g| g.marks.iter().any(Option::is_some));
    let largest = groups
        .iter()
        .flat_map(|g| g.values.iter().flatten().copied())
        .fold(0.0, f64::max);
    BarChart {
        title: format!("{scene}: {title}"),
        value_label: figure(key).map_or_else(String::new, |f| f.heading.axis_label()),
        group_label: "L1/L2 size, KiB".to_owned(),
        series: orders.into_iter().map(style).collect(),
        groups,
        mark_name: marked.then(|| mark_name.to_owned()),
        reference: None,
        // Three digits distinguish neighbouring values.
        decimals: Some(if largest < 10.0 { 2 } else { 1 }),
    }
}

/// Fig. 5: external traffic. The paper's text gives no absolute numbers, so its marks are its ratios to
/// Morton times the measured Morton traffic.
pub fn bandwidth(report: &PaperReport, scene: &str) -> BarChart {
    let key = "external_mb_per_frame";
    let mark = |row: &ResultRow| {
        let saved = row.paper?.reduction_pct()?;
        let morton = report.row(scene, &row.caches_title(), Order::MORTON)?;
        let other = row.point.config.order != Order::MORTON;
        other.then_some(number(morton, key)? * (1.0 - saved / 100.0))
    };
    by_caches(
        report,
        scene,
        "bandwidth",
        key,
        "paper's ratio to Morton",
        mark,
    )
}

/// L1 and L2 miss rates and TMU utilisation with the paper's values as marks.
pub fn rates(report: &PaperReport, scene: &str) -> Vec<BarChart> {
    [
        ("L1 miss rate", "l1_footprint_miss_pct"),
        ("L2 miss rate", "l2_line_miss_pct"),
        ("TMU utilisation", "tmu_util_pct"),
    ]
    .into_iter()
    .filter(|(_, key)| report.rows.iter().any(|r| number(r, key).is_some()))
    .map(|(title, key)| {
        by_caches(report, scene, title, key, "paper", |row| {
            number(row, &format!("paper.{key}"))
        })
    })
    .collect()
}

/// Two figures of an order's rows on the machine of `--preset z2-paper`.
fn points<'r>(
    report: &'r PaperReport,
    order: Order,
    keys: [&'static str; 2],
) -> impl Iterator<Item = (f64, f64)> + 'r {
    let keys = keys.map(|key| format!("z2_paper.{key}"));
    let rows = report
        .rows
        .iter()
        .filter(move |r| r.point.config.order == order);
    rows.filter_map(move |row| Some((number(row, &keys[0])?, number(row, &keys[1])?)))
}

/// Every row's rates of first look-ups on the paper's utilisation surface.
///
/// # Errors
/// See [`ContourChart::svg`].
pub fn surface(report: &PaperReport) -> Result<String, PlotError> {
    let mut series = vec![PointSeries {
        style: SeriesStyle {
            name: "paper".to_owned(),
            color: theme::MUTED,
        },
        points: z2::table()
            .iter()
            .map(|r| (r.l1_footprint_miss_pct, r.l2_line_miss_pct))
            .collect(),
        hollow: true,
    }];
    series.extend(report.orders().into_iter().map(|order| {
        PointSeries {
            style: style(order),
            points: points(report, order, ["l1_footprint_miss_pct", "l2_line_miss_pct"])
                .map(|(l1, l2)| (l1.max(0.5), l2))
                .collect(),
            hollow: false,
        }
    }));
    let largest = series
        .iter()
        .flat_map(|s| s.points.iter().map(|p| p.0))
        .fold(32.0, f64::max);
    ContourChart {
        title: "First look-ups on the surface of TMU utilisation".to_owned(),
        x_label: "L1 miss rate, % (logarithmic)".to_owned(),
        y_label: "L2 miss rate, %; lines: utilisation that the paper's table implies".to_owned(),
        x_range: (0.5, largest.log2().ceil().exp2()),
        surface: &|m1, m2| 100.0 * closed_form_utilization(m1 / 100.0, m2 / 100.0),
        levels: ((11..=19).map(|i| f64::from(i) * 5.0).collect(), " %"),
        series,
    }
    .svg()
}

/// Simulated utilisation against the closed form; `None` without rows of the preset's machine.
pub fn closed_form(report: &PaperReport) -> Option<LineChart> {
    let mut series: Vec<LineSeries> = report
        .orders()
        .into_iter()
        .map(|order| {
            LineSeries::dots(
                style(order),
                points(report, order, ["closed_form_util_pct", "tmu_util_pct"]),
            )
        })
        .filter(|s| !s.points.is_empty())
        .collect();
    let points = series.iter().flat_map(|s| &s.points);
    let ends = axis::ends(points.flat_map(|p| [p.0, p.1]))?;
    let ends = (
        (ends.0 / 5.0).floor() * 5.0,
        ((ends.1 / 5.0).ceil() * 5.0).min(100.0),
    );
    for (offset, name) in [
        (1.5, "+1.5 points"),
        (0.0, "equal"),
        (-1.5, "\u{2212}1.5 points"),
    ] {
        let line = LineSeries::line(
            SeriesStyle {
                name: name.to_owned(),
                color: theme::AXIS,
            },
            vec![(ends.0, ends.0 + offset), (ends.1, ends.1 + offset)],
        );
        series.insert(0, line);
    }
    Some(LineChart {
        title: "Simulated TMU utilisation against the closed form".to_owned(),
        x: Axis::linear("closed form of the measured miss rates, %").between(ends.0, ends.1),
        y: Axis::linear("simulated, %").between(ends.0 - 2.0, ends.1 + 2.0),
        series,
    })
}

/// Miss rates and traffic by mip level, one series per order.
pub fn by_level(details: &[&ResultRow]) -> Vec<BarChart> {
    let Some(first) = details.first() else {
        return Vec::new();
    };
    let chart = |(column, title): (Column<Part>, &str)| BarChart {
        title: format!("{}: {title} by mip level", first.subject.label),
        value_label: column.heading.axis_label(),
        group_label: "mip level, 0 is the finest".to_owned(),
        series: details
            .iter()
            .map(|d| style(d.point.config.order))
            .collect(),
        groups: (0..first.result.by_level.len())
            .map(|level| BarGroup {
                label: level.to_string(),
                values: details
                    .iter()
                    .map(|d| column.value(d.result.by_level.get(level)?).number())
                    .collect(),
                ..BarGroup::default()
            })
            .collect(),
        ..BarChart::default()
    };
    let columns = pick(&["l1_footprint_miss_pct", "external_lines"]).into_iter();
    let titles = ["L1 miss rate", "external traffic"];
    columns.zip(titles).map(chart).collect()
}

/// The textures or draws with the most external traffic.
pub(super) fn by_part(details: &[&ResultRow], most: usize) -> Vec<HBarChart> {
    let Some(first) = details.first() else {
        return Vec::new();
    };
    let (what, parts) = first.result.parts();
    let chart = |(column, title): (Column<Part>, &str)| HBarChart {
        decimals: None,
        title: format!("{}: {title} by {what}", first.subject.label),
        value_label: column.heading.axis_label(),
        series: details
            .iter()
            .map(|d| style(d.point.config.order))
            .collect(),
        rows: busiest(parts, most)
            .into_iter()
            .map(|i| {
                let value = |d: &&ResultRow| column.value(d.result.parts().1.get(i)?).number();
                (parts[i].name.clone(), details.iter().map(value).collect())
            })
            .collect(),
    };
    let columns = pick(&[
        "l1_footprint_miss_pct",
        "l2_line_miss_pct",
        "external_lines",
    ])
    .into_iter();
    let titles = ["L1 miss rate", "L2 miss rate", "external traffic"];
    columns.zip(titles).map(chart).collect()
}

/// Quantities of a tile map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TileMeasure {
    /// Covered lanes per pixel.
    Overdraw,
    /// Footprints.
    Footprints,
    /// Footprints with a missing line.
    L1Misses,
    /// Lines from memory.
    L2Misses,
}

impl TileMeasure {
    /// Every measure, and whether it depends on the order.
    pub const ALL: [(Self, bool); 4] = [
        (Self::Overdraw, false),
        (Self::Footprints, false),
        (Self::L1Misses, true),
        (Self::L2Misses, true),
    ];

    fn titles(self) -> (&'static str, &'static str) {
        match self {
            Self::Overdraw => ("overdraw", "shaded fragments per pixel"),
            Self::Footprints => ("texture accesses", "bilinear footprints per tile"),
            Self::L1Misses => ("L1 misses", "missing footprints per tile"),
            Self::L2Misses => ("external traffic", "lines from memory per tile"),
        }
    }

    fn values(self, map: &TileMap) -> Vec<f64> {
        match self {
            Self::Overdraw => map.overdraw.iter().map(|v| f64::from(*v)).collect(),
            Self::Footprints => map.footprints.iter().map(|v| f64::from(*v)).collect(),
            Self::L1Misses => map.l1_misses.iter().map(|v| f64::from(*v)).collect(),
            Self::L2Misses => map.l2_misses.iter().map(|v| f64::from(*v)).collect(),
        }
    }
}

/// Both eyes' tiles of one run; `None` if the run has no maps of both eyes.
pub(super) fn heat_map(
    info: &TraceInfo,
    detail: &ResultRow,
    measure: TileMeasure,
) -> Option<HeatMap> {
    let (title, value_label) = measure.titles();
    let panels: Vec<Panel> = info
        .eye_passes
        .iter()
        .zip(["left eye", "right eye"])
        .filter_map(|(pass, name)| {
            let map = detail.result.tile_maps.iter().find(|m| m.pass == *pass)?;
            Some(Panel {
                name: name.to_owned(),
                tiles: map.tiles,
                values: measure.values(map),
            })
        })
        .collect();
    let of_order = TileMeasure::ALL
        .iter()
        .any(|(m, depends)| *m == measure && *depends);
    let order = if of_order {
        format!(", {}", detail.point.config.order.title())
    } else {
        String::new()
    };
    (!panels.is_empty()).then(|| HeatMap {
        title: format!("{}: {title}{order}", info.label),
        value_label: value_label.to_owned(),
        panels,
        high: None,
    })
}

/// An order's path over both eyes' grids of `tiles`.
pub fn path(order: Order, seed: u64, tiles: [u32; 2]) -> PathPlot {
    let inputs = PlanInputs {
        seed,
        ..PlanInputs::default()
    };
    let items = order.stereo(tiles, &inputs);
    let stops = stops(&items, tiles);
    let pairs = items.iter().any(|i| matches!(i, WorkItem::Pair(..)));
    let alternates = stops.windows(2).take(1).any(|w| w[0].eye != w[1].eye);
    let note = match (pairs, alternates) {
        (true, _) => "a pair of tiles is one step on one core",
        (false, true) => "left and right tiles alternate",
        (false, false) => "the whole left view, then the whole right view",
    };
    PathPlot {
        title: order.title().to_owned(),
        note: note.to_owned(),
        tiles,
        stops,
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::with_report;
    use super::*;
    use crate::plots::testing::text_at;

    #[test]
    fn marks_equal_the_papers_ratios_times_the_measured_morton_traffic() {
        with_report(|report| {
            let chart = bandwidth(report, "crytek-sponza");
            let group = &chart.groups[3];
            assert_eq!(group.label, "16/256");
            // The report holds the paper's own rates, so bars and marks coincide.
            let (bar, mark) = (group.values[2].unwrap(), group.marks[2].unwrap());
            assert!((bar - mark).abs() < 0.01, "{bar} {mark}");
            assert_eq!(group.marks[0], None);
        });
    }

    #[test]
    fn every_chart_has_a_unit_on_its_values() {
        with_report(|report| {
            let mut charts = rates(report, "crytek-sponza");
            charts.push(bandwidth(report, "crytek-sponza"));
            charts.extend(by_level(&report.details("crytek-sponza")));
            assert_eq!(charts.len(), 6);
            for chart in charts {
                assert!(
                    [
                        "%",
                        "% of footprints",
                        "% of lines",
                        "MB/frame",
                        "1000 lines"
                    ]
                    .iter()
                    .any(|u| chart.value_label.ends_with(&format!(", {u}"))),
                    "{}",
                    chart.value_label
                );
            }
        });
    }

    #[test]
    fn end_labels_of_the_closed_form_chart_do_not_overlap() {
        with_report(|report| {
            let svg = closed_form(report).unwrap().svg().unwrap();
            let names = ["+1.5 points", "equal", "\u{2212}1.5 points"];
            let mut at = names.map(|name| text_at(&svg, name).1);
            at.sort_by(f64::total_cmp);
            assert!(at.windows(2).all(|w| w[1] - w[0] >= 14.0), "{at:?}");
        });
    }

    #[test]
    fn a_path_visits_every_tile_of_both_eyes_once() {
        for order in Order::all() {
            let path = path(order, 1, [8, 4]);
            let mut seen: Vec<(u32, u32, u32)> =
                path.stops.iter().map(|s| (s.eye, s.x, s.y)).collect();
            seen.sort_unstable();
            seen.dedup();
            assert_eq!(seen.len(), 64, "{order:?}");
            path.svg().unwrap();
        }
    }

    #[test]
    fn heat_maps_show_both_eyes() {
        with_report(|report| {
            let row = report.details("crytek-sponza")[0];
            let map = heat_map(&report.traces[0], row, TileMeasure::L2Misses).unwrap();
            assert_eq!(map.panels.len(), 2);
            assert_eq!(map.title, "crytek-sponza: external traffic, Morton");
            assert!(map.svg().unwrap().len() < 60_000);
        });
    }
}
