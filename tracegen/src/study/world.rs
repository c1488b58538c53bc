//! What every row of a study shares: the scene, the path through it, and how a frame is taken.

use formats::textrace::{Tables, TextraceWriter};
use formats::view::{Eye, FrameViews, Hmd, Lens};
use raster::backend::{CaptureBackend, Fragments, Work};
use raster::capture::{CaptureJob, Pictures};
use raster::draws::DrawList;
use raster::error::RasterError;
use raster::frame::Frame;
use raster::lighting::Lighting;
use record::CaptureCounts;
use scene::Scene;
use std::io::{Seek, Write};
use std::time::{Duration, Instant};
use techniques::{Planner, Settings, SettingsError, Skips};
use visibility::Occlusion;

const EYES: &[Eye] = &[Eye::Left, Eye::Right];

/// A scene and a path through it, ready to be rendered.
#[derive(Debug)]
pub struct World {
    /// The scene.
    pub scene: Scene,
    /// Draws.
    pub draws: DrawList,
    /// Lights.
    pub lighting: Lighting,
    /// World-space bounds of the scene.
    pub bounds: (glam::Vec3, glam::Vec3),
    /// Distances that the shadow cascades span, metres.
    pub shadow_range_m: [f32; 2],
    /// The display.
    pub hmd: Hmd,
    /// What the user sees of the left and right eye's picture.
    pub lens: [Lens; 2],
    /// Frames a second along the path.
    pub fps: f32,
    /// The path, by frame number.
    pub views: Vec<FrameViews>,
    /// Tables of the traces, without frames and passes.
    pub tables: Tables,
}

/// A frame that was rendered without capture: what it took.
#[derive(Debug)]
pub struct Shot {
    /// What was drawn.
    pub frame: Frame,
    /// Time of making the pictures of the layers.
    pub compose: Duration,
    /// Time of the whole frame but for its shadow maps, which are the same whatever the technique.
    pub total: Duration,
    /// What the backend did for it.
    pub work: Work,
}

impl World {
    /// Plans frames with `settings`.
    ///
    /// # Errors
    /// Settings that contradict each other or do not suit the display.
    pub fn planner(&self, settings: &Settings) -> Result<Planner, SettingsError> {
        Planner::new(settings, &self.hmd, self.lens, EYES, self.fps)
    }

    /// The job of capturing what `planner` plans.
    #[must_use]
    pub fn job<'a>(&'a self, planner: &'a Planner) -> CaptureJob<'a> {
        CaptureJob {
            scene: &self.scene,
            draws: &self.draws,
            lighting: self.lighting.clone(),
            bounds: self.bounds,
            shadow_range_m: self.shadow_range_m,
            planner,
            // What is searched for anew in every frame would hide what the techniques find.
            skips: Skips::NONE,
            fragments: Fragments::DepthTested,
            shaded: false,
        }
    }

    /// Checks that settings do not contradict each other and suit the display.
    ///
    /// # Errors
    /// They do not.
    pub fn check(&self, settings: &Settings) -> anyhow::Result<()> {
        let planner = self.planner(settings)?;
        self.views
            .iter()
            .try_for_each(|views| planner.check_views(views))?;
        self.job(&planner).frame(&self.views[0])?;
        Ok(())
    }

    /// Renders a frame of the path without capture, and leaves its pictures on the device. `memory` is
    /// what the technique remembers of the frame before.
    ///
    /// # Errors
    /// Driver errors, and eyes that the culling technique is not made for.
    pub fn shoot(
        &mut self,
        backend: &mut dyn CaptureBackend,
        planner: &Planner,
        number: u32,
        memory: &mut Occlusion,
    ) -> Result<Shot, RasterError> {
        let before = backend.work();
        let start = Instant::now();
        self.draws.pose(&self.scene, number as f32 / self.fps);
        backend.pose(&self.draws);
        let posed = backend.work() - before;
        let job = self.job(planner);
        let mut frame = job.frame(&self.views[number as usize])?;
        let planned = start.elapsed();
        // Of another technique's frame, the last one's targets and masks would not fit.
        backend.prepare(&frame)?;
        let start = Instant::now();
        if planner.settings().occlusion {
            job.occlude(backend, &mut frame, memory)?;
        }
        let hidden = start.elapsed();
        job.light(backend, &frame)?;
        let before = backend.work();
        let start = Instant::now();
        job.render_layers(backend, &frame)?;
        let rendered = start.elapsed();
        backend.compose(&frame)?;
        let done = start.elapsed();
        let mut work = backend.work() - before;
        work.bytes_uploaded += posed.bytes_uploaded;
        Ok(Shot {
            frame,
            compose: done - rendered,
            total: planned + hidden + done,
            work,
        })
    }

    /// Reads the pictures of the frame that was just shot.
    ///
    /// # Errors
    /// Driver errors.
    pub fn pictures(
        &self,
        backend: &mut dyn CaptureBackend,
        shot: &Shot,
    ) -> Result<Pictures, RasterError> {
        (0..shot.frame.plan.pictures.len())
            .map(|number| backend.picture(&shot.frame, number))
            .collect()
    }

    /// The tables of a trace of some frames, each with its planner.
    ///
    /// # Errors
    /// As [`CaptureJob::plan`].
    pub fn trace_tables<'s>(
        &mut self,
        planner: impl Fn(u32) -> &'s Planner,
        frames: &[u32],
    ) -> Result<Tables, RasterError> {
        let mut tables = self.tables.clone();
        tables.meta.frames = (frames.iter())
            .map(|&number| self.views[number as usize].clone())
            .collect();
        for views in &tables.meta.frames {
            // What moves decides what a frame's layers are.
            self.draws.pose(&self.scene, views.frame as f32 / self.fps);
            let passes = self.job(planner(views.frame)).passes(views)?;
            tables.passes.extend(passes);
        }
        Ok(tables)
    }
}

/// Appends frames to a trace, one after the other.
pub struct Tracer<'a, W: Write + Seek> {
    tables: &'a Tables,
    writer: TextraceWriter<W>,
    pass: usize,
}

impl<'a, W: Write + Seek> Tracer<'a, W> {
    /// A trace with these tables.
    #[must_use]
    pub fn new(tables: &'a Tables, writer: TextraceWriter<W>) -> Self {
        Self {
            tables,
            writer,
            pass: 0,
        }
    }

    /// Captures the next frame, whose shadow maps have been rendered.
    ///
    /// # Errors
    /// Driver errors, and errors of writing.
    pub fn capture(
        &mut self,
        job: &CaptureJob<'_>,
        backend: &mut dyn CaptureBackend,
        frame: &Frame,
    ) -> Result<CaptureCounts, RasterError> {
        let mut recorder = job.recorder(self.tables);
        let captured =
            job.capture_frame(backend, frame, self.pass, &mut recorder, &mut self.writer)?;
        self.pass += frame.plan.layers.len();
        Ok(captured.counts)
    }

    /// The writer, to be finished.
    #[must_use]
    pub fn into_writer(self) -> TextraceWriter<W> {
        self.writer
    }
}
