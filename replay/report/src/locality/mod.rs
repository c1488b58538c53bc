//! Results of locality analyses, by trace and order: table, JSON, CSV and page.

mod columns;
mod page;
mod plots;

use super::answers;
use super::document::Document;
use super::table::{Style, Table};
use columns::{CurvePoint, Reuses, Subject, Summary, Window};
use locality::{Figures, OrderFigures, Stream};
use serde::Serialize;
use sim::config::{LevelConfig, Mode, RunConfig};
use sim::result::TraceId;

/// A trace's figures.
pub struct TraceFigures {
    /// Short name, unique in the report.
    pub label: String,
    /// Scene and checksum; `None` for plain addresses.
    pub id: Option<TraceId>,
    /// Number of frames.
    pub frames: u32,
    /// By order.
    pub orders: Vec<OrderFigures>,
}

impl TraceFigures {
    /// Whether the accesses come from a rendered trace, not from plain addresses.
    fn is_rendered(&self) -> bool {
        self.id.is_some()
    }
}

/// Locality figures of some traces.
pub struct LocalityReport {
    /// The traces.
    pub traces: Vec<TraceFigures>,
    /// Caches, sampling and layout.
    pub config: RunConfig,
}

/// The JSON object.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct LocalityJson<'a> {
    config: RunConfig,
    traces: Vec<TraceFacts<'a>>,
    rows: Table,
    curves: Table,
    distances: Table,
    working_sets: Table,
}

#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct TraceFacts<'a> {
    label: &'a str,
    #[serde(flatten)]
    id: Option<&'a TraceId>,
    frames: u32,
}

impl<'a> TraceFacts<'a> {
    fn of(trace: &'a TraceFigures) -> Self {
        Self {
            label: &trace.label,
            id: trace.id.as_ref(),
            frames: trace.frames,
        }
    }
}

/// Sizes of a curve of fully associative caches: four per doubling, up to the size where misses stop
/// falling.
fn curve_sizes(figures: &Figures) -> Vec<u64> {
    let enough = figures.distances.enough_lines().max(1);
    let size = |step: i32| (f64::from(step) / 4.0).exp2().round() as u64;
    let mut sizes: Vec<u64> = (0..).map(size).take_while(|&size| size < enough).collect();
    sizes.push(enough);
    sizes.extend(figures.opt.iter().map(|point| point.lines));
    sizes.sort_unstable();
    sizes.dedup();
    sizes
}

impl LocalityReport {
    fn cache(&self, stream: Stream) -> &LevelConfig {
        match stream {
            Stream::L1 | Stream::Merged => &self.config.level.l1,
            Stream::L2 => &self.config.level.l2,
        }
    }

    /// Columns of the summary as text; the trace only if there are several.
    fn table(&self, keys: &[&'static str], style: Style) -> String {
        let one = self.traces.len() == 1;
        let keys = keys.iter().copied();
        let keys = keys.filter(|key| !(one && *key == "trace"));
        self.rows().picked(keys).styled(style)
    }

    /// A row a trace, stream and order.
    fn summaries(&self) -> Vec<Summary<'_>> {
        let mut rows = Vec::new();
        for trace in &self.traces {
            let streams = trace.orders.first().map_or(0, |order| order.streams.len());
            for stream in 0..streams {
                for order in &trace.orders {
                    let (stream, figures) = &order.streams[stream];
                    rows.push(Summary {
                        of: Subject {
                            trace: &trace.label,
                            order: order.order,
                            stream: *stream,
                            line_bytes: self.config.line_bytes,
                        },
                        cache: self.cache(*stream),
                        figures,
                    });
                }
            }
        }
        rows
    }

    /// The curves of a stream: fully associative LRU, LRU by associativity, OPT.
    fn curve<'a>(summary: &Summary<'a>) -> Vec<CurvePoint<'a>> {
        let figures = summary.figures;
        let full = figures.distances.curve(&curve_sizes(figures));
        let lru = full.iter().chain(&figures.lru).map(|cache| ("lru", *cache));
        let opt = figures.opt.iter().map(|cache| ("opt", *cache));
        let point = |(policy, cache)| CurvePoint {
            of: summary.of,
            policy,
            cache,
            accesses: figures.accesses,
        };
        lru.chain(opt).map(point).collect()
    }

    /// Reuses by distance; each bin is twice as wide as the one before.
    fn distances<'a>(summary: &Summary<'a>) -> Vec<Reuses<'a>> {
        let bins = summary.figures.distances.bins().into_iter();
        bins.map(|bin| Reuses {
            of: summary.of,
            distances: (bin.from, bin.to),
            reuses: bin.reuses,
        })
        .collect()
    }

    /// Reuses at every distance that occurs.
    fn exact_distances<'a>(summary: &Summary<'a>) -> Vec<Reuses<'a>> {
        let all = summary.figures.distances.iter();
        all.map(|(distance, &reuses)| Reuses {
            of: summary.of,
            distances: (distance, distance),
            reuses,
        })
        .collect()
    }

    fn working_sets<'a>(summary: &Summary<'a>) -> Vec<Window<'a>> {
        let sets = summary.figures.working_sets.iter();
        sets.map(|&set| Window {
            of: summary.of,
            set,
        })
        .collect()
    }
}

/// The miss-ratio curves of the streams.
fn curves(rows: &[Summary]) -> Table {
    let points: Vec<_> = rows.iter().flat_map(LocalityReport::curve).collect();
    Table::new(&columns::curves(), &points)
}

/// The working sets of the streams.
fn working_sets(rows: &[Summary]) -> Table {
    let sets: Vec<_> = rows.iter().flat_map(LocalityReport::working_sets).collect();
    Table::new(&columns::working_sets(), &sets)
}

impl Document for LocalityReport {
    const SCHEMA: &'static str = "replay.locality/2";
    const HAS_DETAILS: bool = true;
    const CSV_FILES: &'static [&'static str] = &[
        "summary.csv",
        "curves.csv",
        "distances.csv",
        "working-sets.csv",
    ];

    fn content(&self) -> impl Serialize {
        let rows = self.summaries();
        let distances: Vec<_> = rows.iter().flat_map(Self::distances).collect();
        LocalityJson {
            config: self.config,
            traces: self.traces.iter().map(TraceFacts::of).collect(),
            rows: self.rows(),
            curves: curves(&rows),
            distances: Table::new(&columns::distances(), &distances),
            working_sets: working_sets(&rows),
        }
    }

    fn rows(&self) -> Table {
        Table::new(&columns::summary(), &self.summaries()).grouped_by(1)
    }

    #[cfg(feature = "testing")]
    fn tables() -> Vec<(&'static str, Table)> {
        vec![
            ("rows", Table::new(&columns::summary(), &[])),
            ("curves", curves(&[])),
            ("distances", Table::new(&columns::distances(), &[])),
            ("working_sets", working_sets(&[])),
        ]
    }

    fn answer(&self) -> Vec<String> {
        let mut out = page::sentences(&self.summaries());
        let caches = [self.config.level.l1, self.config.level.l2].map(|cache| cache.size_bytes);
        let frames: Vec<u32> = self.traces.iter().map(|trace| trace.frames).collect();
        // Counts of misses without latencies: the mode does not matter.
        let config = RunConfig {
            mode: Mode::Functional,
            ..self.config
        };
        out.insert(
            1.min(out.len()),
            answers::machine(&config, [caches], &frames),
        );
        out
    }

    fn text(&self, style: Style) -> String {
        self.table(&columns::TERMINAL, style)
    }

    fn details(&self, style: Style) -> String {
        self.table(&columns::short(), style)
    }

    fn csv_files(&self) -> Vec<String> {
        let rows = self.summaries();
        // One stream after another, because there are many distances.
        let mut distances = String::new();
        for row in &rows {
            let text = Table::new(&columns::distances(), &Self::exact_distances(row)).csv();
            let heading = text.find('\n').map_or(0, |end| end + 1);
            let skip = if distances.is_empty() { 0 } else { heading };
            distances += &text[skip..];
        }
        vec![
            self.csv(),
            curves(&rows).csv(),
            distances,
            working_sets(&rows).csv(),
        ]
    }
}
