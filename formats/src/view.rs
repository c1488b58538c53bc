//! Head-mounted displays, eyes and tiles: how a stereo pair looks at a scene.

use serde::{Deserialize, Serialize};

/// Edge length of a tile in pixels, as in Z2 paper section 4.1.
pub const TILE_SIZE_PX: u32 = 16;

/// Which eye a view belongs to. Monoscopic passes (a shadow map) have no eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Eye {
    /// View 0.
    Left,
    /// View 1.
    Right,
}

/// Tangents of the four half-angles of an eye's frustum, all positive for an on-axis eye.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FovTangents {
    /// Towards the left edge of the eye's image.
    pub left: f32,
    /// Towards the right edge of the eye's image.
    pub right: f32,
    /// Towards the top edge.
    pub up: f32,
    /// Towards the bottom edge.
    pub down: f32,
}

/// A head-mounted display: pixels, frusta and eye poses relative to the head.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Hmd {
    /// Preset name, or `custom`.
    pub name: String,
    /// Where the figures come from, or `unverified`.
    pub source: String,
    /// Width and height of one eye's image in pixels.
    pub eye_size_px: [u32; 2],
    /// Frustum of the left and of the right eye.
    pub fov: [FovTangents; 2],
    /// Distance between the eye centres in metres.
    pub ipd_m: f32,
    /// Outward yaw of each eye in degrees (0 for parallel eyes).
    pub cant_deg: f32,
}

/// One eye's matrices for one frame, column-major as glam stores them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EyeView {
    /// World to eye space; right-handed, looking down -z.
    pub world_to_eye: [[f32; 4]; 4],
    /// Eye space to clip space; depth 0 to 1, y up.
    pub eye_to_clip: [[f32; 4]; 4],
    /// Eye position in world space, metres.
    pub position: [f32; 3],
}

/// The cameras of one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameViews {
    /// Frame number, from 0.
    pub frame: u32,
    /// Left and right eye.
    pub eyes: [EyeView; 2],
}
