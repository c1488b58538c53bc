//! `manifest.json` of a folder that `tracegen techniques` writes, schema `tracegen.techniques/1`.
//!
//! Unknown keys are ignored, so that captures can record more.

use formats::view::{Hmd, Lens};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// Schema of the manifest.
pub(super) const MANIFEST_SCHEMA: &str = "tracegen.techniques/1";

/// The whole manifest.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Manifest {
    /// `tracegen.techniques/1`.
    pub schema: String,
    /// Program and version that wrote the manifest.
    pub tool: String,
    /// Scene as given on the command line.
    pub scene: String,
    /// Triangles of the scene, instances counted.
    pub scene_triangles: u64,
    /// Instances of the scene.
    pub instances: u64,
    /// Name of the camera.
    pub camera: String,
    /// Camera path, if the camera moves.
    #[serde(default)]
    pub path: Option<String>,
    /// Numbers of the frames, ascending.
    pub frames: Vec<u32>,
    /// Frames per second along the path.
    pub fps: f64,
    /// Width and height of the image of each eye in pixels.
    pub size_px: [u32; 2],
    /// The display.
    pub hmd: Hmd,
    /// Visible area of the left and the right eye's image.
    pub lens: [Lens; 2],
    /// Pixels per degree at the centre of each eye's image.
    pub pixels_per_degree: f32,
    /// Device that rendered.
    pub adapter: String,
    /// Its driver.
    pub driver: String,
    /// Whether the device is the processor.
    pub software_driver: bool,
    /// Technique that the others are compared with.
    pub baseline: String,
    /// One row per technique or combination.
    pub rows: Vec<ManifestRow>,
    /// Result of the search for the cheapest techniques within a budget.
    #[serde(default)]
    pub auto: Option<Auto>,
    /// Defect of the device because of which views were drawn one by one instead of both at once.
    #[serde(default)]
    pub multiview_defect: Option<String>,
}

/// A technique, or a combination of techniques.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct ManifestRow {
    /// Name, unique in the manifest.
    pub technique: String,
    /// Display name.
    pub title: String,
    /// Settings of the capture.
    #[serde(default)]
    pub settings: Value,
    /// Techniques that it combines.
    #[serde(default)]
    pub parts: Vec<String>,
    /// Whether it is meant to leave every visible pixel unchanged.
    pub lossless: bool,
    /// One per frame of the manifest, in the same order.
    pub frames: Vec<Frame>,
    /// Peak memory of the capture.
    #[serde(default)]
    pub peak_memory_bytes: Option<u64>,
    /// Texels of the scene.
    #[serde(default)]
    pub texture_bytes: Option<u64>,
    /// Texture trace, relative to the folder.
    #[serde(default)]
    pub trace: Option<String>,
    /// Content checksum of the trace; missing in folders of earlier versions.
    #[serde(default)]
    pub trace_checksum: Option<String>,
    /// Frames of the trace.
    #[serde(default)]
    pub trace_frames: Vec<u32>,
}

/// One frame of a technique.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Frame {
    /// Number.
    pub frame: u32,
    /// Bounds that were tested against a frustum.
    pub cull_tests: u64,
    /// Time of culling.
    pub cull_s: f64,
    /// Culled draws that are visible; `None` if the device cannot count them.
    #[serde(default)]
    pub false_negatives: Option<u64>,
    /// Draws that were kept but are not visible.
    #[serde(default)]
    pub false_positives: Option<u64>,
    /// Draws of both eyes.
    pub draws: u64,
    /// Calls that submitted them.
    pub draw_calls: u64,
    /// Changes of pipeline, material or target.
    pub state_changes: u64,
    /// Vertices shaded.
    pub vertices: u64,
    /// Triangles submitted.
    pub triangles: u64,
    /// Shaded 2x2 quads; `None` if the device cannot capture.
    #[serde(default)]
    pub quads: Option<u64>,
    /// Fragments shaded.
    #[serde(default)]
    pub fragments: Option<u64>,
    /// Bytes sent to the device.
    pub bytes_uploaded: u64,
    /// Memory traffic, computed from counts.
    #[serde(default)]
    pub memory_bytes: Option<u64>,
    /// Energy of the counted work.
    #[serde(default)]
    pub energy_mj: Option<f64>,
    /// Bytes of images read and written to compute the frame from the one before.
    #[serde(default)]
    pub bytes_reprojected: u64,
    /// Size of the frame's colour targets in bytes.
    #[serde(default)]
    pub target_color_bytes: Option<u64>,
    /// Size in bytes of the depth buffers in use at the same time.
    #[serde(default)]
    pub target_depth_bytes: Option<u64>,
    /// Times of the frame, one per repeat.
    pub frame_s: Vec<f64>,
    /// Times of the same frame with the baseline, each measured next to the repeat.
    #[serde(default)]
    pub baseline_s: Vec<f64>,
    /// Processor time of the frame, one per repeat; empty if the system did not report it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub processor_s: Vec<f64>,
    /// Processor time of the baseline.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub baseline_processor_s: Vec<f64>,
    /// Time by stage.
    #[serde(default)]
    pub stages_s: Map<String, Value>,
    /// Left and right picture, relative to the folder.
    pub images: [String; 2],
    /// CRC-32 of the image files as 8 hexadecimal digits; missing in folders of earlier versions.
    #[serde(default)]
    pub image_checksums: Option<[String; 2]>,
    /// Predictions by the technique itself.
    #[serde(default)]
    pub predicted: Map<String, Value>,
}

/// A search for the cheapest techniques within a budget.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Auto {
    /// The budget.
    pub budget: Value,
    /// Chosen settings.
    pub chosen: Value,
    /// Reason of the choice.
    pub reason: String,
    /// Frames used by the search.
    #[serde(default)]
    pub search_frames: Vec<u32>,
    /// Frames used to check the result.
    #[serde(default)]
    pub held_frames: Vec<u32>,
}

impl Manifest {
    /// The row of the baseline.
    pub fn baseline_row(&self) -> Option<&ManifestRow> {
        self.rows.iter().find(|row| row.technique == self.baseline)
    }
}

/// The numeric entries of a map, in its order.
pub fn numbers(map: &Map<String, Value>) -> impl Iterator<Item = (&str, f64)> {
    map.iter()
        .filter_map(|(key, value)| Some((key.as_str(), value.as_f64()?)))
}
