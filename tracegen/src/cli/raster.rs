//! `tracegen raster`.

use super::capture_cache::cached;
use super::capture_steps::prepare_environment;
use super::drivers::{self, Driver};
use super::raster_args::RasterArgs;
use super::raster_auto::{self, Techniques};
use super::raster_frames;
use super::raster_plan;
use super::scene_args::capture_outputs;
use raster::backend::Fragments;
use std::path::PathBuf;

/// Runs `tracegen raster`.
///
/// # Errors
/// Unreadable input, no driver, or a file that cannot be written.
pub fn run(args: &RasterArgs) -> anyhow::Result<()> {
    prepare_environment(args.threads.count);
    args.threads.start()?;
    let outputs = capture_outputs(&args.output, args.image.as_deref());
    args.check_frames()?;
    args.scene.check_outputs(&args.path, &outputs)?;
    shell::check_outputs(
        &outputs,
        args.techniques.inputs().iter().map(PathBuf::as_path),
    )?;
    if args.hsr == Fragments::All {
        args.check_without_depth_test()?;
    }
    if args.backend == Driver::Osmesa {
        args.check_plain_frames()?;
    }
    let objective = args.objective.of(args.auto)?;
    // What `--auto` chooses may depend on measured times.
    let cache = match args.auto {
        None => args.cache.open_captures()?,
        Some(_) => None,
    };
    cached(cache, &outputs, &drivers::version_files(), || {
        let techniques = match (args.auto, &args.technique) {
            (Some(budget), _) => Techniques::Chosen(budget, objective),
            (None, Some(schedule)) => Techniques::Named(Box::new(schedule.clone())),
            (None, None) if args.plan_only => return raster_plan::run(args, &outputs),
            (None, None) => return raster_frames::run(args, &outputs),
        };
        raster_auto::run(args, &techniques, &outputs)
    })
}
