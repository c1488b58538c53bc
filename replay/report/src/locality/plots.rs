//! The plots of a stream, with all orders in each plot.

use super::LocalityReport;
use super::columns::{CurvePoint, Reuses, Summary, Window};
use crate::plots::SeriesStyle;
use crate::plots::bars::{BarChart, BarGroup};
use crate::plots::lines::{Axis, Doublings, LineChart, LineSeries};
use crate::plots::stacked::StackedChart;
use crate::theme;
use locality::{CacheHits, Origin, Sequence};

fn style(summary: &Summary) -> SeriesStyle {
    SeriesStyle {
        name: summary.of.order.title().to_owned(),
        color: match summary.of.order {
            Sequence::Order(order) => theme::color(order.color()),
            Sequence::AsGiven => theme::INK,
        },
    }
}

fn sizes() -> Axis {
    Axis::doublings("cache size", Doublings::Bytes)
}

/// A chart over cache sizes with one line per order. On an axis of doublings, values of zero or less are
/// left out.
fn over_sizes<'a>(
    rows: &[Summary<'a>],
    title: &str,
    y: Axis,
    points: impl Fn(&Summary<'a>) -> Vec<(f64, f64)>,
) -> LineChart {
    let series = |row: &Summary<'a>| LineSeries::line(style(row), points(row));
    LineChart {
        title: title.to_owned(),
        x: sizes(),
        y,
        series: rows.iter().map(series).collect(),
    }
}

/// Smallest fully associative LRU cache in the charts; smaller ones miss nearly always.
const SMALLEST_BYTES: u64 = 256;

fn full_lru<'a>(row: &Summary<'a>) -> impl Iterator<Item = CurvePoint<'a>> {
    let points = LocalityReport::curve(row).into_iter();
    points
        .filter(|p| p.policy == "lru" && p.cache.ways.is_none() && p.size_bytes() >= SMALLEST_BYTES)
}

/// Misses of fully associative LRU caches of every size.
pub(super) fn miss_ratio(rows: &[Summary]) -> LineChart {
    let y = Axis::doublings("misses, % of line accesses", Doublings::Numbers);
    over_sizes(
        rows,
        "Miss ratio by size, fully associative LRU",
        y,
        |row| {
            let points =
                full_lru(row).filter_map(|p| Some((p.size_bytes() as f64, p.line_miss_pct()?)));
            points.filter(|p| p.1 > 0.0).collect()
        },
    )
}

/// Hits whose previous use was by the other eye.
pub fn other_eye(rows: &[Summary]) -> LineChart {
    let y = Axis::linear("hits whose previous use was by the other eye, % of line accesses");
    over_sizes(rows, "Hits on the other eye's lines, by size", y, |row| {
        let points =
            full_lru(row).filter_map(|p| Some((p.size_bytes() as f64, p.other_eye_pct()?)));
        points.collect()
    })
}

/// LRU misses over OPT misses.
pub(super) fn above_opt(rows: &[Summary]) -> LineChart {
    let y = Axis::linear("LRU misses over OPT misses");
    over_sizes(
        rows,
        "LRU misses over OPT misses by size, both fully associative",
        y,
        |row| {
            let figures = row.figures;
            let ratio = |opt: &CacheHits| {
                let lru = figures.misses(&figures.distances.hits(opt.lines));
                let size = opt.lines * u64::from(row.of.line_bytes);
                let misses = figures.misses(&opt.hits).max(1);
                (size as f64, lru as f64 / misses as f64)
            };
            figures.opt.iter().map(ratio).collect()
        },
    )
}

/// Miss ratio by size, a line for each associativity.
pub(super) fn associativity(row: &Summary) -> LineChart {
    let curve = LocalityReport::curve(row);
    let lru = || curve.iter().filter(|p| p.policy == "lru");
    let mut ways: Vec<u32> = lru().filter_map(|p| p.cache.ways).collect();
    ways.sort_unstable();
    ways.dedup();
    let smallest = lru()
        .filter(|p| p.cache.ways.is_some())
        .map(CurvePoint::size_bytes);
    let (smallest, largest) = (smallest.clone().min(), smallest.max());
    let in_range = |p: &&CurvePoint| {
        smallest.is_some_and(|s| p.size_bytes() >= s)
            && largest.is_some_and(|l| p.size_bytes() <= l)
    };
    let line = |ways: Option<u32>| {
        let points = lru().filter(|p| p.cache.ways == ways).filter(in_range);
        let at = |p: &CurvePoint| Some((p.size_bytes() as f64, p.line_miss_pct()?));
        points
            .filter_map(at)
            .filter(|p| p.1 > 0.0)
            .collect::<Vec<_>>()
    };
    let of_ways = ways.iter().enumerate().map(|(index, &ways)| {
        LineSeries::line(
            SeriesStyle::nth(format!("{ways}-way"), index),
            line(Some(ways)),
        )
    });
    let full = LineSeries::line(SeriesStyle::nth("full", 7), line(None));
    LineChart {
        title: format!("{}: miss ratio by size and ways, LRU", row.of.order.title()),
        x: sizes(),
        y: Axis::doublings("misses, % of line accesses", Doublings::Numbers),
        series: of_ways.chain([full]).collect(),
    }
}

/// Names and colours of the origins of the previous use.
fn origins() -> Vec<SeriesStyle> {
    let name = |(index, origin): (usize, Origin)| {
        let colors = [7, 1, 4, 3];
        SeriesStyle::nth(origin.key().replace('_', " "), colors[index])
    };
    Origin::ALL.into_iter().enumerate().map(name).collect()
}

/// Bins of distances of at least `from`.
fn bins_from<'a>(row: &Summary<'a>, from: u64) -> impl Iterator<Item = Reuses<'a>> {
    let bins = LocalityReport::distances(row).into_iter();
    bins.filter(move |bin| bin.distances.0 >= from)
}

/// Reuses at distances of at least `from`, by the origin of the previous use, one chart per order.
pub fn distances(rows: &[Summary], from: u64) -> Vec<StackedChart> {
    let share =
        |row: &Summary, count: u64| 100.0 * count as f64 / row.figures.accesses.max(1) as f64;
    let highest = rows
        .iter()
        .flat_map(|row| bins_from(row, from).map(move |bin| share(row, bin.reuses.iter().sum())));
    let highest = highest.fold(0.0, f64::max);
    let most = rows
        .iter()
        .map(|row| bins_from(row, from).count())
        .max()
        .unwrap_or(0);
    let chart = |row: &Summary| {
        let mut bars: Vec<(String, Vec<f64>)> = bins_from(row, from)
            .map(|bin| {
                let parts = bin.reuses.iter().map(|&count| share(row, count));
                (short(bin.distances.0), parts.collect())
            })
            .collect();
        bars.resize(most, (String::new(), vec![0.0; Origin::ALL.len()]));
        // There is room for every second label.
        for (name, _) in bars.iter_mut().skip(1).step_by(2) {
            name.clear();
        }
        StackedChart {
            title: row.of.order.title().to_owned(),
            value_label: "reuses, % of line accesses".into(),
            bar_label: "distance, distinct lines from".into(),
            series: origins(),
            bars,
            bar_px: 26.0,
            highest: (highest > 0.0).then_some(1.05 * highest),
            decimals: None,
        }
    };
    rows.iter().map(chart).collect()
}

/// A power of two with a binary unit.
fn short(number: u64) -> String {
    match number {
        n if n >= 1 << 20 => format!("{}M", n >> 20),
        n if n >= 1 << 10 => format!("{}K", n >> 10),
        n => n.to_string(),
    }
}

/// Reuses at smaller distances, percent of the line accesses. `from` is 1 or the start of a bin.
pub(super) fn nearer_pct(row: &Summary, from: u64) -> Option<f64> {
    row.share_pct(row.figures.distances.hits(from).iter().sum())
}

/// A figure of working sets over the length of the stretch.
fn over_stretches(
    rows: &[Summary],
    title: &str,
    y: Axis,
    of: impl Fn(&Summary, &Window) -> f64,
) -> LineChart {
    let series = |row: &Summary| {
        let windows = LocalityReport::working_sets(row).into_iter();
        LineSeries::line(
            style(row),
            windows.map(|window| (window.set.tiles as f64, of(row, &window))),
        )
    };
    LineChart {
        title: title.to_owned(),
        x: Axis::doublings("tiles", Doublings::Numbers),
        y,
        series: rows.iter().map(series).collect(),
    }
}

/// Mean working set by length of the stretch.
pub fn working_sets(rows: &[Summary]) -> LineChart {
    let label = "mean distinct lines of a stretch, in bytes";
    let y = Axis::doublings(label, Doublings::Bytes);
    let mut chart = over_stretches(rows, "Working set by stretch of tiles", y, |row, window| {
        window.mean(window.set.lines) * f64::from(row.of.line_bytes)
    });
    for series in &mut chart.series {
        series.points.retain(|point| point.1 > 0.0);
    }
    chart
}

/// Share of a working set that both eyes use.
pub(super) fn shared_working_sets(rows: &[Summary]) -> LineChart {
    let y = Axis::linear("lines that both eyes use, % of the stretch's");
    let title = "Lines shared by both eyes, by stretch of tiles";
    over_stretches(rows, title, y, |_, window| {
        100.0 * (window.set.lines_of_both() as f64 / window.set.lines.max(1) as f64)
    })
}

/// The configured cache's misses by cause.
pub fn causes(rows: &[Summary]) -> StackedChart {
    let bar = |row: &Summary| {
        let split = &row.figures.split;
        let sum = |counts: &[u64]| counts.iter().sum();
        let parts = [split.compulsory, sum(&split.capacity), sum(&split.conflict)];
        let parts = parts.map(|part| row.share_pct(part).unwrap_or(0.0));
        (row.of.order.title().to_owned(), parts.to_vec())
    };
    StackedChart {
        title: "Misses by cause".into(),
        value_label: "misses, % of line accesses".into(),
        series: SeriesStyle::list(&[("compulsory", 7), ("capacity", 1), ("conflict", 4)]),
        bars: rows.iter().map(bar).collect(),
        bar_px: 64.0,
        decimals: Some(2),
        ..StackedChart::default()
    }
}

/// Misses of the configured cache and of a fully associative one, with LRU and with OPT.
pub fn bounds(rows: &[Summary]) -> BarChart {
    let series = [
        ("as configured", 7),
        ("full LRU", 1),
        ("OPT, ways", 3),
        ("full OPT", 2),
    ];
    let group = |row: &Summary| BarGroup {
        label: row.of.order.title().to_owned(),
        values: [
            row.figures.split.misses(),
            row.figures.split.fully_associative_misses(),
            row.opt_ways_misses(),
            row.opt_misses(),
        ]
        .map(|misses| row.share_pct(misses))
        .to_vec(),
        ..BarGroup::default()
    };
    BarChart {
        title: "LRU and OPT at the configured size".into(),
        value_label: "misses, % of line accesses".into(),
        series: SeriesStyle::list(&series),
        groups: rows.iter().map(group).collect(),
        decimals: Some(2),
        ..BarChart::default()
    }
}
