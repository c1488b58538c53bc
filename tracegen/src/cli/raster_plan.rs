//! `tracegen raster --plan-only`: what is known of a path's frames without drawing them.

use super::capture_steps::load;
use super::raster_args::RasterArgs;
use super::raster_frames::Session;
use formats::textrace::{PlannedFrame, Tables, TextraceWriter, TraceMeta};
use raster::frame::Frame;
use shell::{Output, Progress, lasting_arguments};

/// Writes the plan of a path. Returns the result to print.
///
/// # Errors
/// Unreadable input, or a file that cannot be written.
pub fn run(args: &RasterArgs, outputs: &[Output]) -> anyhow::Result<String> {
    let progress = Progress::new("loading the scene", 0, "");
    let mut session = Session::new(args, load(args, outputs)?)?;
    let frames = session.world.views.len();
    progress.stage("planning", frames as u64, "frames");
    let mut plan = Vec::with_capacity(frames);
    let mut before: Vec<Option<u32>> = Vec::new();
    for position in 0..frames {
        session.world.pose(session.world.views[position].frame)?;
        let mut finest = Vec::new();
        let views = &session.world.views[position];
        let frame = session.job().frame_and_levels(views, &mut finest)?;
        plan.push(planned(&session, &frame, &before, &finest));
        before = finest;
        progress.advance(1);
    }
    drop(progress);
    let world = &session.world;
    let tables = Tables {
        meta: TraceMeta {
            tool: super::tool(),
            command_line: lasting_arguments(std::env::args_os().skip(1)),
            scene: args.scene.scene.to_string(),
            scene_triangles: world.scene.triangle_count(),
            camera: world.camera.name.clone(),
            backend: "plan".into(),
            hmd: world.hmd.clone(),
            frames: world.views.clone(),
            origin_m: world.scene.origin.to_array(),
            plan: Some(plan),
            ..TraceMeta::default()
        },
        ..Tables::default()
    };
    let bytes = TextraceWriter::create(&args.output, &tables)?.finish()?;
    Ok(format!("{frames} frames planned, file {bytes} bytes"))
}

/// The counts of a planned frame. `before` and `finest` are the finest mip levels by image that the frame before and
/// this one may sample.
fn planned(
    session: &Session<'_>,
    frame: &Frame,
    before: &[Option<u32>],
    finest: &[Option<u32>],
) -> PlannedFrame {
    let world = &session.world;
    let visible = || frame.views().flat_map(|view| view.visible.iter().copied());
    let triangles = |draw: u32| {
        let mesh = world.draws.calls[draw as usize].mesh;
        world.scene.meshes[mesh].triangles() as u64
    };
    let texels = |image: usize, from: u32, to: u32| -> u64 {
        let side = |size: u32, level: u32| u64::from((size >> level).max(1));
        let [width, height] = world.scene.images[image].size;
        (from..to)
            .map(|level| side(width, level) * side(height, level))
            .sum()
    };
    let levels = |image: usize| {
        world.scene.images[image]
            .size
            .into_iter()
            .max()
            .unwrap_or(1)
            .ilog2()
            + 1
    };
    let mut counts = PlannedFrame {
        draws: visible().count() as u64,
        triangles: visible().map(triangles).sum(),
        ..PlannedFrame::default()
    };
    for (image, level) in finest.iter().enumerate() {
        let Some(level) = *level else { continue };
        let end = levels(image);
        counts.texels += texels(image, level.min(end), end);
        let known = before.get(image).copied().flatten().unwrap_or(end);
        counts.new_texels += texels(image, level.min(end), known.min(end));
    }
    counts
}
