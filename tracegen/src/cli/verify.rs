//! `tracegen verify`.

use super::cache_args::CacheArgs;
use super::capture_steps::{cascades, prepare_environment, tables};
use super::path_args::PathArgs;
use super::prepared::world;
use super::scene_args::SceneArgs;
use super::verified_trace::{look_as, refuse_partial, trace_cascades};
use anyhow::{Context, ensure};
use clap::Args;
use formats::footprint::LodFormula;
use formats::text::json_text;
use formats::textrace::{Pass, Tables, Textrace, TextraceWriter};
use formats::view::{Eye, Lens};
use lab::verify::frame::{CaptureUnderTest, FrameUnderTest, TileChoice, Verified};
use lab::verify::report::Report;
use raster::backend::Texels;
use raster::capture::CaptureJob;
use raster::frame::Frame;
use raster::lavapipe::{Lavapipe, device};
use record::Recorder;
use scene::{LoadOptions, TextureSlot, TextureSlots};
use shell::{Output, Progress, Threads, note};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;
use techniques::{Settings, Skips};
use textures::TextureSet;

/// Memory for raw records.
const RECORD_BUDGET_BYTES: u64 = 128 << 20;

/// Largest number of failures that are printed one by one.
const MOST_FAILURES: usize = 20;

/// Arguments of `tracegen verify`.
#[derive(Args, Debug)]
pub struct VerifyArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Verify this capture of the scene instead of a new one: its first frame, or every frame if nothing of the
    /// scene moves. Camera and display are taken from the trace.
    #[arg(long, value_name = "FILE.textrace",
          conflicts_with_all = ["camera", "eye", "vfov", "hmd", "size", "hfov", "fov_tangents", "ipd", "cant", "shadows"])]
    trace: Option<PathBuf>,
    /// Light the scene through 4 shadow cascades of 2048x2048.
    #[arg(long)]
    shadows: bool,
    /// Tiles to verify, sampled from both views: a number, or `all`.
    #[arg(long, value_name = "N|all", default_value = "all", value_parser = parse_tiles)]
    tiles: Tiles,
    /// Seed of the sample of tiles.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Also filter every visible texel in software, according to its record, and compare it with the driver's
    /// result.
    #[arg(long)]
    colour: bool,
    /// Formula of the level of detail [default: softpipe for traces of softpipe, else llvmpipe].
    #[arg(long, value_name = "FORMULA", value_parser = parse_formula)]
    lod: Option<LodFormula>,
    /// Write what the reference would have captured, for `replay`; requires all tiles.
    #[arg(long, value_name = "FILE.textrace")]
    write_reference: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    cache: CacheArgs,
    #[command(flatten)]
    threads: Threads,
}

/// `--tiles`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tiles {
    All,
    Some(usize),
}

fn parse_tiles(text: &str) -> Result<Tiles, String> {
    match text {
        "all" => Ok(Tiles::All),
        _ => (text.parse().ok().filter(|count| *count > 0))
            .map(Tiles::Some)
            .ok_or_else(|| format!("expected 'all' or a number of at least 1, found '{text}'")),
    }
}

fn parse_formula(text: &str) -> Result<LodFormula, String> {
    match text {
        "llvmpipe" => Ok(LodFormula::Llvmpipe),
        "softpipe" => Ok(LodFormula::Softpipe),
        "exact" => Ok(LodFormula::Exact),
        _ => Err(format!(
            "expected llvmpipe, softpipe or exact, found '{text}'"
        )),
    }
}

/// Runs `tracegen verify`: exit code 1 if a difference has no known cause.
///
/// # Errors
/// Unreadable input, no driver where one is needed, or a file that cannot be written.
pub fn run(args: &VerifyArgs) -> anyhow::Result<ExitCode> {
    prepare_environment(args.threads.count);
    filter_in_single_precision();
    args.threads.start()?;
    let outputs = args.outputs()?;
    let started = Instant::now();
    let cache = args.cache.open()?;
    let existing = args.trace.as_deref().map(Textrace::open).transpose()?;
    let progress = Progress::new("loading the scene", 0, "");
    let mut setup = (args.scene).setup(None, &PathArgs::still(), 0..1, &LoadOptions::ALL)?;
    setup.check_outputs(&outputs)?;
    let mut shadow_cascades = cascades(&setup.scene, args.shadows);
    let mut shadows_are_known = true;
    if let (Some(trace), Some(file)) = (&existing, &args.trace) {
        refuse_partial(trace)?;
        shadows_are_known = look_as(trace, file, &mut setup)?;
        shadow_cascades = trace_cascades(trace);
    }
    let lens = setup.hmd.fov.map(|fov| Lens::of(&fov));
    let mut world = world(setup, shadow_cascades, lens)?;
    let time_s = world.moments.scene_time_s(0);
    world.draws.pose(&world.scene, time_s as f32);
    let planner = world.planner(&Settings::default())?;
    let job = CaptureJob {
        skips: Skips::default(),
        ..world.job(&planner)
    };
    progress.stage("preparing textures", 0, "");
    let mut finest = Vec::new();
    let planned = (world.views.iter())
        .map(|views| job.frame_and_levels(views, &mut finest))
        .collect::<Result<Vec<_>, _>>()?;
    let textures = TextureSet::prepare(&world.scene, |image| finest[image], cache.as_ref())?;
    let mut backend = match existing.is_none() || args.colour {
        true => Some(Lavapipe::new(
            device::open(None)?,
            &world.scene,
            &world.draws,
            &textures,
            world.hmd.eye_size_px,
            RECORD_BUDGET_BYTES,
        )?),
        false => None,
    };
    progress.stage("capturing", 0, "");
    let trace = match (existing, &mut backend) {
        (None, Some(backend)) => {
            let tables = tables(&world, &args.scene.scene, &textures, backend, job.fragments);
            capture(&job, &planned[0], tables, backend)?
        }
        (Some(trace), _) => trace,
        (None, None) => unreachable!("a driver is opened where there is no trace"),
    };
    let frames: Vec<_> = (world.views.iter().zip(&planned))
        .map(|(views, frame)| FrameUnderTest {
            views: views.clone(),
            cascades: shadows_are_known.then(|| frame.lighting.cascades.clone()),
        })
        .collect();
    let subject = CaptureUnderTest {
        trace: &trace,
        scene: &world.scene,
        draws: &world.draws,
        textures: &textures,
        frames: &frames,
    };
    subject.check()?;
    let texels = match (&mut backend, args.colour) {
        (Some(backend), true) => texels(&job, &planned[0], &subject, backend)?,
        _ => Vec::new(),
    };
    progress.stage("verifying", 0, "");
    let captured = started.elapsed();
    let formula = args
        .lod
        .unwrap_or_else(|| formula_of(&trace.tables().meta.driver));
    let verified = subject.verify(
        args.choice(),
        formula,
        &texels,
        args.write_reference.is_some(),
    )?;
    drop(progress);
    if let Some(file) = &args.write_reference {
        write_reference(file, &subject, &verified)?;
    }
    note(&format!(
        "verified in {:.2} s, after {:.2} s for the scene and the capture",
        (started.elapsed() - captured).as_secs_f64(),
        captured.as_secs_f64()
    ));
    let seed = (args.tiles != Tiles::All).then_some(args.seed);
    let report = Report::new(&args.scene.scene, trace.tables(), &verified, seed);
    print(&report, args.json)
}

/// Prints a report, and its failures on stderr.
fn print(report: &Report, json: bool) -> anyhow::Result<ExitCode> {
    if json {
        shell::print(&json_text(report)?)?;
    } else {
        shell::print(&report.table())?;
    }
    let failures = report.failures();
    for failure in failures.iter().take(MOST_FAILURES) {
        shell::error(failure);
    }
    if failures.len() > MOST_FAILURES {
        let more = failures.len() - MOST_FAILURES;
        shell::error(&format!("and {more} more, which --json lists"));
    }
    match failures.is_empty() {
        true => Ok(ExitCode::SUCCESS),
        false => Ok(ExitCode::FAILURE),
    }
}

impl VerifyArgs {
    fn choice(&self) -> TileChoice {
        match self.tiles {
            Tiles::All => TileChoice::All,
            Tiles::Some(count) => TileChoice::Some {
                count,
                seed: self.seed,
            },
        }
    }

    /// The outputs of the command, checked as far as the arguments allow.
    fn outputs(&self) -> anyhow::Result<Vec<Output>> {
        let Some(file) = &self.write_reference else {
            return Ok(Vec::new());
        };
        ensure!(
            self.tiles == Tiles::All,
            "--write-reference: expected --tiles all, found a sample: a trace holds every tile"
        );
        let outputs = vec![Output::binary("--write-reference", file)];
        shell::check_outputs(&outputs, self.trace.as_deref())?;
        self.scene.check_outputs(&PathArgs::still(), &outputs)?;
        Ok(outputs)
    }
}

/// llvmpipe filters some formats in 8 bits by default, which is not what is verified.
fn filter_in_single_precision() {
    if std::env::var_os("GALLIVM_PERF").is_none() {
        // SAFETY: as in `prepare_environment`: no thread reads the environment meanwhile.
        unsafe { std::env::set_var("GALLIVM_PERF", "no_aos_sampling") }
    }
}

/// Formula of the level of detail of a driver.
fn formula_of(driver: &str) -> LodFormula {
    if driver.contains("softpipe") {
        LodFormula::Softpipe
    } else {
        LodFormula::Llvmpipe
    }
}

fn capture(
    job: &CaptureJob<'_>,
    frame: &Frame,
    mut tables: Tables,
    backend: &mut Lavapipe,
) -> anyhow::Result<Textrace> {
    tables.passes = frame.plan.passes(frame.number);
    job.light(backend, frame)?;
    let writer = TextraceWriter::in_memory(&tables)?;
    let mut recorder = Recorder::new(writer, job.draws.replays(job.fragments));
    job.capture_frame(backend, frame, &mut recorder)?;
    Ok(Textrace::from_bytes(recorder.into_writer()?.into_bytes()?)?)
}

/// The driver's texels, by pass of the trace's first frame and by slot.
fn texels(
    job: &CaptureJob<'_>,
    frame: &Frame,
    subject: &CaptureUnderTest<'_>,
    backend: &mut Lavapipe,
) -> anyhow::Result<Vec<Vec<(TextureSlot, Texels)>>> {
    let textures = job.scene.materials.iter().flat_map(|m| m.textures.iter());
    let slots: Vec<TextureSlot> = textures.map(|(slot, _)| slot).collect();
    let used = TextureSlots::of(&slots);
    let of_pass = |eye: Eye| {
        let view = (frame.views())
            .find(|view| view.layer.eye == Some(eye))
            .context("a layer an eye")?;
        let slots = TextureSlot::ALL
            .into_iter()
            .filter(|slot| used.contains(*slot));
        slots
            .map(|slot| Ok((slot, backend.texels(job.draws, &view, slot)?)))
            .collect::<anyhow::Result<Vec<_>>>()
    };
    let of_first = |(_, _, eye, frame): (usize, &Pass, Eye, usize)| (frame == 0).then_some(eye);
    let eyes = subject.passes().into_iter().map_while(of_first);
    eyes.map(of_pass).collect()
}

fn write_reference(
    file: &Path,
    subject: &CaptureUnderTest<'_>,
    verified: &Verified,
) -> anyhow::Result<()> {
    let mut tables = subject.trace.tables().clone();
    let is_verified = |frame: u32| subject.frames.iter().any(|f| f.views.frame == frame);
    tables.passes.retain(|pass| is_verified(pass.frame));
    tables.meta.frames.retain(|views| is_verified(views.frame));
    tables.meta.tool = super::tool();
    tables.meta.backend = "reference".into();
    tables.meta.driver = "double precision".into();
    let mut writer = TextraceWriter::create(file, &tables)?;
    for (pass, tiles) in verified.reference.iter().enumerate() {
        for (number, tile) in tiles.iter().enumerate() {
            writer.append(pass, number, tile.clone())?;
        }
    }
    writer.finish()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_a_number_or_all() {
        assert_eq!(parse_tiles("all"), Ok(Tiles::All));
        assert_eq!(parse_tiles("12"), Ok(Tiles::Some(12)));
        for bad in ["0", "-1", "some", ""] {
            assert!(
                parse_tiles(bad).unwrap_err().contains("'all' or a number"),
                "{bad}"
            );
        }
    }
}
