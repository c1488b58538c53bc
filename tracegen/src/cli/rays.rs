//! `tracegen rays`.

use super::cache_args::CacheArgs;
use super::capture_cache::cached;
use super::choice::choice;
use super::light_args::LightArgs;
use super::path_args::PathArgs;
use super::scene_args::{SceneArgs, SceneSetup, capture_outputs};
use anyhow::{Context, bail, ensure};
use clap::builder::TypedValueParser;
use clap::{ArgAction, Args};
use formats::container::AtomicFile;
use formats::raytrace::{
    BvhSummary, ChildOrder, EyeCamera, RayKind, RaytraceMeta, RaytraceTables, RaytraceWriter,
    TraversalKind, UpdateMethod,
};
use formats::text::name_of;
use formats::textrace::TraceMeta;
use rays::bvh::TreeOptions;
use rays::frame::{RayFrame, trace_frame};
use rays::moved::{Moved, Pose};
use rays::picture;
use rays::scene::TraceScene;
use rays::tracer::TraceSettings;
use scene::paths::MAX_FRAMES;
use scene::paths::Moments;
use scene::{LoadOptions, Scene, SceneError};
use shell::{Output, Progress, Threads, cannot_write, lasting_arguments, note};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Default eye size, without `--size` and `--hmd`: together 2048x1024, as in the paper.
const DEFAULT_SIZE_PX: [u32; 2] = [1024, 1024];

/// Arguments of `tracegen rays`.
#[derive(Args, Debug)]
pub struct RaysArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// The trace to write.
    #[arg(short, long, value_name = "FILE.raytrace")]
    output: PathBuf,
    #[command(flatten)]
    path: PathArgs,
    /// Number of the frame of the path that is traced.
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Camera",
          value_parser = clap::value_parser!(u32).range(0..i64::from(MAX_FRAMES)))]
    frame: u32,
    /// Also write both eyes' pictures, side by side.
    #[arg(long, value_name = "FILE.png")]
    image: Option<PathBuf>,
    /// Levels of reflection and refraction.
    #[arg(long, value_name = "N", default_value_t = 3,
          value_parser = clap::value_parser!(u32).range(0..=i64::from(formats::raytrace::tables::MAX_DEPTH)))]
    depth: u32,
    /// Samples per pixel.
    #[arg(long, value_name = "N", default_value_t = 1,
          value_parser = clap::value_parser!(u32).range(1..=i64::from(formats::raytrace::tables::MAX_SAMPLES_PER_PX)))]
    spp: u32,
    /// Record every node and triangle that each ray visits, for cache models (large).
    #[arg(long)]
    visits: bool,
    /// Record each ray's origin, direction, limits, hit and stack depth.
    #[arg(long)]
    geometry: bool,
    /// Record the hierarchy: boxes and children of its nodes, and its triangles.
    #[arg(long)]
    hierarchy: bool,
    /// Record all optional columns: --visits, --geometry and --hierarchy.
    #[arg(long)]
    all_columns: bool,
    /// Tree that rays traverse; steps of bvh2 are counted as in T&I unit 2.0.
    #[arg(long, value_parser = bvh_parser(), default_value = "bvh2")]
    bvh: TraversalKind,
    /// Lay the nodes out in treelets of this size; without it, depth first.
    #[arg(long, value_name = "BYTES", value_parser = clap::value_parser!(u32).range(256..=1 << 20))]
    treelets: Option<u32>,
    /// Visit a node's children in this order. Other orders than `nearest` imply --visits and are slower.
    #[arg(long, action = ArgAction::Set, value_parser = choice([
        ("nearest", ChildOrder::Nearest, "The nearest child first"),
        ("node", ChildOrder::Node, "As the node lists them; boxes are tested only before they go onto the stack"),
        ("inner-first", ChildOrder::InnerFirst, "As `node`, but leaves after inner children, from the stack"),
    ]), default_value = "nearest", value_name = "ORDER", conflicts_with = "instances")]
    child_order: ChildOrder,
    /// Build one tree for each mesh that the scene repeats, and one over its instances: same hits, less memory.
    #[arg(long, conflicts_with_all = ["hierarchy", "all_columns"])]
    instances: bool,
    /// How the tree follows a scene that moves, from frame 0 on; the trace states the work of the update from the
    /// frame before [default: each frame has a new tree, and the trace states no update].
    #[arg(long, value_name = "HOW", value_parser = update_parser())]
    bvh_update: Option<UpdateMethod>,
    #[command(flatten)]
    light: LightArgs,
    #[command(flatten)]
    cache: CacheArgs,
    #[command(flatten)]
    threads: Threads,
}

fn bvh_parser() -> impl TypedValueParser<Value = TraversalKind> {
    choice([
        (
            "bvh2",
            TraversalKind::Bvh2,
            "Binary: a step tests two boxes",
        ),
        ("bvh4", TraversalKind::Bvh4, "Four-wide: a step tests four"),
        (
            "bvh8",
            TraversalKind::Bvh8,
            "Eight-wide: a step tests eight",
        ),
        (
            "cwbvh8",
            TraversalKind::Cwbvh8,
            "Eight-wide, nodes of 80 bytes with quantised boxes",
        ),
    ])
}

fn update_parser() -> impl TypedValueParser<Value = UpdateMethod> {
    choice([
        (
            "rebuild",
            UpdateMethod::Rebuild,
            "Trees with a moved triangle are built anew",
        ),
        (
            "refit",
            UpdateMethod::Refit,
            "Trees keep the topology of frame 0; boxes around moved triangles move",
        ),
    ])
}

impl RaysArgs {
    /// Whether every visited node and triangle is recorded.
    fn visits(&self) -> bool {
        self.visits || self.all_columns || self.child_order != ChildOrder::Nearest
    }

    fn tree(&self) -> TreeOptions {
        TreeOptions {
            kind: self.bvh,
            treelet_bytes: self.treelets,
            child_order: self.child_order,
            instances: self.instances,
            refit: self.bvh_update == Some(UpdateMethod::Refit),
        }
    }

    /// Samples of both eyes, as far as they are known without the scene.
    ///
    /// # Errors
    /// An invalid display.
    pub(super) fn samples(&self) -> anyhow::Result<u64> {
        let hmd = self.scene.hmd.resolve(Some(DEFAULT_SIZE_PX), None)?;
        let [width, height] = hmd.eye_size_px.map(u64::from);
        Ok(2 * width * height * u64::from(self.spp))
    }
}

/// Runs `tracegen rays`.
///
/// # Errors
/// Unreadable input or wrong use.
pub fn run(args: &RaysArgs) -> anyhow::Result<()> {
    args.threads.start()?;
    let outputs = capture_outputs(&args.output, args.image.as_deref());
    args.scene.check_outputs(&args.path, &outputs)?;
    cached(args.cache.open_captures()?, &outputs, &[], || {
        capture(args, &outputs)
    })
}

/// Traces a frame. Returns the hierarchy and the numbers of rays, steps and tests.
fn capture(args: &RaysArgs, outputs: &[Output]) -> anyhow::Result<String> {
    let start = Instant::now();
    let progress = Progress::new("loading the scene", 0, "");
    let textures = LoadOptions {
        slots: args.light.texture_slots(),
        ..LoadOptions::ALL
    };
    let setup = {
        let frames = args.frame..args.frame + 1;
        (args.scene).setup(Some(DEFAULT_SIZE_PX), &args.path, frames, &textures)?
    };
    setup.check_outputs(outputs)?;
    let loaded = start.elapsed();
    progress.stage("building the hierarchy", 0, "");
    let (camera, bounds, world) = (
        setup.camera.clone(),
        setup.scene.bounds().unwrap_or_default(),
        setup.scene.origin,
    );
    let (scene, mut tables) = prepare(args, setup)?;
    let prepared = start.elapsed();
    progress.stage("tracing", 2 * u64::from(tables.tile_count()), "tiles");
    let (frame, writer) = trace(args, &scene, &mut tables, &progress)?;
    drop(progress);
    let traced = start.elapsed();
    // The picture is complete before the trace is renamed, so that a full disk leaves neither.
    let image = args.image.as_deref().map(|path| image_file(&frame, path));
    let image = image.transpose()?;
    let file_bytes = writer.finish(&tables)?;
    if let (Some(file), Some(path)) = (image, &args.image) {
        file.persist().with_context(|| cannot_write(path))?;
    }
    if frame.stats.hits == 0 {
        super::scene_args::warn_of_nothing_seen(&camera, bounds, world);
    }
    note_times(&frame, file_bytes, [loaded, prepared, traced]);
    Ok(result(&tables, &frame))
}

/// Builds the hierarchy and the tables of the trace.
fn prepare(args: &RaysArgs, setup: SceneSetup) -> anyhow::Result<(TraceScene, RaytraceTables)> {
    let SceneSetup {
        scene,
        camera,
        hmd,
        frames,
        moments,
        ..
    } = setup;
    let (scene_triangles, scene_origin) = (scene.triangle_count(), scene.origin);
    let (scene, bvh) = build(args, scene, &moments)?;
    let Some(views) = frames.first() else {
        bail!("the camera path has no frame");
    };
    let origin = scene.soup.origin.to_array();
    let eyes = std::array::from_fn(|e| {
        EyeCamera::new(&views.eyes[e], hmd.fov[e], hmd.eye_size_px, origin)
    });
    let meta = RaytraceMeta {
        trace: TraceMeta {
            tool: super::tool(),
            command_line: lasting_arguments(std::env::args_os().skip(1)),
            scene: args.scene.scene.to_string(),
            scene_triangles,
            camera: camera.name,
            backend: "rays".to_owned(),
            driver: name_of(&bvh.traversal),
            seed: args.light.seed,
            hmd,
            frames,
            origin_m: scene_origin.to_array(),
            ..TraceMeta::default()
        },
        origin: (scene_origin + scene.soup.origin).to_array(),
        eyes,
        max_depth: args.depth,
        samples_per_px: args.spp,
        has_visits: args.visits(),
        sky: [scene.sky.sky.to_array(), scene.sky.ground.to_array()],
        lighting: args.light.lighting(),
    };
    let tables = RaytraceTables {
        meta,
        bvh,
        materials: scene.materials.table(),
        lights: scene.lights.clone(),
        triangles: Vec::new(),
    };
    Ok((scene, tables))
}

/// The scene at the frame's time with its hierarchy, and the hierarchy's summary.
fn build(
    args: &RaysArgs,
    mut scene: Scene,
    moments: &Moments,
) -> anyhow::Result<(TraceScene, BvhSummary)> {
    let frame = moments.frames.start;
    // Motions displace the instances from where they are at time 0.
    let at_rest = scene.instances.clone();
    let pose = |scene: &mut Scene, frame| -> Result<(), SceneError> {
        scene.instances.clone_from(&at_rest);
        let time_s = moments.scene_time_s(frame);
        scene.animate(time_s)?;
        scene.pose(time_s as f32);
        Ok(())
    };
    let Some(method) = args.bvh_update else {
        pose(&mut scene, frame)?;
        let scene = TraceScene::with_tree(scene, args.tree())?;
        let bvh = scene.bvh.summary(args.bvh);
        return Ok((scene, bvh));
    };
    ensure!(
        scene.moves(),
        "--bvh-update: expected a scene that moves, found {} without motion or animation",
        &*args.scene.scene
    );
    let before = match frame.checked_sub(1) {
        Some(before) => {
            pose(&mut scene, before)?;
            Some(Pose::of(&scene))
        }
        None => None,
    };
    let is_refit = method == UpdateMethod::Refit && frame > 0;
    pose(&mut scene, if is_refit { 0 } else { frame })?;
    let mut scene = TraceScene::with_tree(scene, args.tree())?;
    if is_refit {
        scene.refit(|scene| pose(scene, frame))?;
    }
    let moved = Moved::since(before.as_ref(), &scene.scene);
    // Without a frame before, the update is the build.
    let method = if is_refit {
        method
    } else {
        UpdateMethod::Rebuild
    };
    let mut bvh = scene.bvh.summary(args.bvh);
    bvh.update = Some(scene.bvh.update(args.bvh, method, &moved));
    Ok((scene, bvh))
}

/// Traces the frame and writes its tiles; the writer lacks the tables.
fn trace(
    args: &RaysArgs,
    scene: &TraceScene,
    tables: &mut RaytraceTables,
    progress: &Progress,
) -> anyhow::Result<(RayFrame, RaytraceWriter)> {
    let settings = TraceSettings {
        max_depth: args.depth,
        samples_per_px: args.spp,
        visits: args.visits(),
        geometry: args.geometry || args.all_columns,
        traversal: tables.bvh.traversal,
        lighting: args.light.lighting(),
        seed: args.light.seed,
    };
    let mut writer = RaytraceWriter::create(&args.output)?;
    if args.hierarchy || args.all_columns {
        writer = writer.with_hierarchy(scene.bvh.contents(tables.bvh.traversal));
    }
    let mut frame = trace_frame(scene, settings, tables, &mut writer, |done| {
        progress.advance(done);
    })?;
    tables.triangles = std::mem::take(&mut frame.triangles);
    Ok((frame, writer))
}

fn image_file(frame: &RayFrame, path: &Path) -> anyhow::Result<AtomicFile> {
    let place = || cannot_write(path);
    let mut file = AtomicFile::create(path).with_context(place)?;
    picture::write_png(&frame.images, &mut file).with_context(place)?;
    Ok(file)
}

/// The hierarchy and the numbers of rays, steps and tests.
fn result(tables: &RaytraceTables, frame: &RayFrame) -> String {
    let (bvh, stats) = (&tables.bvh, &frame.stats);
    let rays = stats.total_rays();
    let kinds: Vec<_> = RayKind::ALL
        .map(|kind| (kind, stats.rays_of(kind)))
        .into_iter()
        .filter(|(kind, rays)| *rays > 0 || !kind.needs_lighting())
        .map(|(kind, rays)| format!("{rays} {kind}"))
        .collect();
    let per_ray = |n: u64| n as f64 / rays.max(1) as f64;
    let instances = bvh.instances.map(|of| format!("{} instances, ", of.count));
    let update = bvh.update.map(|of| format!("\nupdate by {of}"));
    format!(
        "hierarchy: {}, {}{} triangles, {} nodes, {} leaves, depth {}, SAH cost {:.2}\n\
         rays: {rays} ({}), {:.1} steps and {:.1} triangle tests a ray{}",
        bvh.builder,
        instances.unwrap_or_default(),
        bvh.triangles,
        bvh.nodes,
        bvh.leaves,
        bvh.depth,
        bvh.sah_cost,
        kinds.join(", "),
        per_ray(stats.steps),
        per_ray(stats.triangle_tests),
        update.unwrap_or_default(),
    )
}

/// Prints figures that vary from run to run.
fn note_times(frame: &RayFrame, bytes: u64, at: [Duration; 3]) {
    let [loaded, prepared, traced] = at.map(|t| t.as_secs_f64());
    let tracing = traced - prepared;
    note(&format!(
        "time: load {loaded:.2} s, build {:.2} s, trace and write {tracing:.2} s \
         ({:.2} Mray/s); {:.1} MB",
        prepared - loaded,
        frame.stats.total_rays() as f64 / tracing.max(1e-9) / 1e6,
        bytes as f64 / 1e6,
    ));
}
