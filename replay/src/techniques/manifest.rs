//! `manifest.json` of a folder that `tracegen techniques` writes, schema `tracegen.techniques/1`.
//!
//! Keys that are not read here are ignored, so that a capturer may say more.

use formats::view::{Hmd, Lens};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// Schema of the manifest.
pub const MANIFEST_SCHEMA: &str = "tracegen.techniques/1";

/// The whole manifest.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Manifest {
    /// `tracegen.techniques/1`.
    pub schema: String,
    /// Program and version that measured.
    pub tool: String,
    /// Scene as given.
    pub scene: String,
    /// Triangles of the scene, instances counted.
    pub scene_triangles: u64,
    /// Instances of the scene.
    pub instances: u64,
    /// Name of the camera.
    pub camera: String,
    /// Path that the camera takes, if it moves.
    #[serde(default)]
    pub path: Option<String>,
    /// Numbers of the frames, ascending.
    pub frames: Vec<u32>,
    /// Frames a second along the path.
    pub fps: f64,
    /// Width and height of an eye's picture in pixels.
    pub size_px: [u32; 2],
    /// The display.
    pub hmd: Hmd,
    /// What the lenses show of the left and the right eye's picture.
    pub lens: [Lens; 2],
    /// Pixels per degree at the centre of an eye's picture.
    pub pixels_per_degree: f32,
    /// Device that rendered.
    pub adapter: String,
    /// Its driver.
    pub driver: String,
    /// The device is the processor.
    pub software_driver: bool,
    /// Technique that the others are held against.
    pub baseline: String,
    /// One a technique or combination.
    pub rows: Vec<ManifestRow>,
    /// What the search for the cheapest techniques inside a budget chose.
    #[serde(default)]
    pub auto: Option<Auto>,
    /// Why the device drew view by view where both were to be drawn at once.
    #[serde(default)]
    pub multiview_defect: Option<String>,
}

/// A technique, or a combination of some.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct ManifestRow {
    /// Name, unique in the manifest.
    pub technique: String,
    /// Name for people.
    pub title: String,
    /// How the capturer was set.
    #[serde(default)]
    pub settings: Value,
    /// Techniques that it combines.
    #[serde(default)]
    pub parts: Vec<String>,
    /// No pixel that the user can see is to change.
    pub lossless: bool,
    /// One a frame of the manifest, in the same order.
    pub frames: Vec<Frame>,
    /// Most memory that the capture held.
    #[serde(default)]
    pub peak_memory_bytes: Option<u64>,
    /// Texels of the scene.
    #[serde(default)]
    pub texture_bytes: Option<u64>,
    /// Texture trace, relative to the folder.
    #[serde(default)]
    pub trace: Option<String>,
    /// Content checksum of the trace; none in folders of earlier versions.
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
    /// Time that culling took.
    pub cull_s: f64,
    /// Draws that can be seen and were left out; none where the device cannot tell.
    #[serde(default)]
    pub false_negatives: Option<u64>,
    /// Draws that were kept and cannot be seen.
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
    /// 2x2 quads shaded; none where the device cannot capture.
    #[serde(default)]
    pub quads: Option<u64>,
    /// Fragments shaded.
    #[serde(default)]
    pub fragments: Option<u64>,
    /// Bytes sent to the device.
    pub bytes_uploaded: u64,
    /// Memory traffic by counts.
    #[serde(default)]
    pub memory_bytes: Option<u64>,
    /// Energy of the counted work.
    #[serde(default)]
    pub energy_mj: Option<f64>,
    /// Bytes of pictures read and written where the frame was made of the one before.
    #[serde(default)]
    pub bytes_reprojected: u64,
    /// Bytes of the colour that the frame is rendered into.
    #[serde(default)]
    pub target_color_bytes: Option<u64>,
    /// Bytes of its depth buffers that have to be there at a time.
    #[serde(default)]
    pub target_depth_bytes: Option<u64>,
    /// Times of the frame, one a repeat.
    pub frame_s: Vec<f64>,
    /// Times of the baseline's same frame, each measured right beside the repeat.
    #[serde(default)]
    pub baseline_s: Vec<f64>,
    /// What processors worked for the frame, one a repeat; none where the system did not tell.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub processor_s: Vec<f64>,
    /// What they worked for the baseline's.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub baseline_processor_s: Vec<f64>,
    /// Time by stage.
    #[serde(default)]
    pub stages_s: Map<String, Value>,
    /// Left and right picture, relative to the folder.
    pub images: [String; 2],
    /// CRC-32 of the pictures' files in 8 hexadecimal digits; none in folders of earlier versions.
    #[serde(default)]
    pub image_checksums: Option<[String; 2]>,
    /// What the technique says of itself beforehand.
    #[serde(default)]
    pub predicted: Map<String, Value>,
}

/// A search for the cheapest techniques inside a budget.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Auto {
    /// What must hold.
    pub budget: Value,
    /// Settings that were chosen.
    pub chosen: Value,
    /// Why.
    pub reason: String,
    /// Frames that the search saw.
    #[serde(default)]
    pub search_frames: Vec<u32>,
    /// Frames on which the promise was checked.
    #[serde(default)]
    pub held_frames: Vec<u32>,
}

impl Manifest {
    /// The row of the baseline.
    #[must_use]
    pub fn baseline_row(&self) -> Option<&ManifestRow> {
        self.rows.iter().find(|row| row.technique == self.baseline)
    }
}

/// The numbers of a map of measures, in its order.
pub fn numbers(map: &Map<String, Value>) -> impl Iterator<Item = (&str, f64)> {
    map.iter()
        .filter_map(|(key, value)| Some((key.as_str(), value.as_f64()?)))
}
