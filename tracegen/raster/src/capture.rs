//! Captures the frames of a scene into a trace.

use super::backend::{CaptureBackend, View};
use super::cascades;
use super::draws::{DrawList, DrawMode};
use super::error::RasterError;
use super::frame::Frame;
use super::lighting::Lighting;
use formats::textrace::{Pass, PassKind, Tables, TextraceWriter};
use formats::view::{Eye, FrameViews, TILE_SIZE_PX};
use record::{CaptureCounts, Captured, Capturer, Recorder, Region, Sink};
use std::io::{Seek, Write};
use std::time::{Duration, Instant};

/// What to capture, the same for plain rendering and capture.
pub struct CaptureJob<'a> {
    /// Draws.
    pub draws: &'a DrawList,
    /// Lights; cascades are fitted per frame.
    pub lighting: Lighting,
    /// World-space bounds of the scene.
    pub bounds: (glam::Vec3, glam::Vec3),
    /// Distances from the head that the cascades span, metres.
    pub shadow_range_m: [f32; 2],
    /// Pixels of one view.
    pub size_px: [u32; 2],
    /// The views of each frame, in the order of their passes.
    pub views: &'a [Eye],
}

/// The pictures of one frame, one a view: sRGB RGBA8.
pub type Pictures = Vec<Vec<u8>>;

impl CaptureJob<'_> {
    /// Passes of `frames` frames in the order in which [`Self::capture_frame`] writes them.
    #[must_use]
    pub fn passes(&self, frames: u32) -> Vec<Pass> {
        let pass = |frame, eye| Pass {
            frame,
            kind: PassKind::Main,
            eye: Some(eye),
            size_px: self.size_px,
            tiles: self.size_px.map(|s| s.div_ceil(TILE_SIZE_PX)),
        };
        (0..frames)
            .flat_map(|frame| self.views.iter().map(move |eye| pass(frame, *eye)))
            .collect()
    }

    /// The recorder of this job's passes; `tables` are the trace's.
    #[must_use]
    pub fn recorder<'t>(&self, tables: &'t Tables) -> Recorder<'t> {
        let modes = self.draws.calls.iter().map(|call| call.mode);
        Recorder::new(tables, modes.map(|mode| mode == DrawMode::Masked).collect())
    }

    /// Fits the frame's shadow cascades to both eyes, whichever are captured, and finds what each
    /// view may see.
    #[must_use]
    pub fn frame(&self, views: &FrameViews) -> Frame {
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
        let eyes: Vec<_> = (self.views.iter())
            .map(|eye| views.eyes[*eye as usize])
            .collect();
        Frame::new(self.draws, lighting, &eyes)
    }

    /// Renders the frame's shadow maps: once for all its pictures.
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

    /// Makes the driver compile every shader that the frame's plain and captured pictures use, by
    /// rendering one tile of each, so that neither's time includes it.
    ///
    /// # Errors
    /// Driver errors.
    pub fn warm_up(
        &self,
        backend: &mut dyn CaptureBackend,
        frame: &Frame,
    ) -> Result<(), RasterError> {
        let corner = Region {
            origin_px: [0, 0],
            size_px: self.size_px.map(|s| s.min(TILE_SIZE_PX)),
        };
        for view in frame.views() {
            backend.render(self.draws, &view, corner, None)?;
            backend.render(self.draws, &view, corner, Some(&mut |_| Ok(())))?;
        }
        Ok(())
    }

    /// Renders a frame without capture: every view, pictures read back. The frame's shadow maps
    /// have been rendered.
    ///
    /// # Errors
    /// Driver errors.
    pub fn plain_frame(
        &self,
        backend: &mut dyn CaptureBackend,
        frame: &Frame,
    ) -> Result<(Pictures, Duration), RasterError> {
        let start = Instant::now();
        let whole = Region {
            origin_px: [0, 0],
            size_px: self.size_px,
        };
        let pictures = frame
            .views()
            .map(|view| {
                backend.render(self.draws, &view, whole, None)?;
                backend.picture()
            })
            .collect::<Result<_, _>>()?;
        Ok((pictures, start.elapsed()))
    }

    /// Renders a frame with capture and appends its tiles to the trace; `first_pass` is the
    /// number of the first view's pass. The frame's shadow maps have been rendered. The time is
    /// what sorting, encoding and writing took.
    ///
    /// # Errors
    /// Driver errors, a record budget that one tile overflows, and errors of writing.
    pub fn capture_frame<W: Write + Seek>(
        &self,
        backend: &mut dyn CaptureBackend,
        frame: &Frame,
        first_pass: usize,
        recorder: &mut Recorder<'_>,
        writer: &mut TextraceWriter<W>,
    ) -> Result<(Pictures, CaptureCounts, Duration), RasterError> {
        let mut pictures = Pictures::new();
        let mut counts = CaptureCounts::default();
        let mut sorting = Duration::ZERO;
        for (pass, view) in (first_pass..).zip(frame.views()) {
            let mut capturer = ViewCapturer {
                backend: &mut *backend,
                draws: self.draws,
                view,
                size_px: self.size_px,
            };
            let recorded = recorder.record_pass(&mut capturer, pass, writer)?;
            counts += recorded.counts;
            sorting += recorded.sorting;
            pictures.push(backend.picture()?);
        }
        Ok((pictures, counts, sorting))
    }
}

/// One view on a backend.
struct ViewCapturer<'a> {
    backend: &'a mut dyn CaptureBackend,
    draws: &'a DrawList,
    view: View<'a>,
    size_px: [u32; 2],
}

impl Capturer for ViewCapturer<'_> {
    type Error = RasterError;

    fn record_capacity(&self) -> u64 {
        self.backend.record_capacity()
    }

    fn capture(&mut self, region: Region, sink: &mut Sink<'_>) -> Result<Captured, RasterError> {
        // A part of the view needs only the draws that may touch it.
        let touching = self.draws.touching(&self.view, region, self.size_px);
        let view = View {
            visible: &touching,
            ..self.view
        };
        self.backend.render(self.draws, &view, region, Some(sink))
    }
}
