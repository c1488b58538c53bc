//! What all rows of a study share: the scene, the path through it, and rendering a frame.

use super::counted::Counted;
use super::timewarp::{self, Reprojected, Shown};
use formats::textrace::Tables;
use formats::view::{Eye, FrameViews, Hmd, Lens};
use raster::backend::{CaptureBackend, Fragments, Work};
use raster::capture::{CaptureJob, Pictures};
use raster::draws::DrawList;
use raster::error::RasterError;
use raster::frame::Frame;
use raster::lavapipe::Lavapipe;
use raster::lighting::Lighting;
use scene::paths::Moments;
use scene::{Camera, Scene};
use std::time::{Duration, Instant};
use techniques::settings::Reprojection;
use techniques::{Planner, Settings, SettingsError, Skips};
use visibility::Occlusion;

const EYES: &[Eye] = &[Eye::Left, Eye::Right];

/// A scene and a path through it, ready to be rendered.
#[derive(Debug)]
pub struct World {
    /// The scene.
    pub scene: Scene,
    /// Draws of the scene.
    pub draws: DrawList,
    /// Lights.
    pub lighting: Lighting,
    /// World-space bounds of the scene.
    pub bounds: (glam::Vec3, glam::Vec3),
    /// Distances that the shadow cascades span, metres.
    pub shadow_range_m: [f32; 2],
    /// The display.
    pub hmd: Hmd,
    /// Visible parts of the left and right eye's pictures.
    pub lens: [Lens; 2],
    /// Times of the frames.
    pub moments: Moments,
    /// The pose at the start of the path.
    pub camera: Camera,
    /// The path, by frame number.
    pub views: Vec<FrameViews>,
    /// Tables of the traces, without frames and passes.
    pub tables: Tables,
    /// Texels of its textures.
    pub texture_bytes: u64,
    /// The last rendered frame, at half rate.
    pub shown: Option<Shown>,
}

/// A frame that was rendered without capture, and its cost.
#[derive(Debug)]
pub struct Shot {
    /// What was drawn.
    pub frame: Frame,
    /// Time of composing the pictures from the layers.
    pub compose: Duration,
    /// Time of the whole frame without its shadow maps, which do not depend on the technique.
    pub total: Duration,
    /// The backend's work for it.
    pub work: Work,
    /// The backend's work for occlusion culling.
    pub hiding: Work,
    /// Whether depth passes for occlusion culling were drawn.
    pub occludes: bool,
    /// Whether one draw rendered both eyes.
    pub at_once: bool,
    /// The reprojection, if the frame was not rendered.
    pub reprojection: Option<Reprojected>,
}

impl Shot {
    /// Its counts, without textures, which require a capture.
    pub fn counted(&self, fragments: u64) -> Counted {
        if let Some(reprojection) = &self.reprojection {
            return Counted {
                picture_bytes: reprojection.bytes,
                ..Counted::default()
            };
        }
        let mut work = self.work;
        work.vertices += self.hiding.vertices;
        work.bytes_uploaded += self.hiding.bytes_uploaded;
        let mut counted = Counted::of(&self.frame.plan, self.occludes, &work, fragments);
        if self.at_once {
            // Read once, transformed for each eye.
            counted.vertices += self.work.vertices;
        }
        counted
    }
}

impl World {
    /// A scene with some shadow cascades, seen from a path through lenses. Its tables are empty.
    ///
    /// # Errors
    /// A scene that cannot be drawn.
    pub fn new(
        (scene, cascades): (Scene, u32),
        (camera, views, moments): (Camera, Vec<FrameViews>, Moments),
        (hmd, lens): (Hmd, [Lens; 2]),
    ) -> Result<Self, RasterError> {
        let bounds = scene.bounds().unwrap_or_default();
        Ok(Self {
            draws: DrawList::new(&scene, cascades)?,
            lighting: Lighting::new(&scene),
            bounds,
            shadow_range_m: shadow_range_m(&camera, bounds),
            hmd,
            lens,
            moments,
            camera,
            views,
            tables: Tables::default(),
            texture_bytes: 0,
            shown: None,
            scene,
        })
    }

    /// Plans frames with `settings`.
    ///
    /// # Errors
    /// Settings that contradict each other or do not suit the display.
    pub fn planner(&self, settings: &Settings) -> Result<Planner, SettingsError> {
        Planner::new(settings, &self.hmd, self.lens, EYES, self.moments.fps)
    }

    /// The job that captures the plans of `planner`.
    pub fn job<'a>(&'a self, planner: &'a Planner) -> CaptureJob<'a> {
        CaptureJob {
            scene: &self.scene,
            draws: &self.draws,
            lighting: self.lighting.clone(),
            bounds: self.bounds,
            shadow_range_m: self.shadow_range_m,
            planner,
            // Skips would hide part of what the techniques find, because they are searched anew in every
            // frame.
            skips: Skips::NONE,
            fragments: Fragments::DepthTested,
            shaded: false,
        }
    }

    /// Checks that settings do not contradict each other and suit the display.
    ///
    /// # Errors
    /// Settings that contradict each other or do not suit the display.
    pub fn check(&self, settings: &Settings) -> anyhow::Result<()> {
        let planner = self.planner(settings)?;
        self.views
            .iter()
            .try_for_each(|views| planner.check_views(views))?;
        self.job(&planner).frame(&self.views[0])?;
        Ok(())
    }

    /// Poses the scene and its draws for a frame.
    ///
    /// # Errors
    /// A coordinate exceeds the supported range.
    pub fn pose(&mut self, number: u32) -> Result<(), RasterError> {
        let time_s = self.moments.scene_time_s(number);
        let scene = &mut self.scene;
        (scene.animate(time_s)).map_err(|error| RasterError::Scene(error.to_string()))?;
        if scene.animation.is_some() {
            self.bounds = scene.bounds().unwrap_or_default();
            self.shadow_range_m = shadow_range_m(&self.camera, self.bounds);
            self.lighting = Lighting::new(scene);
        }
        self.draws.pose(&self.scene, time_s as f32);
        Ok(())
    }

    /// Plans frames of the path, each with its planner, before any of them is drawn.
    ///
    /// # Errors
    /// As [`CaptureJob::frame`].
    pub fn plan_all<'s>(
        &mut self,
        planner: impl Fn(u32) -> &'s Planner,
        frames: &[u32],
    ) -> Result<Vec<Frame>, RasterError> {
        (frames.iter())
            .map(|&number| self.plan(planner(number), number))
            .collect()
    }

    /// Poses the scene for a frame, on which its layers depend, and plans the frame.
    fn plan(&mut self, planner: &Planner, number: u32) -> Result<Frame, RasterError> {
        self.pose(number)?;
        self.job(planner).frame(&self.views[number as usize])
    }

    /// Plans a frame of the path and renders it without capture, and leaves its pictures on the device.
    /// `memory` is the state of occlusion culling from the frame before.
    ///
    /// # Errors
    /// Driver errors, or eyes that the culling technique does not support.
    pub fn shoot(
        &mut self,
        backend: &mut Lavapipe,
        planner: &Planner,
        number: u32,
        memory: &mut Occlusion,
    ) -> Result<Shot, RasterError> {
        if planner.settings().reprojects(number)
            && let Some(shown) = self.shown.take_if(|shown| shown.number + 1 == number)
        {
            return self.reproject(planner, number, &shown);
        }
        let start = Instant::now();
        let frame = self.plan(planner, number)?;
        self.draw_posed(backend, planner, frame, start.elapsed(), memory)
    }

    /// Renders a frame that was planned before; otherwise as [`Self::shoot`].
    ///
    /// # Errors
    /// Driver errors.
    pub fn draw(
        &mut self,
        backend: &mut Lavapipe,
        planner: &Planner,
        frame: Frame,
        memory: &mut Occlusion,
    ) -> Result<Shot, RasterError> {
        self.pose(frame.number)?;
        self.draw_posed(backend, planner, frame, Duration::ZERO, memory)
    }

    /// Renders a frame for which the scene is posed; `planned` is the time for its plan.
    fn draw_posed(
        &mut self,
        backend: &mut Lavapipe,
        planner: &Planner,
        mut frame: Frame,
        planned: Duration,
        memory: &mut Occlusion,
    ) -> Result<Shot, RasterError> {
        let (start, before) = (Instant::now(), backend.work());
        backend.pose(&self.scene, &self.draws);
        let posed = backend.work() - before;
        let planned = planned + start.elapsed();
        let job = self.job(planner);
        // Targets and masks of another technique's frame would not fit.
        backend.prepare(&frame)?;
        let (start, before) = (Instant::now(), backend.work());
        let occludes = planner.settings().occlusion;
        if occludes {
            job.occlude(backend, &mut frame, memory)?;
        }
        let (hidden, hiding) = (start.elapsed(), backend.work() - before);
        job.light(backend, &frame)?;
        let at_once = job.draws_both_at_once(&frame);
        let before = backend.work();
        let start = Instant::now();
        job.render_layers(backend, &frame)?;
        let rendered = start.elapsed();
        backend.compose(&frame)?;
        let done = start.elapsed();
        let mut work = backend.work() - before;
        work.bytes_uploaded += posed.bytes_uploaded;
        let shot = Shot {
            frame,
            compose: done - rendered,
            total: planned + hidden + done,
            work,
            hiding,
            occludes,
            at_once,
            reprojection: None,
        };
        if let Some(follows) = planner.settings().half_rate {
            // A runtime would still hold these pictures, so reading them back is not part of the frame's
            // time.
            let job = self.job(planner);
            let depths = (follows == Reprojection::Depth).then(|| job.depths(backend, &shot.frame));
            let depths = depths.transpose()?;
            self.shown = Some(Shown {
                number: shot.frame.number,
                pictures: self.pictures(backend, &shot)?,
                depths,
            });
        }
        Ok(shot)
    }

    /// Reprojects a frame from the one before.
    fn reproject(
        &self,
        planner: &Planner,
        number: u32,
        shown: &Shown,
    ) -> Result<Shot, RasterError> {
        let [before, now] = [shown.number, number].map(|number| &self.views[number as usize]);
        let mut frame = self.job(planner).frame(now)?;
        // Nothing is drawn, so nothing is culled.
        (frame.cull_tests, frame.cull_time) = (0, Duration::ZERO);
        let reprojection = timewarp::reproject(shown, before, now, self.hmd.eye_size_px);
        Ok(Shot {
            frame,
            compose: reprojection.took,
            total: reprojection.took,
            work: Work::default(),
            reprojection: Some(reprojection),
            hiding: Work::default(),
            occludes: false,
            at_once: false,
        })
    }

    /// Reads the pictures of the frame that was shot last.
    ///
    /// # Errors
    /// Driver errors.
    pub fn pictures(
        &self,
        backend: &mut dyn CaptureBackend,
        shot: &Shot,
    ) -> Result<Pictures, RasterError> {
        if let Some(reprojection) = &shot.reprojection {
            return Ok(reprojection.pictures.clone());
        }
        (0..shot.frame.plan.pictures.len())
            .map(|number| backend.picture(&shot.frame, number))
            .collect()
    }

    /// The tables of a trace of planned frames.
    pub fn tables_of<'f>(&self, frames: impl IntoIterator<Item = &'f Frame>) -> Tables {
        let mut tables = self.tables.clone();
        tables.meta.frames.clear();
        for frame in frames {
            (tables.meta.frames).push(self.views[frame.number as usize].clone());
            tables.passes.extend(frame.plan.passes(frame.number));
        }
        tables
    }
}

/// Near and far end of the cascades: from the near plane to where the scene ends.
fn shadow_range_m(camera: &Camera, (lo, hi): (glam::Vec3, glam::Vec3)) -> [f32; 2] {
    let farthest = (camera.eye - lo)
        .abs()
        .max((camera.eye - hi).abs())
        .length();
    // Nothing nearer than 5 cm needs shadows of its own, nor anything nearer than a twentieth of a small
    // scene.
    let near = camera.near.max(farthest.min(1.0) * 0.05);
    [near, farthest.min(camera.far).max(2.0 * near)]
}
