//! What the OpenXR runtime gets from the launcher, and what it tells the layer of the same process.

use serde::{Deserialize, Serialize};
use std::ffi::CStr;
use std::path::Path;

/// File of [`RuntimeSettings`] in the capture's folder.
const SETTINGS_FILE: &str = "openxr.json";

/// A rigid pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Unit quaternion: x, y, z, w.
    pub orientation: [f64; 4],
    /// Position in metres.
    pub position_m: [f64; 3],
}

/// An eye of the display.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DisplayEye {
    /// Pose relative to the head.
    pub in_head: Pose,
    /// Tangents of the half-angles: left, right, up, down; all positive for an eye that looks straight ahead.
    pub tangents: [f32; 4],
    /// Corners of the hidden triangles, as tangents to the right and up.
    pub hidden: Vec<[[f32; 2]; 3]>,
}

/// The space in which the head's path is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PathSpace {
    /// The space `LOCAL`, whose origin is where the head usually starts.
    Local,
    /// The space `STAGE`, whose origin is on the floor.
    Stage,
}

/// The simulated display and the head's path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RuntimeSettings {
    /// Name of the system.
    pub system: String,
    /// Recommended width and height of an eye's picture.
    pub eye_size_px: [u32; 2],
    /// Left and right eye.
    pub eyes: [DisplayEye; 2],
    /// The head's pose in each shown frame; the last one holds for later frames.
    pub heads: Vec<Pose>,
    /// Space of `heads`.
    pub space: PathSpace,
    /// Height of the eyes above the floor, in metres.
    pub eye_height_m: f64,
    /// Nanoseconds from frame to frame.
    pub frame_ns: i64,
    /// Number of shown frames after which the runtime asks the program to end.
    pub frames: u32,
    /// Number of frames without a picture for the eyes after which it does so.
    pub most_empty_frames: u32,
}

impl RuntimeSettings {
    /// Writes the settings into a capture's folder.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn save(&self, folder: &Path) -> std::io::Result<()> {
        std::fs::write(folder.join(SETTINGS_FILE), serde_json::to_vec(self)?)
    }

    /// Reads the settings of a capture.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn load(folder: &Path) -> std::io::Result<Self> {
        let bytes = std::fs::read(folder.join(SETTINGS_FILE))?;
        Ok(serde_json::from_slice(&bytes)?)
    }
}

/// A picture that a program shows to an eye in a frame, as the runtime tells it the layer.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ShownView {
    /// `VkImage` handle.
    pub image: u64,
    /// Array layer of the image.
    pub layer: u32,
    /// Left, top, width and height of the picture in the image.
    pub rect: [i32; 4],
    /// Orientation of the eye in the space of the head's path: x, y, z, w.
    pub orientation: [f32; 4],
    /// Position of the eye in that space, in metres.
    pub position_m: [f32; 3],
    /// Angles of the left, right, upper and lower edge in radians, as the program passed them.
    pub angles: [f32; 4],
    /// Distances of the near and the far plane in metres; zeros if the program did not tell.
    pub planes_m: [f32; 2],
}

/// Name of the layer's function that ends a frame of an OpenXR program.
pub const END_FRAME: &CStr = c"parallax_end_openxr_frame";

/// Type of that function: the `VkDevice` handle of the session, and the frame's views, of which there are 2.
pub type EndFrame = unsafe extern "C" fn(device: u64, views: *const ShownView);

/// An image of Vulkan.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct NewestImage {
    /// `VkDevice` handle.
    pub device: u64,
    /// `VkImage` handle.
    pub image: u64,
}

/// Name of the layer's function that finds the image of a texture of OpenGL.
pub const NEWEST_IMAGE: &CStr = c"parallax_newest_openxr_image";

/// Type of that function: width, height, layers and samples of the image, which is the newest one of this size that the
/// function has not found before; and where it is written. Returns whether there is one.
pub type FindNewestImage =
    unsafe extern "C" fn(size: *const [u32; 4], found: *mut NewestImage) -> bool;

/// A picture that a program showed to an eye.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShownEye {
    /// Number of the image.
    pub image: u32,
    /// Array layer of the image.
    pub layer: u32,
    /// Left, top, width and height of the picture in the image.
    pub rect: [i32; 4],
    /// Orientation of the eye: x, y, z, w.
    pub orientation: [f32; 4],
    /// Position of the eye in metres.
    pub position_m: [f32; 3],
    /// Angles of the left, right, upper and lower edge in radians.
    pub angles: [f32; 4],
    /// Distances of the near and the far plane in metres, if the program told them; no far plane if it is infinitely
    /// far away.
    pub planes_m: Option<(f32, Option<f32>)>,
}

impl ShownView {
    /// The view of an image with a number.
    pub fn of_image(&self, image: u32) -> ShownEye {
        let [near, far] = self.planes_m;
        // With a reversed depth, programs exchange the planes.
        let (near, far) = if near > far { (far, near) } else { (near, far) };
        let known = near > 0.0 && near.is_finite() && far > near;
        ShownEye {
            image,
            layer: self.layer,
            rect: self.rect,
            orientation: self.orientation,
            position_m: self.position_m,
            angles: self.angles,
            planes_m: known.then(|| (near, far.is_finite().then_some(far))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_are_in_order_or_unknown() {
        let view = |planes_m| ShownView {
            image: 1,
            layer: 0,
            rect: [0; 4],
            orientation: [0.0, 0.0, 0.0, 1.0],
            position_m: [0.0; 3],
            angles: [0.0; 4],
            planes_m,
        };
        let planes = |planes_m| view(planes_m).of_image(7).planes_m;
        assert_eq!(planes([0.1, 50.0]), Some((0.1, Some(50.0))));
        assert_eq!(planes([50.0, 0.1]), Some((0.1, Some(50.0))));
        assert_eq!(planes([f32::INFINITY, 0.1]), Some((0.1, None)));
        for unknown in [
            [0.0, 0.0],
            [0.0, 5.0],
            [1.0, 1.0],
            [f32::NAN, 1.0],
            [-1.0, 2.0],
        ] {
            assert_eq!(planes(unknown), None, "{unknown:?}");
        }
    }
}
