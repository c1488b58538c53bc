//! Results for plain addresses: one row per configuration.

use super::columns::{Column, Columns, columns_of};
use super::document::Document;
use super::memory_columns;
use super::table::{Style, Table};
use serde::Serialize;
use sim::addresses::{LevelCounts, Outcome, Point, Totals};
use sim::config::LevelConfig;

/// The replays of an address file.
pub struct AddressesReport<'a> {
    /// Name of the file.
    pub input: &'a str,
    /// What was counted.
    pub outcome: &'a Outcome,
}

/// A configuration of an outcome.
struct PointRow<'a> {
    point: &'a Point,
    outcome: &'a Outcome,
}

impl PointRow<'_> {
    fn infinite_bytes(&self) -> u64 {
        self.outcome.unique_lines * u64::from(self.point.config.line_bytes)
    }
}

/// A level of a point.
type OfLevel = fn(&Point) -> &LevelCounts;

/// Names of the kinds of access, in the order of the counters.
const KINDS: [&str; 3] = ["reads", "writes", "fetches"];

/// Columns of a level: the cache, look-ups, misses and miss rate.
fn level<'a, 'r>(
    name: &'static str,
    cache: fn(&Point) -> &LevelConfig,
    of: OfLevel,
) -> Vec<Column<'a, PointRow<'r>>> {
    let key = |end: &str| format!("{}.{end}", name.to_lowercase());
    let named = |end: &str| format!("{name} {end}");
    columns_of::<PointRow<'r>>()
        .real(key("kib"), name, "KiB", 0, move |r| {
            cache(r.point).size_bytes as f64 / 1024.0
        })
        .real(key("ways"), "ways", "", 0, move |r| cache(r.point).ways)
        .text(key("replacement"), "policy", move |r| {
            cache(r.point).replacement.name()
        })
        .real(key("line_lookups"), named("look-ups"), "", 0, move |r| {
            of(r.point).line_lookups()
        })
        .real(key("line_misses"), named("misses"), "", 0, move |r| {
            of(r.point).line_misses()
        })
        .real(key("line_miss_pct"), named("miss"), "%", 2, move |r| {
            100.0 * of(r.point).line_miss_rate()
        })
}

/// Every column. Columns by kind of access are empty if all accesses are reads.
fn columns<'a, 'r: 'a>() -> Vec<Column<'a, PointRow<'r>>> {
    let mut columns = columns_of::<PointRow<'r>>()
        .real("line_bytes", "line", "B", 0, |r| r.point.config.line_bytes);
    columns.extend(level(
        "L1",
        |point| &point.config.level.l1,
        |point| &point.l1,
    ));
    columns.extend(level(
        "L2",
        |point| &point.config.level.l2,
        |point| &point.l2,
    ));
    columns = columns
        .real("external_bytes", "external", "bytes", 0, |r| {
            r.point.external_bytes()
        })
        .about("lines from memory times the line size of the last level")
        .real("bound_bytes", "bound", "bytes", 0, PointRow::infinite_bytes)
        .about("external traffic of an infinite cache");
    for (kind, name) in KINDS.into_iter().enumerate() {
        let only_reads = |r: &PointRow<'r>| r.outcome.totals.accesses[1..] == [0, 0];
        let levels: [(&str, OfLevel); 2] = [("L1", |point| &point.l1), ("L2", |point| &point.l2)];
        for (level, of) in levels {
            let key = format!("{name}.{}_line_misses", level.to_lowercase());
            columns = columns.real(key, format!("{level} {name}"), "", 0, move |r| {
                (!only_reads(r)).then(|| of(r.point).misses[kind])
            });
        }
    }
    let memory = memory_columns::columns().into_iter();
    columns.extend(memory.map(|column| column.on(|r: &PointRow<'r>| &r.point.memory)));
    columns
}

/// Counts of the accesses, as JSON.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
struct Accesses {
    accesses: u64,
    reads: u64,
    writes: u64,
    fetches: u64,
    line_lookups: u64,
    unique_lines: u64,
    left_out: u64,
    other_packets: u64,
}

impl Accesses {
    fn new(totals: &Totals, unique_lines: u64) -> Self {
        let [reads, writes, fetches] = totals.accesses;
        Self {
            accesses: reads + writes + fetches,
            reads,
            writes,
            fetches,
            line_lookups: totals.lookups.iter().sum(),
            unique_lines,
            left_out: totals.left_out,
            other_packets: totals.other_packets,
        }
    }
}

/// The JSON object.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct AddressesJson<'a> {
    input: &'a str,
    accesses: Accesses,
    points: Table,
}

impl Document for AddressesReport<'_> {
    const SCHEMA: &'static str = "replay.addresses/2";

    fn content(&self) -> impl Serialize {
        AddressesJson {
            input: self.input,
            accesses: Accesses::new(&self.outcome.totals, self.outcome.unique_lines),
            points: self.rows(),
        }
    }

    /// One row per configuration.
    fn rows(&self) -> Table {
        let outcome = self.outcome;
        let rows: Vec<PointRow> = (outcome.points.iter())
            .map(|point| PointRow { point, outcome })
            .collect();
        Table::new(&columns(), &rows)
    }

    #[cfg(feature = "testing")]
    fn tables() -> Vec<(&'static str, Table)> {
        vec![("points", Table::new(&columns(), &[]))]
    }

    /// The text: the counts of accesses, then the levels of a single configuration or one row for
    /// each of several.
    fn text(&self, style: Style) -> String {
        let Self { input, outcome } = self;
        let of = Accesses::new(&outcome.totals, outcome.unique_lines);
        let mut text = format!(
            "{input}: {} accesses ({} reads, {} writes, {} fetches), {} line look-ups, {} distinct lines\n",
            of.accesses, of.reads, of.writes, of.fetches, of.line_lookups, of.unique_lines
        );
        if of.left_out > 0 {
            text += &format!("{} accesses of other kinds skipped\n", of.left_out);
        }
        if of.other_packets > 0 {
            text += &format!(
                "{} packets skipped that are not accesses\n",
                of.other_packets
            );
        }
        let all = self.rows().without_empty_columns();
        let part = |keys: &[&str]| all.picked(keys.iter().copied()).styled(style);
        if let [point] = outcome.points.as_slice() {
            for level in ["l1", "l2"] {
                let keys = LEVEL.map(|key| format!("{level}.{key}"));
                let kinds = KINDS.map(|kind| format!("{kind}.{level}_line_misses"));
                let keys = keys.iter().chain(&kinds).map(String::as_str);
                text += &format!("\n{}", all.picked(keys).styled(style));
            }
            let line_bytes = point.config.line_bytes;
            text += &format!("\nlines of {line_bytes} bytes\n{}", point.memory);
            return text + &part(&["external_bytes", "bound_bytes"]);
        }
        text + "\n" + &part(&SEVERAL)
    }
}

/// Columns of a level: the second half of their keys.
const LEVEL: [&str; 6] = [
    "kib",
    "ways",
    "replacement",
    "line_lookups",
    "line_misses",
    "line_miss_pct",
];

/// Columns for several configurations.
const SEVERAL: [&str; 8] = [
    "line_bytes",
    "l1.kib",
    "l2.kib",
    "l1.line_misses",
    "l1.line_miss_pct",
    "l2.line_misses",
    "l2.line_miss_pct",
    "external_bytes",
];
