//! `replay run`: replays one trace in one order with one configuration, or plain addresses through caches.

use super::ConfigArgs;
use super::addresses::AddressArgs;
use super::outputs::{self, Outputs};
use super::sample::WithinArgs;
use super::subjects::Traces;
use crate::files;
use anyhow::{Context, Result, bail, ensure};
use report::run::{ModesReport, RunReport};
use shell::Output;
use sim::config::{Mode, RunConfig, TmuModel};
use sim::preset::Preset;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;
use studies::experiment::{self, Plan};
use studies::sampling::of::Of;

/// Arguments of `replay run`.
#[derive(Debug, clap::Args)]
#[command(
    mut_arg("csv", outputs::csv_before_traces),
    after_help = "Examples:
  replay run c.textrace --order z2-sta
  replay run c.textrace --order z2-lrta --l1 16KiB --l2 256KiB --json
  replay run c.textrace --mode functional --order morton --block-order morton
  replay run c.textrace --l3 4MiB --prefetch next-line --dram lpddr4
  replay run c.textrace --order z2-sta --timeline c.perfetto.json
  replay run c.textrace --print-config > machine.toml
  replay run --addresses gcc.din.gz --l1 32KiB --l2 256KiB --line 64 --ways 8
  replay convert c.textrace --to u32 | replay run --addresses - --address-form u32 --caches 8/128,16/256"
)]
pub struct Args {
    /// Texture trace; optional with --addresses and --print-config
    #[arg(required_unless_present_any = ["print_config", "addresses"], conflicts_with = "addresses")]
    trace: Option<PathBuf>,
    #[command(flatten)]
    outputs: Outputs,
    /// Also count by tile
    #[arg(long, conflicts_with_all = ["addresses", "csv"], hide_short_help = true)]
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
    #[arg(long, conflicts_with_all = ["json", "csv", "path", "compare_modes", "addresses"])]
    print_config: bool,
    #[command(flatten)]
    within: WithinArgs,
    #[command(flatten)]
    threads: shell::Threads,
    #[command(flatten)]
    addresses: AddressArgs,
    #[command(flatten)]
    machine: ConfigArgs,
}

/// Runs the subcommand.
///
/// # Errors
/// An invalid configuration or an unreadable trace.
pub fn run(args: &Args) -> Result<ExitCode> {
    let mut config = args.machine.resolve()?;
    if let Some(path) = args.addresses.path(&args.machine)? {
        args.threads.start()?;
        return args.addresses.run(path, &config, &args.outputs);
    }
    if let Some(machine) = args.machine.preset().and_then(Preset::machine)
        && machine.ranged().next().is_some()
    {
        shell::note(&format!(
            "{}: not published: {}; `replay orders --preset {}` states how far figures move",
            machine.name,
            machine.ranges_text(),
            machine.name
        ));
    }
    config.tile_maps |= args.tiles;
    config.timeline = args.timeline.is_some();
    ensure!(
        !config.timeline || config.is_looping(),
        "--timeline: expected --mode timed --tmu looping, the only model that records when work items run"
    );
    ensure!(
        args.outputs.json || !(args.tiles && args.compare_modes),
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
    let mut outputs = args.outputs.list::<RunReport>()?;
    let timeline = args.timeline.iter();
    outputs.extend(timeline.map(|path| Output::text("--timeline", path)));
    let prints = files::check_outputs(&outputs, inputs)?;
    if args.within.within.is_some() {
        return sampled(args, &path, &config, prints);
    }
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
    match rows.as_slice() {
        [] => {}
        [row] => {
            let by_texture = args.machine.counts_by().is_some();
            args.outputs.write(&RunReport { row, by_texture }, prints)?;
        }
        [timed, functional, ..] => args
            .outputs
            .write(&ModesReport([timed, functional]), prints)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// Replays some frames of a trace.
fn sampled(args: &Args, path: &Path, config: &RunConfig, prints: bool) -> Result<ExitCode> {
    let other = [
        ("--timeline", args.timeline.is_some()),
        ("--compare-modes", args.compare_modes),
        ("--tiles", args.tiles),
        ("--frame", config.frame.is_some()),
    ];
    if let Some((flag, _)) = other.iter().find(|(_, is_given)| *is_given) {
        bail!("--within: expected no {flag} with it, found both");
    }
    args.threads.start()?;
    let level = &config.level;
    let sizes = [(level.l1.size_bytes, level.l2.size_bytes)];
    let found = (args.within).answer(Of::Bytes, path, config, &[config.order], &sizes)?;
    let report = found.context("--within")?;
    args.outputs.write(&report, prints)?;
    Ok(super::sample::exit_code(&report))
}
