//! `tracegen raster`.

use super::cache_args::CacheArgs;
use super::objective_args::ObjectiveArgs;
use super::path_args::{PathArgs, frame_count};
use super::raster_auto::Techniques;
use super::raster_summary::{Summary, worked_since};
use super::scene_args::{SceneArgs, SceneSetup, capture_outputs};
use super::technique_args::TechniqueArgs;
use crate::doubtful::Doubtful;
use crate::picture;
use crate::study::auto::{Budget, Schedule};
use crate::study::processor;
use anyhow::{Context, bail, ensure};
use clap::{Args, ValueEnum};
use formats::textrace::{Encoding, Pass, Tables, TextraceWriter, TraceMeta};
use formats::view::Eye;
use raster::backend::{CaptureBackend, Fragments};
use raster::capture::{CaptureJob, Pictures};
use raster::draws::DrawList;
use raster::drivers::Driver;
use raster::geometry::geometry;
use raster::lighting::Lighting;
use scene::{LoadOptions, Scene};
use shell::{Progress, Threads, lasting_arguments, note};
use std::path::{Path, PathBuf};
use std::time::Instant;
use techniques::skips::Skip;
use techniques::{Planner, Skips};
use textures::TextureSet;

/// Cascades that `--shadows` adds (Z2 paper section 4.1).
const CASCADES: u32 = 4;

/// Arguments of `tracegen raster`.
#[derive(Args, Debug)]
pub struct RasterArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Trace to write.
    #[arg(short, long, value_name = "FILE.textrace")]
    pub(super) output: PathBuf,
    /// Picture of all views side by side.
    #[arg(long, value_name = "FILE.png")]
    pub(super) image: Option<PathBuf>,
    #[command(flatten)]
    pub(super) path: PathArgs,
    /// Frames along the path.
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Camera",
          value_parser = frame_count())]
    pub(super) frames: u32,
    /// Light the scene through 4 shadow cascades of 2048x2048.
    #[arg(long)]
    pub(super) shadows: bool,
    /// Views of each frame.
    #[arg(long, value_enum, default_value_t = Views::Stereo, help_heading = "Camera")]
    views: Views,
    /// Driver that captures; osmesa captures plain frames alone, without techniques.
    #[arg(long, value_enum, default_value_t = Backend::Lavapipe, value_name = "NAME")]
    backend: Backend,
    /// Skip the render without capture that times and depths are compared with.
    #[arg(long)]
    no_plain: bool,
    /// Draw the picture while capturing, too, and compare it with the plain one.
    #[arg(long)]
    shade: bool,
    /// Hidden-surface removal of the renderer whose texture accesses are captured.
    #[arg(long, value_enum, default_value_t = Hsr::EarlyZ)]
    hsr: Hsr,
    /// Memory for raw records; a frame that needs more is captured in parts. The driver's limit is
    /// 128MiB.
    #[arg(long, value_name = "SIZE", default_value = "128MiB", value_parser = parse_bytes)]
    pub(super) record_budget: u64,
    /// How the trace's tiles are packed.
    #[arg(long, value_enum, default_value_t = TileEncoding::Delta, value_name = "NAME")]
    pub(super) encoding: TileEncoding,
    /// Add what vertex processing reads and the primitives that enter each tile, for `replay run --frame`.
    #[arg(long)]
    pub(super) geometry: bool,
    /// Draw or prepare what nobody sees, too: images, mip-levels, cascades, regions or all of
    /// them. Pictures and trace stay the same.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    no_skip: Vec<Skip>,
    /// Choose the techniques under a budget, for each frame: `flip=ERROR` (mean FLIP inside the
    /// lens, 0 for lossless ones alone) or `pixels=PX` for those of least cost inside it, `budget-ms=MS` for the least
    /// error whose median frame takes no longer.
    #[arg(long, value_name = "BUDGET", help_heading = "Techniques",
          conflicts_with_all = ["cull", "occlusion", "multiview", "hidden_area_mask", "hidden_area_mesh",
                                "cull_distance", "cull_px", "far_field", "foveate",
                                "views", "no_plain", "shade", "no_skip"])]
    auto: Option<Budget>,
    #[command(flatten)]
    objective: ObjectiveArgs,
    /// Render with techniques by name: `TECHNIQUE`, those of `tracegen techniques --only`, joined by `+`, then those of
    /// single frames, `,FRAME:TECHNIQUE` or `,FIRST-LAST:TECHNIQUE`. What `--auto` chose can be captured again so.
    #[arg(long, value_name = "TECHNIQUE", help_heading = "Techniques",
          conflicts_with_all = ["auto", "cull", "occlusion", "multiview", "hidden_area_mask", "far_field", "foveate",
                                "views", "no_plain", "shade", "no_skip"])]
    technique: Option<Schedule>,
    #[command(flatten)]
    pub(super) techniques: TechniqueArgs,
    #[command(flatten)]
    pub(super) cache: CacheArgs,
    #[command(flatten)]
    threads: Threads,
}

impl RasterArgs {
    /// Pixels of all frames, as far as they can be told without the scene.
    ///
    /// # Errors
    /// A display that cannot be.
    pub(super) fn pixels(&self) -> anyhow::Result<u64> {
        let [width, height] = self
            .scene
            .hmd
            .resolve(None, None)?
            .eye_size_px
            .map(u64::from);
        let views = self.views.eyes().len() as u64;
        Ok(width * height * views * u64::from(self.frames))
    }
}

/// Drivers that capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Backend {
    /// Mesa's Vulkan driver on the processor.
    Lavapipe,
    /// OpenGL without a window, through llvmpipe or (GALLIUM_DRIVER=softpipe) softpipe.
    Osmesa,
    /// lavapipe where it is found, else OSMesa.
    Auto,
}

impl Backend {
    fn driver(self) -> Driver {
        match self {
            Self::Lavapipe => Driver::Lavapipe,
            Self::Osmesa => Driver::Osmesa,
            Self::Auto => Driver::Auto,
        }
    }
}

/// Tile encodings by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum TileEncoding {
    /// Bit-packed differences.
    Delta,
    /// A plane for each primitive: about 0.5 of the size, slower to read and to write.
    Planes,
}

impl TileEncoding {
    pub(super) fn encoding(self) -> Encoding {
        match self {
            Self::Delta => Encoding::Delta,
            Self::Planes => Encoding::Planes,
        }
    }
}

/// Views of a frame.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Views {
    /// Both eyes, left before right.
    Stereo,
    /// The left eye alone.
    Left,
    /// The right eye alone.
    Right,
}

/// Hidden-surface removal while fragments are recorded; the words of `replay run --hsr`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Hsr {
    /// Every fragment that a draw covers, whatever lies before it; for `replay run --hsr none`.
    None,
    /// Fragments that pass the depth test when they are drawn; for `--hsr early-z` and `deferred`.
    EarlyZ,
}

impl Hsr {
    fn fragments(self) -> Fragments {
        match self {
            Self::None => Fragments::All,
            Self::EarlyZ => Fragments::DepthTested,
        }
    }
}

impl Views {
    fn eyes(self) -> &'static [Eye] {
        match self {
            Self::Stereo => &[Eye::Left, Eye::Right],
            Self::Left => &[Eye::Left],
            Self::Right => &[Eye::Right],
        }
    }
}

/// Says that both views are not drawn at once, and why.
pub(super) fn warn_of_multiview(defect: &str) {
    shell::warn(&format!(
        "multiview cannot be trusted, so views are drawn one by one: {defect}"
    ));
}

impl RasterArgs {
    /// Refuses what the OSMesa backend does not do.
    fn check_plain_frames(&self) -> anyhow::Result<()> {
        let auto = self.auto.map(|_| "--auto");
        let named = self.technique.as_ref().map(|_| "--technique");
        if let Some(flag) = auto
            .or(named)
            .or_else(|| self.techniques.beyond_plain_frames())
        {
            bail!(
                "{flag}: expected with --backend lavapipe, found with osmesa, which captures plain frames alone"
            );
        }
        Ok(())
    }

    /// Refuses what leaves fragments out by depth, or is measured with the depth test.
    fn check_without_depth_test(&self) -> anyhow::Result<()> {
        ensure!(
            !self.techniques.has_far_field(),
            "--hsr none: expected every fragment to be drawn, found --far-field, whose layers hold only what the depth of others leaves open"
        );
        ensure!(
            self.auto.is_none(),
            "--hsr none: expected techniques by their own options, found --auto, which measures frames with the depth test"
        );
        ensure!(
            self.technique.is_none(),
            "--hsr none: expected techniques by their own options, found --technique, which captures with the depth test"
        );
        Ok(())
    }
}

/// Runs `tracegen raster`.
///
/// # Errors
/// Unreadable input, no driver, or a file that cannot be written.
pub fn run(args: &RasterArgs) -> anyhow::Result<()> {
    prepare_environment(args.threads.count);
    args.threads.start()?;
    let outputs = capture_outputs(&args.output, args.image.as_deref());
    args.scene.check_outputs(&args.path, &outputs)?;
    shell::check_outputs(
        &outputs,
        args.techniques.inputs().iter().map(PathBuf::as_path),
    )?;
    if args.hsr == Hsr::None {
        args.check_without_depth_test()?;
    }
    if args.backend == Backend::Osmesa {
        args.check_plain_frames()?;
    }
    let objective = args.objective.of(args.auto)?;
    let chosen = args
        .auto
        .map(|budget| Techniques::Chosen(budget, objective));
    let named = args
        .technique
        .clone()
        .map(|named| Techniques::Named(Box::new(named)));
    if let Some(techniques) = chosen.or(named) {
        return super::raster_auto::run(args, &techniques, &outputs);
    }
    let started = Instant::now();
    let cache = args.cache.open()?;
    let progress = Progress::new("loading the scene", 0, "");
    let setup = args
        .scene
        .setup(None, &args.path, 0..args.frames, &LoadOptions::ALL)?;
    setup.check_outputs(&outputs)?;
    let loaded = started.elapsed();
    let cascades = cascades(&setup.scene, args.shadows);
    progress.stage("preparing textures and shaders", 0, "");
    let mut draws = DrawList::new(&setup.scene, cascades)?;
    let size_px = setup.hmd.eye_size_px;
    let bounds = setup.scene.bounds().unwrap_or_default();
    let planner = Planner::new(
        &args.techniques.settings(&setup.hmd)?,
        &setup.hmd,
        args.techniques.lens.lenses(&setup.hmd)?,
        args.views.eyes(),
        args.path.fps,
    )?;
    let (mut passes, mut finest) = (Vec::new(), Vec::new());
    for views in &setup.frames {
        // What moves decides what a frame's layers are.
        draws.pose(&setup.scene, setup.moments.time_s(views.frame));
        let job = self::job(args, &setup, &draws, &planner, bounds);
        passes.extend(job.passes(views)?);
        job.add_finest_levels(views, &mut finest)?;
    }
    draws.pose(
        &setup.scene,
        setup.moments.time_s(setup.moments.frames.start),
    );
    let job = job(args, &setup, &draws, &planner, bounds);
    let searched = started.elapsed();
    let uploads = TextureSet::prepare(&setup.scene, |image| finest[image], cache.as_ref())?;
    let textured = started.elapsed();
    for note in &uploads.notes {
        shell::warn(note);
    }
    let driver = args.backend.driver();
    let mut opened = driver.open(&setup.scene, &draws, &uploads, size_px, args.record_budget)?;
    let backend = opened.backend.as_mut();
    if let Some(reason) = &opened.instead_of {
        shell::warn(&format!("{reason}; {} captures instead", backend.name()));
    }
    if backend.name() == "osmesa" {
        args.check_plain_frames()?;
    }
    if let Some(lacks) = backend.records_fragments_because() {
        note(&format!(
            "{} lacks {lacks}: fragments are recorded one by one and merged into quads",
            backend.driver()
        ));
    }
    let tables = tables(
        &setup,
        &args.scene.scene,
        &draws,
        &uploads,
        backend,
        passes,
        job.fragments,
    );
    let (total, cached, unseen) = (uploads.textures.len(), uploads.cached, uploads.unseen());
    let texels = format!(
        "{:.1} MiB of texels, {:.1} MiB left out ({unseen} images and the finest levels of {} that no view samples, found in {:.2} s)",
        mib(uploads.bytes()),
        mib(uploads.skipped_bytes()),
        uploads.shortened(),
        (searched - loaded).as_secs_f64()
    );
    drop(uploads);
    let mut summary = Summary::default();
    let first = summary.look(&job, backend, &setup.frames[0])?;
    summary.light(&job, backend, &first)?;
    if !args.no_plain {
        job.warm_up(backend, &first)?;
    }
    if planner.settings().multiview
        && let Some(defect) = backend.multiview_defect()?
    {
        warn_of_multiview(&defect);
    }
    let mut first = Some(first);
    let mut recorder = job.recorder(&tables);
    let ready = started.elapsed();
    note(&format!(
        "{}: ready in {:.2} s (scene {:.2} s; textures {:.2} s: {} compressed, {cached} from the cache, {unseen} seen by no view; driver {:.2} s)",
        args.scene.scene,
        ready.as_secs_f64(),
        loaded.as_secs_f64(),
        (textured - loaded).as_secs_f64(),
        total - cached - unseen,
        (ready - textured).as_secs_f64(),
    ));
    progress.stage("capturing", setup.frames.len() as u64, "frames");

    let writer = TextraceWriter::create(&args.output, &tables)?;
    let mut writer = writer.with_encoding(args.encoding.encoding());
    if args.geometry {
        writer = writer.with_geometry(geometry(&setup.scene, &draws))?;
    }
    let mut first_pictures: Option<Pictures> = None;
    let mut first_pass = 0;
    for views in &setup.frames {
        let time_s = setup.moments.time_s(views.frame);
        draws.pose(&setup.scene, time_s);
        backend.pose(&draws);
        if summary.doubtful.is_none() {
            let doubtful = summary.doubtful.insert(Doubtful::default());
            for eye in planner.eyes() {
                doubtful.look(&setup.scene, &draws, &views.eyes[*eye as usize], size_px);
            }
        }
        let job = self::job(args, &setup, &draws, &planner, bounds);
        let frame = match first.take() {
            Some(first) => first,
            None => {
                let frame = summary.look(&job, backend, views)?;
                summary.light(&job, backend, &frame)?;
                frame
            }
        };
        // Without a picture, what the capture shares with the plain render is depth.
        let compares_depth = !job.shaded && job.fragments == Fragments::DepthTested;
        let mut plain = None;
        if !args.no_plain {
            let (worked, before) = (processor::time(), backend.work());
            let (pictures, time) = job.plain_frame(backend, &frame)?;
            summary.plain += time;
            summary.plain_draws.add(before, backend.work());
            summary.plain_work += worked_since(worked);
            let depths = compares_depth.then(|| job.depths(backend, &frame));
            plain = Some((pictures, depths.transpose()?));
        }
        let (start, worked, before) = (Instant::now(), processor::time(), backend.work());
        let captured =
            job.capture_frame(backend, &frame, first_pass, &mut recorder, &mut writer)?;
        summary.capture_draws.add(before, backend.work());
        first_pass += frame.plan.layers.len();
        summary.sorting += captured.sorting;
        summary.captured += start.elapsed();
        summary.captured_work += worked_since(worked);
        summary.counts += captured.counts;
        summary.predicted.push(frame.plan.predicted);
        let mut pictures = captured.pictures;
        if let Some((plain, depths)) = plain {
            let what = match (&pictures, depths) {
                (Some(drawn), _) => Some(("pictures", *drawn == plain)),
                (_, Some(depths)) => Some(("depths", job.depths(backend, &frame)? == depths)),
                _ => None,
            };
            if let Some((what, same)) = what {
                ensure!(
                    same,
                    "frame {}: {what} with and without capture differ: the capture disturbed the rendering",
                    views.frame
                );
                summary.compared = Some(what);
            }
            pictures = Some(plain);
        }
        first_pictures = first_pictures.or(pictures);
        progress.advance(1);
    }
    drop(progress);
    let cannot_write = |path: &Path| format!("cannot write {}", path.display());
    let image = match (&args.image, &first_pictures) {
        (Some(path), Some(pictures)) => {
            let prepared = picture::prepare_side_by_side(path, pictures, size_px)
                .with_context(|| cannot_write(path))?;
            Some((path, prepared))
        }
        _ => None,
    };
    let start = Instant::now();
    let file_bytes = writer.finish()?;
    summary.captured += start.elapsed();
    if let Some((path, prepared)) = image {
        prepared.persist().with_context(|| cannot_write(path))?;
    }
    if summary.counts.fragments == 0 {
        super::scene_args::warn_of_nothing_seen(&setup.camera, bounds, setup.scene.origin);
    }
    let of_a_frame = summary.counts.fragments / setup.frames.len().max(1) as u64;
    let doubtful = summary.doubtful.unwrap_or_default();
    for warning in doubtful.warnings(&setup.scene, of_a_frame) {
        shell::warn(&warning);
    }
    let views = [setup.frames.len(), planner.eyes().len()];
    note(&texels);
    summary.print(views, size_px, file_bytes, &backend.work());
    Ok(())
}

/// What to capture of the draws where they stand.
fn job<'a>(
    args: &RasterArgs,
    setup: &'a SceneSetup,
    draws: &'a DrawList,
    planner: &'a Planner,
    bounds: (glam::Vec3, glam::Vec3),
) -> CaptureJob<'a> {
    CaptureJob {
        scene: &setup.scene,
        draws,
        lighting: Lighting::new(&setup.scene),
        bounds,
        shadow_range_m: shadow_range_m(setup, bounds),
        planner,
        skips: Skips::without(&args.no_skip),
        fragments: args.hsr.fragments(),
        // Both views at once leave no depth to compare.
        shaded: args.shade || planner.settings().multiview || args.no_plain && args.image.is_some(),
    }
}

/// Shadow cascades of a scene, or those that `--shadows` adds.
pub(super) fn cascades(scene: &Scene, shadows: bool) -> u32 {
    if shadows {
        CASCADES
    } else {
        scene.shadow_cascades.min(CASCADES)
    }
}

/// Near and far end of the cascades: from the near plane to where the scene ends.
pub(super) fn shadow_range_m(setup: &SceneSetup, (lo, hi): (glam::Vec3, glam::Vec3)) -> [f32; 2] {
    let farthest = (setup.camera.eye - lo)
        .abs()
        .max((setup.camera.eye - hi).abs())
        .length();
    // What is nearer than 5 cm needs no shadows of its own, nor a twentieth of a smaller scene.
    let near = setup.camera.near.max(farthest.min(1.0) * 0.05);
    [near, farthest.min(setup.camera.far).max(2.0 * near)]
}

/// The tables of a trace of the scene's frames, of which `fragments` are recorded.
pub(super) fn tables(
    setup: &SceneSetup,
    spec: &str,
    draws: &DrawList,
    uploads: &TextureSet,
    backend: &dyn CaptureBackend,
    passes: Vec<Pass>,
    fragments: Fragments,
) -> Tables {
    let textures = draws.textures(uploads);
    let (samplers, draw_table) = draws.tables(&setup.scene, uploads, &textures);
    Tables {
        meta: TraceMeta {
            tool: super::tool(),
            command_line: lasting_arguments(std::env::args_os().skip(1)),
            scene: spec.into(),
            scene_triangles: setup.scene.triangle_count(),
            camera: setup.camera.name.clone(),
            backend: backend.name().into(),
            driver: backend.driver().into(),
            seed: 0,
            hmd: setup.hmd.clone(),
            frames: setup.frames.clone(),
            surfaces: Some(draws.surfaces(fragments)),
            origin_m: setup.scene.origin.to_array(),
            techniques: None,
            program: None,
        },
        textures,
        samplers,
        draws: draw_table,
        passes,
    }
}

/// Bytes in MiB.
fn mib(bytes: usize) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

/// Sets what Mesa reads from the environment.
pub(super) fn prepare_environment(threads: Option<u16>) {
    // SAFETY: the only other thread waits for signals; nothing reads the environment meanwhile.
    unsafe {
        // Mesa's device selection asks a display server, in vain and aloud where there is none.
        std::env::set_var("NODEVICE_SELECT", "1");
        // At narrow vectors Mesa 22.3 corrupts memory where the processor has AVX2, and on some that have AVX.
        let set = |name: &str| std::env::var_os(name);
        if set("LP_NATIVE_VECTOR_WIDTH").is_some_and(|bits| bits == "128")
            && set("GALLIUM_OVERRIDE_CPU_CAPS").is_none()
        {
            std::env::set_var("GALLIUM_OVERRIDE_CPU_CAPS", "sse4.1");
        }
        // softpipe has all that the capture needs of OpenGL 4.5, as extensions of 3.3.
        if set("GALLIUM_DRIVER").is_some_and(|driver| driver == "softpipe") {
            std::env::set_var("MESA_GL_VERSION_OVERRIDE", "4.5");
            std::env::set_var("MESA_GLSL_VERSION_OVERRIDE", "450");
        }
        if let Some(threads) = threads {
            std::env::set_var("LP_NUM_THREADS", threads.to_string());
        }
    }
}

/// Bytes with an optional binary suffix: `64MiB`, `512KiB`, `1GiB`, `4096`.
pub(super) fn parse_bytes(text: &str) -> Result<u64, String> {
    let digits = text
        .find(|c: char| !c.is_ascii_digit())
        .unwrap_or(text.len());
    let (number, suffix) = text.split_at(digits);
    let shift = match suffix {
        "" | "B" => Some(0),
        "KiB" => Some(10),
        "MiB" => Some(20),
        "GiB" => Some(30),
        _ => None,
    };
    shift
        .and_then(|shift| number.parse::<u64>().ok()?.checked_mul(1 << shift))
        .filter(|bytes| *bytes >= 4096)
        .ok_or_else(|| format!("expected at least 4KiB as in 64MiB or 1048576, found '{text}'"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_take_binary_suffixes() {
        assert_eq!(parse_bytes("64MiB"), Ok(64 << 20));
        assert_eq!(parse_bytes("65536"), Ok(65536));
        for bad in ["", "MiB", "1", "64MB", "-4MiB", "99999999999999999999GiB"] {
            assert!(parse_bytes(bad).is_err(), "{bad}");
        }
    }
}
