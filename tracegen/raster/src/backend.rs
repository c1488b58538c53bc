//! The joint between the capture and the drivers that it runs on.

use super::draws::DrawList;
use super::error::RasterError;
use super::lighting::Lighting;
use formats::view::EyeView;
use glam::Mat4;
use record::RawRecords;

/// A rectangle of the view in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Left and top edge.
    pub origin_px: [u32; 2],
    /// Width and height.
    pub size_px: [u32; 2],
}

/// What every draw of a view shares.
#[derive(Clone, Debug)]
pub struct View<'a> {
    /// Eye matrices.
    pub eye: EyeView,
    /// Lights and shadow matrices of the frame.
    pub lighting: &'a Lighting,
    /// Draws that may be visible, as indices into the draw list, ascending.
    pub visible: &'a [u32],
}

impl View<'_> {
    /// World to clip space.
    #[must_use]
    pub fn clip_from_world(&self) -> Mat4 {
        Mat4::from_cols_array_2d(&self.eye.eye_to_clip)
            * Mat4::from_cols_array_2d(&self.eye.world_to_eye)
    }
}

/// What became of one region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rendered {
    /// The picture is complete; this many records were handed to the sink (0 without capture).
    Complete {
        /// Records of the region.
        records: u64,
    },
    /// The record buffer was too small; nothing was handed over and the region must be rendered
    /// again in parts.
    Overflow {
        /// Records that the region produces.
        needed: u64,
    },
}

/// A driver that renders a scene and hands over what its fragments sampled.
///
/// A backend owns the uploaded scene. It renders one region of one view at a time, so that the
/// memory for records stays bounded however large the frame; regions of a view may be rendered in
/// any order and need not be disjoint in time.
pub trait CaptureBackend {
    /// `lavapipe` or `osmesa`.
    fn name(&self) -> &'static str;

    /// Driver string as it names itself.
    fn driver(&self) -> &str;

    /// Records that one region may produce.
    fn record_capacity(&self) -> u64;

    /// Renders the shadow maps of a frame, if the lighting has any.
    ///
    /// # Errors
    /// Driver errors.
    fn render_shadows(&mut self, draws: &DrawList, lighting: &Lighting) -> Result<(), RasterError>;

    /// Renders a region of a view into the view's picture, and with `capture` hands every record
    /// of the region to `sink`.
    ///
    /// # Errors
    /// Driver errors.
    fn render(
        &mut self,
        draws: &DrawList,
        view: &View<'_>,
        region: Region,
        capture: bool,
        sink: &mut dyn FnMut(RawRecords<'_>) -> Result<(), RasterError>,
    ) -> Result<Rendered, RasterError>;

    /// Reads the picture that the regions since have filled: sRGB RGBA8, row by row.
    ///
    /// # Errors
    /// Driver errors.
    fn picture(&mut self) -> Result<Vec<u8>, RasterError>;
}
