//! Captures the frames of a scene into a trace.

use super::backend::{CaptureBackend, Fragments, RecordRequest, View};
use super::cascades;
use super::draws::{DrawCall, DrawList, DrawMode};
use super::error::RasterError;
use super::frame::Frame;
use super::geometry;
use super::lighting::Lighting;
use formats::textrace::Pass;
use formats::view::{Eye, FrameViews, TILE_SIZE_PX};
use glam::Vec3;
use record::{CaptureCounts, Captured, Capturer, RecordError, Recorder, Region, Sink};
use scene::Scene;
use std::io::{Seek, Write};
use std::time::{Duration, Instant};
use techniques::least_work::Object;
use techniques::{FramePlan, Planner, Skips};
use visibility::Rig;

/// Inputs shared by plain rendering and capture.
pub struct CaptureJob<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its draws.
    pub draws: &'a DrawList,
    /// Lights. Cascades are fitted per frame.
    pub lighting: Lighting,
    /// World-space bounds of the scene.
    pub bounds: (glam::Vec3, glam::Vec3),
    /// Distances from the head that the cascades span, metres.
    pub shadow_range_m: [f32; 2],
    /// Determines the layers of the frames.
    pub planner: &'a Planner,
    /// Invisible work that is skipped.
    pub skips: Skips,
    /// Which fragments are recorded.
    pub fragments: Fragments,
    /// Captured frames also have pictures.
    pub shaded: bool,
}

/// Results of capturing a frame, besides its tiles.
pub struct CapturedFrame {
    /// Its pictures, if the job is shaded.
    pub pictures: Option<Pictures>,
    /// Counts of the records.
    pub counts: CaptureCounts,
    /// Time spent on sorting, encoding and writing.
    pub sorting: Duration,
}

/// The pictures of one frame, one per eye: sRGB RGBA8.
pub type Pictures = Vec<Vec<u8>>;

impl CaptureJob<'_> {
    /// The plan of a frame: its layers and pictures.
    ///
    /// # Errors
    /// Eyes for which no far field can be made.
    pub fn plan(&self, views: &FrameViews) -> Result<FramePlan, RasterError> {
        let objects = || {
            let size_px = self.planner.hmd().eye_size_px;
            let object = |call: &DrawCall| {
                let triangles = self.scene.meshes[call.mesh].triangles() as u32;
                Object::of_bounds(call.bounds, triangles, &views.eyes, size_px)
            };
            self.draws.calls.iter().filter_map(object).collect()
        };
        let mut calls = self.draws.calls.iter();
        let blends = calls.any(|call| call.mode == DrawMode::Blended);
        Ok(self.planner.plan(views, blends, objects)?)
    }

    /// Fits the frame's shadow cascades to both eyes, whichever are captured, and finds the draws
    /// that each layer may see.
    ///
    /// # Errors
    /// Eyes that the culling technique does not support.
    pub fn frame(&self, views: &FrameViews) -> Result<Frame, RasterError> {
        self.planned(views, |_| {})
    }

    /// [`Self::frame`], and in `finest` by image of the scene the finest mip level that this frame
    /// or an earlier one may sample; `None` for an image that they do not sample.
    ///
    /// # Errors
    /// Eyes that the culling technique does not support.
    pub fn frame_and_levels(
        &self,
        views: &FrameViews,
        finest: &mut Vec<Option<u32>>,
    ) -> Result<Frame, RasterError> {
        self.planned(views, |frame| self.add_finest_levels(frame, finest))
    }

    /// The planned frame. `boxes_seen` receives it before draws are culled by more than their
    /// bounding boxes.
    fn planned(
        &self,
        views: &FrameViews,
        boxes_seen: impl FnOnce(&Frame),
    ) -> Result<Frame, RasterError> {
        let start = Instant::now();
        let mut frame = self.boxes_seen(views)?;
        let seen = start.elapsed();
        boxes_seen(&frame);
        let start = Instant::now();
        self.cull_distant(&mut frame, views);
        self.skip(&mut frame);
        frame.plan_time = seen + start.elapsed();
        Ok(frame)
    }

    /// The frame according to the bounding boxes of its draws.
    fn boxes_seen(&self, views: &FrameViews) -> Result<Frame, RasterError> {
        let mut lighting = self.lighting.clone();
        let [near, far] = self.shadow_range_m;
        lighting.cascades = cascades::fit(
            &views.eyes,
            self.draws.cascades,
            lighting.to_sun,
            self.bounds,
            near,
            far,
        );
        let between = (views.eyes.iter())
            .map(|eye| Vec3::from_array(eye.position) / 2.0)
            .sum();
        let share = self.planner.settings().highlight_disparity;
        lighting.highlights = share.map(|share| (between, share));
        let (culling, number) = (self.planner.settings().culling, views.frame);
        let (plan, rig) = (self.plan(views)?, self.rig(views));
        Ok(Frame::new(
            self.draws, lighting, plan, rig, culling, number,
        )?)
    }

    /// Whether colours are drawn while records are made: for pictures, or because another eye takes them.
    fn draws_pictures(&self) -> bool {
        self.shaded || self.planner.settings().shading_reuse.is_some()
    }

    /// The eyes of a frame.
    pub fn rig(&self, views: &FrameViews) -> Rig {
        let eye = |eye: &Eye| visibility::Eye {
            view: views.eyes[*eye as usize],
            lens: self.planner.lenses()[*eye as usize],
            size_px: self.planner.hmd().eye_size_px,
        };
        Rig::new(self.planner.eyes().iter().map(eye).collect())
    }

    /// Renders the frame's shadow maps, once for all its pictures.
    ///
    /// # Errors
    /// Driver errors.
    pub fn light(
        &self,
        backend: &mut dyn CaptureBackend,
        frame: &Frame,
    ) -> Result<Duration, RasterError> {
        let start = Instant::now();
        backend.render_shadows(self.draws, frame)?;
        Ok(start.elapsed())
    }

    /// Makes the driver compile every shader of the frame's plain and captured pictures by
    /// rendering a tile of each layer. Measured times then exclude compilation.
    ///
    /// # Errors
    /// Driver errors.
    pub fn warm_up(
        &self,
        backend: &mut dyn CaptureBackend,
        frame: &Frame,
    ) -> Result<(), RasterError> {
        for view in frame.views() {
            let layer = view.layer;
            let open = layer
                .mask
                .as_ref()
                .map_or(Some([0, 0]), |mask| mask.first());
            let Some(open) = open else { continue };
            let origin_px = open.map(|px| px / TILE_SIZE_PX * TILE_SIZE_PX);
            let tile = Region {
                origin_px,
                size_px: [0, 1]
                    .map(|axis: usize| (layer.size_px[axis] - origin_px[axis]).min(TILE_SIZE_PX)),
            };
            backend.render(self.draws, &view, tile, None)?;
            let recording = RecordRequest {
                fragments: self.fragments,
                picture: self.draws_pictures(),
                sink: &mut |_| Ok(()),
            };
            backend.render(self.draws, &view, tile, Some(recording))?;
        }
        if self.planner.settings().multiview {
            // Tests whether the driver's multiview is sound.
            self.render_layers(backend, frame)?;
        }
        backend.compose(frame)
    }

    /// Renders every layer of a frame without capture. With multiview, both eyes are rendered in
    /// one submission if their pictures are plain layers. The frame's shadow maps have been
    /// rendered.
    ///
    /// # Errors
    /// Driver errors.
    pub fn render_layers(
        &self,
        backend: &mut dyn CaptureBackend,
        frame: &Frame,
    ) -> Result<(), RasterError> {
        let views: Vec<View<'_>> = frame.views().collect();
        if let ([left, right], true) = (&views[..], self.draws_both_at_once(frame)) {
            return (backend.for_technique("multiview")?).render_both(self.draws, [left, right]);
        }
        for view in &views {
            let whole = Region {
                origin_px: [0, 0],
                size_px: view.layer.size_px,
            };
            backend.render(self.draws, view, whole, None)?;
        }
        Ok(())
    }

    /// True if one draw call renders both eyes' pictures: with multiview, if these are plain
    /// layers.
    pub fn draws_both_at_once(&self, frame: &Frame) -> bool {
        let layers = &frame.plan.layers;
        self.planner.settings().multiview
            && layers.len() == 2
            && layers.iter().all(techniques::Layer::is_plain)
    }

    /// Renders a frame without capture: renders every layer, then composes and reads the pictures.
    /// The frame's shadow maps have been rendered.
    ///
    /// # Errors
    /// Driver errors.
    pub fn plain_frame(
        &self,
        backend: &mut dyn CaptureBackend,
        frame: &Frame,
    ) -> Result<(Pictures, Duration), RasterError> {
        let start = Instant::now();
        self.render_layers(backend, frame)?;
        let pictures = pictures(backend, frame)?;
        Ok((pictures, start.elapsed()))
    }

    /// Renders a frame with capture and appends its tiles to the trace. The frame's shadow maps have
    /// been rendered, and its first layer is the trace's next render pass.
    ///
    /// # Errors
    /// Driver errors, a tile whose records exceed the budget, and errors of writing.
    pub fn capture_frame<W: Write + Seek>(
        &self,
        backend: &mut dyn CaptureBackend,
        frame: &Frame,
        recorder: &mut Recorder<W>,
    ) -> Result<CapturedFrame, RasterError> {
        let mut counts = CaptureCounts::default();
        let mut sorting = Duration::ZERO;
        let first_pass = recorder.next_pass();
        self.check_passes(frame, &recorder.tables().passes, first_pass)?;
        if recorder.writer().has_geometry()
            && let Some(&pass) = recorder.tables().passes.get(first_pass)
        {
            for (view, lists) in
                geometry::views(self.scene, self.draws, frame, pass.frame, first_pass)
            {
                let written = recorder.writer().append_view(view, &lists);
                written.map_err(RecordError::from)?;
            }
        }
        for view in frame.views() {
            let mut capturer = ViewCapturer {
                backend: &mut *backend,
                draws: self.draws,
                view,
                skip_regions: self.skips.regions,
                fragments: self.fragments,
                picture: self.draws_pictures(),
            };
            let recorded = recorder.capture_pass(&mut capturer)?;
            counts += recorded.counts;
            sorting += recorded.sorting;
        }
        let pictures = self.shaded.then(|| pictures(backend, frame));
        Ok(CapturedFrame {
            pictures: pictures.transpose()?,
            counts,
            sorting,
        })
    }

    /// Refuses a frame whose layers differ from those for which its render passes were written.
    fn check_passes(
        &self,
        frame: &Frame,
        passes: &[Pass],
        first_pass: usize,
    ) -> Result<(), RasterError> {
        let planned = passes.iter().skip(first_pass);
        let planned = planned.take_while(|pass| pass.frame == frame.number);
        if frame.plan.passes(frame.number).iter().eq(planned) {
            return Ok(());
        }
        Err(RasterError::Scene(format!(
            "frame {}: expected the layers that were planned for it, found {}",
            frame.number,
            frame.plan.layers.len()
        )))
    }

    /// Depth of the frame's layers from their latest rendering.
    ///
    /// # Errors
    /// A layer that has not been rendered, and driver errors.
    pub fn depths(
        &self,
        backend: &mut dyn CaptureBackend,
        frame: &Frame,
    ) -> Result<Vec<Vec<f32>>, RasterError> {
        (0..frame.plan.layers.len())
            .map(|layer| backend.layer_depth(layer))
            .collect()
    }
}

/// Composes a frame's pictures and reads them back.
fn pictures(backend: &mut dyn CaptureBackend, frame: &Frame) -> Result<Pictures, RasterError> {
    backend.compose(frame)?;
    (0..frame.plan.pictures.len())
        .map(|number| backend.picture(frame, number))
        .collect()
}

/// Captures one layer on a backend.
struct ViewCapturer<'a> {
    backend: &'a mut dyn CaptureBackend,
    draws: &'a DrawList,
    view: View<'a>,
    skip_regions: bool,
    fragments: Fragments,
    picture: bool,
}

impl Capturer for ViewCapturer<'_> {
    type Error = RasterError;

    fn record_capacity(&self) -> u64 {
        self.backend.record_capacity()
    }

    fn capture(&mut self, region: Region, sink: &mut Sink<'_>) -> Result<Captured, RasterError> {
        // For a part of the layer, only the draws that may touch it are needed.
        let touching = if self.skip_regions {
            self.draws.touching(&self.view, region)
        } else {
            self.view.visible.to_vec()
        };
        let view = View {
            visible: &touching,
            ..self.view
        };
        let recording = RecordRequest {
            fragments: self.fragments,
            picture: self.picture,
            sink,
        };
        (self.backend).render(self.draws, &view, region, Some(recording))
    }
}
