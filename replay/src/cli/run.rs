//! `replay run`: one trace, one order, one configuration.

use super::ConfigArgs;
use crate::config::{Mode, RunConfig};
use crate::engine;
use crate::result::{LevelResult, Part, RUN_SCHEMA, RunResult, TraceId};
use crate::size::format_bytes;
use crate::tmu::closed_form;
use anyhow::Result;
use comfy_table::{CellAlignment, Table, presets};
use formats::textrace::Textrace;
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Version of the program, recorded with every result.
pub const TOOL: &str = concat!("replay ", env!("CARGO_PKG_VERSION"));

/// Schema of the object that `--compare-modes --json` prints.
const COMPARE_SCHEMA: &str = "replay.compare-modes/1";

/// Arguments of `replay run`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  replay run c.textrace --order z2-sta
  replay run c.textrace --order z2-lrta --l1 16KiB --l2 256KiB --json
  replay run c.textrace --mode functional --order morton --block-order morton
  replay run c.textrace --print-config > machine.toml")]
pub struct Args {
    /// Texture trace; may be left out with --print-config
    #[arg(required_unless_present = "print_config")]
    trace: Option<PathBuf>,
    #[command(flatten)]
    machine: ConfigArgs,
    /// Print one JSON object (schema replay.run/1)
    #[arg(long)]
    json: bool,
    /// Also count by tile (in the JSON)
    #[arg(long)]
    tiles: bool,
    /// Replay in both modes and print the difference
    #[arg(long, conflicts_with = "mode")]
    compare_modes: bool,
    /// Print the whole configuration as TOML and stop
    #[arg(long)]
    print_config: bool,
    #[command(flatten)]
    threads: shell::Threads,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
pub struct RunOutput<'a> {
    /// `replay.run/1`.
    pub schema: &'a str,
    /// Program and version.
    pub tool: &'a str,
    /// The trace.
    pub trace: &'a TraceId,
    /// Everything that decides the result.
    pub config: &'a RunConfig,
    /// The result.
    pub result: &'a RunResult,
}

/// Runs the subcommand.
///
/// # Errors
/// An impossible configuration or an unreadable trace.
pub fn run(args: &Args) -> Result<ExitCode> {
    let mut config = args.machine.resolve()?;
    config.tile_maps |= args.tiles;
    let Some(path) = args.trace.as_ref().filter(|_| !args.print_config) else {
        super::print(&toml::to_string(&config)?)?;
        return Ok(ExitCode::SUCCESS);
    };
    args.threads.start()?;
    let (trace, id) = super::open_textrace(path)?;
    if args.compare_modes {
        return compare_modes(&trace, &id, &config, args.json);
    }
    let result = timed_replay(&trace, &config)?;
    super::print(&if args.json {
        serde_json::to_string_pretty(&output(&id, &config, &result))?
    } else {
        table(&id, &config, &result)
    })?;
    Ok(ExitCode::SUCCESS)
}

fn output<'a>(trace: &'a TraceId, config: &'a RunConfig, result: &'a RunResult) -> RunOutput<'a> {
    RunOutput {
        schema: RUN_SCHEMA,
        tool: TOOL,
        trace,
        config,
        result,
    }
}

/// Replays and says on stderr how fast; never in the result, which must not depend on the machine.
fn timed_replay(trace: &Textrace, config: &RunConfig) -> Result<RunResult> {
    let start = Instant::now();
    let result = engine::replay(trace, config)?;
    let seconds = start.elapsed().as_secs_f64();
    shell::note(&format!(
        "{:.1} M footprints/s ({} footprints in {seconds:.3} s, decoding included)",
        result.footprints as f64 / seconds / 1e6,
        result.footprints,
    ));
    Ok(result)
}

fn percent(rate: f64) -> String {
    format!("{:.2} %", 100.0 * rate)
}

/// A table without lines whose columns but the first are numbers.
pub(super) fn plain(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(header);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

fn table(id: &TraceId, config: &RunConfig, result: &RunResult) -> String {
    let mut levels = plain(&[
        "",
        "footprints",
        "with a miss",
        "line look-ups",
        "line misses",
        "merged",
        "miss rate",
    ]);
    for (name, level) in [("L1", &result.l1), ("L2", &result.l2)] {
        levels.add_row(level_row(name, level));
    }
    let mut views = plain(&[
        "view",
        "footprints",
        "L1 miss rate",
        "L2 misses",
        "external",
    ]);
    for part in &result.by_view {
        views.add_row(view_row(part, config.line_bytes));
    }
    let mut text = format!(
        "{} ({}), {}, {}, L1 {}, L2 {}\n\n{levels}\n\n{views}\n\n",
        id.scene,
        id.checksum,
        config.order.name(),
        if config.mode == Mode::Timed {
            "timed"
        } else {
            "functional"
        },
        format_bytes(config.l1.size_bytes),
        format_bytes(config.l2.size_bytes),
    );
    let bound = result.unique_lines * u64::from(config.line_bytes);
    text += &format!(
        "quads {}, covered pixels {}\nexternal {} bytes; infinite cache {bound} bytes\naccess hash {}\n",
        result.quads, result.lanes, result.external_bytes, result.access_hash,
    );
    if let (Some(tmu), Some(cycles)) = (&result.tmu, result.cycles) {
        text += &format!(
            "texture unit used {} (the paper's surface at these miss rates: {}), {cycles} cycles, {} loops\n",
            percent(tmu.utilization),
            percent(closed_form(result.l1.miss_rate, result.l2.miss_rate)),
            tmu.loops,
        );
    }
    text
}

fn level_row(name: &str, level: &LevelResult) -> Vec<String> {
    let c = &level.counters;
    let counts = [
        c.footprints,
        c.footprint_misses,
        c.line_lookups,
        c.line_misses,
        c.secondary_misses,
    ];
    let mut row = vec![name.to_owned()];
    row.extend(counts.map(|n| n.to_string()));
    row.push(percent(level.miss_rate));
    row
}

fn view_row(part: &Part, line_bytes: u32) -> Vec<String> {
    let rate = part.l1.footprint_misses as f64 / part.l1.footprints.max(1) as f64;
    vec![
        part.name.clone(),
        part.l1.footprints.to_string(),
        percent(rate),
        part.l2.line_misses.to_string(),
        (part.l2.line_misses * u64::from(line_bytes)).to_string(),
    ]
}

/// How the timed result differs from the functional one, as timed over functional less one.
#[derive(Debug, Serialize)]
struct Difference {
    l1_miss_rate: f64,
    l2_miss_rate: f64,
    external_bytes: f64,
}

impl Difference {
    fn new(timed: &RunResult, functional: &RunResult) -> Self {
        let relative = |timed: f64, functional: f64| {
            if functional == 0.0 {
                0.0
            } else {
                timed / functional - 1.0
            }
        };
        Self {
            l1_miss_rate: relative(timed.l1.miss_rate, functional.l1.miss_rate),
            l2_miss_rate: relative(timed.l2.miss_rate, functional.l2.miss_rate),
            external_bytes: relative(
                timed.external_bytes as f64,
                functional.external_bytes as f64,
            ),
        }
    }
}

fn compare_modes(
    trace: &Textrace,
    id: &TraceId,
    config: &RunConfig,
    json: bool,
) -> Result<ExitCode> {
    let with = |mode| RunConfig { mode, ..*config };
    let configs = [with(Mode::Timed), with(Mode::Functional)];
    let [timed, functional] = [
        timed_replay(trace, &configs[0])?,
        timed_replay(trace, &configs[1])?,
    ];
    let difference = Difference::new(&timed, &functional);
    if json {
        let object = serde_json::json!({
            "schema": COMPARE_SCHEMA,
            "timed": output(id, &configs[0], &timed),
            "functional": output(id, &configs[1], &functional),
            "timed_over_functional_less_one": difference,
        });
        super::print(&serde_json::to_string_pretty(&object)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut table = plain(&["", "timed", "functional", "difference"]);
    for (name, timed, functional, difference) in [
        (
            "L1 miss rate",
            percent(timed.l1.miss_rate),
            percent(functional.l1.miss_rate),
            difference.l1_miss_rate,
        ),
        (
            "L2 miss rate",
            percent(timed.l2.miss_rate),
            percent(functional.l2.miss_rate),
            difference.l2_miss_rate,
        ),
        (
            "external bytes",
            timed.external_bytes.to_string(),
            functional.external_bytes.to_string(),
            difference.external_bytes,
        ),
    ] {
        table.add_row([
            name.to_owned(),
            timed,
            functional,
            format!("{:+.2} %", 100.0 * difference),
        ]);
    }
    super::print(&table.to_string())?;
    Ok(ExitCode::SUCCESS)
}
