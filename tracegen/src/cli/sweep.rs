//! `tracegen sweep`: the captures of a manifest, here or on many machines.

use super::{Cli, Command};
use crate::captures::{self, Capture};
use ::scenes::load_with;
use anyhow::{Context, bail, ensure};
use clap::{Args, Parser};
use formats::Trace;
use formats::container::{check_regular, read_regular, remove_abandoned};
use scene::{LoadOptions, TextureSlots};
use serde::Serialize;
use shell::{Output, Piece, Progress, Shard, ShardArgs, SlurmArray, Threads, balanced};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};
use std::time::Duration;

/// Schema of `--plan --json`.
const PLAN_SCHEMA: &str = "tracegen.plan/1";

/// An unfinished trace that has not changed for this long is abandoned.
const ABANDONED_AFTER: Duration = Duration::from_secs(24 * 3600);

/// Number of pixels that take as long to draw as one triangle takes to load and prepare, and the same for
/// samples of rays (results/capture-costs.csv).
const PIXELS_PER_TRIANGLE: u64 = 8;
const SAMPLES_PER_TRIANGLE: u64 = 10;

/// Arguments of `tracegen sweep`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  tracegen sweep captures.toml -o traces
  tracegen sweep captures.toml -o traces --shard 3/8
  tracegen sweep captures.toml -o traces --emit-slurm 8 > captures.sh && sh captures.sh
  replay sweep caches.toml traces/*.textrace

Each capture is a trace and its recipe: a line of arguments, and the checksum of what they made. A whole trace
that stands there with the same recipe is not captured again. Paths in the manifest are relative to it.")]
pub struct SweepArgs {
    /// Manifest: [base] and [[captures]] with options of `raster` and `rays`
    manifest: PathBuf,
    /// Folder for the traces and their recipes
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Print the captures and stop
    #[arg(long, conflicts_with = "emit_slurm")]
    plan: bool,
    /// Print the plan as one JSON object (schema tracegen.plan/1)
    #[arg(long, requires = "plan")]
    json: bool,
    #[command(flatten)]
    shards: ShardArgs,
    #[command(flatten)]
    threads: Threads,
}

/// A capture, and whether its trace exists.
struct Planned {
    capture: Capture,
    trace: PathBuf,
    /// Estimated cost in pixels or samples.
    cost: u64,
    done: bool,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PlanDocument<'a> {
    schema: &'a str,
    tool: String,
    captures: Vec<PlannedCapture<'a>>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PlannedCapture<'a> {
    file: &'a str,
    recipe: String,
    cost: u64,
    done: bool,
}

/// The schema of the JSON object.
#[cfg(test)]
pub(crate) fn schema() -> formats::schemas::Published {
    formats::schemas::Published::of::<PlanDocument<'_>>(PLAN_SCHEMA)
}

/// Runs `tracegen sweep`.
///
/// # Errors
/// A bad manifest, a folder that cannot be written, captures that failed.
pub fn run(args: &SweepArgs) -> anyhow::Result<()> {
    args.threads.start()?;
    let name = || args.manifest.display().to_string();
    let captures = captures::parse(&shell::read_settings(&args.manifest)?).with_context(name)?;
    let mut scenes = SceneSizes::new(folder_of(&args.manifest));
    let planned = captures
        .into_iter()
        .map(|capture| plan(capture, &args.output, &mut scenes));
    let mut planned: Vec<Planned> = planned.collect::<Result<_, _>>().with_context(name)?;
    if let Some(shards) = args.shards.emit_slurm {
        return shell::print(&slurm_script(args, shards)?);
    }
    let mine = match args.shards.shard {
        None => 0..planned.len(),
        Some(shard) => of_shard(&planned, shard),
    };
    let mine = &mut planned[mine];
    // This reads every trace to its end, so only the traces of this shard are checked.
    for p in &mut *mine {
        p.done = is_done(&p.capture, &args.output);
    }
    let mine = &*mine;
    if args.plan {
        return shell::print(&plan_text(mine, args.json)?);
    }
    capture_all(args, mine)
}

/// The folder of a manifest; paths in the manifest are relative to it.
fn folder_of(manifest: &Path) -> &Path {
    match manifest.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Numbers of triangles of scenes, each loaded once, without its images.
struct SceneSizes<'a> {
    /// Folder that paths are relative to.
    folder: &'a Path,
    triangles: HashMap<String, u64>,
}

impl<'a> SceneSizes<'a> {
    fn new(folder: &'a Path) -> Self {
        Self {
            folder,
            triangles: HashMap::new(),
        }
    }

    fn triangles(&mut self, scene: &str) -> anyhow::Result<u64> {
        if let Some(builtin) = scenes::BUILTINS.iter().find(|b| b.name == scene) {
            return Ok(builtin.triangles);
        }
        if let Some(triangles) = self.triangles.get(scene) {
            return Ok(*triangles);
        }
        let path = self.folder.join(scene);
        let spec = match path.to_str() {
            Some(path) if Path::new(path).is_file() => path,
            _ => scene,
        };
        let without_images = LoadOptions {
            slots: TextureSlots::NONE,
            ..LoadOptions::ALL
        };
        let triangles = load_with(spec, &without_images)?.scene.triangle_count();
        self.triangles.insert(scene.to_owned(), triangles);
        Ok(triangles)
    }
}

/// Whether the capture's trace exists, is whole, and was made by its recipe.
fn is_done(capture: &Capture, folder: &Path) -> bool {
    let Ok(recipe) = read_regular(&folder.join(capture.recipe_file())) else {
        return false;
    };
    // Reading traces takes long, and the arguments of most unfinished captures differ already.
    let first = recipe.split(|byte| *byte == b'\n').next();
    let same = first == Some(capture.recipe().as_bytes());
    let checksum = || content_checksum(&folder.join(&capture.file));
    same && checksum().is_ok_and(|sum| capture.recipe_text(sum).as_bytes() == recipe)
}

fn content_checksum(trace: &Path) -> anyhow::Result<u32> {
    check_regular(trace).with_context(|| trace.display().to_string())?;
    Ok(Trace::open(trace)?.content_checksum())
}

/// Checks a capture's arguments and its scene.
fn plan(capture: Capture, folder: &Path, scenes: &mut SceneSizes) -> anyhow::Result<Planned> {
    let trace = folder.join(&capture.file);
    let place = || format!("[[captures]] {}: {}", capture.table, capture.recipe());
    let words = ["tracegen"]
        .into_iter()
        .chain(capture.arguments.iter().map(String::as_str));
    let parsed = Cli::try_parse_from(words.chain(["-o", "trace"])).map_err(|error| {
        let text = error.to_string();
        let first = text.lines().next().unwrap_or_default();
        anyhow::anyhow!("{}", first.trim_start_matches("error: "))
    });
    let (scene, pixels, per_triangle) = match parsed.with_context(place)?.command {
        Command::Raster(args) => (
            args.scene.scene.to_string(),
            args.pixels(),
            PIXELS_PER_TRIANGLE,
        ),
        Command::Rays(args) => (
            args.scene.scene.to_string(),
            args.samples(),
            SAMPLES_PER_TRIANGLE,
        ),
        _ => bail!("{}: expected a capture", place()),
    };
    let triangles = scenes.triangles(&scene).with_context(place)?;
    let cost = pixels.with_context(place)? + per_triangle * triangles;
    Ok(Planned {
        done: false,
        cost,
        trace,
        capture,
    })
}

fn of_shard(planned: &[Planned], shard: Shard) -> std::ops::Range<usize> {
    let pieces: Vec<Piece> = planned
        .iter()
        .map(|p| Piece {
            cost: p.cost,
            set: 0,
        })
        .collect();
    balanced(&pieces, &[0], shard.count)[shard.number as usize - 1].clone()
}

fn plan_text(planned: &[Planned], json: bool) -> anyhow::Result<String> {
    if !json {
        let line = |p: &Planned| format!("{}: {}", p.capture.file, p.capture.recipe());
        return Ok(planned.iter().map(line).collect::<Vec<_>>().join("\n"));
    }
    let captures = planned.iter().map(|p| PlannedCapture {
        file: &p.capture.file,
        recipe: p.capture.recipe(),
        cost: p.cost,
        done: p.done,
    });
    Ok(serde_json::to_string(&PlanDocument {
        schema: PLAN_SCHEMA,
        tool: super::tool(),
        captures: captures.collect(),
    })?)
}

/// Makes the missing captures. Each runs in its own process, so it has the driver to itself and its trace
/// equals that of the same command line.
fn capture_all(args: &SweepArgs, planned: &[Planned]) -> anyhow::Result<()> {
    let place = || args.output.display().to_string();
    shell::check_folder("--output", &args.output)?;
    std::fs::create_dir_all(&args.output).with_context(place)?;
    let outputs: Vec<Output> = planned
        .iter()
        .flat_map(|p| [p.trace.clone(), args.output.join(p.capture.recipe_file())])
        .map(|path| Output::binary("--output", &path))
        .collect();
    shell::check_outputs(&outputs, [args.manifest.as_path()])?;
    let program = std::env::current_exe().context("the program's own path")?;
    let folder = folder_of(&args.manifest);
    let open: Vec<&Planned> = planned.iter().filter(|p| !p.done).collect();
    let progress = Progress::new("capturing", open.len() as u64, "traces");
    let mut failed = Vec::new();
    for p in &open {
        let recipe = args.output.join(p.capture.recipe_file());
        // A recipe exists only beside the trace that it made.
        if recipe.exists() {
            std::fs::remove_file(&recipe).with_context(|| recipe.display().to_string())?;
        }
        let mut process = Process::new(&program);
        process.args(&p.capture.arguments).arg("--quiet");
        process.arg("-o").arg(std::path::absolute(&p.trace)?);
        if let Some(threads) = args.threads.count {
            process.args(["--threads", &threads.to_string()]);
        }
        process.current_dir(folder).stdin(Stdio::null());
        // The result of each capture is in its trace.
        process.stdout(Stdio::null());
        let status = shell::run_child(&mut process);
        if status.context("the program itself")?.success() {
            let text = p.capture.recipe_text(content_checksum(&p.trace)?);
            shell::write_file(&recipe, text)?;
        } else {
            failed.push(p.capture.file.as_str());
        }
        progress.advance(1);
    }
    drop(progress);
    // Unfinished files that cannot be removed are harmless, because they are never read.
    let _left = remove_abandoned(&args.output, ABANDONED_AFTER);
    ensure!(
        failed.is_empty(),
        "{} of {} captures failed: {}",
        failed.len(),
        planned.len(),
        failed.join(", ")
    );
    shell::note(&format!(
        "{} captures: {} made, {} there with the same recipe",
        planned.len(),
        open.len(),
        planned.len() - open.len()
    ));
    Ok(())
}

fn slurm_script(args: &SweepArgs, shards: u32) -> anyhow::Result<String> {
    let program = std::env::current_exe().context("the program's own path")?;
    let name = args.manifest.file_stem().unwrap_or_default();
    let array = SlurmArray {
        name: &name.to_string_lossy(),
        shards,
        cpus: args.threads.count,
        needs: None,
        command: vec![
            shell::absolute(&program)?,
            "sweep".to_owned(),
            shell::absolute(&args.manifest)?,
            "--output".to_owned(),
            shell::absolute(&args.output)?,
        ],
        then: Vec::new(),
    };
    Ok(array.script())
}
