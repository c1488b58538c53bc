//! `tracegen raster --auto` and `--technique`: captures a path whose frames use techniques that a search
//! chose or the user named.

use super::capture_steps::{TraceOutput, load, warn_of_multiview_defect};
use super::prepared::{Preparation, Prepared, prepare};
use super::raster_args::RasterArgs;
use super::raster_summary::DoubtfulTriangles;
use super::scene_args::warn_of_nothing_seen;
use crate::study::auto::{Budget, Known, Objective, Schedule, choose, search_frames};
use crate::study::world::World;
use ::raster::lavapipe::{Lavapipe, device};
use anyhow::ensure;
use formats::textrace::{Choice, ChosenTechniques};
use record::CaptureCounts;
use shell::{Output, Progress, note};
use techniques::Planner;
use visibility::Occlusion;

/// Source of the frames' techniques.
#[derive(Clone, Debug)]
pub enum Techniques {
    /// A search under a budget.
    Chosen(Budget, Objective),
    /// Names from the user.
    Named(Box<Schedule>),
}

/// Chooses the techniques unless they are named, and captures each frame of the path with its techniques.
///
/// # Errors
/// Unreadable input, no driver, a budget that nothing meets, or a file that cannot be written.
pub fn run(
    args: &RasterArgs,
    techniques: &Techniques,
    outputs: &[Output],
) -> anyhow::Result<String> {
    let progress = Progress::new("loading the scene", 0, "");
    let setup = load(args, outputs)?;
    progress.stage("preparing textures and shaders", 0, "");
    let gpu = device::open(None)?;
    let camera = setup.camera.clone();
    let Prepared {
        mut world,
        mut backend,
    } = prepare(
        Preparation {
            lens: args.techniques.lens.lenses(&setup.hmd)?,
            scene: &args.scene.scene,
            shadows: args.shadows,
            record_budget: args.record_budget,
            cache: args.cache,
        },
        setup,
        gpu,
    )?;
    let (schedule, choice) = match techniques {
        Techniques::Named(schedule) => ((**schedule).clone(), None),
        Techniques::Chosen(budget, objective) => {
            let (schedule, choice) = search(
                args.frames(),
                (*budget, *objective),
                &mut world,
                &mut backend,
                &progress,
            )?;
            (schedule, Some(choice))
        }
    };
    let planners = Planners::new(&world, &schedule, args.frames())?;
    if planners.use_multiview() {
        warn_of_multiview_defect(&mut backend)?;
    }
    let numbers: Vec<u32> = (0..args.frames()).collect();
    let frames = world.plan_all(|frame| planners.of_frame(frame), &numbers)?;
    let mut tables = world.tables_of(&frames);
    let name = |frame: &u32| schedule.row(*frame).name.clone();
    tables.meta.techniques = Some(ChosenTechniques {
        frames: numbers.iter().map(name).collect(),
        schedule: schedule.to_string(),
        choice: choice.clone(),
    });
    let mut output = TraceOutput::create(args, &tables, &world)?;
    progress.stage("capturing", frames.len() as u64, "frames");
    let mut memory = Occlusion::default();
    let mut counts = CaptureCounts::default();
    let (mut first, mut doubtful) = (None, DoubtfulTriangles::default());
    for frame in frames {
        let number = frame.number;
        let planner = planners.of_frame(number);
        let shot = world.draw(&mut backend, planner, frame, &mut memory)?;
        if first.is_none() {
            first = Some(world.pictures(&mut backend, &shot)?);
            for eye in &world.views[number as usize].eyes {
                doubtful.look(&world, eye);
            }
        }
        let job = world.job(planner);
        let captured = job.capture_frame(&mut backend, &shot.frame, &mut output.recorder)?;
        counts += captured.counts;
        progress.advance(1);
    }
    drop(progress);
    let file_bytes = output.finish(first.as_ref(), world.hmd.eye_size_px)?;
    if counts.fragments == 0 {
        warn_of_nothing_seen(&camera, world.bounds, world.scene.origin);
    }
    doubtful.warn(&world.scene, counts.fragments / u64::from(args.frames()));
    note(&format!(
        "{} frame(s): {} quads, {} fragments; file {file_bytes} bytes",
        numbers.len(),
        counts.quads,
        counts.fragments
    ));
    Ok(match choice {
        Some(choice) => format!(
            "--auto {} --objective {}: {}\nagain by name: --technique {schedule}",
            choice.budget, choice.objective, choice.reason
        ),
        None => format!("--technique {schedule}"),
    })
}

/// Searches for the techniques of a path's frames under a budget.
fn search(
    frames: u32,
    (budget, objective): (Budget, Objective),
    world: &mut World,
    backend: &mut Lavapipe,
    progress: &Progress,
) -> anyhow::Result<(Schedule, Choice)> {
    // Single frames, because techniques treat even and odd frames differently.
    let runs = search_frames(frames).into_iter().map(|frame| vec![frame]);
    let known = Known::new();
    let found = choose(
        world,
        backend,
        runs.collect(),
        budget,
        objective,
        known,
        progress,
    )?;
    let choice = Choice {
        budget: budget.to_string(),
        objective: objective.name(),
        reason: found.record.reason,
    };
    Ok((Schedule::of(&found.held), choice))
}

/// The planners of a path's frames, one per different settings.
struct Planners {
    planners: Vec<Planner>,
    of_frame: Vec<usize>,
}

impl Planners {
    fn new(world: &World, schedule: &Schedule, frames: u32) -> anyhow::Result<Self> {
        if let Some(last) = schedule.last_frame() {
            ensure!(
                last < frames,
                "--technique: expected frames below {frames}, found {last}"
            );
        }
        let mut planners: Vec<Planner> = Vec::new();
        let mut of_frame = Vec::new();
        for frame in 0..frames {
            let row = schedule.row(frame);
            let known = (planners.iter()).position(|p| p.settings() == &row.settings);
            of_frame.push(known.unwrap_or(planners.len()));
            if known.is_none() {
                ensure!(
                    row.settings.half_rate.is_none(),
                    "--technique: expected techniques that render every frame, found {}",
                    row.name
                );
                world.check(&row.settings)?;
                planners.push(world.planner(&row.settings)?);
            }
        }
        Ok(Self { planners, of_frame })
    }

    fn of_frame(&self, frame: u32) -> &Planner {
        &self.planners[self.of_frame[frame as usize]]
    }

    fn use_multiview(&self) -> bool {
        (self.planners.iter()).any(|planner| planner.settings().multiview)
    }
}
