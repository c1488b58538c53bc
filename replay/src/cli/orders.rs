//! `replay orders`: compares tile orders with each other and with bounds.

use super::ConfigArgs;
use super::experiment_args::{parse_caches, refuse_varied};
use super::order_arg::parse_named;
use super::outputs::PageOutputs;
use super::sample::WithinArgs;
use super::subjects::Traces;
use crate::files::{self, write_atomically};
use anyhow::{Context, Result, bail, ensure};
use report::orders::{LearnedTrace, OrdersReport};
use shell::Progress;
use sim::config::{BetweenFrames, Mode, Order, RunConfig};
use sim::preset::Preset;
use sim::size::format_bytes;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::ExitCode;
use studies::experiment::frame_count;
use studies::orders_study::learn::learn;
use studies::orders_study::search::{Method, Schedule};
use studies::orders_study::{
    BASELINE, Corners, OrderFile, OrdersStudy, Searched, Subjects, default_orders,
};
use studies::sampling::of::Of;

/// The default of `--caches` for machines without caches of their own: the paper's.
const CACHES: &str = "8/128,16/128,8/256,16/256";

/// The machine without `--preset`, `--config` and `--caches`: a present headset's.
const PRESET: Preset = Preset::ADRENO_740;

/// Number of best orders that are replayed over the ranges of a machine if no orders are listed, besides three fixed
/// ones.
const FINALISTS: usize = 3;

/// Stands for the orders that the study knows: every curve and every part.
const ALL: &str = "all";

/// The default orders of the learner.
const LEARNER: &str = "adaptive+sta+offset+boustro,zig-zag+sta+offset+boustro,band4+sta+offset+boustro,band8+sta+offset+boustro";

/// Arguments of `replay orders`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  replay orders atrium.textrace
  replay orders *.textrace --search greedy --bounds --json
  replay orders a.textrace --orders z2-sta,zig-zag+sta+offset,strip+sta+offset --html orders.html
  replay orders head.textrace --between keep,lose-50,flush --orders z2-sta,zig-zag+sta+offset+boustro
  replay orders head.textrace --learn
  replay orders a.textrace --search anneal --moves 1000000 --save-orders searched
  replay orders a.textrace --preset mali-g715 --orders morton,z2-sta,zig-zag+sta+offset
  replay orders a.textrace --caches 8/128,16/128,8/256,16/256
  replay orders a.textrace --mode timed --dram lpddr4 --orders z2-sta,zig-zag+sta+offset
docs/models/orders.md explains the parts of an order, docs/results/orders.md has results.")]
pub struct Args {
    /// Texture traces
    #[arg(required = true, value_name = "TRACE")]
    traces: Vec<PathBuf>,
    #[command(flatten)]
    machine: ConfigArgs,
    /// Orders to compare, comma-separated: names, or parts as in strip8+sta+offset. z2-sta is always included
    /// [default: all, which has every named order, every curve and every part]
    #[arg(long, value_name = "ORDERS")]
    orders: Option<String>,
    /// L1/L2 sizes in KiB, comma-separated. Without them, --preset, --config and --learn, the machine is adreno-740
    /// [default: those of a --preset with caches, else 8/128,16/128,8/256,16/256]
    #[arg(long, value_name = "L1/L2,...")]
    caches: Option<String>,
    /// What happens to caches between frames, comma-separated: keep, flush, lose-N
    #[arg(long, value_name = "CACHES,...", default_value = "keep")]
    between: String,
    /// Also search orders for traces of one frame, comma-separated: greedy, greedy-N (with a look-ahead of N
    /// items), anneal
    #[arg(long, value_name = "METHODS")]
    search: Option<String>,
    /// Number of moves that annealing tries
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    moves: u64,
    /// Write the searched orders into this folder
    #[arg(long, value_name = "DIR", requires = "search")]
    save_orders: Option<PathBuf>,
    /// Also replay a searched order from a file, with the L2 for which it was searched
    #[arg(long = "order-file", value_name = "FILE")]
    order_files: Vec<PathBuf>,
    /// Also print lower bounds: infinite cache, OPT replacement, windows of uses
    #[arg(long)]
    bounds: bool,
    /// Also let a learner choose one of these orders per frame, comma-separated [default with no value: four
    /// curves with sta, offset and boustro]
    #[arg(long, value_name = "ORDERS", num_args = 0..=1, default_missing_value = LEARNER)]
    learn: Option<String>,
    #[command(flatten)]
    within: WithinArgs,
    #[command(flatten)]
    outputs: PageOutputs,
    #[command(flatten)]
    threads: shell::Threads,
}

/// Runs the subcommand.
///
/// # Errors
/// Invalid arguments, an unreadable trace or order, or an output that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.threads.start()?;
    let study = study(args)?;
    let prints = check_outputs(args)?;
    if args.within.within.is_some() {
        return sampled(args, &study, prints);
    }
    let traces = Traces::open(&args.traces)?;
    let opened = traces.subjects();
    let subjects = Subjects {
        traces: &opened,
        files: order_files(
            &args.order_files,
            &opened
                .iter()
                .map(|s| s.id.checksum.as_str())
                .collect::<Vec<_>>(),
        )?,
    };
    let replays = opened.len() * study.replays_per_trace();
    let progress = Progress::new("replaying", replays as u64, "replays");
    let (rows, searched, work) = study.run(&subjects, &|done| progress.advance(done))?;
    drop(progress);
    warn_of_unused(&subjects.files, &study.caches_bytes);
    let replays = rows.iter().filter_map(|row| {
        let result = row.result.as_ref()?;
        Some((row.subject, &row.config, result))
    });
    super::warnings::of_replays(subjects.traces, &replays.collect::<Vec<_>>());
    shell::note(&work.summary(rows.iter().filter(|row| row.result.is_some()).count()));
    if let Some(folder) = &args.save_orders {
        for Searched { source, file } in searched.iter().skip(subjects.files.len()) {
            write_atomically(&folder.join(source), file.text().as_bytes())?;
        }
    }
    let report = OrdersReport {
        rows,
        learned: learned(args, &study, &subjects)?,
        config: study.base,
    };
    args.outputs.write(&report, prints, || report.page())?;
    Ok(ExitCode::SUCCESS)
}

/// Replays some frames of a trace, with savings over Morton order.
fn sampled(args: &Args, study: &OrdersStudy, prints: bool) -> Result<ExitCode> {
    let [path] = &args.traces[..] else {
        bail!("--within: expected one trace, found {}", args.traces.len());
    };
    let other = [
        ("--search", args.search.is_some()),
        ("--order-file", !args.order_files.is_empty()),
        ("--bounds", args.bounds),
        ("--learn", args.learn.is_some()),
        ("--between", study.between.len() > 1),
        ("--html", args.outputs.html.is_some()),
    ];
    if let Some((flag, _)) = other.iter().find(|(_, is_given)| *is_given) {
        bail!("--within: expected no {flag} with it, found both");
    }
    let base = RunConfig {
        between_frames: study.between[0],
        ..study.base
    };
    let mut orders = study.orders.clone();
    orders.retain(|order| *order != Order::MORTON);
    orders.insert(0, Order::MORTON);
    let found = args
        .within
        .answer(Of::Saving, path, &base, &orders, &study.caches_bytes)?;
    let report = found.context("--within")?;
    args.outputs.write(&report, prints, || Ok(String::new()))?;
    Ok(super::sample::exit_code(&report))
}

/// Builds the study from the arguments.
fn study(args: &Args) -> Result<OrdersStudy> {
    let usual = RunConfig {
        mode: Mode::Functional,
        ..RunConfig::default()
    };
    // The learner counts caches of 4 ways, as the default ones.
    let is_open = args.caches.is_none() && args.learn.is_none() && !args.machine.has_base();
    let chosen = match is_open {
        true => args.machine.on(PRESET),
        false => args.machine.clone(),
    };
    let mut base = chosen.resolve_over(usual)?;
    if is_open && base.mode == Mode::Functional && !args.machine.has_dram() {
        base.dram = None;
    }
    let machine = chosen.preset().and_then(Preset::machine);
    refuse_varied(&base, &machine.map_or(usual, |machine| machine.over(usual)))?;
    ensure!(
        base.between_frames == usual.between_frames,
        "--between-frames is varied here; use --between"
    );
    let mut orders = parse_orders(args.orders.as_deref().unwrap_or(ALL))?;
    if !orders.contains(&BASELINE) {
        orders.insert(0, BASELINE);
    }
    let caches_bytes = match (&args.caches, machine) {
        (Some(text), _) => parse_caches(text)?,
        (None, Some(_)) => vec![(base.level.l1.size_bytes, base.level.l2.size_bytes)],
        (None, None) => parse_caches(CACHES)?,
    };
    let mut study = OrdersStudy {
        base,
        corners: corners(args, &chosen, usual)?,
        caches_bytes,
        between: parse_between(&args.between)?,
        orders,
        methods: Vec::new(),
        bounds: args.bounds,
    };
    for name in args.search.iter().flat_map(|names| names.split(',')) {
        let schedule = Schedule::new(args.moves, base.seed);
        let method = Method::find(name.trim(), &schedule);
        study.methods.push(method.with_context(|| {
            format!("--search: expected greedy, greedy-N with a look-ahead of N items, or anneal, found `{name}`")
        })?);
    }
    for config in study.configs() {
        config.validate()?;
    }
    Ok(study)
}

/// The corners of the ranges of a machine. `--caches` leaves no size to vary.
fn corners(args: &Args, chosen: &ConfigArgs, usual: RunConfig) -> Result<Option<Corners>> {
    let machine = chosen.preset().and_then(Preset::machine);
    let Some(machine) = machine.filter(|_| args.caches.is_none()) else {
        return Ok(None);
    };
    let mut configs = chosen.resolve_corners(usual)?;
    // Only bytes are compared there, and a functional replay counts the same without DRAM.
    for config in configs
        .iter_mut()
        .filter(|config| config.mode == Mode::Functional)
    {
        config.dram = None;
    }
    configs.dedup();
    let over = format!(
        "{} corners of {}: {}",
        configs.len(),
        machine.name,
        machine.ranges_text()
    );
    let finalists = args.orders.is_none().then_some(FINALISTS);
    Ok((!configs.is_empty()).then_some(Corners {
        configs,
        over,
        finalists,
    }))
}

/// Parses comma-separated orders. Here `all` also has every curve and part, not only the orders with a name.
fn parse_orders(text: &str) -> Result<Vec<Order>> {
    match text {
        ALL => Ok(default_orders()),
        names => parse_named(names),
    }
}

fn parse_between(text: &str) -> Result<Vec<BetweenFrames>> {
    let mut between = Vec::new();
    for name in text.split(',') {
        let of = name.trim().parse();
        let of: BetweenFrames = of.map_err(|why: String| anyhow::anyhow!("--between: {why}"))?;
        if !between.contains(&of) {
            between.push(of);
        }
    }
    Ok(between)
}

/// Reads searched orders. Each must belong to one of the traces.
fn order_files(paths: &[PathBuf], checksums: &[&str]) -> Result<Vec<Searched>> {
    let read = |path: &PathBuf| {
        let text = shell::read_settings(path)?;
        let file = OrderFile::parse(&text).with_context(|| path.display().to_string())?;
        ensure!(
            checksums.contains(&file.trace.as_str()),
            "{}: expected an order of one of the traces ({}), found one of {}",
            path.display(),
            checksums.join(", "),
            file.trace
        );
        Ok(Searched {
            source: path.display().to_string(),
            file,
        })
    };
    paths.iter().map(read).collect()
}

/// Warns of order files for an L2 that no machine has, because they are not replayed.
fn warn_of_unused(files: &[Searched], caches_bytes: &[(u64, u64)]) {
    let sizes: BTreeSet<u64> = caches_bytes.iter().map(|(_, l2)| *l2).collect();
    for Searched { source, file } in files {
        if !sizes.contains(&file.l2_bytes) {
            let replayed: Vec<String> = sizes.iter().map(|size| format_bytes(*size)).collect();
            shell::warn(&format!(
                "{source}: not replayed: expected l2_bytes of one of the L2 caches of --caches ({}), found {} ({})",
                replayed.join(", "),
                file.l2_bytes,
                format_bytes(file.l2_bytes)
            ));
        }
    }
}

/// Runs the learner, if requested.
fn learned<'a>(
    args: &Args,
    study: &OrdersStudy,
    subjects: &'a Subjects<'a>,
) -> Result<Vec<LearnedTrace<'a>>> {
    let Some(names) = &args.learn else {
        return Ok(Vec::new());
    };
    let orders = parse_orders(names)?;
    let mut learned = Vec::new();
    for subject in subjects.traces {
        let frames = u64::from(frame_count(subject.source.tables()));
        for config in study.configs() {
            let progress = Progress::new("learning", frames, "frames");
            let found = learn(subject.source, &config, &orders, &|done| {
                progress.advance(done)
            });
            let found = found.with_context(|| subject.label.clone())?;
            let Some(found) = found else {
                bail!("--learn: expected LRU caches of 4 ways, which the learner counts");
            };
            learned.push(LearnedTrace {
                file: &subject.id.name,
                config,
                learned: found,
            });
        }
    }
    Ok(learned)
}

/// Checks the outputs. Returns true if the table or JSON goes to standard output.
fn check_outputs(args: &Args) -> Result<bool> {
    if let Some(folder) = &args.save_orders {
        shell::check_folder("--save-orders", folder)?;
    }
    let inputs = args
        .traces
        .iter()
        .chain(&args.order_files)
        .map(PathBuf::as_path);
    let outputs = args.outputs.list::<OrdersReport>()?;
    files::check_outputs(&outputs, inputs.chain(args.machine.file()))
}
