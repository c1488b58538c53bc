//! `manifest.json` of the folder that `tracegen techniques` writes and `replay techniques` reads, schema
//! `tracegen.techniques/1` (see docs/use/techniques-folder.md).
//!
//! Settings, predictions, counts and the record of a search are types of the writer. A reader leaves them as
//! JSON and ignores unknown keys, so that captures can record more.

use crate::view::{Hmd, Lens};
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// Schema of the manifest.
pub const SCHEMA: &str = "tracegen.techniques/1";

/// The whole manifest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Manifest<R = Row, Auto = Value> {
    /// `tracegen.techniques/1`.
    pub schema: String,
    /// Program and version.
    pub tool: String,
    /// Scene as given.
    pub scene: String,
    /// Triangles, including instances.
    pub scene_triangles: u64,
    /// Instances.
    pub instances: u64,
    /// Name of the camera.
    pub camera: String,
    /// The head's path as given.
    #[cfg_attr(feature = "testing", schemars(with = "String"))]
    pub path: Option<String>,
    /// Frames of that path.
    #[serde(default)]
    pub path_frames: u32,
    /// Numbers of the measured frames, ascending.
    pub frames: Vec<u32>,
    /// Frames per second along the path.
    #[cfg_attr(feature = "testing", schemars(with = "f32"))]
    pub fps: f64,
    /// Scene time of the path's first frame.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub time_s: f64,
    /// The animation that plays, as given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub animation: Option<String>,
    /// Width and height of an eye's picture.
    pub size_px: [u32; 2],
    /// The display.
    #[cfg_attr(feature = "testing", schemars(with = "Map<String, Value>"))]
    pub hmd: Hmd,
    /// Visible parts of the left and right eye's pictures.
    #[cfg_attr(feature = "testing", schemars(with = "[Map<String, Value>; 2]"))]
    pub lens: [Lens; 2],
    /// At the centre of an eye's picture.
    pub pixels_per_degree: f32,
    /// Device that renders.
    pub adapter: String,
    /// Its driver.
    pub driver: String,
    /// Whether the device is the processor, so that times are processor time.
    pub software_driver: bool,
    /// Technique that the others are compared with.
    pub baseline: String,
    /// Repetitions of each frame's timing.
    #[serde(default)]
    pub repeats: u32,
    /// Frames of each row's trace.
    #[serde(default)]
    pub trace_frames: Vec<u32>,
    /// How the tiles of the traces are packed.
    #[serde(default)]
    pub trace_encoding: String,
    /// Shadow cascades.
    #[serde(default)]
    pub shadow_cascades: u32,
    /// Checksum of the files that scene and path are read from.
    #[serde(default)]
    pub input_checksum: String,
    /// One row per technique or combination.
    pub rows: Vec<R>,
    /// The search for the cheapest techniques within a budget.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub auto: Option<Auto>,
    /// Defect of the device because of which views were drawn one by one instead of both at once.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub multiview_defect: Option<String>,
}

/// Omits a time of zero from manifests.
fn is_zero(time_s: &f64) -> bool {
    *time_s == 0.0
}

/// A measured row: a technique, or a combination of techniques.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[cfg_attr(
    feature = "testing",
    schemars(
        rename = "RowRecord",
        bound = "F: schemars::JsonSchema, Settings: Default + Serialize"
    )
)]
pub struct Row<Settings = Value, F = Frame> {
    /// Name, unique in the manifest.
    pub technique: String,
    /// Title for readers.
    pub title: String,
    /// Settings of its capture.
    #[serde(default)]
    #[cfg_attr(feature = "testing", schemars(with = "Map<String, Value>"))]
    pub settings: Settings,
    /// Techniques that it consists of.
    #[serde(default)]
    pub parts: Vec<String>,
    /// Whether no visible pixel may change.
    pub lossless: bool,
    /// One per measured frame.
    pub frames: Vec<F>,
    /// Peak memory of the process, if the system reports it.
    pub peak_memory_bytes: Option<u64>,
    /// Texels of the scene, which do not depend on the technique.
    #[cfg_attr(feature = "testing", schemars(with = "u64"))]
    pub texture_bytes: Option<u64>,
    /// Texture trace, relative to the folder.
    pub trace: Option<String>,
    /// Its content checksum; missing in folders of earlier versions.
    pub trace_checksum: Option<String>,
    /// Frames of the trace.
    #[serde(default)]
    pub trace_frames: Vec<u32>,
}

/// A frame of a row. Names with `_s` are times, which differ from run to run; nothing else does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
#[cfg_attr(
    feature = "testing",
    schemars(
        rename = "FrameRecord",
        bound = "Counted: schemars::JsonSchema, Predicted: Default + Serialize"
    )
)]
pub struct Frame<Counted = IgnoredAny, Predicted = Map<String, Value>> {
    /// Number.
    pub frame: u32,
    /// Boxes tested against volumes.
    pub cull_tests: u64,
    /// Time of culling, the median of the repeats.
    pub cull_s: f64,
    /// Draws that were culled although they are visible through the lens, both eyes; none if the device
    /// cannot count them.
    pub false_negatives: Option<u64>,
    /// Draws that were submitted although they are not visible through the lens, both eyes.
    pub false_positives: Option<u64>,
    /// Draws submitted.
    pub draws: u64,
    /// Calls that submitted them.
    pub draw_calls: u64,
    /// Pipelines, materials and meshes set.
    pub state_changes: u64,
    /// Vertices of the draws' meshes.
    pub vertices: u64,
    /// Triangles of the draws.
    pub triangles: u64,
    /// Covered 2x2 quads; none if the device cannot capture.
    pub quads: Option<u64>,
    /// Shaded fragments.
    pub fragments: Option<u64>,
    /// Bytes written to the device for views and lists of draws.
    pub bytes_uploaded: u64,
    /// Memory traffic by counts; none if the device cannot capture.
    pub counted: Option<Counted>,
    /// The sum of these bytes.
    pub memory_bytes: Option<u64>,
    /// Energy of the counts.
    pub energy_mj: Option<f64>,
    /// Bytes of pictures read and written, if the frame was reprojected from the one before.
    #[serde(default)]
    pub bytes_reprojected: u64,
    /// Bytes of the colour that the frame is rendered into.
    #[cfg_attr(feature = "testing", schemars(with = "u64"))]
    pub target_color_bytes: Option<u64>,
    /// Bytes of its depth buffers that exist at the same time.
    #[cfg_attr(feature = "testing", schemars(with = "u64"))]
    pub target_depth_bytes: Option<u64>,
    /// Times of the frame without capture, one per repetition.
    pub frame_s: Vec<f64>,
    /// Times of the baseline's frame, each measured next to the repetition.
    #[serde(default)]
    pub baseline_s: Vec<f64>,
    /// Processor time of the frame in each repetition over all threads, if the system reports it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub processor_s: Vec<f64>,
    /// Processor time of the baseline next to it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub baseline_processor_s: Vec<f64>,
    /// Processor time by stage, the median of the repetitions.
    #[serde(default)]
    #[cfg_attr(
        feature = "testing",
        schemars(with = "std::collections::BTreeMap<String, f64>")
    )]
    pub stages_s: Map<String, Value>,
    /// Left and right picture, relative to the folder.
    pub images: [String; 2],
    /// CRC-32 of their files as 8 hexadecimal digits; missing in folders of earlier versions.
    #[cfg_attr(feature = "testing", schemars(with = "[String; 2]"))]
    pub image_checksums: Option<[String; 2]>,
    /// Errors that the techniques predict.
    #[serde(default)]
    #[cfg_attr(feature = "testing", schemars(with = "Map<String, Value>"))]
    pub predicted: Predicted,
}

impl<Settings, F, Auto> Manifest<Row<Settings, F>, Auto> {
    /// The row of the baseline.
    pub fn baseline_row(&self) -> Option<&Row<Settings, F>> {
        self.rows.iter().find(|row| row.technique == self.baseline)
    }
}
