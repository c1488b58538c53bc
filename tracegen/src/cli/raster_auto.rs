//! `tracegen raster --auto`: the trace of a path whose techniques are chosen under a budget.

use super::prepared::{Prepared, prepare};
use super::raster::{RasterArgs, cascades};
use crate::picture;
use crate::study::auto::{Budget, choose};
use crate::study::world::Tracer;
use ::raster::lavapipe::device;
use anyhow::Context;
use formats::textrace::TextraceWriter;
use record::CaptureCounts;
use scene::LoadOptions;
use shell::{Output, Progress, note};
use visibility::Occlusion;

/// Chooses, and captures each frame of the path with what holds the budget there.
///
/// # Errors
/// Unreadable input, no driver, a budget that nothing meets, or a file that cannot be written.
pub fn run(args: &RasterArgs, budget: Budget, outputs: &[Output]) -> anyhow::Result<()> {
    let progress = Progress::new("loading the scene", 0, "");
    let setup = args
        .scene
        .setup(None, &args.path, 0..args.frames, &LoadOptions::ALL)?;
    setup.check_outputs(outputs)?;
    let sizes = [
        cascades(&setup.scene, args.shadows).into(),
        args.record_budget,
    ];
    progress.stage("preparing textures and shaders", 0, "");
    let gpu = device::open(None)?;
    let lens = args.techniques.lens.lenses(&setup.hmd)?;
    let prepared = prepare(
        setup,
        lens,
        args.path.fps,
        &args.scene.scene,
        gpu,
        sizes,
        args.cache,
    )?;
    let Prepared {
        mut world,
        mut backend,
    } = prepared;
    let choice = choose(&mut world, &mut backend, budget, &progress)?;
    let frames: Vec<u32> = (0..args.frames).collect();
    let planners = choice.planners(&world)?;
    let planner = |frame: u32| &planners[choice.held.of_frame[frame as usize]];
    let tables = world.trace_tables(planner, &frames)?;
    let writer = TextraceWriter::create(&args.output, &tables)?;
    let writer = writer.with_encoding(args.encoding.encoding());
    let mut tracer = Tracer::new(&tables, writer);
    progress.stage("capturing", frames.len() as u64, "frames");
    let mut memory = Occlusion::default();
    let mut counts = CaptureCounts::default();
    let mut first = None;
    for &frame in &frames {
        let shot = world.shoot(&mut backend, planner(frame), frame, &mut memory)?;
        if first.is_none() {
            first = Some(world.pictures(&mut backend, &shot)?);
        }
        counts += tracer.capture(&world.job(planner(frame)), &mut backend, &shot.frame)?;
        progress.advance(1);
    }
    drop(progress);
    let image = match (&args.image, &first) {
        (Some(path), Some(pictures)) => {
            let cannot_write = || format!("cannot write {}", path.display());
            let size_px = world.hmd.eye_size_px;
            let prepared = picture::prepare_side_by_side(path, pictures, size_px);
            Some((prepared.with_context(cannot_write)?, cannot_write()))
        }
        _ => None,
    };
    let file_bytes = tracer.into_writer().finish()?;
    if let Some((image, cannot_write)) = image {
        image.persist().context(cannot_write)?;
    }
    note(&format!(
        "{} frame(s): {} quads, {} fragments; file {file_bytes} bytes",
        frames.len(),
        counts.quads,
        counts.fragments
    ));
    shell::print(&format!("--auto {budget}: {}", choice.record.reason))
}
