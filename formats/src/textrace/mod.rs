//! The texture-address trace (`.textrace`): its data model, and reading and writing.
//!
//! A trace has passes (one view of one frame), which consist of 16x16 tiles. A tile has its primitives in
//! submission order, and each primitive has its covered 2x2 quads with the texture coordinates of every uv
//! group that its draw samples. Addresses are not stored: replay computes them from the texture table and
//! the chosen layout.

mod bits;
mod delta;
pub mod geometry;
mod index;
mod invariant;
mod planes;
mod program;
mod raw;
mod reader;
mod sampled;
mod sharing;
pub mod tables;
mod vertex_reads;
mod writer;

pub use bits::PADDING_BYTES as BITS_PADDING_BYTES;
pub use index::INDEX_ENTRY_BYTES;
pub use invariant::{TILE_QUADS, quad_morton};
pub use program::{LeftOut, ProgramCapture, UnrecordedReads, VertexReadCounts};
pub use raw::{RECORD_BYTES as RAW_RECORD_BYTES, RUN_BYTES as RAW_RUN_BYTES};
pub use reader::{Textrace, TileStats};
pub use sampled::PlannedFrame;
pub use vertex_reads::{LEAST_BYTES as VERTEX_LEAST_BYTES, VertexDraw, VertexRead, VertexSite};
pub use writer::{EncodedTile, TextraceWriter, encode_tile, encode_tile_as};

use crate::container::ChunkTag;
use crate::error::{Broken, ensure};
use crate::parse::Parsed;
use crate::texture::{Sampler, Texture};
use crate::view::{Eye, FrameViews, Hmd};
use serde::{Deserialize, Serialize};

/// Fixed-point steps per texel of a group's `extent`, for uv, dx, dy and cross.
///
/// A lane's coordinate is the sum of at most four rounded terms, so its error is at most `4 * 0.5 / 2048` =
/// 1/1024 texel.
pub const SUBTEXELS: i32 = 2048;

/// The tile index: one fixed-size entry for every tile of every pass.
pub const TILE_INDEX: ChunkTag = ChunkTag(*b"TIDX");
/// The encoded tiles, in index order.
pub const TILES: ChunkTag = ChunkTag(*b"TILE");

/// The bytes after a decoded tile.
type Decoded<'a> = Parsed<'a, ()>;

/// Encoding of a tile's bytes. Each tile names its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum Encoding {
    /// Records as in memory.
    Raw = 0,
    /// Bit-packed differences from a linear prediction.
    #[default]
    Delta = 1,
    /// A plane for each primitive, and the residuals of its quads.
    Planes = 3,
}

impl Encoding {
    /// Every encoding, by number.
    pub const ALL: [Self; 3] = [Self::Raw, Self::Delta, Self::Planes];

    /// Every encoding with its number.
    const IDS: [(u64, Self); 3] = [(0, Self::Raw), (1, Self::Delta), (3, Self::Planes)];

    /// Maximum number of records in `bytes` bytes, at the best compression.
    fn most_records(self, bytes: u32) -> u64 {
        match self {
            Self::Raw => u64::from(bytes) / raw::RECORD_BYTES as u64,
            Self::Delta => u64::from(bytes) * 8 / u64::from(delta::MIN_RECORD_BITS),
            Self::Planes => u64::from(bytes) * 8 / u64::from(planes::MIN_RECORD_BITS),
        }
    }
}

/// The description of a trace: everything except its tables and tiles.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TraceMeta {
    /// Program and version that wrote the trace, `tracegen 0.1.0`.
    pub tool: String,
    /// Its arguments without the output paths, so that equal captures have equal bytes.
    pub command_line: Vec<String>,
    /// Scene name or path as given on the command line.
    pub scene: String,
    /// Triangles in the scene, instances counted.
    pub scene_triangles: u64,
    /// Name of the camera (`default` or a camera node's).
    pub camera: String,
    /// Capture backend, `lavapipe` or `osmesa`.
    pub backend: String,
    /// Driver string, as reported by the driver.
    pub driver: String,
    /// Seed of all random numbers of the capture.
    pub seed: u64,
    /// The display.
    pub hmd: Hmd,
    /// Eye matrices by frame, relative to `origin_m`.
    pub frames: Vec<FrameViews>,
    /// Properties of the recorded fragments; missing in older traces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surfaces: Option<Surfaces>,
    /// World position that the eyes' positions are relative to, in metres. Zero except for scenes far from
    /// the origin, whose coordinates would lose precision in single precision.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub origin_m: [f64; 3],
    /// Techniques of the frames, if they were chosen automatically or given by name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub techniques: Option<ChosenTechniques>,
    /// Set for the capture of a program; absent for that of a scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub program: Option<ProgramCapture>,
    /// Set for a plan, which has no passes: what is known of each frame, in the order of `frames`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan: Option<Vec<PlannedFrame>>,
    /// Frames that only fill the caches for the frames after them, ascending. What the
    /// caches held is unknown where frame numbers leave a gap.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warm_frames: Vec<u32>,
}

/// The techniques of the frames of a path, by name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChosenTechniques {
    /// Technique of each frame, in the order of `frames`.
    pub frames: Vec<String>,
    /// The same in the syntax of `tracegen raster --technique`.
    pub schedule: String,
    /// Reason of an automatic choice; absent if a user named the techniques.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub choice: Option<Choice>,
}

/// The request and the result of a search.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Choice {
    /// The requested budget: `flip=0.01`.
    pub budget: String,
    /// The cost that was minimised within the budget: `time`, `fragments`, `bytes` or `energy`.
    pub objective: String,
    /// Explanation.
    pub reason: String,
}

fn is_zero(origin_m: &[f64; 3]) -> bool {
    *origin_m == [0.0; 3]
}

/// Which fragments were recorded, and which draws are opaque.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Surfaces {
    /// Only fragments that passed the depth test when they were drawn.
    pub depth_tested: bool,
    /// Ranges (first and number) of draws whose fragments may be transparent: alpha-masked and blended
    /// ones. Ascending and disjoint.
    pub not_opaque: Vec<[u32; 2]>,
}

impl Surfaces {
    /// Ranges of the draws that are not opaque, from one flag per draw.
    pub fn ranges(opaque: impl IntoIterator<Item = bool>) -> Vec<[u32; 2]> {
        let mut ranges: Vec<[u32; 2]> = Vec::new();
        for (draw, opaque) in (0..).zip(opaque) {
            match ranges.last_mut() {
                _ if opaque => (),
                Some([first, count]) if *first + *count == draw => *count += 1,
                _ => ranges.push([draw, 1]),
            }
        }
        ranges
    }

    /// Checks the ranges against the number of draws.
    pub(crate) fn check(&self, draws: usize) -> Result<(), Broken> {
        let mut next = 0;
        for [first, count] in &self.not_opaque {
            let end = u64::from(*first) + u64::from(*count);
            let fits = u64::from(*first) >= next && *count > 0 && end <= draws as u64;
            ensure(
                fits,
                "surfaces.not_opaque",
                format_args!("ranges of draws below {draws}, ascending and apart"),
                format_args!("{:?}", self.not_opaque),
            )?;
            next = end;
        }
        Ok(())
    }
}

impl TraceMeta {
    /// Checks the display and the frames.
    pub(crate) fn check(&self) -> Result<(), Broken> {
        self.hmd.check()?;
        let numbers: Vec<u32> = self.frames.iter().map(|views| views.frame).collect();
        ensure(
            !numbers.is_empty() && numbers.is_sorted_by(|a, b| a < b),
            "frames",
            "at least one, numbers ascending",
            format_args!("{numbers:?}"),
        )?;
        ensure(
            self.origin_m.iter().all(|at| at.is_finite()),
            "origin",
            "finite numbers",
            format_args!("{:?}", self.origin_m),
        )?;
        sampled::check(&self.frames, self.plan.as_deref(), &self.warm_frames)
    }
}

/// Kinds of passes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum PassKind {
    /// The picture of one eye.
    #[default]
    Main = 0,
    /// A layer of a shadow map (texture accesses of alpha-masked casters).
    Shadow = 1,
    /// A part of the picture of one eye or both, with its own size and matrices.
    Layer = 2,
}

/// One pass: one view of one frame. Its tiles are numbered row by row from the top left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pass {
    /// Frame number.
    pub frame: u32,
    /// Kind of the pass.
    pub kind: PassKind,
    /// Eye, or `None` for a pass of both eyes.
    pub eye: Option<Eye>,
    /// Number of a layer within its frame and eye. The left and the right layer with the same number show
    /// the same part. 0 for passes that are not layers.
    pub layer: u16,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// Tile columns and rows; the last ones may be partly outside the image.
    pub tiles: [u32; 2],
}

impl Pass {
    /// Whether the pass is visible to an eye, that is, not a shadow map.
    pub fn is_seen(&self) -> bool {
        self.kind != PassKind::Shadow
    }

    /// Number of tiles.
    pub fn tile_count(&self) -> u32 {
        self.tiles[0] * self.tiles[1]
    }

    /// Number of tiles of an unchecked pass.
    pub(crate) fn tile_count_u64(&self) -> u64 {
        u64::from(self.tiles[0]) * u64::from(self.tiles[1])
    }
}

/// Source of a sample's level of detail.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum LodRule {
    /// The derivatives of the coordinates.
    #[default]
    Derivatives = 0,
    /// The derivatives and a bias.
    Bias = 1,
    /// A level specified by the shader.
    Explicit = 2,
}

/// Source of a sample's level of detail and layer in addition to its coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct SampleLevel {
    /// Source of the level.
    pub rule: LodRule,
    /// The bias or level that applies to every fragment, in 1/256 of a level. 0 if only the derivatives
    /// determine it.
    pub lod_256ths: i16,
    /// Whether each fragment adds its own level (in u) and layer (in v). The record directly before that of
    /// the sample's group has them: see [`QuadRecord::lane_operands`].
    pub operands: bool,
}

impl SampleLevel {
    /// Level from the derivatives only; layer of the sample.
    pub const DERIVED: Self = Self {
        rule: LodRule::Derivatives,
        lod_256ths: 0,
        operands: false,
    };

    /// Whether only the derivatives determine the level, and the layer is the sample's.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// One texture read that a draw makes per fragment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Sample {
    /// Index into the texture table.
    pub texture: u32,
    /// Index into the sampler table.
    pub sampler: u16,
    /// Array layer.
    pub layer: u16,
    /// Texel offset at the sampled level (the taps of percentage-closer filtering).
    pub offset: [i8; 2],
    /// Source of level of detail and layer in addition to the coordinates.
    #[serde(default, skip_serializing_if = "SampleLevel::is_default")]
    pub level: SampleLevel,
}

/// Textures that one draw samples at the same texture coordinates; one quad record serves all.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct UvGroup {
    /// Texels per unit of u and v that define the fixed-point step `1 / (SUBTEXELS * extent)`: by axis, the
    /// largest level-0 size among the group's textures.
    pub extent: [u32; 2],
    /// The samples, in shader order.
    pub samples: Vec<Sample>,
}

impl UvGroup {
    /// Whether each record of the group follows a record of operands, which belongs to the group before it.
    pub fn has_operands(&self) -> bool {
        self.samples.iter().any(|sample| sample.level.operands)
    }
}

impl Draw {
    /// Whether records of a group are operands of the group after it.
    pub fn is_operands(&self, group: u8) -> bool {
        let next = self.groups.get(usize::from(group) + 1);
        next.is_some_and(UvGroup::has_operands)
    }
}

/// One draw call. The same draw has the same index in every pass.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Draw {
    /// Material name for reports.
    pub material: String,
    /// Global number of its first primitive. Primitive `p` of the draw is `first_primitive + p` in every
    /// pass, so a triangle has the same number in both eyes.
    pub first_primitive: u32,
    /// Number of primitives.
    pub primitives: u32,
    /// Sampled groups, at most 15. Empty for an untextured draw, whose quads are recorded (without group)
    /// because they take shader time.
    pub groups: Vec<UvGroup>,
}

/// Group number in the record of a quad without samples.
pub const NO_GROUP: u8 = 15;

/// One covered quad of one primitive and its coordinates in one uv group.
///
/// A quad with several groups has several consecutive records with the same position and ascending groups.
/// A shadow-mapped quad in two cascades has one record per cascade, each with the lanes that use it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct QuadRecord {
    /// Quad column in the tile, 0 to 7.
    pub x: u8,
    /// Quad row in the tile, 0 to 7.
    pub y: u8,
    /// Covered lanes that take this sample: bit 0 top left, 1 top right, 2 bottom left, 3 bottom right.
    /// Never 0.
    pub mask: u8,
    /// Index into the draw's groups, or `NO_GROUP`.
    pub group: u8,
    /// Coordinates of the top-left lane, fixed point (covered or not).
    pub uv: [i32; 2],
    /// Horizontal derivative, top row.
    pub dx: [i32; 2],
    /// Vertical derivative, left column.
    pub dy: [i32; 2],
    /// Change of the horizontal derivative from the top row to the bottom row.
    pub cross: [i32; 2],
}

impl QuadRecord {
    /// Fixed-point coordinates of a lane (0 to 3): `uv + i*dx + j*dy + i*j*cross`.
    #[inline]
    pub fn lane_uv(&self, lane: u32) -> [i32; 2] {
        let i = (lane & 1) as i32;
        let j = (lane >> 1) as i32;
        let axis = |a: usize| {
            self.uv[a]
                .wrapping_add(i.wrapping_mul(self.dx[a]))
                .wrapping_add(j.wrapping_mul(self.dy[a]))
                .wrapping_add((i * j).wrapping_mul(self.cross[a]))
        };
        [axis(0), axis(1)]
    }

    /// A lane's values in a record of operands: its level of detail, and its layer rounded to the nearest
    /// integer.
    pub fn lane_operands(&self, lane: u32) -> (f32, i32) {
        let [lod, layer] = self.lane_uv(lane);
        let half = SUBTEXELS / 2;
        (
            lod as f32 / SUBTEXELS as f32,
            layer.saturating_add(half).div_euclid(SUBTEXELS),
        )
    }
}

/// Each record with its predecessor, which has its operands if its group needs them.
pub fn with_operands(
    records: &[QuadRecord],
) -> impl Iterator<Item = (&QuadRecord, Option<&QuadRecord>)> {
    let before = std::iter::once(None).chain(records.iter().map(Some));
    records.iter().zip(before)
}

/// A run of records that belong to one primitive in one tile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PrimitiveRun {
    /// Global primitive number (see `Draw::first_primitive`), ascending within a tile.
    pub primitive: u32,
    /// Index into the draw table.
    pub draw: u32,
    /// Records `first..first + count` of the tile.
    pub first: u32,
    /// Number of records.
    pub count: u32,
}

/// One decoded tile: its primitives in submission order and their quad records.
///
/// Within a primitive, quads follow the Morton curve over the tile's 8x8 quads.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tile {
    /// Runs in submission order.
    pub runs: Vec<PrimitiveRun>,
    /// Records of all runs.
    pub records: Vec<QuadRecord>,
}

impl Tile {
    /// Appends a primitive with its records.
    pub fn push_run(
        &mut self,
        primitive: u32,
        draw: u32,
        records: impl IntoIterator<Item = QuadRecord>,
    ) {
        let first = self.records.len() as u32;
        self.records.extend(records);
        self.runs.push(PrimitiveRun {
            primitive,
            draw,
            first,
            count: self.records.len() as u32 - first,
        });
    }

    /// Empties the tile and keeps its memory for the next one.
    pub fn clear(&mut self) {
        self.runs.clear();
        self.records.clear();
    }
}

/// The tables of a trace: everything needed to compute texel addresses from a record.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tables {
    /// Description.
    pub meta: TraceMeta,
    /// Textures.
    pub textures: Vec<Texture>,
    /// Samplers.
    pub samplers: Vec<Sampler>,
    /// Draws in submission order.
    pub draws: Vec<Draw>,
    /// Passes in submission order; a stereo frame is left eye then right eye.
    pub passes: Vec<Pass>,
}

#[cfg(test)]
pub(crate) mod tests;
