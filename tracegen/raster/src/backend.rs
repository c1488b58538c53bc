//! The interface between the capture and the drivers.

use super::batches::Plan;
use super::draws::DrawList;
use super::error::RasterError;
use super::frame::Frame;
use super::lavapipe::Lavapipe;
pub use super::view::{Fragments, View};
use record::{Captured, Region, Sink};
use scene::Scene;
use std::time::Duration;

/// What is recorded of a region, and the sink of the records.
pub struct RecordRequest<'s, 't> {
    /// Which fragments are recorded.
    pub fragments: Fragments,
    /// Draws the picture as well. Otherwise the layer's colour is unchanged.
    pub picture: bool,
    /// Receives every record of the region (see [`record::Capturer::capture`]).
    pub sink: &'s mut Sink<'t>,
}

/// Visibility of a draw.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Marks {
    /// A fragment is visible in the picture.
    pub picture: bool,
    /// A fragment is visible at a pixel whose centre is visible through the lens.
    pub lens: bool,
}

/// The samples of one texture slot of the materials by the visible fragments of a view, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Texels {
    /// Filtered colour as the shader gets it: linear red, green, blue, and alpha.
    pub colors: Vec<[f32; 4]>,
    /// Number of the primitive, or [`Self::NO_PRIMITIVE`].
    pub primitives: Vec<u32>,
}

impl Texels {
    /// Nothing is visible, or the visible material has no such texture.
    pub const NO_PRIMITIVE: u32 = u32::MAX;
}

/// Counts of a backend's work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Rendered regions of layers, including those that overflowed.
    pub regions: u64,
    /// Draws of all render passes.
    pub draws: u64,
    /// Draw calls for these draws.
    pub calls: u64,
    /// Pipelines, materials and meshes set before draw calls.
    pub state_changes: u64,
    /// Vertices of the draws' meshes, counted once per draw.
    pub vertices: u64,
    /// Triangles of the draws.
    pub triangles: u64,
    /// Bytes written to the driver for views, lists of draws, moving draws and moving vertices.
    pub bytes_uploaded: u64,
    /// Time spent on batching, encoding and submitting views, excluding pictures with records.
    pub submitting: Duration,
    /// Time spent waiting for these views.
    pub waiting: Duration,
    /// Time spent on composing pictures from layers.
    pub composing: Duration,
    /// Shadow maps rendered, one per cascade.
    pub shadow_maps: u64,
    /// Pipelines made.
    pub pipelines: u64,
    /// Samplers made.
    pub samplers: u64,
}

impl Work {
    /// Adds the draws of a render pass. `mesh_counts` returns a mesh's vertices and triangles.
    pub fn add_draws(
        &mut self,
        draws: &DrawList,
        plan: &Plan,
        mesh_counts: impl Fn(usize) -> [u32; 2],
    ) {
        for (batch, _) in plan {
            let instances = batch.range.len() as u64;
            let [vertices, triangles] = mesh_counts(draws.calls[batch.draw as usize].mesh);
            self.vertices += instances * u64::from(vertices);
            self.triangles += instances * u64::from(triangles);
            self.draws += instances;
        }
        self.calls += plan.len() as u64;
    }
}

impl std::ops::Sub for Work {
    type Output = Self;

    /// The work done since `earlier`.
    fn sub(self, earlier: Self) -> Self {
        Self {
            regions: self.regions - earlier.regions,
            draws: self.draws - earlier.draws,
            calls: self.calls - earlier.calls,
            state_changes: self.state_changes - earlier.state_changes,
            vertices: self.vertices - earlier.vertices,
            triangles: self.triangles - earlier.triangles,
            bytes_uploaded: self.bytes_uploaded - earlier.bytes_uploaded,
            submitting: self.submitting - earlier.submitting,
            waiting: self.waiting - earlier.waiting,
            composing: self.composing - earlier.composing,
            shadow_maps: self.shadow_maps - earlier.shadow_maps,
            pipelines: self.pipelines - earlier.pipelines,
            samplers: self.samplers - earlier.samplers,
        }
    }
}

/// A driver that renders a scene and returns what its fragments sampled.
///
/// A backend owns the uploaded scene. It renders one region of one layer at a time, so that the
/// memory for records stays bounded for any frame size. Regions of a layer may be rendered in any
/// order. Each layer of a frame has its own target, and the pictures are composed from these.
pub trait CaptureBackend {
    /// `lavapipe` or `osmesa`.
    fn name(&self) -> &'static str;

    /// The driver's own name and version string.
    fn driver(&self) -> &str;

    /// Largest number of records of one region.
    fn record_capacity(&self) -> u64;

    /// The missing driver feature because of which fragments are recorded one by one and merged;
    /// `None` if quads are recorded as wholes. The records are the same either way.
    fn records_fragments_because(&self) -> Option<&str>;

    /// The work done so far.
    fn work(&self) -> Work;

    /// Updates the positions of moving draws and of moving vertices. The others stay as they were
    /// uploaded.
    fn pose(&mut self, scene: &Scene, draws: &DrawList);

    /// Renders the shadow maps of a frame, if its lighting has any.
    ///
    /// # Errors
    /// Driver errors.
    fn render_shadows(&mut self, draws: &DrawList, frame: &Frame) -> Result<(), RasterError>;

    /// Renders a region of a layer into the layer's target, and records it if requested. Depth is
    /// the same either way, and so is the picture if the recording has one. Without a picture,
    /// [`Fragments::All`] writes no depth.
    ///
    /// # Errors
    /// Driver errors, and what the recording's sink returns.
    fn render(
        &mut self,
        draws: &DrawList,
        view: &View<'_>,
        region: Region,
        recording: Option<RecordRequest<'_, '_>>,
    ) -> Result<Captured, RasterError>;

    /// Composes the frame's pictures from its layers, all of whose regions have been rendered.
    /// Pictures that are single layers need no composition.
    ///
    /// # Errors
    /// Driver errors.
    fn compose(&mut self, _frame: &Frame) -> Result<(), RasterError> {
        Ok(())
    }

    /// Reads the depth in a layer's target: row by row, 1 where nothing was drawn.
    ///
    /// # Errors
    /// A layer that has not been rendered, and driver errors.
    fn layer_depth(&mut self, layer: usize) -> Result<Vec<f32>, RasterError>;

    /// Reads one of the frame's pictures, which have been composed: sRGB RGBA8, row by row.
    ///
    /// # Errors
    /// Driver errors.
    fn picture(&mut self, frame: &Frame, number: usize) -> Result<Vec<u8>, RasterError>;

    /// The only backend that draws with techniques; `None` for others.
    fn lavapipe(&mut self) -> Option<&mut Lavapipe> {
        None
    }
}

impl dyn CaptureBackend + '_ {
    /// The backend, if it draws with techniques.
    ///
    /// # Errors
    /// A backend that captures only plain frames.
    pub fn for_technique(&mut self, what: &str) -> Result<&mut Lavapipe, RasterError> {
        let driver = self.driver().to_owned();
        self.lavapipe().ok_or_else(|| RasterError::Unsupported {
            driver,
            what: what.to_owned(),
        })
    }
}
