//! `replay view`: a page to explore tiles and orders of a texture trace, or tiles and reuse of a ray trace.

use super::ConfigArgs;
use super::order_arg::parse_orders;
use super::subjects::{Traces, replayed};
use crate::files::{self, write_atomically};
use anyhow::{Result, ensure};
use formats::Trace;
use report::picture::EmbeddedPicture;
use report::view::ViewReport;
use shell::Output;
use sim::config::CountBy;
use sim::config::RunConfig;
use std::path::PathBuf;
use std::process::ExitCode;
use studies::experiment::Plan;

/// Orders that a page compares.
const MOST_ORDERS: usize = 4;

const ORDERS: &str = "morton,z2-sta";

/// Arguments of `replay view`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  replay view atrium.textrace -o view.html
  replay view atrium.textrace --frame tile-based -o view.html    # captured with --geometry: traffic of all clients
  replay view chess.raytrace -o view.html
  replay view atrium.textrace --orders morton,zig-zag+sta+offset --image atrium.png -o view.html")]
pub struct Args {
    /// Texture trace; or ray trace, whose page has the rays and the reuse of each tile
    trace: PathBuf,
    /// Page to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Orders to compare, comma-separated, at most four
    #[arg(long, value_name = "ORDERS", default_value = ORDERS)]
    orders: String,
    /// Rendered picture of both eyes, to show below the maps
    #[arg(long, value_name = "FILE")]
    image: Option<PathBuf>,
    #[command(flatten)]
    threads: shell::Threads,
    #[command(flatten)]
    machine: ConfigArgs,
}

/// Runs the subcommand.
///
/// # Errors
/// A machine without a timeline, an unreadable trace or picture, or a page that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.threads.start()?;
    let base = machine(&args.machine)?;
    ensure!(
        base.order == RunConfig::default().order,
        "--order: this command varies the order; use --orders"
    );
    ensure!(
        base.is_looping(),
        "--mode, --tmu: expected --mode timed --tmu looping, the only model that records when tiles are rendered"
    );
    let orders = parse_orders(&args.orders)?;
    ensure!(
        orders.len() <= MOST_ORDERS,
        "--orders: expected at most {MOST_ORDERS}, found {}",
        orders.len()
    );
    let inputs = [
        Some(args.trace.as_path()),
        args.machine.file(),
        args.image.as_deref(),
    ];
    let output = Output::text("--output", &args.output);
    let prints = files::check_outputs(&[output], inputs.into_iter().flatten())?;
    // Standard input can be read only once, so it holds a texture trace.
    if !shell::is_stdout(&args.trace)
        && let Trace::Ray(_) = Trace::open(&args.trace)?
    {
        ensure!(
            args.image.is_none()
                && args.orders == ORDERS
                && base == machine(&ConfigArgs::default())?,
            "{}: a ray trace takes no --orders, no --image and no flags of the machine",
            args.trace.display()
        );
        return write(args, &super::reproject::view(&args.trace)?, prints);
    }
    let caches = (base.level.l1.size_bytes, base.level.l2.size_bytes);
    let plan = |base| Plan::paper(base, &[caches], &orders, false);
    let by_draw = RunConfig {
        count_by: CountBy::Draw,
        tile_maps: false,
        timeline: false,
        ..base
    };
    let (plan, by_draw) = (plan(base)?, plan(by_draw)?);
    let traces = Traces::open(std::slice::from_ref(&args.trace))?;
    let subjects = traces.subjects();
    let picture = args.image.as_deref();
    let picture = picture.map(|path| EmbeddedPicture::open(&subjects[0].label, path));
    let picture = picture.transpose()?;
    let outcome = replayed(&plan, &subjects, None)?;
    let draws = replayed(&by_draw, &subjects, None)?;
    let report = ViewReport {
        rows: &outcome.rows(),
        draws: &draws.rows(),
        picture: picture.as_ref(),
    };
    let (page, left_out) = report.page()?;
    if left_out > 0 {
        shell::warn(&format!(
            "{}: {} frames left out, to keep the page below 5 MB; capture fewer frames",
            args.output.display(),
            left_out
        ));
    }
    write(args, &page, prints)
}

fn machine(args: &ConfigArgs) -> Result<RunConfig> {
    Ok(RunConfig {
        tile_maps: true,
        timeline: true,
        l2_changes: true,
        count_by: CountBy::Texture,
        ..args.resolve()?
    })
}

fn write(args: &Args, page: &str, prints: bool) -> Result<ExitCode> {
    write_atomically(&args.output, page.as_bytes())?;
    if prints {
        super::print(&args.output.display().to_string())?;
    }
    Ok(ExitCode::SUCCESS)
}
