//! `tracegen techniques`.

use super::cache_args::CacheArgs;
use super::capture_steps::{self, warn_of_multiview_defect};
use super::lens_args::LensArgs;
use super::objective_args::ObjectiveArgs;
use super::path_args::PathArgs;
use super::prepared::{Preparation, Prepared, prepare};
use super::scene_args::{SceneArgs, SceneSetup};
use super::values::encoding_parser;
use crate::study::auto::{AutoRecord, Budget, Objective, choose};
use crate::study::folder::{self, Folder, Manifest, RowRecord};
use crate::study::frames;
use crate::study::measure::Bench;
use crate::study::rows::Row;
use crate::study::timing::Extent;
use crate::study::world::World;
use ::raster::lavapipe::device::{self, Gpu};
use anyhow::{Context, ensure};
use clap::Args;
use formats::technique_study::SCHEMA;
use formats::text::name_of;
use formats::textrace::Encoding;
use image_error::PIXELS_PER_DEGREE;
use scene::LoadOptions;
use shell::{Progress, Threads, note};
use std::collections::HashMap;
use std::path::PathBuf;
use xxhash_rust::xxh3::xxh3_64;

/// Default eye size, without `--size` and `--hmd`: half the default display's.
const SIZE_PX: [u32; 2] = [480, 540];
/// Memory for raw records.
const RECORD_BUDGET: u64 = 128 << 20;

/// Name under which errors and counts of searches are stored.
const SEEN: &str = "seen-by-searches";

/// Arguments of `tracegen techniques`.
#[derive(Args, Debug)]
pub struct TechniquesArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Folder to write: a manifest, pictures and traces. Results of an earlier run of the same study in this
    /// folder are kept.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Techniques, alone or joined by `+`, separated by commas; the baseline is always measured
    /// [default: all, and combinations].
    #[arg(long, value_name = "LIST")]
    only: Option<String>,
    /// Frames to measure: pairs of consecutive ones, spread over the path.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = super::path_args::frame_count())]
    frames: u32,
    #[command(flatten)]
    path: PathArgs,
    /// Frames of the path.
    #[arg(long, value_name = "N", default_value_t = 72, help_heading = "Camera",
          value_parser = super::path_args::frame_count())]
    path_frames: u32,
    /// Measured frames that go into each technique's trace.
    #[arg(long, value_name = "N", default_value_t = 1)]
    trace_frames: u32,
    /// How the tiles of the traces are packed.
    #[arg(long, value_parser = encoding_parser(), default_value = "delta", value_name = "NAME")]
    encoding: Encoding,
    /// Repetitions of each frame's timing; the baseline is timed alternately.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeats: u32,
    #[command(flatten)]
    lens: LensArgs,
    /// Light the scene through 4 shadow cascades of 2048x2048.
    #[arg(long)]
    shadows: bool,
    /// Device to render on: a part of its name [default: Mesa's software driver]. A device that cannot
    /// capture is timed, without traces and counts of fragments.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Also search for the best combination under a budget, and measure it: `flip=ERROR` (mean FLIP inside
    /// the lens) or `pixels=PX` choose the least cost within that error in every frame of the path;
    /// `budget-ms=MS` chooses the least error whose median frame time on this device stays within the budget.
    #[arg(long, value_name = "BUDGET")]
    auto: Option<Budget>,
    #[command(flatten)]
    objective: ObjectiveArgs,
    #[command(flatten)]
    cache: CacheArgs,
    #[command(flatten)]
    threads: Threads,
}

/// Runs `tracegen techniques`.
///
/// # Errors
/// Unreadable input, no driver, or a folder that cannot be written.
pub fn run(args: &TechniquesArgs) -> anyhow::Result<()> {
    capture_steps::prepare_environment(args.threads.count);
    args.threads.start()?;
    let rows = match &args.only {
        Some(list) => Row::parse_list(list).context("--only")?,
        None => Row::all(),
    };
    folder::check(&args.output, &args.inputs())?;
    let objective = args.objective.of(args.auto)?;
    ensure!(
        args.frames <= args.path_frames,
        "--frames: expected at most {}, the frames of the path, found {}",
        args.path_frames,
        args.frames
    );
    let gpu = device::open(args.adapter.as_deref())?;
    let progress = Progress::new("loading the scene", 0, "");
    let setup = args.scene.setup(
        Some(SIZE_PX),
        &args.path,
        0..args.path_frames,
        &LoadOptions::ALL,
    )?;
    folder::check(&args.output, &setup.inputs)?;
    progress.stage("preparing textures and shaders", 0, "");
    let captures = gpu.no_capture.is_none();
    if let Some(what) = &gpu.no_capture {
        shell::warn(&format!(
            "{} lacks {what}: no traces, no counts of fragments",
            gpu.adapter
        ));
    }
    let mut manifest = args.manifest(&setup, &gpu)?;
    let Prepared {
        mut world,
        mut backend,
    } = prepare(
        Preparation {
            scene: &args.scene.scene,
            lens: manifest.lens,
            shadows: args.shadows,
            record_budget: RECORD_BUDGET,
            cache: args.cache,
        },
        setup,
        gpu,
    )?;
    let rows = args.possible(rows, &world)?;
    let folder = Folder::create(&args.output, &manifest)?;
    let extent = args.extent();
    let mut bench = Bench {
        world: &mut world,
        backend: &mut backend,
        captures,
        extent: &extent,
        encoding: args.encoding,
        truth: HashMap::new(),
        folder: &folder,
        progress: &progress,
    };
    manifest.rows = measure(&mut bench, &rows)?;
    let auto = args
        .auto
        .map(|budget| measure_auto(&mut bench, budget, objective))
        .transpose()?;
    drop(progress);
    manifest.auto = auto.map(|(record, row)| {
        manifest.rows.push(row);
        record
    });
    if manifest.rows.iter().any(|row| row.settings.multiview) {
        manifest.multiview_defect = warn_of_multiview_defect(&mut backend)?;
    }
    let path = folder.finish(&manifest)?;
    if (manifest.rows.iter())
        .flat_map(|row| &row.frames)
        .all(|frame| frame.fragments == Some(0))
    {
        shell::warn("no frame shows anything of the scene: choose another --camera");
    }
    let mut text = format!("{}: {} rows", path.display(), manifest.rows.len());
    if let Some(auto) = &manifest.auto {
        text += &format!(
            "\n--auto {} --objective {}: {}",
            auto.budget,
            objective.name(),
            auto.reason
        );
    }
    shell::print(&text)
}

/// Measures the rows that have no stored result, in their order.
fn measure(bench: &mut Bench<'_>, rows: &[Row]) -> anyhow::Result<Vec<RowRecord>> {
    let mut records: Vec<_> = (rows.iter())
        .map(|row| bench.folder.finished(&row.name, &row.settings))
        .collect();
    let open = records.iter().filter(|record| record.is_none()).count();
    if open < rows.len() {
        note(&format!(
            "{} of {} rows were there already",
            rows.len() - open,
            rows.len()
        ));
    }
    bench
        .progress
        .stage("measuring", open as u64 * bench.extent.steps(), "frames");
    for (row, record) in rows.iter().zip(&mut records) {
        if record.is_none() {
            let planner = bench.world.planner(&row.settings)?;
            let measured = bench
                .measure(row, |_| &planner)
                .with_context(|| row.name.clone())?;
            bench.folder.keep(&measured)?;
            *record = Some(measured);
        }
    }
    Ok(records.into_iter().flatten().collect())
}

/// Chooses under a budget and measures the choice, unless its result is stored.
fn measure_auto(
    bench: &mut Bench<'_>,
    budget: Budget,
    objective: Objective,
) -> anyhow::Result<(AutoRecord, RowRecord)> {
    let budget_name = budget.to_string().replace('=', "-");
    let name = format!("auto-{budget_name}-{}", objective.name());
    let question = (budget, objective);
    let kept: Option<(AutoRecord, RowRecord)> = bench.folder.kept(&name, &question);
    if let Some(kept) = kept.filter(|(_, row)| bench.folder.is_whole(row)) {
        return Ok(kept);
    }
    // On the frames that the table shows.
    let runs = bench.extent.runs.clone();
    let choice = choose(
        bench.world,
        bench.backend,
        runs,
        budget,
        objective,
        bench.folder.kept(SEEN, &"frames").unwrap_or_default(),
        bench.progress,
    )?;
    bench.folder.write_kept(SEEN, &"frames", &choice.known)?;
    let (held, planners) = (&choice.held, choice.planners(bench.world)?);
    let chosen = &held.chain[0];
    let row = Row {
        title: format!("Least {} for {budget}: {}", objective.name(), chosen.title),
        name: name.clone(),
        ..chosen.clone()
    };
    let steps = bench.extent.steps();
    bench
        .progress
        .stage("measuring what was chosen", steps, "frames");
    let measured = bench.measure(&row, |frame| &planners[held.of_frame[frame as usize]])?;
    let kept = (choice.record, measured);
    bench.folder.write_kept(&name, &question, &kept)?;
    Ok(kept)
}

impl TechniquesArgs {
    /// The manifest before the measurements: scene, path, display and device.
    fn manifest(&self, setup: &SceneSetup, gpu: &Gpu) -> anyhow::Result<Manifest> {
        let pixels_per_degree =
            image_error::pixels_per_degree(setup.hmd.eye_size_px[0], &setup.hmd.fov[0]);
        ensure!(
            PIXELS_PER_DEGREE.contains(&pixels_per_degree),
            "--size: expected {} to {} pixels per degree, which image errors belong to, found {pixels_per_degree}",
            PIXELS_PER_DEGREE.start(),
            PIXELS_PER_DEGREE.end()
        );
        let extent = self.extent();
        let trace_frames = match gpu.no_capture {
            None => extent.trace_frames.clone(),
            Some(_) => Vec::new(),
        };
        Ok(Manifest {
            schema: SCHEMA.to_owned(),
            tool: super::tool(),
            scene: self.scene.scene.to_string(),
            scene_triangles: setup.scene.triangle_count(),
            instances: setup.scene.instances.len() as u64,
            camera: setup.camera.name.clone(),
            path: Some(self.path.path.to_string()),
            path_frames: self.path_frames,
            frames: extent.frames(),
            // As given: f64::from would write 59.94 as 59.939998626708984.
            fps: self.path.fps.to_string().parse()?,
            time_s: self.scene.pose.time,
            animation: self.scene.pose.animation.clone(),
            size_px: setup.hmd.eye_size_px,
            hmd: setup.hmd.clone(),
            lens: self.lens.lenses(&setup.hmd)?,
            pixels_per_degree,
            adapter: gpu.adapter.clone(),
            driver: gpu.driver.clone(),
            software_driver: gpu.is_software,
            baseline: Row::baseline().name,
            repeats: self.repeats,
            trace_frames,
            trace_encoding: name_of(&self.encoding),
            shadow_cascades: capture_steps::cascades(&setup.scene, self.shadows),
            input_checksum: checksum(&setup.inputs)?,
            rows: Vec::new(),
            auto: None,
            multiview_defect: None,
        })
    }

    /// The rows that are possible with the display and the path. Impossible rows are an error if the user
    /// named them.
    fn possible(&self, rows: Vec<Row>, world: &World) -> anyhow::Result<Vec<Row>> {
        let mut possible = Vec::new();
        for row in rows {
            match world.check(&row.settings) {
                Ok(()) => possible.push(row),
                Err(error) if self.only.is_some() => return Err(error.context(row.name)),
                Err(error) => shell::warn(&format!("{} is left out: {error}", row.name)),
            }
        }
        Ok(possible)
    }

    /// Files that the study reads.
    fn inputs(&self) -> Vec<PathBuf> {
        let scene = self.scene.scene.path();
        // Names of built-in scenes have no extension and are not files.
        let scene = scene.extension().map(|_| scene.to_owned());
        scene.into_iter().chain(self.path.file()).collect()
    }

    fn extent(&self) -> Extent {
        let runs = frames::runs(self.frames, self.path_frames);
        let trace_frames = runs
            .concat()
            .into_iter()
            .take(self.trace_frames as usize)
            .collect();
        Extent {
            runs,
            trace_frames,
            repeats: self.repeats,
        }
    }
}

/// Checksum of the files' bytes, one after the other.
fn checksum(files: &[PathBuf]) -> anyhow::Result<String> {
    let mut sums = Vec::new();
    for file in files {
        // A scene may refer to an image that no material uses and that does not exist.
        let bytes = match std::fs::metadata(file) {
            Ok(found) if found.is_file() => {
                std::fs::read(file).with_context(|| file.display().to_string())?
            }
            Ok(_) | Err(_) => Vec::new(),
        };
        sums.extend(xxh3_64(&bytes).to_le_bytes());
    }
    Ok(format!("{:016x}", xxh3_64(&sums)))
}
