//! `replay sweep`: replays the points of an experiment on one or many machines.

use super::ConfigArgs;
use super::experiment_args::refuse_sizes;
use super::outputs::{ParquetArg, StyleArg};
use super::subjects::Traces;
use crate::files::{self, write_atomically};
use anyhow::{Context, Result, anyhow, ensure};
use formats::container::ScratchFolder;
use report::document::Document;
use report::sweep::SweepReport;
use report::sweep_plan::SweepPlan;
use shell::{Needs, Output, Progress, Shard, ShardArgs, SlurmArray};
use sim::preset::Preset;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use studies::experiment::{
    self, CACHES, ExperimentFile, Outcome, Plan, Point, Split, Store, Subject,
};

/// Arguments of `replay sweep`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  replay sweep replay/experiments/caches.toml crytek.textrace --out out/caches
  replay sweep replay/experiments/open-choices.toml *.textrace --out out/open-choices --json
  replay sweep model.textrace --caches 8/64,8/128,8/256 --orders morton,z2-sta --preset adreno-740
  replay sweep model.textrace --vary l2.ways=4,8,16
  replay sweep caches.toml --out out/caches --shard 3/8
  replay sweep caches.toml --out out/caches --merge-only
  replay sweep caches.toml --out out/caches --emit-slurm 8 > caches.sh && sh caches.sh

A sweep that was stopped goes on where it stopped when it is started again with the same --out.")]
pub struct Args {
    /// Experiment file with [base], [axes] and [one-at-a-time] over configuration keys, unless flags list the values;
    /// then texture traces, which override the list in the experiment file
    #[arg(value_name = "EXPERIMENT.toml|TRACE", required = true)]
    inputs: Vec<PathBuf>,
    /// L1/L2 sizes in KiB to vary, comma-separated
    #[arg(long, value_name = "L1/L2,...")]
    caches: Option<String>,
    /// Orders to vary, comma-separated
    #[arg(long, value_name = "ORDERS")]
    orders: Option<String>,
    /// Configuration key to vary, and its values; several are crossed
    #[arg(long, value_name = "KEY=V1,V2,...")]
    vary: Vec<String>,
    /// Folder for results.json, results.csv, report.html and points/ [default: out/NAME of an experiment file, none
    /// without]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object (schema replay.sweep/3, with --plan replay.plan/2)
    #[arg(long, conflicts_with_all = ["emit_slurm"])]
    json: bool,
    #[command(flatten)]
    style: StyleArg,
    #[command(flatten)]
    parquet: ParquetArg,
    /// Print the points and stop; with --json also their keys, their costs and which are done
    #[arg(long, conflicts_with_all = ["emit_slurm", "merge_only"])]
    plan: bool,
    /// Replay nothing: merge the rows that shards have written, or list the missing ones
    #[arg(long, conflicts_with_all = ["shard", "emit_slurm"], help_heading = "Many machines")]
    merge_only: bool,
    #[command(flatten)]
    threads: shell::Threads,
    #[command(flatten)]
    shards: ShardArgs,
    #[command(flatten)]
    machine: ConfigArgs,
}

impl Args {
    /// Fails if a flag has no effect in combination with another.
    fn check(&self) -> Result<()> {
        let sharded = self.shards.shard.is_some();
        ensure!(
            self.json || !self.plan || self.out.is_none(),
            "--plan --out: expected --json, because only the JSON lists which points are in the folder"
        );
        ensure!(
            self.json || !self.plan || !sharded,
            "--plan --shard: expected --json, because only the JSON lists the shards"
        );
        ensure!(
            self.plan || !self.json || !sharded,
            "--shard --json: a shard writes only points; --merge-only prints the results"
        );
        ensure!(
            self.parquet.path.is_none() || !sharded && !self.plan,
            "--parquet: expected results, found {}",
            if sharded {
                "--shard, which writes only points"
            } else {
                "--plan"
            }
        );
        Ok(())
    }

    /// The lists of values on the command line, as axes.
    fn axes(&self) -> Vec<String> {
        let orders = self.orders.iter().map(|list| format!("order={list}"));
        let caches = self.caches.iter().map(|list| format!("{CACHES}={list}"));
        orders
            .chain(caches)
            .chain(self.vary.iter().cloned())
            .collect()
    }

    /// The experiment file, if the first input is one: without lists on the command line, or by its extension.
    fn experiment(&self) -> Option<&Path> {
        let first = self.inputs.first().map(PathBuf::as_path)?;
        let is_toml = first
            .extension()
            .is_some_and(|extension| extension == "toml");
        (is_toml || self.axes().is_empty()).then_some(first)
    }

    /// Name of the experiment file for messages.
    fn name(&self) -> String {
        let name = |path: &Path| path.display().to_string();
        self.experiment().map_or_else(|| "sweep".to_owned(), name)
    }

    /// The experiment: its file, then the flags.
    fn plan(&self) -> Result<(ExperimentFile, Plan)> {
        let name = self.name();
        let mut file = match self.experiment() {
            Some(path) => {
                ExperimentFile::parse(&shell::read_settings(path)?).with_context(|| name.clone())?
            }
            None => ExperimentFile::default(),
        };
        let given = file.base;
        file.base = self.machine.resolve_over(given)?;
        let axes = self.axes();
        if axes.is_empty() {
            ensure!(
                file.base == given,
                "flags of the machine: expected with --caches, --orders or --vary, found with an experiment file alone, whose [base] sets the machine"
            );
        } else {
            ensure!(
                self.shards.shard.is_none() && self.shards.emit_slurm.is_none() && !self.merge_only,
                "--caches, --orders, --vary: a sweep on many machines needs an experiment file with the same [axes]"
            );
        }
        let machine = self.machine.preset().and_then(Preset::machine);
        let usual = machine.map_or(given, |machine| machine.over(given));
        if self.orders.is_some() {
            ensure!(
                file.base.order == usual.order,
                "--order is varied here; use --orders"
            );
        }
        if self.caches.is_some() {
            refuse_sizes(&file.base, &usual)?;
        }
        for axis in axes {
            file.add_axis(&axis)
                .map_err(|message| anyhow!("{message}"))?;
        }
        let plan = file.plan().with_context(|| name)?;
        Ok((file, plan))
    }
}

/// Runs the subcommand.
///
/// # Errors
/// An invalid experiment file, an unreadable trace, an output that cannot be written, or a point that is
/// missing in a merge.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.check()?;
    args.threads.start()?;
    let (file, plan) = args.plan()?;
    if args.plan && !args.json {
        let titles: Vec<String> = plan.points.iter().map(Point::title).collect();
        super::print(&titles.join("\n"))?;
        return Ok(ExitCode::SUCCESS);
    }
    let sweep = Sweep::open(args, file, plan)?;
    if !args.merge_only {
        sweep.report_damages();
    }
    let subjects = sweep.traces.subjects();
    if let Some(shards) = args.shards.emit_slurm {
        sweep.check_outputs()?;
        super::print(&sweep.slurm_script(shards)?)?;
    } else if args.plan {
        let tasks = sweep.split().tasks(&sweep.plan, args.shards.shard);
        let plan = SweepPlan {
            plan: &sweep.plan,
            subjects: &subjects,
            tasks: &tasks,
            store: &sweep.store,
        };
        super::print(&plan.json()?)?;
    } else if let Some(shard) = args.shards.shard {
        sweep.run_shard(shard, &subjects)?;
    } else {
        let prints = sweep.check_outputs()?;
        let outcome = if args.merge_only {
            experiment::merge(&sweep.plan, &subjects, &sweep.store)
                .with_context(|| sweep.out.display().to_string())?
        } else {
            let points = subjects.len() * sweep.plan.points.len();
            let progress = Progress::new("replaying", points as u64, "points");
            let done = |done| progress.advance(done);
            experiment::run(&sweep.plan, &subjects, Some(&sweep.store), &done)?
        };
        super::warnings::of_outcome(&outcome);
        shell::note(&outcome.shared());
        sweep.write(&outcome, prints)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Memory of a replay in addition to its traces: lines of expanded frames (384 MiB), tags of the largest
/// caches (300 MiB), and the same amount again as a margin.
const BASE_MEMORY_MIB: u64 = 1024;

/// A sweep after all inputs are checked.
struct Sweep<'a> {
    args: &'a Args,
    file: ExperimentFile,
    plan: Plan,
    paths: Vec<PathBuf>,
    traces: Traces,
    out: PathBuf,
    /// Stands for --out where nothing is kept.
    temporary: Option<ScratchFolder>,
    store: Store,
}

impl<'a> Sweep<'a> {
    fn open(args: &'a Args, file: ExperimentFile, plan: Plan) -> Result<Self> {
        let paths = trace_paths(args, &file);
        ensure!(
            !paths.is_empty(),
            "{}: expected traces in `traces` or on the command line, found none",
            args.name()
        );
        let (out, temporary) = match (&args.out, args.experiment()) {
            (Some(out), _) => (out.clone(), None),
            (None, Some(file)) => (
                Path::new("out").join(file.file_stem().unwrap_or_default()),
                None,
            ),
            (None, None) => {
                let folder = ScratchFolder::create_in(&std::env::temp_dir())?;
                (folder.path().to_owned(), Some(folder))
            }
        };
        shell::check_folder("--out", &out)?;
        shell::check_folder("--out", &out.join("points"))?;
        let store = Store::open(&out, args.shards.shard)?;
        Ok(Self {
            traces: Traces::open(&paths)?,
            store,
            args,
            file,
            plan,
            paths,
            out,
            temporary,
        })
    }

    /// Prints a note for each damaged stored row; a merge lists only those that leave a point missing.
    fn report_damages(&self) {
        for damage in self.store.damages() {
            shell::note(&format!("damaged row is replayed again: {damage}"));
        }
    }

    fn split(&self) -> Split {
        Split::new(&self.plan, &self.traces.records())
    }

    /// Paths of the JSON, CSV and page.
    fn outputs(&self) -> [PathBuf; 3] {
        ["results.json", "results.csv", "report.html"].map(|name| self.out.join(name))
    }

    /// Checks the outputs; returns true if standard output is free for the result.
    fn check_outputs(&self) -> Result<bool> {
        if let Some(path) = &self.args.parquet.path {
            ensure!(
                path != self.store.folder(),
                "--parquet {}: expected a file, found the name of the points' folder",
                path.display()
            );
        }
        let outputs = self.outputs();
        let outputs = outputs.iter().map(|path| Output::text("--out", path));
        let mut outputs: Vec<Output> = outputs.chain(self.args.parquet.output()).collect();
        outputs.extend(self.args.json.then(|| Output::result("--json")));
        let inputs = self.paths.iter().map(PathBuf::as_path);
        let settings = self
            .args
            .experiment()
            .into_iter()
            .chain(self.args.machine.file());
        files::check_outputs(&outputs, inputs.chain(settings))
    }

    /// Replays the points of a shard and writes only their rows.
    fn run_shard(&self, shard: Shard, subjects: &[Subject]) -> Result<()> {
        let split = self.split();
        let tasks = split.tasks(&self.plan, Some(shard));
        files::check_outputs(
            &[Output::text("--out", &self.store.folder().join("rows"))],
            [],
        )?;
        let wanted = split.shard(shard);
        let progress = Progress::new("replaying", tasks.len() as u64, "points");
        let done = |done| progress.advance(done);
        let work = experiment::run_part(&self.plan, subjects, &self.store, &wanted, &done)?;
        drop(progress);
        shell::note(&format!(
            "shard {}/{}: {}",
            shard.number,
            shard.count,
            work.summary(tasks.len())
        ));
        Ok(())
    }

    /// Writes and prints the results.
    fn write(&self, outcome: &Outcome, prints: bool) -> Result<()> {
        let report = SweepReport::new(&self.file, outcome);
        let json = report.json()?;
        if self.temporary.is_none() {
            let of = self.args.experiment().unwrap_or(&self.out).file_stem();
            let page = report.page(&format!(
                "Parallax sweep: {}",
                of.unwrap_or_default().to_string_lossy()
            ))?;
            let contents = [format!("{json}\n"), report.csv(), page];
            for (path, text) in self.outputs().iter().zip(contents) {
                write_atomically(path, text.as_bytes())?;
            }
        }
        self.args.parquet.write(|| report.rows())?;
        match (prints, self.args.json) {
            (false, _) => Ok(()),
            (true, true) => super::print(&json),
            (true, false) => super::print(&report.terminal(self.args.style.style(), false)),
        }
    }

    /// A script that runs the same sweep as a Slurm job array.
    fn slurm_script(&self, shards: u32) -> Result<String> {
        let program = std::env::current_exe().context("the program's own path")?;
        let mut command = vec![shell::absolute(&program)?, "sweep".to_owned()];
        for input in &self.args.inputs {
            command.push(shell::absolute(input)?);
        }
        command.extend(["--out".to_owned(), shell::absolute(&self.out)?]);
        let name = self.args.inputs[0].file_stem().unwrap_or_default();
        let mut then = vec!["--merge-only".to_owned()];
        if let Some(path) = &self.args.parquet.path {
            ensure!(
                !shell::is_stdout(path),
                "--parquet -: expected a file for the script to write"
            );
            then.extend(["--parquet".to_owned(), shell::absolute(path)?]);
        }
        let array = SlurmArray {
            name: &name.to_string_lossy(),
            shards,
            cpus: self.args.threads.count,
            needs: Some(Needs {
                memory_mib: BASE_MEMORY_MIB + self.traces.file_bytes().div_ceil(1 << 20),
                minutes: self.split().minutes(shards),
            }),
            command,
            then,
        };
        Ok(array.script())
    }
}

/// The traces of the command line, or those of the file, which are relative to it.
fn trace_paths(args: &Args, file: &ExperimentFile) -> Vec<PathBuf> {
    let Some(experiment) = args.experiment() else {
        return args.inputs.clone();
    };
    if args.inputs.len() > 1 {
        return args.inputs[1..].to_vec();
    }
    let folder = experiment.parent().unwrap_or(Path::new(""));
    file.traces.iter().map(|t| folder.join(t)).collect()
}
