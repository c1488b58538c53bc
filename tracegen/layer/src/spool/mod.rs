//! Files that a captured process leaves for the launcher: events, one JSON object per line, and raw records.
//!
//! Every process writes its own pair of files. Lines are written whole, and a span of records is written
//! before the event that refers to it, so the files of a killed program are as usable as those of one that
//! ended.

mod read;
mod write;

pub use read::{Process, ReadError, Reader};
pub use write::Writer;

use crate::inject::{DepthTests, Site};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Environment variable that names the folder; without it the layer does nothing.
pub const FOLDER_VARIABLE: &str = "PARALLAX_CAPTURE_FOLDER";
/// Name of the layer for the loader.
pub const LAYER_NAME: &str = "VK_LAYER_PARALLAX_capture";
/// File of [`Settings`] in the folder.
const SETTINGS_FILE: &str = "settings.json";
/// Extensions of a process's files.
const EVENTS: &str = "events";
const RECORDS: &str = "records";

/// Settings from the launcher.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Settings {
    /// Whether texture samples are recorded. Otherwise only passes and draws are listed.
    pub records: bool,
    /// First frame, and the first one that is of no interest any more.
    pub frames: [u32; 2],
    /// How frames are counted.
    pub frames_by: FramesBy,
    /// Every draw is counted by an occlusion query as well.
    pub occlusion: bool,
    /// Bytes for the records of one submission.
    pub record_bytes: u64,
    /// Whether small pictures of passes are kept.
    #[serde(default)]
    pub pictures: bool,
    /// Folder for every module as the program gave it and as it records.
    #[serde(default)]
    pub modules: Option<std::path::PathBuf>,
}

/// How frames are counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FramesBy {
    /// Presents, or readbacks of a program that has no swapchain.
    Auto,
    /// The program presents an image of a swapchain.
    Present,
    /// The program copies an image to a buffer.
    Readback,
    /// The launcher counts, through [`crate::control`].
    Launcher,
}

impl Settings {
    /// Writes them into a capture's folder.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn save(&self, folder: &Path) -> std::io::Result<()> {
        std::fs::write(folder.join(SETTINGS_FILE), serde_json::to_vec(self)?)
    }

    /// Reads a capture's settings.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn load(folder: &Path) -> std::io::Result<Self> {
        let bytes = std::fs::read(folder.join(SETTINGS_FILE))?;
        Ok(serde_json::from_slice(&bytes)?)
    }
}

/// File of the picture of a pass.
fn picture(folder: &Path, process: &str, pass: u32) -> PathBuf {
    folder.join(format!("{process}-{pass}.rgba"))
}

fn file(folder: &Path, name: &str, extension: &str) -> PathBuf {
    folder.join(format!("{name}.{extension}"))
}

/// One thing that happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// A process begins to use Vulkan.
    Process {
        /// Its id.
        pid: u32,
        /// Its program and arguments.
        command: Vec<String>,
    },
    /// A device was opened.
    Device {
        /// As it names itself.
        name: String,
        /// Driver and version, likewise.
        driver: String,
        /// Why nothing is recorded on it, if so.
        refused: Option<String>,
        /// Records are those of quads.
        ballots: bool,
    },
    /// A shader that records.
    Shader(ShaderInfo),
    /// An image.
    Image(ImageInfo),
    /// A render pass, as far as draws need it.
    Pass(PassInfo),
    /// A draw.
    Draw(DrawInfo),
    /// Command buffers were executed.
    Submit {
        /// Frame.
        frame: u32,
        /// Number and pass of each draw in the order of execution.
        draws: Vec<[u32; 2]>,
        /// Records of these draws, in the records' file.
        records: Span,
        /// Bytes of records that found no room.
        lost_bytes: u64,
        /// Samples that each draw's occlusion query counted: number of the draw and count.
        occlusion: Vec<(u32, u64)>,
    },
    /// A small picture of a pass: a file `PASS.rgba` next to the records has its texels, row by row.
    Picture {
        /// Number of the pass.
        pass: u32,
        /// Width and height.
        size: [u32; 2],
    },
    /// A frame ended.
    Frame {
        /// Its number.
        frame: u32,
    },
    /// The device was closed: nothing follows from it.
    Closed,
    /// Something made the capture worth less.
    Trouble {
        /// What it was.
        what: String,
    },
}

/// A run of records in the records' file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Span {
    /// Its first unit of [`crate::inject::UNIT_BYTES`].
    pub first: u64,
    /// How many units.
    pub count: u64,
}

/// A fragment shader of a pipeline that records.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShaderInfo {
    /// Number.
    pub shader: u32,
    /// When its fragments are tested.
    pub tests: DepthTests,
    /// What it records.
    pub sites: Vec<Site>,
}

/// An image.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageInfo {
    /// Number, in the order of creation: handles are used again.
    pub image: u32,
    /// `VkFormat`.
    pub format: i32,
    /// Width, height and depth.
    pub size: [u32; 3],
    /// Mip levels.
    pub levels: u32,
    /// Array layers.
    pub layers: u32,
    /// Samples a texel.
    pub samples: u32,
    /// An image of a swapchain.
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
}

/// A sampler, as far as it decides which texels are read.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SamplerInfo {
    /// `VkFilter` for magnification and minification.
    pub filters: [i32; 2],
    /// `VkSamplerMipmapMode`.
    pub mip: i32,
    /// `VkSamplerAddressMode` in u and v.
    pub wrap: [i32; 2],
    /// Bias, least and largest level of detail.
    pub lod: [f32; 3],
    /// Largest anisotropy; 1 without.
    pub anisotropy: f32,
    /// Coordinates are texels.
    pub unnormalized: bool,
}

/// Target of a pass.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PassInfo {
    /// Number.
    pub pass: u32,
    /// Colour attachments; those without writes are left out.
    pub colors: Vec<ViewInfo>,
    /// Depth attachment.
    pub depth: Option<ViewInfo>,
    /// Left, top, width and height of the rendered area.
    pub area: [i32; 4],
    /// Views that each draw is broadcast to; 0 without multiview.
    pub view_mask: u32,
    /// Colours or depth are cleared, and not those of an earlier pass.
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
    /// The image, where there is one.
    pub view: Option<ViewInfo>,
    /// The sampler, where there is one.
    pub sampler: Option<SamplerInfo>,
}

/// Depth test of a draw.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct DepthInfo {
    /// Fragments are tested.
    pub tests: bool,
    /// Those that pass write their depth.
    pub writes: bool,
    /// `VkCompareOp`.
    pub compare: i32,
    /// Stencil is tested, too.
    pub stencil: bool,
}

/// A draw.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DrawInfo {
    /// Number.
    pub draw: u32,
    /// Number of its pipeline.
    pub pipeline: u32,
    /// Number of its recording shader; none if it does not record.
    pub shader: Option<u32>,
    /// Why it does not record, where it should.
    pub unrecorded: Option<String>,
    /// Recorded by an additional draw before the program's, which writes nothing.
    pub twice: bool,
    /// Left, top, width and height; a negative height is a picture upside down.
    pub viewport: [f32; 4],
    /// Left, top, width and height.
    pub scissor: [i32; 4],
    /// Channels written of each colour attachment, `VkColorComponentFlags`.
    pub color_masks: Vec<u32>,
    /// Colours are blended with those that are there.
    pub blends: bool,
    /// Depth test.
    pub depth: DepthInfo,
    /// `VkPrimitiveTopology`.
    pub topology: i32,
    /// Vertices or indices; 0 if only the device knows the number.
    pub vertices: u32,
    /// Instances, likewise.
    pub instances: u32,
    /// Samples per pixel.
    pub samples: u32,
    /// Reasons why its records are less exact.
    pub caveats: Vec<String>,
    /// Textures that its shader may read.
    pub textures: Vec<TextureInfo>,
}

#[cfg(test)]
mod tests;
