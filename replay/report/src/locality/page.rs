//! The page: plots and tables of every trace and stream.

use super::columns::{MISSES, Summary};
use super::{LocalityReport, TraceFigures, plots};
use crate::answers;
use crate::document::Document;
use crate::html::{self, Answer, Page, figures};
use crate::plots::PlotError;
use crate::plots::stacked::StackedChart;
use crate::table::Table;
use locality::Stream;
use maud::{Markup, html};
use sim::size::format_bytes;

/// Keys of the columns in the page's table; CSV and JSON have all columns. Earlier frames are left out for
/// traces of one frame.
const BEFORE_MISSES: [&str; 5] = [
    "order",
    "accesses",
    "unique_lines",
    "both_eyes_pct",
    "earlier_frames_pct",
];
const AFTER_MISSES: [&str; 9] = [
    "opt_ways_line_miss_pct",
    "hits_same_tile_pct",
    "hits_other_tile_pct",
    "hits_other_eye_pct",
    "hits_earlier_frame_pct",
    "reuses_other_eye_pct",
    "reuses_earlier_frame_pct",
    "capacity_other_eye_pct",
    "tile_lines",
];

impl LocalityReport {
    /// The page.
    ///
    /// # Errors
    /// A plot that cannot be drawn.
    pub fn page(&self) -> Result<String, PlotError> {
        let (rows, table) = (self.summaries(), self.rows());
        let mut page = Page::default();
        let same = |a: &Summary, b: &Summary| {
            (a.of.trace, a.of.stream.key()) == (b.of.trace, b.of.stream.key())
        };
        for rows in rows.chunk_by(same) {
            let of = rows[0].of;
            let table = table
                .only("trace", of.trace)
                .only("stream", of.stream.key());
            let trace = self.traces.iter().find(|t| t.label == of.trace);
            let Some(trace) = trace else { continue };
            let title = format!("{}: {}", of.trace, of.stream.title());
            page.add(title, stream(rows, &table, trace)?);
        }
        page.add(
            "Machine",
            html::settings("configuration (TOML)", &self.config),
        );
        let names: Vec<&str> = self.traces.iter().map(|t| t.label.as_str()).collect();
        let rendered = self.traces.iter().any(TraceFigures::is_rendered);
        let about = html! {
            p {
                "Reuse distances of cache lines in " (names.join(", ")) @if rendered { ", in each tile order" }
                ", and the resulting misses of caches of every size, without latencies. "
                "The JSON file next to this page has every number of the plots; the CSV file has the tables."
            }
            @if rendered {
                p {
                    "A reuse is counted by the origin of the previous use: the same tile, another tile, a tile of the other eye, or an earlier frame."
                }
            }
        };
        let first = rows.chunk_by(same).next();
        let answer = Answer {
            sentences: self.answer(),
            chart: html::chart(first.map(|rows| plots::miss_ratio(rows).svg()), "")?,
            about,
        };
        Ok(page.text("Parallax: locality", &answer))
    }
}

/// The misses of the first trace's streams, and its hits on the other eye's lines.
pub(super) fn sentences(rows: &[Summary]) -> Vec<String> {
    let Some(first) = rows.first() else {
        return Vec::new();
    };
    let own = rows.iter().filter(|row| row.of.trace == first.of.trace);
    let own: Vec<&Summary> = own.collect();
    let mut out = Vec::new();
    for rows in own
        .chunk_by(|a, b| a.of.stream.key() == b.of.stream.key())
        .take(2)
    {
        let cache = format!(
            "{}, {} of {}",
            rows[0].of.trace,
            rows[0].of.stream.title(),
            format_bytes(rows[0].cache.size_bytes)
        );
        let misses = rows.iter().filter_map(|row| {
            Some(answers::Misses {
                order: row.of.order.title().to_owned(),
                miss_pct: row.share_pct(row.figures.split.misses())?,
                opt_pct: row.share_pct(row.opt_misses())?,
            })
        });
        out.extend(answers::misses(&cache, &misses.collect::<Vec<_>>()));
    }
    out
}

/// A stream of a trace: its table and plots.
fn stream(rows: &[Summary], table: &Table, trace: &TraceFigures) -> Result<Markup, PlotError> {
    let (rendered, one_frame) = (trace.is_rendered(), trace.frames < 2);
    // The start of a bin.
    let far_from = (rows[0].figures.configured_lines / 8)
        .max(1)
        .next_power_of_two();
    let far = distances(rows, far_from)?;
    let all = distances(rows, 1)?;
    let ways = rows.iter().map(|row| plots::associativity(row).svg());
    let keys = BEFORE_MISSES.into_iter().chain(MISSES).chain(AFTER_MISSES);
    let empty =
        |key: &&str| (one_frame && key.contains("earlier")) || (!rendered && key.contains("eye"));
    let shown = table.picked(keys.filter(|key| !empty(key)));
    let shown = shown.without_empty_columns();
    let mut by_size = vec![plots::miss_ratio(rows).svg()];
    if rendered {
        by_size.push(plots::other_eye(rows).svg());
    }
    by_size.push(plots::above_opt(rows).svg());
    let together = if rendered {
        "Two tiles rendered together count as two tiles in length, and their lines belong to both."
    } else {
        ""
    };
    let mut working_sets = vec![(plots::working_sets(rows).svg()?, together.to_owned())];
    if rendered {
        working_sets.push((plots::shared_working_sets(rows).svg()?, String::new()));
    }
    Ok(html! {
        p { (about(rows, rendered)) }
        (shown.markup())
        (shown.folded_meanings())
        h3 { "Misses by size" }
        (html::charts(by_size)?)
        h3 { "The configured cache" }
        (figures(&[
            (plots::causes(rows).svg()?, "Compulsory: first uses. Conflict: a fully associative cache of this size hits. Capacity: it also misses.".to_owned()),
            (plots::bounds(rows).svg()?, "OPT evicts the line whose next use is furthest away. No cache of this size that allocates on every miss has fewer misses.".to_owned()),
        ]))
        h3 { "Reuse distances" }
        p { "Reuses that a fully associative cache of an eighth of the configured size would miss:" }
        (figures(&far))
        details {
            summary { "smaller distances" }
            (figures(&all))
        }
        h3 { "Working sets" }
        (figures(&working_sets))
        details {
            summary { "miss ratio by size and ways, by order" }
            (html::charts(ways)?)
        }
    })
}

/// Charts of the reuses at distances of at least `from`, one per order.
fn distances(rows: &[Summary], from: u64) -> Result<Vec<(String, String)>, PlotError> {
    let charts = plots::distances(rows, from);
    let figure = |(chart, row): (&StackedChart, &Summary)| {
        let nearer = plots::nearer_pct(row, from).unwrap_or(0.0);
        Ok((
            chart.svg()?,
            format!("Not shown: {nearer:.1} % at smaller distances."),
        ))
    };
    charts.iter().zip(rows).map(figure).collect()
}

fn about(rows: &[Summary], rendered: bool) -> String {
    let (of, cache) = (rows[0].of, rows[0].cache);
    let sees = match of.stream {
        Stream::L1 if !rendered => {
            "Accesses to the L1 in the trace's order; 1,024 look-ups count as a tile"
        }
        Stream::L2 if !rendered => "Misses of the configured L1",
        Stream::L1 => {
            "Accesses of each core to its own L1; counts are sums over the cores, and a size is the size of each core's cache"
        }
        Stream::L2 => {
            "Misses of the configured L1 caches, in the order in which they reach the L2 that the cores share"
        }
        Stream::Merged => "Accesses of all cores to an L1 that they share",
    };
    let (size, line) = (
        format_bytes(cache.size_bytes),
        format_bytes(of.line_bytes.into()),
    );
    let (ways, policy) = (cache.ways, cache.replacement.name());
    format!("{sees}. The configured cache: {size}, {ways} ways, {policy}, lines of {line}.")
}
