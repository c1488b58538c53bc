//! `tracegen rays`.

use super::scene_args::{SceneArgs, SceneSetup};
use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use formats::container::AtomicFile;
use formats::raytrace::{
    EyeCamera, RayKind, RaytraceMeta, RaytraceTables, RaytraceWriter, TraversalKind,
};
use formats::textrace::TraceMeta;
use indicatif::{ProgressBar, ProgressStyle};
use rays::frame::{Frame, trace_frame};
use rays::picture;
use rays::scene::TraceScene;
use rays::tracer::TraceSettings;
use scene::LoadOptions;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Eye size where neither `--size` nor `--hmd` is given: together 2048x1024, as in the paper.
const DEFAULT_SIZE_PX: [u32; 2] = [1024, 1024];

/// Arguments of `tracegen rays`.
#[derive(Args, Debug)]
pub struct RaysArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// The trace to write.
    #[arg(short, long, value_name = "FILE.raytrace")]
    output: PathBuf,
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
    /// Tree that is walked; the steps of bvh2 are T&I unit 2.0's.
    #[arg(long, value_enum, default_value_t = Tree::Bvh2)]
    bvh: Tree,
    /// Threads [default: all cores]. The trace is the same for any number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

/// `--bvh`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Tree {
    /// Binary: a step tests two boxes.
    Bvh2,
    /// Eight-wide: a step tests eight.
    Bvh8,
}

/// Runs `tracegen rays`.
///
/// # Errors
/// Unreadable input or wrong use.
pub fn run(args: RaysArgs) -> anyhow::Result<()> {
    if args.scene.camera.frames > 1 {
        bail!(
            "--frames {}: a ray trace holds one frame",
            args.scene.camera.frames
        );
    }
    if args.image.as_ref() == Some(&args.output) {
        bail!(
            "--image and --output name the same file, {}",
            args.output.display()
        );
    }
    if let Some(threads) = args.threads {
        // The global pool serves scene loading and texture pyramids, too.
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads.into())
            .build_global()
            .context("cannot start the threads")?;
    }
    let start = Instant::now();
    let writer = RaytraceWriter::create(&args.output)?;
    let textures = LoadOptions {
        // Base colour, metallic-roughness and emissive: what rays look at.
        slots: [true, false, true, false, false, true],
    };
    let setup = args.scene.setup(Some(DEFAULT_SIZE_PX), &textures)?;
    let loaded = start.elapsed();
    let (scene, mut tables) = prepare(&args, setup)?;
    let prepared = start.elapsed();
    let frame = trace(&args, &scene, &mut tables, writer)?;
    let traced = start.elapsed();
    if let Some(path) = &args.image {
        write_image(&frame, path)?;
    }
    let bytes = std::fs::metadata(&args.output).map_or(0, |m| m.len());
    report(&tables, &frame, bytes, [loaded, prepared, traced]);
    Ok(())
}

/// Builds the hierarchy and everything of the trace but its tiles.
fn prepare(args: &RaysArgs, setup: SceneSetup) -> anyhow::Result<(TraceScene, RaytraceTables)> {
    let SceneSetup {
        scene,
        camera,
        hmd,
        frames,
    } = setup;
    let scene_triangles = scene.triangle_count();
    let scene = TraceScene::new(scene)?;
    let traversal = match args.bvh {
        Tree::Bvh2 => TraversalKind::Bvh2,
        Tree::Bvh8 => TraversalKind::Bvh8,
    };
    let bvh = scene.bvh.summary(traversal);
    let Some(views) = frames.first() else {
        bail!("the camera path has no frame");
    };
    let origin = scene.soup.origin.to_array();
    let eyes = std::array::from_fn(|e| {
        EyeCamera::new(&views.eyes[e], hmd.fov[e], hmd.eye_size_px, origin)
    });
    let meta = RaytraceMeta {
        trace: TraceMeta {
            tool: format!("tracegen {}", env!("CARGO_PKG_VERSION")),
            command_line: recorded_arguments(std::env::args().skip(1)),
            scene: args.scene.scene.clone(),
            scene_triangles,
            camera: camera.name,
            backend: "rays".to_owned(),
            driver: format!("{:?}", bvh.traversal).to_lowercase(),
            seed: 0,
            hmd,
            frames,
        },
        origin,
        eyes,
        max_depth: args.depth,
        samples_per_px: args.spp,
        has_visits: args.visits,
        sky: [scene.sky.sky.to_array(), scene.sky.ground.to_array()],
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

fn trace(
    args: &RaysArgs,
    scene: &TraceScene,
    tables: &mut RaytraceTables,
    mut writer: RaytraceWriter,
) -> anyhow::Result<Frame> {
    let settings = TraceSettings {
        max_depth: args.depth,
        samples_per_px: args.spp,
        visits: args.visits,
        traversal: tables.bvh.traversal,
    };
    // Drawn on terminals only.
    let bar = ProgressBar::new(2 * u64::from(tables.tile_count()));
    if let Ok(style) = ProgressStyle::with_template("tracing {wide_bar} {pos}/{len} tiles, {eta}") {
        bar.set_style(style);
    }
    let mut frame = trace_frame(scene, settings, tables, &mut writer, |done| bar.inc(done))?;
    bar.finish_and_clear();
    tables.triangles = std::mem::take(&mut frame.triangles);
    writer.finish(tables)?;
    Ok(frame)
}

fn write_image(frame: &Frame, path: &Path) -> anyhow::Result<()> {
    let place = || format!("cannot write {}", path.display());
    let mut file = AtomicFile::create(path).with_context(place)?;
    picture::write_png(&frame.images, &mut file).with_context(place)?;
    file.persist().with_context(place)
}

/// The figures of a trace, on stderr: they vary from run to run.
fn report(tables: &RaytraceTables, frame: &Frame, bytes: u64, at: [Duration; 3]) {
    let (bvh, stats) = (&tables.bvh, &frame.stats);
    let [loaded, prepared, traced] = at.map(|t| t.as_secs_f64());
    let rays = stats.total_rays();
    let per_ray = |n: u64| n as f64 / rays.max(1) as f64;
    anstream::eprintln!(
        "hierarchy: {}, {} triangles, {} nodes, {} leaves, depth {}, SAH cost {:.2}",
        bvh.builder,
        bvh.triangles,
        bvh.nodes,
        bvh.leaves,
        bvh.depth,
        bvh.sah_cost
    );
    anstream::eprintln!(
        "rays: {rays} ({} primary, {} shadow, {} reflection, {} refraction), \
         {:.1} steps and {:.1} triangle tests a ray",
        stats.rays_of(RayKind::Primary),
        stats.rays_of(RayKind::Shadow),
        stats.rays_of(RayKind::Reflection),
        stats.rays_of(RayKind::Refraction),
        per_ray(stats.steps),
        per_ray(stats.triangle_tests),
    );
    let tracing = traced - prepared;
    anstream::eprintln!(
        "time: load {loaded:.2} s, build {:.2} s, trace and write {tracing:.2} s \
         ({:.2} Mray/s); {:.1} MB",
        prepared - loaded,
        rays as f64 / tracing.max(1e-9) / 1e6,
        bytes as f64 / 1e6,
    );
}

/// Arguments that decide what the trace holds: without output paths and thread count.
fn recorded_arguments(arguments: impl Iterator<Item = String>) -> Vec<String> {
    const LEFT_OUT: [&str; 4] = ["-o", "--output", "--image", "--threads"];
    let mut kept = Vec::new();
    let mut skip = false;
    for argument in arguments {
        if std::mem::take(&mut skip) {
            continue;
        }
        let name = argument.split('=').next().unwrap_or_default();
        if LEFT_OUT.contains(&name) {
            skip = !argument.contains('=');
        } else if !argument.starts_with("-o") {
            kept.push(argument);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn output_paths_and_threads_are_not_recorded() {
        let given = "rays teapot -o a.raytrace --image=b.png --threads 2 --size 64x64 --output c";
        let kept = recorded_arguments(given.split(' ').map(str::to_owned));
        assert_eq!(kept, ["rays", "teapot", "--size", "64x64"]);
    }
}
