//! Files that a captured process writes for the launcher: events, one JSON object per line, and raw records.
//!
//! Every process has its own pair of files. Lines are written whole, and records are written before the event
//! that refers to them. The files are therefore usable even if the program was killed.

pub mod buffer;
pub mod control;
pub mod openxr;
mod read;
mod site;
mod write;

pub use buffer::{RawFragment, RawQuad, RawSample, UNIT_BYTES, Unit, unpack};
pub use read::{Process, ReadError, Reader};
pub use site::{Access, Binding, DepthTests, Form, Lod, Shape, Site, TextureSite, What};
pub use write::Writer;

use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Environment variable with the name of the folder; without it, the layer is inactive.
pub const FOLDER_VARIABLE: &str = "PARALLAX_CAPTURE_FOLDER";
/// Link to the layer's library in the folder, by which the loader opens it.
pub const LAYER_LINK: &str = "libparallax_layer.so";
/// Name of the layer for the loader.
pub const LAYER_NAME: &str = "VK_LAYER_PARALLAX_capture";
/// Caveat of an indirect draw command, whose draws share one number.
pub const INDIRECT: &str = "draws that the device chooses share a number";
/// File of [`Settings`] in the folder.
const SETTINGS_FILE: &str = "settings.json";
/// Extensions of a process's files.
const EVENTS: &str = "events";
const RECORDS: &str = "records";

/// Settings from the launcher.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Settings {
    /// Whether texture samples are recorded. Otherwise only render passes and draws are listed.
    pub records: bool,
    /// First requested frame, and the frame after the last one.
    pub frames: [u32; 2],
    /// How frames are counted.
    pub frames_by: FramesBy,
    /// Whether an occlusion query counts the samples of each draw.
    pub occlusion: bool,
    /// Size of the record buffer in bytes. It holds the records of one submission.
    pub record_bytes: u64,
    /// Whether small pictures of render passes are written.
    #[serde(default)]
    pub pictures: bool,
    /// Folder for every module, before and after it is rewritten.
    #[serde(default)]
    pub modules: Option<std::path::PathBuf>,
}

/// How frames are counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FramesBy {
    /// Presents; readbacks if the program has no swapchain; waits for rendering if it does not read back either.
    Auto,
    /// A frame ends when the program presents an image of a swapchain.
    Present,
    /// A frame ends when the program copies an image to a buffer.
    Readback,
    /// The launcher counts frames, through [`crate::control`].
    Launcher,
    /// A frame ends when the OpenXR runtime of the capture gets its pictures.
    OpenXr,
}

impl Settings {
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

/// File with the picture of a render pass.
fn picture(folder: &Path, process: &str, pass: u32) -> PathBuf {
    folder.join(format!("{process}-{pass}.rgba"))
}

fn file(folder: &Path, name: &str, extension: &str) -> PathBuf {
    folder.join(format!("{name}.{extension}"))
}

/// An event in a captured process.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// A process started to use Vulkan.
    Process {
        /// Process ID.
        pid: u32,
        /// Program and arguments.
        command: Vec<String>,
    },
    /// A device was opened.
    Device {
        /// Name of the device.
        name: String,
        /// Name and version of the driver.
        driver: String,
        /// Reason why nothing is recorded on the device, if any.
        refused: Option<String>,
        /// Whether one record holds all lanes of a quad.
        ballots: bool,
        /// Whether the caller implements OpenGL, whose images have their lowest row first.
        #[serde(default)]
        opengl: bool,
    },
    /// A recording shader was created.
    Shader(ShaderInfo),
    /// Description of an image.
    Image(ImageInfo),
    /// Description of a render pass.
    Pass(PassInfo),
    /// Description of a draw.
    Draw(DrawInfo),
    /// Command buffers were executed.
    Submit {
        /// Frame.
        frame: u32,
        /// Frame if the program's waits separate frames.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        frame_by_waits: Option<u32>,
        /// Number and render pass of each draw, in order of execution.
        draws: Vec<[u32; 2]>,
        /// The records of these draws in the file of records.
        records: Span,
        /// Number of bytes of records that did not fit the buffer.
        lost_bytes: u64,
        /// Samples counted by the occlusion query of each draw: number of the draw, and count.
        occlusion: Vec<(u32, u64)>,
        /// Dispatches whose shaders read textures.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        dispatches: Vec<DispatchInfo>,
    },
    /// Command buffers copied images.
    Copies {
        /// Frame.
        frame: u32,
        /// Numbers of the source and the destination of each copy, blit and resolve between images.
        pairs: Vec<[u32; 2]>,
        /// The same by array layer: image and layer of the source, image and layer of the destination.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        layers: Vec<[u32; 4]>,
        /// Numbers of the images of which one texel alone was copied to a buffer.
        probed: Vec<u32>,
    },
    /// The pictures that an OpenXR program showed to the left and the right eye.
    Shown {
        /// Frame.
        frame: u32,
        /// The eyes.
        eyes: [openxr::ShownEye; 2],
    },
    /// The small picture of a render pass. Its texels are in the file `PASS.rgba` next to the records, row by
    /// row.
    Picture {
        /// Number of the render pass.
        pass: u32,
        /// Width and height.
        size: [u32; 2],
    },
    /// A frame ended.
    Frame {
        /// Its number.
        frame: u32,
        /// Microseconds since the end of the previous frame.
        took_us: u64,
    },
    /// A frame ended, if the program's waits separate frames.
    Waited {
        /// Its number.
        frame: u32,
        /// Microseconds since the end of the previous frame.
        took_us: u64,
    },
    /// The device was destroyed.
    Closed,
    /// A problem that makes the capture incomplete.
    Trouble {
        /// Description of the problem.
        what: String,
    },
}

/// A range of the file of records.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Span {
    /// First unit, of [`UNIT_BYTES`] bytes.
    pub first: u64,
    /// Number of units.
    pub count: u64,
}

/// Fragment or vertex shader of a recording pipeline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShaderInfo {
    /// Number.
    pub shader: u32,
    /// Order of depth test and shading.
    pub tests: DepthTests,
    /// The sites where it records.
    pub sites: Vec<Site>,
}

/// An image.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageInfo {
    /// Number, in the order of creation. Handles are reused, so they are not unique.
    pub image: u32,
    /// `VkFormat`.
    pub format: i32,
    /// Width, height and depth.
    pub size: [u32; 3],
    /// Mip levels.
    pub levels: u32,
    /// Array layers.
    pub layers: u32,
    /// Samples per texel.
    pub samples: u32,
    /// Whether the image belongs to a swapchain.
    pub presented: bool,
}

/// A part of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct ViewInfo {
    /// Number of the image.
    pub image: u32,
    /// `VkFormat` of the view.
    pub format: i32,
    /// `VkImageViewType`.
    pub kind: i32,
    /// First level and number of levels.
    pub levels: [u32; 2],
    /// First layer and number of layers.
    pub layers: [u32; 2],
    /// Least level of the image that samples read, in 1/256 (`VK_EXT_image_view_min_lod`).
    #[serde(default)]
    pub min_lod_256ths: u32,
}

/// The part of a sampler's state that determines which texels are read.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SamplerInfo {
    /// `VkFilter` for magnification and minification.
    pub filters: [i32; 2],
    /// `VkSamplerMipmapMode`.
    pub mip: i32,
    /// `VkSamplerAddressMode` in u and v.
    pub wrap: [i32; 2],
    /// Bias, minimum and maximum of the level of detail.
    pub lod: [f32; 3],
    /// Maximum anisotropy; 1 if disabled.
    pub anisotropy: f32,
    /// Whether coordinates are in texels.
    pub unnormalized: bool,
    /// Whether the wrap modes also apply to the faces of cube maps (`VK_EXT_non_seamless_cube_map`).
    #[serde(default)]
    pub non_seamless: bool,
}

/// Targets of a render pass.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PassInfo {
    /// Number.
    pub pass: u32,
    /// Colour attachments, without unwritten ones.
    pub colors: Vec<ViewInfo>,
    /// Depth attachment.
    pub depth: Option<ViewInfo>,
    /// Left, top, width and height of the rendered area.
    pub area: [i32; 4],
    /// View mask; 0 without multiview.
    pub view_mask: u32,
    /// Whether colours or depth are cleared at the start.
    pub clears: bool,
}

/// A texture that a draw's shader may read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureInfo {
    /// Descriptor set.
    pub set: u32,
    /// Binding.
    pub binding: u32,
    /// Element of the binding's array.
    pub element: u32,
    /// The image, if one is bound.
    pub view: Option<ViewInfo>,
    /// The sampler, if one is bound.
    pub sampler: Option<SamplerInfo>,
}

/// Image instructions of a shader that are not recorded, for one kind of texture.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StageReads {
    /// Name of the stage.
    pub stage: String,
    /// Kind of texture.
    pub what: String,
    /// Number of instructions.
    pub instructions: u32,
}

/// A dispatch whose shader reads textures.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DispatchInfo {
    /// Number of workgroups in each direction; `None` if the device chose it.
    pub groups: Option<[u32; 3]>,
    /// Size of a workgroup.
    pub workgroup: [u32; 3],
    /// Texture reads of its shader.
    pub reads: Vec<StageReads>,
}

/// Depth test of a draw.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct DepthInfo {
    /// Whether the depth test is enabled.
    pub tests: bool,
    /// Whether fragments that pass write their depth.
    pub writes: bool,
    /// `VkCompareOp`.
    pub compare: i32,
    /// Whether the stencil test is enabled.
    pub stencil: bool,
}

/// A draw.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DrawInfo {
    /// Number.
    pub draw: u32,
    /// Number of its pipeline.
    pub pipeline: u32,
    /// Number of its recording shader; `None` if it is not recorded.
    pub shader: Option<u32>,
    /// Reason why it is not recorded although records were requested.
    pub unrecorded: Option<String>,
    /// Whether it is recorded by an additional draw before the program's, which writes nothing.
    pub twice: bool,
    /// Left, top, width and height. If the height is negative, the picture is upside down.
    pub viewport: [f32; 4],
    /// Left, top, width and height.
    pub scissor: [i32; 4],
    /// Written channels of each colour attachment, `VkColorComponentFlags`.
    pub color_masks: Vec<u32>,
    /// Whether colours are blended with those in the target.
    pub blends: bool,
    /// Depth test.
    pub depth: DepthInfo,
    /// `VkPrimitiveTopology`.
    pub topology: i32,
    /// Number of vertices or indices; 0 for indirect draws.
    pub vertices: u32,
    /// Number of instances; 0 for indirect draws.
    pub instances: u32,
    /// Samples per pixel.
    pub samples: u32,
    /// Reasons why its records are less exact.
    pub caveats: Vec<String>,
    /// Textures that its shader may read.
    pub textures: Vec<TextureInfo>,
    /// Texture reads of the shaders before its fragment shader that are not recorded.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reads: Vec<StageReads>,
    /// Number of its recording vertex shader; `None` if its vertices are not recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertex_shader: Option<u32>,
    /// Textures that its recording vertex shader may read.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub vertex_textures: Vec<TextureInfo>,
}

#[cfg(test)]
mod tests;
