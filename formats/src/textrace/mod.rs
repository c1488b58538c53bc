//! The texture-address trace (`.textrace`): its data model, and reading and writing it.
//!
//! A trace holds, for every pass (one view of one frame), for every 16x16 tile, the primitives in
//! submission order, and for each primitive the covered 2x2 quads with the texture coordinates of
//! every uv group that its draw samples. Addresses are not stored: they follow from the texture
//! table and from the layout that replay chooses.

mod bits;
mod delta;
pub mod geometry;
mod index;
mod invariant;
mod planes;
mod raw;
mod reader;
pub mod tables;
mod writer;

pub use bits::PADDING_BYTES as BITS_PADDING_BYTES;
pub use index::INDEX_ENTRY_BYTES;
pub use invariant::{TILE_QUADS, quad_morton};
pub use raw::{RECORD_BYTES as RAW_RECORD_BYTES, RUN_BYTES as RAW_RUN_BYTES};
pub use reader::{Textrace, TileStats};
pub use writer::{EncodedTile, TextraceWriter, encode_tile, encode_tile_as};

use crate::container::ChunkTag;
use crate::error::{Broken, ensure};
use crate::texture::{Sampler, Texture};
use crate::view::{Eye, FrameViews, Hmd};
use serde::{Deserialize, Serialize};

/// Fixed-point steps per texel of a group's `extent` in which uv, dx, dy and cross are stored.
///
/// A lane's coordinate is the sum of at most four rounded terms, so it is exact to
/// `4 * 0.5 / 2048` = 1/1024 texel.
pub const SUBTEXELS: i32 = 2048;

/// The tile index: one fixed-size entry for every tile of every pass.
pub const TILE_INDEX: ChunkTag = ChunkTag(*b"TIDX");
/// The encoded tiles, in index order.
pub const TILES: ChunkTag = ChunkTag(*b"TILE");

/// How a tile's bytes are encoded. Each tile names its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum Encoding {
    /// Records as they are in memory.
    Raw = 0,
    /// Bit-packed differences from a linear prediction.
    #[default]
    Delta = 1,
    /// A plane for each primitive, and what quads leave over.
    Planes = 3,
}

impl Encoding {
    /// Every encoding, by number.
    pub const ALL: [Self; 3] = [Self::Raw, Self::Delta, Self::Planes];

    fn from_id(id: u64) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|encoding| *encoding as u64 == id)
    }

    /// Most records that `bytes` bytes can hold, however well they compress.
    fn most_records(self, bytes: u32) -> u64 {
        match self {
            Self::Raw => u64::from(bytes) / raw::RECORD_BYTES as u64,
            Self::Delta => u64::from(bytes) * 8 / u64::from(delta::MIN_RECORD_BITS),
            Self::Planes => u64::from(bytes) * 8 / u64::from(planes::MIN_RECORD_BITS),
        }
    }
}

/// The whole description of a trace but for its quads.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TraceMeta {
    /// Program and version that wrote the trace, `tracegen 0.1.0`.
    pub tool: String,
    /// Its arguments without the output paths, so that the same capture gives the same bytes.
    pub command_line: Vec<String>,
    /// Scene name or path as given.
    pub scene: String,
    /// Triangles in the scene, instances counted.
    pub scene_triangles: u64,
    /// Name of the camera (`default` or a camera node's).
    pub camera: String,
    /// Capture backend, `lavapipe` or `osmesa`.
    pub backend: String,
    /// Driver string as it names itself.
    pub driver: String,
    /// Seed of whatever was random in the capture.
    pub seed: u64,
    /// The display.
    pub hmd: Hmd,
    /// Eye matrices by frame, relative to `origin_m`.
    pub frames: Vec<FrameViews>,
    /// What the recorded fragments say of what is seen; older traces do not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surfaces: Option<Surfaces>,
    /// World position that the eyes' places are relative to, metres: zero but for a scene far out,
    /// whose coordinates would lose their digits in single precision.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub origin_m: [f64; 3],
    /// What the frames were rendered with, where that was chosen or given by name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub techniques: Option<ChosenTechniques>,
    /// Present where a program was captured and not a scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub program: Option<ProgramCapture>,
}

/// How a program that nothing was known of became a trace.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProgramCapture {
    /// The eyes' matrices and frusta are the program's. Otherwise they are placeholders.
    pub cameras_known: bool,
    /// What told its frames apart.
    pub frames_by: String,
    /// What told its eyes apart.
    pub views_by: String,
    /// Texture accesses of recorded fragments that the trace lacks.
    pub left_out: Vec<LeftOut>,
}

/// A kind of texture access that a trace lacks.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// What it is.
    pub what: String,
    /// Draws that have some.
    pub draws: u64,
    /// Fragments that did it.
    pub fragments: u64,
}

/// The techniques of a path's frames, by name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChosenTechniques {
    /// Of each frame, in the order of `frames`.
    pub frames: Vec<String>,
    /// The same as `tracegen raster --technique` takes it.
    pub schedule: String,
    /// Why they were chosen; absent where a user named them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub choice: Option<Choice>,
}

/// What a search was asked for and what it found.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Choice {
    /// As asked for: `flip=0.01`.
    pub budget: String,
    /// The cost that is as small as the budget allows: `time`, `fragments`, `bytes` or `energy`.
    pub objective: String,
    /// In words.
    pub reason: String,
}

fn is_zero(origin_m: &[f64; 3]) -> bool {
    *origin_m == [0.0; 3]
}

/// Which fragments were recorded, and which of them hide what lies behind.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Surfaces {
    /// Only fragments that passed the depth test when they were drawn.
    pub depth_tested: bool,
    /// First and number of draws in a row whose fragments may turn out transparent when they are
    /// shaded: alpha-masked and blended ones. Ascending and apart.
    pub not_opaque: Vec<[u32; 2]>,
}

impl Surfaces {
    /// Ranges of the draws that are not opaque, from a flag by draw.
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
            ensure(fits, || {
                Broken::new(
                    "surfaces.not_opaque",
                    format!("ranges of draws below {draws}, ascending and apart"),
                    format_args!("{:?}", self.not_opaque),
                )
            })?;
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
            || {
                Broken::new(
                    "frames",
                    "at least one, numbers ascending",
                    format_args!("{numbers:?}"),
                )
            },
        )?;
        ensure(self.origin_m.iter().all(|at| at.is_finite()), || {
            Broken::new(
                "origin",
                "finite numbers",
                format_args!("{:?}", self.origin_m),
            )
        })
    }
}

/// What a pass renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum PassKind {
    /// The picture of one eye.
    Main = 0,
    /// A layer of a shadow map (texture accesses of alpha-masked casters).
    Shadow = 1,
    /// A part of the picture of one eye or of both, with a size and matrices of its own.
    Layer = 2,
}

/// One pass: one view of one frame. Its tiles are numbered row by row from the top left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pass {
    /// Frame number.
    pub frame: u32,
    /// What it renders.
    pub kind: PassKind,
    /// Eye, or `None` for a pass that belongs to both.
    pub eye: Option<Eye>,
    /// Number of a layer among those of its frame and eye: the left and the right layer of a number
    /// show the same part. 0 for passes that are no layers.
    pub layer: u16,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// Tile columns and rows; the last ones may be partly outside the image.
    pub tiles: [u32; 2],
}

impl Pass {
    /// The pass shows what eyes see: all but shadow maps.
    #[must_use]
    pub fn is_seen(&self) -> bool {
        self.kind != PassKind::Shadow
    }

    /// Number of tiles.
    #[must_use]
    pub fn tile_count(&self) -> u32 {
        self.tiles[0] * self.tiles[1]
    }

    /// Number of tiles of a pass that has not been checked.
    pub(crate) fn tile_count_u64(&self) -> u64 {
        u64::from(self.tiles[0]) * u64::from(self.tiles[1])
    }
}

/// Where a sample's level of detail comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum LodRule {
    /// The derivatives of the coordinates.
    #[default]
    Derivatives = 0,
    /// These, and a bias.
    Bias = 1,
    /// The shader names it.
    Explicit = 2,
}

/// What decides a sample's level of detail and layer beside its coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct SampleLevel {
    /// Where the level comes from.
    pub rule: LodRule,
    /// The bias or the level of every fragment, in 1/256 of a level. 0 where the derivatives decide alone.
    pub lod_256ths: i16,
    /// Each fragment adds a level (in u) and a layer (in v) of its own. The record right before that of the sample's
    /// group has them: see [`QuadRecord::lane_operands`].
    pub operands: bool,
}

impl SampleLevel {
    /// The derivatives decide alone, and the layer is the sample's.
    pub const DERIVED: Self = Self {
        rule: LodRule::Derivatives,
        lod_256ths: 0,
        operands: false,
    };

    /// The derivatives decide alone, and the layer is the sample's.
    #[must_use]
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// One texture read that a draw makes per fragment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Sample {
    /// Index into the texture table.
    pub texture: u32,
    /// Index into the sampler table.
    pub sampler: u16,
    /// Array layer.
    pub layer: u16,
    /// Texel offset at the sampled level (the taps of percentage-closer filtering).
    pub offset: [i8; 2],
    /// What decides level of detail and layer beside the coordinates.
    #[serde(default, skip_serializing_if = "SampleLevel::is_default")]
    pub level: SampleLevel,
}

/// Textures that one draw samples at the same texture coordinates: one quad record serves all.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct UvGroup {
    /// Texels per unit of u and v that define the fixed-point step `1 / (SUBTEXELS * extent)`:
    /// the largest level-0 size among the group's textures, by axis.
    pub extent: [u32; 2],
    /// The samples, in shader order.
    pub samples: Vec<Sample>,
}

impl UvGroup {
    /// Each record of the group follows on its operands: a record of the group before it.
    #[must_use]
    pub fn has_operands(&self) -> bool {
        self.samples.iter().any(|sample| sample.level.operands)
    }
}

impl Draw {
    /// Records of a group are operands of the group after it.
    #[must_use]
    pub fn is_operands(&self, group: u8) -> bool {
        let next = self.groups.get(usize::from(group) + 1);
        next.is_some_and(UvGroup::has_operands)
    }
}

/// One draw call. The same draw has the same index in every pass.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Draw {
    /// Material name for reports.
    pub material: String,
    /// Global number of its first primitive: primitive `p` of the draw is `first_primitive + p`
    /// in every pass, so both eyes name the same triangle alike.
    pub first_primitive: u32,
    /// Number of primitives.
    pub primitives: u32,
    /// What it samples; at most 15 groups. Empty for an untextured draw, whose quads are still
    /// recorded (with no group) because they take shader time.
    pub groups: Vec<UvGroup>,
}

/// Group number of the record of a quad that samples nothing.
pub const NO_GROUP: u8 = 15;

/// One covered quad of one primitive and its coordinates in one uv group.
///
/// A quad with several groups is several consecutive records with the same position, groups
/// ascending; a shadow-mapped quad that straddles two cascades has one record per cascade, each
/// with the lanes that use it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct QuadRecord {
    /// Quad column in the tile, 0 to 7.
    pub x: u8,
    /// Quad row in the tile, 0 to 7.
    pub y: u8,
    /// Covered lanes that take this sample: bit 0 top left, 1 top right, 2 bottom left, 3 bottom
    /// right. Never 0.
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
    #[must_use]
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

    /// Operands of a lane in a record of operands: its level of detail, and its layer rounded to the nearest.
    #[must_use]
    pub fn lane_operands(&self, lane: u32) -> (f32, i32) {
        let [lod, layer] = self.lane_uv(lane);
        let half = SUBTEXELS / 2;
        (
            lod as f32 / SUBTEXELS as f32,
            layer.saturating_add(half).div_euclid(SUBTEXELS),
        )
    }
}

/// Each record of some, with the record before it, which has its operands where its group asks for any.
pub fn with_operands(
    records: &[QuadRecord],
) -> impl Iterator<Item = (&QuadRecord, Option<&QuadRecord>)> {
    let before = std::iter::once(None).chain(records.iter().map(Some));
    records.iter().zip(before)
}

/// A run of records that belong to one primitive in one tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
    /// Empties the tile, keeping its memory for the next one.
    pub fn clear(&mut self) {
        self.runs.clear();
        self.records.clear();
    }
}

/// The tables of a trace: everything that is needed to turn a record into texel addresses.
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

impl Tables {
    /// They hold what a trace of version 1 cannot say.
    #[must_use]
    pub fn need_version_2(&self) -> bool {
        self.meta.program.is_some()
            || self.textures.iter().any(|t| !t.format.is_in_version_1())
            || self.samplers.iter().any(|s| !s.is_in_version_1())
            || (self.draws.iter().flat_map(|draw| &draw.groups))
                .flat_map(|group| &group.samples)
                .any(|sample| !sample.level.is_default())
    }
}

#[cfg(test)]
pub(crate) mod tests;
