//! `replay predict`: what orders save at a size that was not captured, from a capture at a smaller one.

use super::experiment_args::{parse_caches, refuse_sizes};
use super::order_arg::parse_over;
use super::outputs::ReplayArgs;
use super::subjects::Traces;
use anyhow::{Context, Result, bail, ensure};
use report::predict::PredictReport;
use shell::Progress;
use sim::config::{Mode, RunConfig, SetIndex};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::ExitCode;
use studies::experiment::frame_count;
use studies::predict::{not_predicted, predict};

/// Largest difference between the ratios of two pictures' widths and heights.
const SHAPE: f64 = 0.02;

/// Caches without other sizes.
const USUAL_CACHES: &str = "8/128,8/512,8/2048";

/// Arguments of `replay predict`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  replay predict half.textrace --to 1920x2160
  replay predict half.textrace --to 1920x2160 --orders z2-sta --caches 8/512,16/1024 --json
  replay predict --to 1920x2160 -- tracegen raster jungle --size 960x1080
docs/models/size-prediction.md has the errors.")]
pub struct Args {
    /// Texture trace at a smaller size
    #[arg(value_name = "TRACE")]
    trace: PathBuf,
    /// Picture per eye to predict for, in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    to: [u32; 2],
    /// Orders, comma-separated
    #[arg(
        long,
        value_name = "ORDERS",
        default_value = "z2-sta,zig-zag+sta+offset"
    )]
    orders: String,
    /// Order that savings are over
    #[arg(long, value_name = "ORDER", default_value = "morton")]
    baseline: String,
    /// L1/L2 sizes in KiB, comma-separated [default: those of --preset, --config, --l1 and --l2, else
    /// 8/128,8/512,8/2048]. The L2 has 16 ways and a hashed set index unless flags set them
    #[arg(long, value_name = "L1/L2,...")]
    caches: Option<String>,
    #[command(flatten)]
    replay: ReplayArgs,
}

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let side = |text: &str| text.parse::<u32>().ok().filter(|n| (1..=16384).contains(n));
    let sides = text.split_once('x');
    let sides = sides.and_then(|(width, height)| Some([side(width)?, side(height)?]));
    sides.ok_or_else(|| format!("expected a size as in 1920x2160, found '{text}'"))
}

/// Runs the subcommand.
///
/// # Errors
/// Wrong arguments, an unreadable trace, or an output that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.replay.threads.start()?;
    let mut usual = RunConfig {
        mode: Mode::Functional,
        ..RunConfig::default()
    };
    (usual.level.l2.ways, usual.level.l2.set_index) = (16, SetIndex::Xor);
    let mut config = args.replay.machine.resolve_over(usual)?;
    // DRAM changes no count of bytes.
    config.dram = None;
    ensure!(
        config.order == usual.order,
        "--order is varied here; use --orders"
    );
    if let Some([key, expected, found]) = not_predicted(&config) {
        bail!("{key}: expected {expected} with `replay predict`, found {found}");
    }
    let orders = parse_over(&args.baseline, &args.orders)?;
    ensure!(
        orders.len() > 1,
        "--orders: expected an order other than the baseline, found `{}`",
        args.orders
    );
    let [sizes, usual_sizes] = [&config, &usual].map(|of| {
        let level = &of.level;
        (level.l1.size_bytes, level.l2.size_bytes)
    });
    let caches = match &args.caches {
        Some(caches) => {
            refuse_sizes(&config, &usual)?;
            parse_caches(caches)?
        }
        None if sizes != usual_sizes => vec![sizes],
        None => parse_caches(USUAL_CACHES)?,
    };
    let paths = [args.trace.clone()];
    let prints = args.replay.check::<PredictReport>(&paths)?;
    let traces = Traces::open(&paths)?;
    let Some(trace) = traces.sources().next() else {
        bail!("expected a trace");
    };
    let tables = trace.tables();
    let from = tables.meta.hmd.eye_size_px;
    let Some(growth) = longer(from, args.to).filter(|growth| *growth >= 1.0) else {
        let [[width, height], [wide, high]] = [from, args.to];
        bail!(
            "--to: expected a size of at least the trace's {width}x{height} and of its shape, found {wide}x{high}"
        );
    };
    let l1s: BTreeSet<u64> = caches.iter().map(|(l1, _)| *l1).collect();
    // Each order is analysed at the captured size and at half of it.
    let frames = 2 * u64::from(frame_count(tables)) * (orders.len() * l1s.len()) as u64;
    let progress = Progress::new("analysing", frames, "frames");
    let done = |steps| progress.advance(steps);
    let rows = predict(trace, growth, &config, &orders, &caches, &done)
        .with_context(|| args.trace.display().to_string())?;
    drop(progress);
    let report = PredictReport {
        config,
        baseline: args.baseline.clone(),
        sizes_px: [from, args.to],
        rows,
    };
    args.replay.outputs.write(&report, prints)?;
    Ok(ExitCode::SUCCESS)
}

/// How many times as long the sides of `b` are; none if the pictures have different shapes.
fn longer(a: [u32; 2], b: [u32; 2]) -> Option<f64> {
    let [x, y] = [0, 1].map(|side| f64::from(b[side]) / f64::from(a[side]));
    ((x / y - 1.0).abs() <= SHAPE).then(|| (x * y).sqrt())
}
