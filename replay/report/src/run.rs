//! Results of one replay, and of one point in both modes.

use super::answers::{self, Traffic};
use super::columns::{Column, Columns, Row, Show, Value, columns_of};
use super::document::{Document, Envelope};
use super::errors::{self, KnownError, Of};
use super::figures::figures;
use super::table::{Style, Table};
use serde::Serialize;
use sim::config::RunConfig;
use sim::model_version::MODEL_VERSION;
use sim::result::ClientTraffic;
use sim::result::{LevelResult, Part, RUN_SCHEMA, RunResult, TileMap, TraceId};
use studies::experiment::{ResultRow, frame_count};

/// One replay.
pub struct RunReport<'a> {
    /// The result.
    pub row: &'a ResultRow<'a>,
    /// Whether the text has the textures with most misses.
    pub by_texture: bool,
}

/// One point in timed and in functional mode.
pub struct ModesReport<'a>(pub [&'a ResultRow<'a>; 2]);

/// The JSON object of `replay run --json`.
#[derive(Debug, Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct RunJson<'a> {
    trace: &'a TraceId,
    config: &'a RunConfig,
    result: &'a RunResult,
    /// Known errors of the figures. Last, because they are not about this trace.
    errors: Vec<&'static KnownError>,
}

/// Both modes of a point as JSON.
#[derive(Serialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct ModesJson<'a> {
    schema: &'static str,
    timed: Envelope<RunJson<'a>>,
    functional: Envelope<RunJson<'a>>,
    /// Relative difference of each figure.
    timed_over_functional_less_one: serde_json::Map<String, serde_json::Value>,
}

impl<'a> RunJson<'a> {
    fn new(row: &'a ResultRow) -> Self {
        Self {
            trace: &row.subject.id,
            config: &row.point.config,
            result: row.result,
            errors: errors::known(Of::Textures),
        }
    }
}

/// Every figure of every result.
fn rows<'r>(rows: impl IntoIterator<Item = &'r ResultRow<'r>>) -> Table {
    let mut columns = super::config_columns::trace();
    columns.extend(super::config_columns::config());
    columns.extend(figures());
    Table::new(&columns, rows)
}

impl Document for RunReport<'_> {
    const SCHEMA: &'static str = RUN_SCHEMA;
    const HAS_DETAILS: bool = true;

    fn content(&self) -> impl Serialize {
        RunJson::new(self.row)
    }

    fn rows(&self) -> Table {
        rows([self.row])
    }

    fn answer(&self) -> Vec<String> {
        answer(self.row)
    }

    fn text(&self, style: Style) -> String {
        text(self.row, self.by_texture, style)
    }

    fn details(&self, style: Style) -> String {
        details(self.row, style)
    }
}

impl Document for ModesReport<'_> {
    const SCHEMA: &'static str = "replay.compare-modes/2";

    fn content(&self) -> impl Serialize {
        let [timed, functional] = self.0;
        let differences = MEASURES.iter().map(|(key, .., value)| {
            let difference = difference(value(timed.result), value(functional.result));
            ((*key).to_owned(), difference.into())
        });
        let [timed, functional] = [timed, functional]
            .map(|row| Envelope::new(RUN_SCHEMA, MODEL_VERSION, RunJson::new(row)));
        ModesJson {
            schema: Self::SCHEMA,
            timed,
            functional,
            timed_over_functional_less_one: differences.collect(),
        }
    }

    fn rows(&self) -> Table {
        rows(self.0)
    }

    fn answer(&self) -> Vec<String> {
        answer(self.0[0])
    }

    fn text(&self, style: Style) -> String {
        let [timed, functional] = self.0;
        modes_text(timed, functional, style)
    }

    /// Without versions of its own, because both modes have theirs.
    fn json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(&self.content())
    }
}

/// The traffic, and the machine.
pub(crate) fn answer(row: &ResultRow) -> Vec<String> {
    let (result, config) = (row.result, &row.point.config);
    let whole = (result.clients.iter().map(ClientTraffic::bytes)).reduce(|a, b| a + b);
    let traffic = Traffic {
        of: format!("{}, {}", row.subject.label, config.order.title()),
        texture_mb: row.mb_per_frame(result.external_bytes),
        bound_mb: row.mb_per_frame(row.bound_bytes()),
        error_pct: errors::sum_of_largest("external_bytes"),
        frame_mb: whole.map(|bytes| row.mb_per_frame(bytes)),
    };
    let caches = [config.level.l1, config.level.l2].map(|cache| cache.size_bytes);
    let frames = frame_count(row.subject.source.tables());
    let mut out = answers::replayed(&traffic);
    out.insert(1, answers::machine(config, [caches], &[frames]));
    out
}

/// One result as tables: levels, the draws or (if `by_texture`) the textures with most misses, tiles if they were
/// counted, and what the machine's other parts counted.
fn text(row: &ResultRow, by_texture: bool, style: Style) -> String {
    let result = row.result;
    let level: Vec<Column<(&str, &LevelResult)>> = vec![
        Column::text("level", "", |l: &(&str, _)| l.0),
        count("footprints", |l| l.1.counters.footprints),
        count("with a miss", |l| l.1.counters.footprint_misses),
        count("line look-ups", |l| l.1.counters.line_lookups),
        count("line misses", |l| l.1.counters.line_misses),
        count("merged", |l| l.1.counters.secondary_misses),
        Column::real(
            "footprint_miss_pct",
            "miss rate",
            "% of footprints",
            2,
            |l: &(_, &LevelResult)| 100.0 * l.1.footprint_miss_rate,
        ),
        Column::real(
            "line_miss_pct",
            "miss rate",
            "% of lines",
            2,
            |l: &(_, &LevelResult)| 100.0 * l.1.line_miss_rate,
        ),
    ];
    let levels = Table::new(&level, &[("L1", &result.l1), ("L2", &result.l2)]);
    let mut text = levels.styled(style);
    if by_texture || !result.by_draw.is_empty() {
        let (kind, parts) = result.parts();
        text += &busiest(kind, parts, style);
    }
    if !result.tile_maps.is_empty() {
        text += &tiles(&result.tile_maps, style);
    }
    text += &result.memory.to_string();
    if !result.clients.is_empty() {
        text += &format!("\n{}", clients(row).styled(style));
    }
    text
}

/// Views, the figures of the whole replay, and known errors.
fn details(row: &ResultRow, style: Style) -> String {
    let result = row.result;
    let mut text = format!(
        "{} ({}), {}\n\n{}\n{}\nquads {}, covered pixels {}, access hash {}\n",
        row.subject.id.scene,
        row.subject.id.checksum,
        row.point.config.order.name(),
        Table::new(&Part::columns(), &result.by_view).styled(style),
        whole(row).styled(style).trim_start(),
        result.quads,
        result.lanes,
        result.access_hash,
    );
    if let Some(counts) = &result.geometry {
        text += &format!(
            "{} triangles submitted, {} in the list of at least one tile, {} list entries; {} vertices shaded\n",
            counts.triangles_submitted,
            counts.triangles_binned,
            counts.list_entries,
            counts.vertices_shaded
        );
    }
    if let Some(tmu) = &result.tmu {
        text += &format!("{} loops of threads that missed\n", tmu.loops);
    }
    text + &errors::text(Of::Textures, style)
}

/// Traffic by memory client, and the total.
fn clients(row: &ResultRow) -> Table {
    type ClientLine = (&'static str, [u64; 2], f64, f64);
    let clients = &row.result.clients;
    let sum: u64 = clients.iter().map(ClientTraffic::bytes).sum();
    let share = |bytes: u64| 100.0 * bytes as f64 / sum.max(1) as f64;
    let mut lines: Vec<ClientLine> = (clients.iter())
        .map(|c| {
            (
                c.client.name(),
                [c.read_bytes, c.write_bytes],
                share(c.bytes()),
                c.energy_mj,
            )
        })
        .collect();
    let all = [0, 1].map(|kind: usize| lines.iter().map(|line| line.1[kind]).sum());
    let energy_mj = clients.iter().map(|c| c.energy_mj).sum();
    lines.push(("all", all, share(sum), energy_mj));
    let frames = |kind: usize| move |l: &ClientLine| row.mb_per_frame(l.1[kind]);
    let columns = columns_of::<ClientLine>()
        .text("client", "", |l| l.0)
        .real("read_mb_per_frame", "read", "MB/frame", 3, frames(0))
        .real("write_mb_per_frame", "written", "MB/frame", 3, frames(1))
        .real("share_pct", "of all", "%", 1, |l| l.2)
        .real("energy_mj_per_frame", "DRAM energy", "mJ/frame", 3, |l| {
            row.per_frame(l.3)
        });
    Table::new(&columns, &lines)
}

type Level<'a> = (&'a str, &'a LevelResult);

fn count<'a>(
    name: &'static str,
    value: impl Fn(&Level<'a>) -> u64 + 'static,
) -> Column<'static, Level<'a>> {
    Column::new(name, name, "", Show::Decimals(0), value)
}

/// Every figure of the point that has a value, one per line.
fn whole(row: &ResultRow) -> Table {
    type Line = (&'static str, String, &'static str);
    let mut lines: Vec<Line> = Vec::new();
    for figure in figures() {
        let (heading, value) = (&figure.heading, figure.value(row));
        if value != Value::None {
            lines.push((heading.about, heading.show.write(&value), heading.unit));
        }
    }
    let columns = columns_of::<Line>()
        .text("about", "", |l| l.0)
        .real("value", "", "", 0, |l| l.1.clone())
        .text("unit", "", |l| l.2);
    Table::new(&columns, &lines)
}

/// Timed over functional, minus one; zero if both are zero.
fn difference(timed: f64, functional: f64) -> f64 {
    if functional == 0.0 {
        0.0
    } else {
        timed / functional - 1.0
    }
}

/// A figure compared between the modes: key in JSON, name, unit, decimals, value.
type Measure = (
    &'static str,
    &'static str,
    &'static str,
    usize,
    fn(&RunResult) -> f64,
);

const MEASURES: [Measure; 3] = [
    (
        "l1_footprint_miss_rate",
        "L1 miss rate",
        "% of footprints",
        2,
        |r| r.l1.footprint_miss_rate,
    ),
    ("l2_line_miss_rate", "L2 miss rate", "% of lines", 2, |r| {
        r.l2.line_miss_rate
    }),
    ("external_bytes", "external", "bytes", 0, |r| {
        r.external_bytes as f64
    }),
];

/// Both modes of a point side by side.
fn modes_text(timed: &ResultRow, functional: &ResultRow, style: Style) -> String {
    let cell = |(.., unit, decimals, value): &Measure, row: &ResultRow| {
        let scale = if unit.starts_with('%') { 100.0 } else { 1.0 };
        format!("{:.*} {unit}", decimals, scale * value(row.result))
    };
    let columns = columns_of::<Measure>()
        .text("measure", "", |m| m.1)
        .real("timed", "timed", "", 0, |m| cell(m, timed))
        .real("functional", "functional", "", 0, |m| cell(m, functional))
        .real("difference", "difference", "", 0, |m| {
            let [timed, functional] = [timed, functional].map(|row| m.4(row.result));
            format!("{:+.2} %", 100.0 * difference(timed, functional))
        });
    Table::new(&columns, &MEASURES).styled(style)
}

/// Number of parts in the table of parts with most misses.
const BUSIEST_PARTS: usize = 10;

/// The draws or textures with the most line misses of the L2.
fn busiest(kind: &str, parts: &[Part], style: Style) -> String {
    let mut busiest: Vec<&Part> = parts.iter().collect();
    busiest.sort_by_key(|part| std::cmp::Reverse((part.l2.line_misses, part.l1.footprints)));
    busiest.truncate(BUSIEST_PARTS);
    let rows: Vec<Part> = busiest.into_iter().cloned().collect();
    let more = match parts.len() - rows.len() {
        0 => String::new(),
        more => format!("and {more} more {kind}s (--json lists all)\n"),
    };
    format!(
        "\n{}{more}",
        Table::new(&Part::columns(), &rows).styled(style)
    )
}

/// The counts of every tile, pass by pass and row by row.
fn tiles(maps: &[TileMap], style: Style) -> String {
    type Tile<'a> = (&'a TileMap, usize);
    let tiles: Vec<Tile> = maps
        .iter()
        .flat_map(|map| (0..map.footprints.len()).map(move |tile| (map, tile)))
        .collect();
    let whole = |key: &'static str, name, value: fn(&Tile) -> u64| {
        Column::new(key, name, "", Show::Whole, value)
    };
    let columns = [
        whole("pass", "pass", |(map, _)| map.pass.into()),
        whole("column", "column", |(map, tile)| {
            *tile as u64 % u64::from(map.tiles[0].max(1))
        }),
        whole("row", "row", |(map, tile)| {
            *tile as u64 / u64::from(map.tiles[0].max(1))
        }),
        Column::real("overdraw", "overdraw", "", 2, |(map, tile): &Tile| {
            f64::from(map.overdraw[*tile])
        }),
        whole("footprints", "footprints", |(map, tile)| {
            map.footprints[*tile].into()
        }),
        whole("l1_misses", "L1 misses", |(map, tile)| {
            map.l1_misses[*tile].into()
        }),
        whole("l2_misses", "lines from memory", |(map, tile)| {
            map.l2_misses[*tile].into()
        }),
    ];
    format!("\n{}", Table::new(&columns, &tiles).styled(style))
}

/// The schema of the JSON object of both modes.
#[cfg(feature = "testing")]
pub fn modes_schema() -> formats::schemas::Published {
    formats::schemas::Published::of::<ModesJson<'_>>(ModesReport::SCHEMA)
}
