//! `replay locality`: reuse distances and statistics derived from them, by order.

use super::ConfigArgs;
use super::addresses::{AddressInput, name_of, two_levels_only};
use super::order_arg::parse_orders;
use super::outputs::PageOutputs;
use super::subjects::Traces;
use crate::files::check_outputs;
use anyhow::{Context, Result, ensure};
use clap::Arg;
use locality::{OrderFigures, Stream, Streams, analyse, analyse_addresses};
use report::locality::{LocalityReport, TraceFigures};
use shell::Progress;
use sim::config::{Order, RunConfig};
use sim::stream::TileSource;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use studies::experiment::frame_count;

/// Default of `--orders`.
const USUAL_ORDERS: &str = "morton,z2-lrta,z2-sta,z2-sta-merge";

/// Arguments of `replay locality`.
#[derive(Debug, clap::Args)]
#[command(
    mut_arg("csv", csv_folder),
    after_help = "Examples:
  replay locality c.textrace
  replay locality c.textrace --orders all --html locality.html
  replay locality c.textrace --orders morton,z2-sta --l1 16KiB --json
  replay locality c.textrace --csv tables
  replay locality --addresses gcc.din.gz --l1 32KiB --l2 256KiB --line 64
docs/models/locality.md defines every figure."
)]
pub struct Args {
    /// Texture traces
    #[arg(
        required_unless_present = "addresses",
        value_name = "TRACE",
        conflicts_with = "addresses"
    )]
    traces: Vec<PathBuf>,
    /// Orders to compare, comma-separated, or `all` [default: morton,z2-lrta,z2-sta,z2-sta-merge]
    #[arg(long, value_name = "ORDERS", conflicts_with = "addresses")]
    orders: Option<String>,
    /// Also analyse the accesses of all cores as one stream
    #[arg(long)]
    merged: bool,
    /// Analyse only the L2's accesses, which takes a fraction of the time
    #[arg(long, conflicts_with_all = ["merged", "addresses"])]
    only_l2: bool,
    #[command(flatten)]
    outputs: PageOutputs,
    #[command(flatten)]
    threads: shell::Threads,
    #[command(flatten)]
    addresses: AddressInput,
    #[command(flatten)]
    machine: ConfigArgs,
}

fn csv_folder(csv: Arg) -> Arg {
    csv.value_name("DIR").help(
        "Also write the tables as CSV files into this folder, with exact counts of every distance; without DIR, print \
         the summary",
    )
}

/// Runs the subcommand.
///
/// # Errors
/// An invalid configuration, an unreadable trace, or an output that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.threads.start()?;
    let config = args.machine.resolve()?;
    two_levels_only(&config, "locality")?;
    ensure!(
        config.order == RunConfig::default().order,
        "--order: this command varies the order; use --orders"
    );
    let orders = parse_orders(args.orders.as_deref().unwrap_or(USUAL_ORDERS))?;
    let inputs = args.traces.iter().map(PathBuf::as_path);
    let inputs = inputs
        .chain(args.addresses.file())
        .chain(args.machine.file());
    let prints = check_outputs(&args.outputs.list::<LocalityReport>()?, inputs)?;
    let traces = match args.addresses.path(&args.machine)? {
        Some(path) => vec![of_addresses(args, path, &config)?],
        None => of_traces(args, &config, &orders)?,
    };
    let report = LocalityReport { traces, config };
    args.outputs.write(&report, prints, || report.page())?;
    Ok(ExitCode::SUCCESS)
}

/// Analyses the traces in every order.
fn of_traces(args: &Args, config: &RunConfig, orders: &[Order]) -> Result<Vec<TraceFigures>> {
    let traces = Traces::open(&args.traces)?;
    let subjects = traces.subjects();
    let frames = |source: &dyn TileSource| u64::from(frame_count(source.tables()));
    let steps: u64 = subjects.iter().map(|s| frames(s.source)).sum();
    let progress = Progress::new("analysing", steps * orders.len() as u64, "frames");
    let streams = match (args.merged, args.only_l2) {
        (true, _) => Streams::WithMerged,
        (false, true) => Streams::OnlyL2,
        (false, false) => Streams::Levels,
    };
    let mut figures = Vec::new();
    for subject in &subjects {
        let done = |steps| progress.advance(steps);
        let orders = analyse(subject.source, config, orders, streams, &done)
            .with_context(|| subject.label.clone())?;
        warn_of_bound(&subject.label, &orders);
        figures.push(TraceFigures {
            label: subject.label.clone(),
            id: Some(subject.id.clone()),
            frames: frame_count(subject.source.tables()),
            orders,
        });
    }
    Ok(figures)
}

/// Warns if the L2 misses each line once in every order.
fn warn_of_bound(label: &str, orders: &[OrderFigures]) {
    let is_bound = |of: &OrderFigures| {
        let l2 = of.streams.iter().find(|(stream, _)| *stream == Stream::L2);
        l2.is_some_and(|(_, l2)| l2.unique_lines > 0 && l2.split.misses() == l2.split.compulsory)
    };
    if orders.iter().all(is_bound) {
        super::warnings::of_bound(&[label]);
    }
}

/// Analyses plain addresses.
fn of_addresses(args: &Args, path: &Path, config: &RunConfig) -> Result<TraceFigures> {
    ensure!(
        !args.merged,
        "--merged cannot be used with --addresses: plain addresses have no cores"
    );
    let file = args.addresses.open(path)?;
    Ok(TraceFigures {
        label: name_of(path),
        id: None,
        frames: 1,
        orders: vec![analyse_addresses(file, config, args.addresses.kinds())?],
    })
}
