//! `tracegen raster` with the techniques of its options: plans, prepares, captures, compares and prints.

use super::capture_steps::{
    TraceOutput, cascades, load, no_maps, prepare_textures, tables, warn_of_multiview_defect,
};
use super::drivers::Opened;
use super::prepared::world;
use super::raster_args::RasterArgs;
use super::raster_summary::{DoubtfulTriangles, Summary, worked_since};
use super::scene_args::SceneSetup;
use crate::study::processor;
use crate::study::world::World;
use anyhow::ensure;
use formats::texture::TexelFormat;
use raster::backend::{CaptureBackend, Fragments};
use raster::capture::{CaptureJob, CapturedFrame, Pictures};
use raster::frame::Frame;
use shell::{Output, Progress, note};
use std::collections::BTreeSet;
use std::time::{Duration, Instant};
use techniques::{Planner, Skips};
use textures::{TextureSet, alpha_tested};

/// What is captured of a scene.
pub(super) struct Session<'a> {
    args: &'a RasterArgs,
    pub(super) world: World,
    planner: Planner,
}

/// A frame as it is rendered without capture.
struct PlainFrame {
    pictures: Pictures,
    /// Depth per view, where captures are compared by depth.
    depths: Option<Vec<Vec<f32>>>,
}

/// Captures the frames of a path. Returns what was recorded.
///
/// # Errors
/// Unreadable input, no driver, or a file that cannot be written.
pub fn run(args: &RasterArgs, outputs: &[Output]) -> anyhow::Result<String> {
    let started = Instant::now();
    let cache = args.cache.open()?;
    let progress = Progress::new("loading the scene", 0, "");
    let setup = load(args, outputs)?;
    let loaded = started.elapsed();
    progress.stage("preparing textures and shaders", 0, "");
    let mut session = Session::new(args, setup)?;
    let (mut planned, finest) = session.plan()?;
    let searched = started.elapsed();
    let scene = &session.world.scene;
    // Records are of coordinates, so only alpha tests read texels.
    let read = match session.reads_texels() {
        true => vec![true; scene.images.len()],
        false => alpha_tested(scene),
    };
    let finest = |image: usize| finest[image].filter(|_| read[image]);
    let textures = prepare_textures(scene, finest, cache.as_ref())?;
    let textured = started.elapsed();
    let mut opened = session.open_driver(&textures)?;
    let backend = opened.backend.as_mut();
    let mut tables = tables(
        &session.world,
        &args.scene.scene,
        &textures,
        backend,
        args.hsr,
    );
    tables.meta.warm_frames = args.chosen().map_or_else(Vec::new, |chosen| chosen.warm());
    tables.passes = (planned.iter())
        .flat_map(|frame| frame.plan.passes(frame.number))
        .collect();
    let texels = texels_note(&textures, session.reads_texels(), searched - loaded);
    let counts = [textures.textures.len(), textures.cached, textures.unseen()];
    drop(textures);
    let mut summary = Summary::default();
    session.prepare(backend, &mut planned[0], &mut summary)?;
    if !args.no_plain {
        session.job().warm_up(backend, &planned[0])?;
    }
    if session.planner.settings().multiview {
        warn_of_multiview_defect(backend)?;
    }
    let ready = started.elapsed();
    let scene = format!(
        "{}, camera {}",
        &*args.scene.scene, session.world.camera.name
    );
    note_ready(&scene, counts, [loaded, textured, ready]);
    let frames = planned.len();
    progress.stage("capturing", frames as u64, "frames");
    let mut output = TraceOutput::create(args, &tables, &session.world)?;
    let mut first_pictures: Option<Pictures> = None;
    for (position, mut frame) in planned.into_iter().enumerate() {
        session.pose(backend, position, &mut summary)?;
        if position > 0 {
            session.prepare(backend, &mut frame, &mut summary)?;
        }
        let pictures = session.draw(backend, &frame, &mut output, &mut summary)?;
        first_pictures = first_pictures.or(pictures);
        progress.advance(1);
    }
    drop(progress);
    let world = &session.world;
    let size_px = world.hmd.eye_size_px;
    let start = Instant::now();
    let file_bytes = output.finish(first_pictures.as_ref(), size_px)?;
    summary.captured += start.elapsed();
    if summary.counts.fragments == 0 {
        super::scene_args::warn_of_nothing_seen(&world.camera, world.bounds, world.scene.origin);
    }
    warn_of_few_pixels(summary.covered, &world.camera.name);
    if let Some(doubtful) = &summary.doubtful {
        let per_frame = summary.counts.fragments / frames as u64;
        doubtful.warn(&world.scene, per_frame);
    }
    note(&texels);
    let views = [frames, args.views.len()];
    let result = summary.result(views, size_px, file_bytes);
    summary.print(frames, &backend.work());
    Ok(result)
}

impl<'a> Session<'a> {
    pub(super) fn new(args: &'a RasterArgs, mut setup: SceneSetup) -> anyhow::Result<Self> {
        if let Some(chosen) = args.chosen() {
            setup
                .frames
                .retain(|views| chosen.captured.contains(&views.frame));
        }
        let lens = args.techniques.lens.lenses(&setup.hmd)?;
        let cascades = cascades(&setup.scene, args.shadows);
        ensure!(
            cascades > 0 || args.shadow_format == TexelFormat::R32f,
            no_maps(&args.scene.scene)
        );
        let mut world = world(setup, cascades, lens)?;
        world.draws.shadow_format = args.shadow_format;
        let settings = args.techniques.settings(&world.hmd)?;
        let planner = Planner::new(&settings, &world.hmd, world.lens, args.views, args.path.fps)?;
        Ok(Self {
            args,
            world,
            planner,
        })
    }

    /// What to capture of the draws where they are.
    pub(super) fn job(&self) -> CaptureJob<'_> {
        let args = self.args;
        CaptureJob {
            skips: Skips::without(&args.no_skip),
            fragments: args.hsr,
            // Both views at once leave no depth to compare.
            shaded: args.shade
                || self.planner.settings().multiview
                || args.no_plain && args.image.is_some(),
            ..self.world.job(&self.planner)
        }
    }

    /// Whether all texels are prepared: for a picture, with capture or without, or because nothing is skipped.
    fn reads_texels(&self) -> bool {
        let job = self.job();
        !self.args.no_plain || job.shaded || !job.skips.images
    }

    /// Plans all frames: their layers and draws, and the finest level of each image that they sample. Draws
    /// are where they start afterwards.
    fn plan(&mut self) -> anyhow::Result<(Vec<Frame>, Vec<Option<u32>>)> {
        let (mut planned, mut finest) = (Vec::new(), Vec::new());
        for position in 0..self.world.views.len() {
            // The layers of a frame depend on where its draws are.
            self.world.pose(self.world.views[position].frame)?;
            let views = &self.world.views[position];
            planned.push(self.job().frame_and_levels(views, &mut finest)?);
        }
        self.world.pose(self.world.views[0].frame)?;
        Ok((planned, finest))
    }

    /// Opens the driver and prints what it replaces or lacks.
    fn open_driver(&self, textures: &TextureSet) -> anyhow::Result<Opened> {
        let world = &self.world;
        let size_px = world.hmd.eye_size_px;
        let budget = self.args.record_budget;
        let driver = self.args.backend;
        let opened = driver.open(&world.scene, &world.draws, textures, size_px, budget)?;
        let backend = &opened.backend;
        if let Some(reason) = &opened.instead_of {
            shell::warn(&format!("{reason}; {} captures instead", backend.name()));
        }
        if backend.name() == "osmesa" {
            self.args.check_plain_frames()?;
        }
        if let Some(lacks) = backend.records_fragments_because() {
            note(&format!(
                "{} lacks {lacks}: fragments are recorded one by one and merged into quads",
                backend.driver()
            ));
        }
        Ok(opened)
    }

    /// Removes the draws of a frame that others hide and renders its shadow maps.
    fn prepare(
        &self,
        backend: &mut dyn CaptureBackend,
        frame: &mut Frame,
        summary: &mut Summary,
    ) -> anyhow::Result<()> {
        let job = self.job();
        summary.occlude(&job, backend, frame)?;
        Ok(summary.light(&job, backend, frame)?)
    }

    /// Poses the scene for a frame of the path. Looks for doubtful triangles in the first.
    fn pose(
        &mut self,
        backend: &mut dyn CaptureBackend,
        position: usize,
        summary: &mut Summary,
    ) -> anyhow::Result<()> {
        self.world.pose(self.world.views[position].frame)?;
        let world = &self.world;
        backend.pose(&world.scene, &world.draws);
        if summary.doubtful.is_none() {
            let doubtful = summary.doubtful.insert(DoubtfulTriangles::default());
            for eye in self.args.views {
                doubtful.look(world, &world.views[position].eyes[*eye as usize]);
            }
        }
        Ok(())
    }

    /// Captures a prepared frame. Returns its pictures if any were drawn.
    fn draw(
        &self,
        backend: &mut dyn CaptureBackend,
        frame: &Frame,
        output: &mut TraceOutput<'_>,
        summary: &mut Summary,
    ) -> anyhow::Result<Option<Pictures>> {
        let job = self.job();
        let plain = match self.args.no_plain {
            true => None,
            false => Some(render_plain(&job, backend, frame, summary)?),
        };
        let captured = capture(&job, backend, frame, output, summary)?;
        let has_depth =
            job.fragments == Fragments::DepthTested && !job.planner.settings().multiview;
        if summary.covered.is_none() && has_depth {
            summary.covered = Some(covered(frame, &job.depths(backend, frame)?));
        }
        let Some(plain) = plain else {
            return Ok(captured.pictures);
        };
        let compared = match (&captured.pictures, &plain.depths) {
            (Some(drawn), _) => Some(("pictures", *drawn == plain.pictures)),
            (_, Some(depths)) => Some(("depths", job.depths(backend, frame)? == *depths)),
            _ => None,
        };
        if let Some((what, same)) = compared {
            ensure!(
                same,
                "frame {}: {what} with and without capture differ: the capture disturbed the rendering",
                frame.number
            );
            summary.compared = Some(what);
        }
        Ok(Some(plain.pictures))
    }
}

/// Share of the pictures' pixels that something covers, from the depths of a frame's layers.
fn covered(frame: &Frame, depths: &[Vec<f32>]) -> f64 {
    let pictures = (depths.iter().enumerate()).filter(|(layer, _)| frame.plan.is_picture(*layer));
    let (mut drawn, mut all) = (0, 0);
    for (_, depth) in pictures {
        drawn += depth.iter().filter(|depth| **depth > 0.0).count();
        all += depth.len();
    }
    drawn as f64 / all.max(1) as f64
}

/// Share of the pixels below which a view shows little of a scene.
const FEW: f64 = 0.5;

/// Warns of a first frame that is mostly background; its caches see little.
fn warn_of_few_pixels(covered: Option<f64>, camera: &str) {
    let Some(share) = covered.filter(|share| *share > 0.0 && *share < FEW) else {
        return;
    };
    shell::warn(&format!(
        "the scene covers {:.1} % of the pixels of the first frame (camera {camera}), so that few texels are read \
         more than once: choose a nearer --camera or --eye and --target, or views around by --cameras auto:8",
        100.0 * share
    ));
}

fn render_plain(
    job: &CaptureJob<'_>,
    backend: &mut dyn CaptureBackend,
    frame: &Frame,
    summary: &mut Summary,
) -> anyhow::Result<PlainFrame> {
    let (worked, before) = (processor::time(), backend.work());
    let (pictures, time) = job.plain_frame(backend, frame)?;
    summary.plain += time;
    summary.plain_draws.add(before, backend.work());
    summary.plain_work += worked_since(worked);
    // A capture that draws no picture has only its depth in common with the plain frame.
    let compares_depth = !job.shaded && job.fragments == Fragments::DepthTested;
    let depths = compares_depth.then(|| job.depths(backend, frame));
    Ok(PlainFrame {
        pictures,
        depths: depths.transpose()?,
    })
}

fn capture(
    job: &CaptureJob<'_>,
    backend: &mut dyn CaptureBackend,
    frame: &Frame,
    output: &mut TraceOutput<'_>,
    summary: &mut Summary,
) -> anyhow::Result<CapturedFrame> {
    let (start, worked, before) = (Instant::now(), processor::time(), backend.work());
    let captured = job.capture_frame(backend, frame, &mut output.recorder)?;
    summary.capture_draws.add(before, backend.work());
    summary.sorting += captured.sorting;
    summary.captured += start.elapsed();
    summary.captured_work += worked_since(worked);
    summary.counts += captured.counts;
    summary.predicted.push(frame.plan.predicted);
    Ok(captured)
}

/// Says which texels were prepared and which left out.
fn texels_note(textures: &TextureSet, reads_texels: bool, searched: Duration) -> String {
    let mib = |bytes: usize| bytes as f64 / f64::from(1 << 20);
    let formats: BTreeSet<String> = (textures.textures.iter())
        .map(|texture| format!("{:?}", texture.texture.format).to_uppercase())
        .collect();
    let formats: Vec<String> = formats.into_iter().collect();
    let why = match reads_texels {
        true => "that no view samples",
        false => "that no alpha test reads",
    };
    format!(
        "{:.1} MiB of texels in {}; {:.1} MiB {why} skipped: {} images, and the finest levels of {} others (found in {:.2} s)",
        mib(textures.bytes()),
        formats.join(", "),
        mib(textures.skipped_bytes()),
        textures.unseen(),
        textures.shortened(),
        searched.as_secs_f64()
    )
}

/// Prints how long the preparation took, from the times at which its steps ended.
fn note_ready(
    scene: &str,
    [textures, cached, unseen]: [usize; 3],
    [loaded, textured, ready]: [Duration; 3],
) {
    note(&format!(
        "{scene}: ready in {:.2} s (scene {:.2} s; textures {:.2} s: {} compressed, {cached} from the cache, {unseen} seen by no view; driver {:.2} s)",
        ready.as_secs_f64(),
        loaded.as_secs_f64(),
        (textured - loaded).as_secs_f64(),
        textures - cached - unseen,
        (ready - textured).as_secs_f64(),
    ));
}
