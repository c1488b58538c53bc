//! `replay run`: replays one trace in one order with one configuration, or plain addresses through caches.

use super::ConfigArgs;
use super::addresses::AddressArgs;
use super::subjects::Traces;
use crate::files;
use anyhow::{Result, bail, ensure};
use report::run as document;
use shell::Output;
use sim::config::{Mode, TmuModel};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;
use studies::experiment::{self, Plan};

/// Arguments of `replay run`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  replay run c.textrace --order z2-sta
  replay run c.textrace --order z2-lrta --l1 16KiB --l2 256KiB --json
  replay run c.textrace --mode functional --order morton --block-order morton
  replay run c.textrace --l3 4MiB --prefetch next-line --dram lpddr4
  replay run c.textrace --order z2-sta --timeline c.perfetto.json
  replay run c.textrace --print-config > machine.toml
  replay run --addresses gcc.din.gz --l1 32KiB --l2 256KiB --line 64 --ways 8
  replay convert c.textrace --to u32 | replay run --addresses - --address-form u32 --caches 8/128,16/256")]
pub struct Args {
    /// Texture trace; optional with --addresses and --print-config
    #[arg(required_unless_present_any = ["print_config", "addresses"], conflicts_with = "addresses")]
    trace: Option<PathBuf>,
    /// Print one JSON object (schema replay.run/2, or replay.addresses/2)
    #[arg(long)]
    json: bool,
    /// Print CSV, one row per configuration
    #[arg(long, conflicts_with_all = ["json", "tiles"], hide_short_help = true)]
    csv: bool,
    /// Also count by tile
    #[arg(long, conflicts_with = "addresses", hide_short_help = true)]
    tiles: bool,
    /// Also write which tiles each core renders over time, for ui.perfetto.dev (timed mode)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["addresses", "compare_modes", "print_config"])]
    timeline: Option<PathBuf>,
    /// Rendered picture; colour compression is computed from its tiles (with --frame, tile-based machines)
    #[arg(
        long,
        value_name = "FILE",
        conflicts_with = "addresses",
        hide_short_help = true
    )]
    picture: Option<PathBuf>,
    /// Replay in both modes and print the difference
    #[arg(long, conflicts_with_all = ["mode", "preset", "addresses"], hide_short_help = true)]
    compare_modes: bool,
    /// Print the whole configuration as TOML and stop
    #[arg(long, conflicts_with_all = ["json", "csv", "compare_modes", "addresses"])]
    print_config: bool,
    #[command(flatten)]
    threads: shell::Threads,
    #[command(flatten)]
    addresses: AddressArgs,
    #[command(flatten)]
    machine: ConfigArgs,
}

/// All outputs of the command, including standard output.
fn outputs(args: &Args) -> Vec<Output> {
    let timeline = args.timeline.iter();
    let mut outputs: Vec<Output> = timeline
        .map(|path| Output::text("--timeline", path))
        .collect();
    outputs.extend(args.json.then(|| Output::result("--json")));
    outputs.extend(args.csv.then(|| Output::result("--csv")));
    outputs
}

/// Runs the subcommand.
///
/// # Errors
/// An invalid configuration or an unreadable trace.
pub fn run(args: &Args) -> Result<ExitCode> {
    let mut config = args.machine.resolve()?;
    if let Some(path) = args.addresses.path(&args.machine)? {
        args.threads.start()?;
        return args.addresses.run(path, &config, [args.json, args.csv]);
    }
    config.tile_maps |= args.tiles;
    config.timeline = args.timeline.is_some();
    ensure!(
        !config.timeline || config.is_looping(),
        "--timeline: expected --mode timed --tmu looping, the only model that records when work items run"
    );
    ensure!(
        args.json || !(args.tiles && args.compare_modes),
        "--tiles: expected --json with it, because the table of --compare-modes has no tiles"
    );
    if let Some(picture) = &args.picture {
        let Some(frame) = &mut config.frame else {
            bail!("--picture: only with --frame");
        };
        let rgb = report::picture::read(picture)?;
        frame.color_compressed_permille = sim::access::compressed_permille(
            rgb.as_raw(),
            rgb.width() as usize,
            config.tile_px,
            frame.line_bytes,
        );
        config.validate()?;
    }
    let Some(path) = args.trace.clone().filter(|_| !args.print_config) else {
        super::print(&toml::to_string(&config)?)?;
        return Ok(ExitCode::SUCCESS);
    };
    if args.compare_modes {
        (config.mode, config.tmu.model) = (Mode::Timed, TmuModel::Looping);
    }
    let inputs = std::iter::once(path.as_path()).chain(args.machine.file());
    let inputs = inputs.chain(args.picture.as_deref());
    let prints = files::check_outputs(&outputs(args), inputs)?;
    let plan = Plan::single(config, args.compare_modes)?;
    args.threads.start()?;
    let traces = Traces::open(&[path])?;
    let subjects = traces.subjects();

    let start = Instant::now();
    let outcome = experiment::run(&plan, &subjects, None, &|_| ())?;
    let seconds = start.elapsed().as_secs_f64();
    super::warnings::of_outcome(&outcome);
    let rows = outcome.rows();
    // On stderr, because results must not depend on the host machine.
    let footprints: u64 = rows.iter().map(|row| row.result.footprints).sum();
    shell::note(&format!(
        "{:.1} M footprints/s ({footprints} footprints in {seconds:.3} s, decoding included)",
        footprints as f64 / seconds / 1e6,
    ));
    if let (Some(file), [row, ..]) = (&args.timeline, rows.as_slice())
        && let Some(timeline) = &row.result.timeline
    {
        let tables = row.subject.source.tables();
        let text = report::timeline::json(timeline, tables, config.line_bytes)?;
        files::write_atomically(file, text.as_bytes())?;
    }
    if !prints {
        return Ok(ExitCode::SUCCESS);
    }
    super::print(&match (rows.as_slice(), args.json) {
        (rows, _) if args.csv => document::csv(rows),
        ([timed, functional], true) => document::modes_json(timed, functional)?,
        ([timed, functional], false) => document::modes_text(timed, functional),
        ([row, ..], true) => document::json(row)?,
        ([row, ..], false) => document::text(row, args.machine.counts_by().is_some()),
        ([], _) => String::new(),
    })?;
    Ok(ExitCode::SUCCESS)
}
