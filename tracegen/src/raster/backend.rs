//! The joint between the capture and the drivers that it runs on.

use super::draws::DrawList;
use super::lighting::Lighting;
use formats::view::EyeView;
use glam::Mat4;

/// Bytes of one raw record.
pub const RECORD_BYTES: u64 = 44;

/// Bytes of one raw depth.
pub const DEPTH_BYTES: u64 = 20;

/// One covered quad in one uv group as the instrumented shader writes it.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct RawRecord {
    /// `qx:12 | qy:12 << 12 | mask:4 << 24 | group:4 << 28`, quads of the whole view.
    pub header: u32,
    /// Global primitive number.
    pub primitive: u32,
    /// Index into the draw table.
    pub draw: u32,
    /// Coordinates of the top-left lane, covered or not.
    pub uv: [f32; 2],
    /// Horizontal derivative of the top row.
    pub dx: [f32; 2],
    /// Vertical derivative of the left column.
    pub dy: [f32; 2],
    /// Change of the horizontal derivative from the top row to the bottom row.
    pub cross: [f32; 2],
}

impl RawRecord {
    /// Quad column in the view.
    #[must_use]
    pub fn qx(&self) -> u32 {
        self.header & 0xfff
    }

    /// Quad row in the view.
    #[must_use]
    pub fn qy(&self) -> u32 {
        self.header >> 12 & 0xfff
    }

    /// Covered lanes, bit 0 top left, 1 top right, 2 bottom left, 3 bottom right.
    #[must_use]
    pub fn mask(&self) -> u8 {
        (self.header >> 24 & 15) as u8
    }

    /// Uv group or `NO_GROUP`.
    #[must_use]
    pub fn group(&self) -> u8 {
        (self.header >> 28) as u8
    }

    /// Packs position, mask and group.
    #[must_use]
    pub fn pack(qx: u32, qy: u32, mask: u8, group: u8) -> u32 {
        qx & 0xfff | (qy & 0xfff) << 12 | u32::from(mask & 15) << 24 | u32::from(group) << 28
    }
}

/// What the in-order replay of an alpha-masked draw needs to know about a quad.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct RawDepth {
    /// Depth of each lane.
    pub depth: [f32; 4],
    /// Covered lanes whose alpha passes the test.
    pub passing: u32,
}

/// The raw records of one region, in no particular order.
#[derive(Clone, Copy, Debug)]
pub struct RawRecords<'a> {
    /// One a quad and uv group.
    pub quads: &'a [RawRecord],
    /// `depths[i]` belongs to `quads[i]` where that is group 0 of a masked draw, and means nothing
    /// elsewhere; empty where no draw is masked.
    pub depths: &'a [RawDepth],
}

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

/// Why a capture failed.
#[derive(Debug, thiserror::Error)]
pub enum RasterError {
    /// No usable driver.
    #[error(
        "no lavapipe (Mesa's CPU Vulkan driver) found{0}; install it with: apt-get install mesa-vulkan-drivers libvulkan1"
    )]
    NoDriver(String),
    /// A driver that lacks what the capture needs.
    #[error("{driver} lacks {what}")]
    Unsupported {
        /// Driver string.
        driver: String,
        /// What is missing.
        what: String,
    },
    /// The driver reported an error.
    #[error("the driver failed while {doing}: {message}")]
    Driver {
        /// What was being done.
        doing: &'static str,
        /// Its message.
        message: String,
    },
    /// Something is larger than the driver takes.
    #[error("{what}: {found} exceeds the limit of {limit}")]
    TooLarge {
        /// What is too large.
        what: String,
        /// How large it is.
        found: u64,
        /// How large it may be.
        limit: u64,
    },
    /// The smallest part of a frame does not fit the record buffer.
    #[error(
        "tile ({tx}, {ty}) alone needs {needed} records of {RECORD_BYTES} bytes, the record budget holds {capacity}; raise --record-budget"
    )]
    Budget {
        /// Tile column.
        tx: u32,
        /// Tile row.
        ty: u32,
        /// Records that the tile produces.
        needed: u64,
        /// Records that fit.
        capacity: u64,
    },
    /// Inconsistent input.
    #[error("{0}")]
    Scene(String),
    /// The trace could not be written.
    #[error("writing the trace: {0}")]
    Write(String),
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
