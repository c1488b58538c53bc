//! `tracegen raster --auto` and `--technique`: the trace of a path whose frames are rendered with techniques that are
//! chosen under a budget, or named.

use super::prepared::{Prepared, prepare};
use super::raster::{RasterArgs, cascades, warn_of_multiview};
use super::scene_args::warn_of_nothing_seen;
use crate::doubtful::Doubtful;
use crate::picture;
use crate::study::auto::{Budget, Known, Objective, Schedule, choose, search_frames};
use crate::study::world::Tracer;
use ::raster::backend::CaptureBackend;
use ::raster::geometry::geometry;
use ::raster::lavapipe::device;
use anyhow::{Context, ensure};
use formats::textrace::{Choice, ChosenTechniques, TextraceWriter};
use record::CaptureCounts;
use scene::LoadOptions;
use shell::{Output, Progress, note};
use techniques::Planner;
use visibility::Occlusion;

/// Where the techniques of the frames come from.
#[derive(Clone, Debug)]
pub enum Techniques {
    /// A search under a budget.
    Chosen(Budget, Objective),
    /// The user.
    Named(Box<Schedule>),
}

/// Chooses unless techniques are named, and captures each frame of the path with its own.
///
/// # Errors
/// Unreadable input, no driver, a budget that nothing meets, or a file that cannot be written.
pub fn run(args: &RasterArgs, techniques: &Techniques, outputs: &[Output]) -> anyhow::Result<()> {
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
    let camera = setup.camera.clone();
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
    let frames: Vec<u32> = (0..args.frames).collect();
    let (schedule, choice) = match techniques {
        Techniques::Named(schedule) => ((**schedule).clone(), None),
        Techniques::Chosen(budget, objective) => {
            // Alone: techniques tell even frames from odd ones.
            let runs = search_frames(args.frames)
                .into_iter()
                .map(|frame| vec![frame]);
            let found = choose(
                &mut world,
                &mut backend,
                runs.collect(),
                *budget,
                *objective,
                Known::new(),
                &progress,
            )?;
            let choice = Choice {
                budget: budget.to_string(),
                objective: objective.name().to_owned(),
                reason: found.record.reason,
            };
            (Schedule::of(&found.held), Some(choice))
        }
    };
    if let Some(last) = schedule.last_frame() {
        ensure!(
            last < args.frames,
            "--technique: expected frames below {}, found {last}",
            args.frames
        );
    }
    let mut planners: Vec<Planner> = Vec::new();
    let mut of_frame = Vec::new();
    for &frame in &frames {
        let settings = &schedule.row(frame).settings;
        let known = planners.iter().position(|p| p.settings() == settings);
        of_frame.push(known.unwrap_or(planners.len()));
        if known.is_none() {
            ensure!(
                settings.half_rate.is_none(),
                "--technique: expected techniques that render every frame, found {}",
                schedule.row(frame).name
            );
            world.check(settings)?;
            planners.push(world.planner(settings)?);
        }
    }
    let planner = |frame: u32| &planners[of_frame[frame as usize]];
    if planners.iter().any(|planner| planner.settings().multiview)
        && let Some(defect) = backend.multiview_defect()?
    {
        warn_of_multiview(&defect);
    }
    let mut tables = world.trace_tables(planner, &frames)?;
    let name = |frame: &u32| schedule.row(*frame).name.clone();
    tables.meta.techniques = Some(ChosenTechniques {
        frames: frames.iter().map(name).collect(),
        schedule: schedule.to_string(),
        choice: choice.clone(),
    });
    let writer = TextraceWriter::create(&args.output, &tables)?;
    let mut writer = writer.with_encoding(args.encoding.encoding());
    if args.geometry {
        writer = writer.with_geometry(geometry(&world.scene, &world.draws))?;
    }
    let mut tracer = Tracer::new(&tables, writer);
    progress.stage("capturing", frames.len() as u64, "frames");
    let mut memory = Occlusion::default();
    let mut counts = CaptureCounts::default();
    let (mut first, mut doubtful) = (None, Doubtful::default());
    for &frame in &frames {
        let shot = world.shoot(&mut backend, planner(frame), frame, &mut memory)?;
        if first.is_none() {
            first = Some(world.pictures(&mut backend, &shot)?);
            let views = &world.views[frame as usize];
            for eye in &views.eyes {
                doubtful.look(&world.scene, &world.draws, eye, world.hmd.eye_size_px);
            }
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
    if counts.fragments == 0 {
        warn_of_nothing_seen(&camera, world.bounds, world.scene.origin);
    }
    for warning in doubtful.warnings(&world.scene, counts.fragments / u64::from(args.frames)) {
        shell::warn(&warning);
    }
    note(&format!(
        "{} frame(s): {} quads, {} fragments; file {file_bytes} bytes",
        frames.len(),
        counts.quads,
        counts.fragments
    ));
    shell::print(&match choice {
        Some(choice) => format!(
            "--auto {} --objective {}: {}\nagain by name: --technique {schedule}",
            choice.budget, choice.objective, choice.reason
        ),
        None => format!("--technique {schedule}"),
    })
}
