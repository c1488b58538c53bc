//! `replay compare`: compares two captures of the same views, and their cache misses.

use super::order_arg::parse_orders;
use super::outputs::ReplayArgs;
use super::subjects::{Traces, replayed};
use anyhow::{Context, Result, ensure};
use report::compare::{CompareReport, Replayed, Side};
use sim::config::Order;
use std::path::PathBuf;
use std::process::ExitCode;
use studies::compare::compare;
use studies::experiment::{Axis, Plan};
use toml::Value;

/// Arguments of `replay compare`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Exit code: 0 compared, 2 unreadable, or different views or textures.

Examples:
  replay compare lavapipe.textrace osmesa.textrace
  replay compare full.textrace foveated.textrace --mode functional --json
  replay compare a.textrace b.textrace --orders all --l1 16KiB --l2 256KiB"
)]
pub struct Args {
    /// First capture
    a: PathBuf,
    /// Second capture, of the same views
    b: PathBuf,
    /// Orders for the replays of both, comma-separated, or `all`
    #[arg(long, value_name = "ORDERS", default_value = "morton,z2-lrta,z2-sta")]
    orders: String,
    #[command(flatten)]
    replay: ReplayArgs,
}

/// Runs the subcommand.
///
/// # Errors
/// Wrong arguments, an unreadable trace, or captures of different views or textures.
pub fn run(args: &Args) -> Result<ExitCode> {
    let config = args.replay.machine.resolve()?;
    ensure!(
        args.replay.machine.first_of_traces() != Some("--order"),
        "--order: this command varies the order; use --orders"
    );
    let orders = parse_orders(&args.orders)?;
    let captures = [args.a.clone(), args.b.clone()];
    let prints = args.replay.check::<CompareReport>(&captures)?;
    args.replay.threads.start()?;
    let traces = Traces::open(&captures)?;
    let subjects = traces.subjects();
    let [a, b] = [&subjects[0], &subjects[1]];
    let comparison = compare([a.source, b.source], &config)
        .with_context(|| format!("{} and {}", args.a.display(), args.b.display()))?;
    let name = |order: &Order| Value::String(order.name().to_owned());
    let axis = Axis {
        key: "order".to_owned(),
        values: orders.iter().map(name).collect(),
    };
    let plan = Plan::cross(config, &[axis], &[])?;
    let outcome = replayed(&plan, &subjects, None)?;
    let rows = outcome.rows();
    let (of_a, of_b) = rows.split_at(orders.len());
    let replayed = of_a.iter().zip(of_b).map(|(a, b)| Replayed {
        order: a.point.config.order,
        results: [a.result, b.result],
        morton: a.morton.zip(b.morton).map(|(a, b)| [a, b]),
    });
    let report = CompareReport {
        sides: [a, b].map(|subject| Side {
            trace: &subject.id,
            meta: &subject.source.tables().meta,
        }),
        config,
        comparison: &comparison,
        replayed: replayed.collect(),
    };
    args.replay.outputs.write(&report, prints)?;
    Ok(ExitCode::SUCCESS)
}
