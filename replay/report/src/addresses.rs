//! Results for plain addresses: one row per configuration.

use super::columns::{Column, Columns, Show, columns_of};
use super::document::Document;
use super::memory_columns;
use super::table::Table;
use serde::Serialize;
use sim::addresses::{LevelCounts, Outcome, Point, Totals};

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

/// Columns of a level: look-ups, misses and miss rate.
fn level<'a, 'r>(
    key: &'static str,
    name: &'static str,
    of: OfLevel,
) -> [Column<'a, PointRow<'r>>; 3] {
    let key = |end: &str| format!("{key}.{end}");
    let name = |end: &str| format!("{name} {end}");
    [
        count(
            key("line_lookups"),
            name("look-ups"),
            move |r: &PointRow<'r>| of(r.point).line_lookups(),
        ),
        count(key("line_misses"), name("misses"), move |r| {
            of(r.point).line_misses()
        }),
        Column::real(
            key("line_miss_pct"),
            name("miss"),
            "%",
            2,
            move |r: &PointRow<'r>| 100.0 * of(r.point).line_miss_rate(),
        ),
    ]
}

fn count<'a, 'r, V: super::columns::Cell>(
    key: String,
    name: String,
    value: impl Fn(&PointRow<'r>) -> V + 'a,
) -> Column<'a, PointRow<'r>> {
    Column::new(key, name, "", Show::Decimals(0), value)
}

/// Every column. Columns by kind of access are empty if all accesses are reads.
fn columns<'a, 'r: 'a>() -> Vec<Column<'a, PointRow<'r>>> {
    let kib = |bytes: u64| bytes as f64 / 1024.0;
    let mut columns = columns_of::<PointRow<'r>>()
        .real("line_bytes", "line", "B", 0, |r| {
            u64::from(r.point.config.line_bytes)
        })
        .real("l1.kib", "L1", "KiB", 0, move |r| {
            kib(r.point.config.level.l1.size_bytes)
        })
        .real("l1.ways", "ways", "", 0, |r| {
            u64::from(r.point.config.level.l1.ways)
        })
        .text("l1.replacement", "policy", |r| {
            r.point.config.level.l1.replacement.name()
        });
    columns.extend(level("l1", "L1", |point| &point.l1));
    columns = columns
        .real("l2.kib", "L2", "KiB", 0, move |r| {
            kib(r.point.config.level.l2.size_bytes)
        })
        .real("l2.ways", "ways", "", 0, |r| {
            u64::from(r.point.config.level.l2.ways)
        })
        .text("l2.replacement", "policy", |r| {
            r.point.config.level.l2.replacement.name()
        });
    columns.extend(level("l2", "L2", |point| &point.l2));
    columns.push(
        Column::real(
            "external_bytes",
            "external",
            "bytes",
            0,
            |r: &PointRow<'r>| r.point.external_bytes(),
        )
        .about("lines from memory times the line size of the last level"),
    );
    columns.push(
        Column::real("bound_bytes", "bound", "bytes", 0, |r: &PointRow<'r>| {
            r.infinite_bytes()
        })
        .about("external traffic of an infinite cache"),
    );
    for (kind, name) in KINDS.into_iter().enumerate() {
        let only_reads = |r: &PointRow<'r>| r.outcome.totals.accesses[1..] == [0, 0];
        let levels: [(&str, OfLevel); 2] = [("L1", |point| &point.l1), ("L2", |point| &point.l2)];
        for (level, of) in levels {
            let key = format!("{name}.{}_line_misses", level.to_lowercase());
            columns.push(count(key, format!("{level} {name}"), move |r| {
                (!only_reads(r)).then(|| of(r.point).misses[kind])
            }));
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
    fn text(&self) -> String {
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
        let part = |keys: &[&str]| all.picked(keys.iter().copied()).text();
        if let [point] = outcome.points.as_slice() {
            for level in ["l1", "l2"] {
                let keys = LEVEL.map(|key| format!("{level}.{key}"));
                let kinds = KINDS.map(|kind| format!("{kind}.{level}_line_misses"));
                let keys = keys.iter().chain(&kinds).map(String::as_str);
                text += &format!("\n{}", all.picked(keys).text());
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
