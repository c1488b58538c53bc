//! The counts of a trace, and the JSON of `replay info`.

use crate::cli::tiles::{ray_tiles, tiles};
use anyhow::{Result, anyhow};
use formats::Trace;
use formats::container::{ChunkEntry, Container};
use formats::layout::{Layout, LayoutConfig};
use formats::raytrace::{
    BvhSummary, RayKind, RayLight, RayMaterial, RayTile, RayTriangle, Raytrace, RaytraceMeta,
};
use formats::textrace::{Draw, Encoding, Pass, Textrace, TraceMeta, VertexDraw};
use formats::texture::{Sampler, Texture};
use formats::view::Eye;
use rayon::prelude::*;
use serde::{Serialize, Serializer};
use serde_json::{Map, Value};
use std::collections::{BTreeMap, HashSet};

/// Schema of the object that `replay info --json` prints.
const SCHEMA: &str = "replay.info/2";

/// The JSON object.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged)]
enum InfoJson<'a> {
    Texture(TextureJson<'a>),
    Ray(RayJson<'a>),
}

/// The file of a trace.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct FileJson {
    schema: &'static str,
    /// `textrace` or `raytrace`.
    kind: String,
    /// Major and minor version of the format.
    version: String,
    /// Checksum of the content, in hexadecimal digits.
    checksum: String,
    /// Checksum of the file, in hexadecimal digits.
    file_checksum: String,
    file_bytes: u64,
    chunks: Vec<ChunkJson>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct ChunkJson {
    tag: String,
    offset_bytes: u64,
    length_bytes: u64,
    /// Checksum in hexadecimal digits.
    crc32: String,
}

/// A texture trace.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct TextureJson<'a> {
    #[serde(flatten)]
    file: FileJson,
    #[cfg_attr(test, schemars(with = "sim::schemas::Meta"))]
    meta: &'a TraceMeta,
    totals: Totals,
    passes: Vec<PassJson<'a>>,
    /// Texture reads of vertex shaders by frame and eye; absent if the trace has none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    vertex_reads: Vec<VertexReadsJson>,
    /// The trace's chunk TEXS (FORMAT.md).
    #[cfg_attr(test, schemars(with = "Vec<Map<String, Value>>"))]
    textures: &'a [Texture],
    /// The trace's chunk SMPS (FORMAT.md).
    #[cfg_attr(test, schemars(with = "Vec<Map<String, Value>>"))]
    samplers: &'a [Sampler],
    /// The trace's chunk DRAW (FORMAT.md).
    #[cfg_attr(test, schemars(with = "Vec<Map<String, Value>>"))]
    draws: &'a [Draw],
}

/// A ray trace.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct RayJson<'a> {
    #[serde(flatten)]
    file: FileJson,
    #[cfg_attr(test, schemars(with = "sim::schemas::Meta"))]
    meta: &'a RaytraceMeta,
    totals: EyeTotals,
    /// The trace's chunk RBVH (FORMAT.md), with the settings as an object.
    hierarchy: Map<String, Value>,
    /// The trace's chunk RMAT (FORMAT.md).
    #[cfg_attr(test, schemars(with = "Vec<Map<String, Value>>"))]
    materials: &'a [RayMaterial],
    /// The trace's chunk RLIT (FORMAT.md).
    #[cfg_attr(test, schemars(with = "Vec<Map<String, Value>>"))]
    lights: &'a [RayLight],
    /// The trace's chunk RTRI (FORMAT.md).
    #[cfg_attr(test, schemars(with = "Vec<Map<String, Value>>"))]
    triangles: &'a [RayTriangle],
}

/// The trace's tables and totals, as `--json` prints them.
///
/// # Errors
/// An unreadable tile.
pub fn to_json(trace: &Trace) -> Result<Value> {
    let file = FileJson::of(trace);
    let info = match trace {
        Trace::Texture(trace) => {
            let tables = trace.tables();
            InfoJson::Texture(TextureJson {
                file,
                meta: &tables.meta,
                totals: Totals::of(trace)?,
                passes: passes(trace),
                vertex_reads: vertex_reads(trace)?,
                textures: &tables.textures,
                samplers: &tables.samplers,
                draws: &tables.draws,
            })
        }
        Trace::Ray(trace) => {
            let tables = trace.tables();
            let [left, right] = ray_counts(trace)?;
            InfoJson::Ray(RayJson {
                file,
                meta: &tables.meta,
                totals: EyeTotals { left, right },
                hierarchy: hierarchy(&tables.bvh)?,
                materials: &tables.materials,
                lights: &tables.lights,
                triangles: &tables.triangles,
            })
        }
    };
    Ok(serde_json::to_value(info)?)
}

/// The schema of the JSON object.
#[cfg(test)]
pub(crate) fn schema() -> formats::schemas::Published {
    formats::schemas::Published::of::<InfoJson<'_>>(SCHEMA)
}

/// Major and minor version of a trace's format.
pub(super) fn version(container: &Container) -> String {
    let (major, minor) = container.version();
    format!("{major}.{minor}")
}

impl FileJson {
    fn of(trace: &Trace) -> Self {
        let container = trace.container();
        let chunk = |entry: &ChunkEntry| ChunkJson {
            tag: entry.tag.to_string(),
            offset_bytes: entry.offset_bytes,
            length_bytes: entry.length_bytes,
            crc32: format!("{:08x}", entry.crc32),
        };
        Self {
            schema: SCHEMA,
            kind: container.kind().to_string(),
            version: version(container),
            checksum: format!("{:08x}", trace.content_checksum()),
            file_checksum: format!("{:08x}", container.file_checksum()),
            file_bytes: container.file_bytes(),
            chunks: container.directory().iter().map(chunk).collect(),
        }
    }
}

fn hierarchy(bvh: &BvhSummary) -> Result<Map<String, Value>> {
    let Value::Object(mut table) = serde_json::to_value(bvh)? else {
        unreachable!("a struct is an object")
    };
    let settings = bvh.settings.iter();
    let settings = settings.map(|(name, value)| (name.clone(), value.clone().into()));
    table.insert("settings".to_owned(), Value::Object(settings.collect()));
    Ok(table)
}

/// Counts of some tiles, read from the index only.
#[derive(Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct Counts {
    pub tiles: u64,
    pub touched_tiles: u64,
    pub records: u64,
    pub runs: u64,
    pub tile_bytes: u64,
    pub bytes_per_record: f64,
}

impl Counts {
    fn of(trace: &Textrace, tiles: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut counts = Self::default();
        for (pass, tile) in tiles {
            let stats = trace.tile_stats(pass, tile);
            counts.tiles += 1;
            counts.touched_tiles += u64::from(stats.records > 0);
            counts.records += u64::from(stats.records);
            counts.runs += u64::from(stats.runs);
            counts.tile_bytes += u64::from(stats.bytes);
        }
        counts.bytes_per_record = counts.tile_bytes as f64 / counts.records.max(1) as f64;
        counts
    }
}

/// Counts of a texture trace.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct Totals {
    #[serde(flatten)]
    pub counts: Counts,
    /// Tiles with records, by the name of their encoding.
    tiles_by_encoding: Map<String, Value>,
    /// Tiles with records whose bytes are stored for an earlier tile; absent if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shared_tiles: Option<u64>,
}

impl Totals {
    /// # Errors
    /// A tile of an unknown encoding.
    pub fn of(trace: &Textrace) -> Result<Self> {
        let passes = &trace.tables().passes;
        let mut tiles_by_encoding = Map::new();
        for encoding in Encoding::ALL {
            let mut count = 0u64;
            for (pass, tile) in tiles(passes) {
                let used = trace.tile_stats(pass, tile).records > 0;
                count += u64::from(used && trace.tile_encoding(pass, tile)? == encoding);
            }
            let name = serde_json::to_value(encoding)?;
            let name = name.as_str().unwrap_or_default().to_owned();
            tiles_by_encoding.insert(name, count.into());
        }
        Ok(Self {
            counts: Counts::of(trace, tiles(passes)),
            tiles_by_encoding,
            shared_tiles: Some(trace.shared_tiles()).filter(|shared| *shared > 0),
        })
    }
}

/// A pass and its counts.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct PassJson<'a> {
    /// A row of the trace's chunk PASS (FORMAT.md).
    #[cfg_attr(test, schemars(with = "Map<String, Value>"))]
    #[serde(flatten)]
    pub pass: &'a Pass,
    pub counts: Counts,
}

pub(super) fn passes(trace: &Textrace) -> Vec<PassJson<'_>> {
    let passes = trace.tables().passes.iter().enumerate();
    passes
        .map(|(index, pass)| {
            let of_pass = (0..pass.tile_count() as usize).map(|tile| (index, tile));
            PassJson {
                pass,
                counts: Counts::of(trace, of_pass),
            }
        })
        .collect()
}

/// Texture reads of vertex shaders for an eye of a frame.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct VertexReadsJson {
    pub frame: u32,
    /// `left`, `right`, or `null` if the draws are for both eyes or for no eye's target.
    #[cfg_attr(test, schemars(with = "Option<String>"))]
    pub eye: Option<Eye>,
    pub draws: u64,
    pub vertices: u64,
    pub reads: u64,
    /// Different texels that these reads touch.
    pub texels: u64,
    /// Lines of 64 bytes with these texels, where the default layout of textures places them.
    pub lines: u64,
}

pub(super) fn vertex_reads(trace: &Textrace) -> Result<Vec<VertexReadsJson>> {
    if trace.vertex_reads().is_empty() {
        return Ok(Vec::new());
    }
    let layout = Layout::new(&trace.tables().textures, &LayoutConfig::default());
    let layout = layout.map_err(|error| anyhow!("{}: {error}", trace.container().file()))?;
    let mut by_eye: BTreeMap<_, Vec<&VertexDraw>> = BTreeMap::new();
    for draw in trace.vertex_reads() {
        let eye = draw.eye.map_or(2, |eye| eye as u8);
        by_eye.entry((draw.frame, eye)).or_default().push(draw);
    }
    let of = by_eye.into_values().map(|draws| {
        let (mut texels, mut lines) = (HashSet::new(), HashSet::new());
        for draw in &draws {
            draw.footprints(trace.tables(), |site, of| {
                for texel in of.texels() {
                    let place = (site.texture, of.layer, of.level, texel);
                    if texels.insert(place) {
                        let (layer, level) = (of.layer.into(), of.level.into());
                        let address = layout.address(site.texture, layer, level, texel);
                        lines.extend(address.map(|address| address / 64));
                    }
                }
            });
        }
        VertexReadsJson {
            frame: draws[0].frame,
            eye: draws[0].eye,
            draws: draws.len() as u64,
            vertices: draws.iter().map(|draw| draw.vertices()).sum(),
            reads: draws.iter().map(|draw| draw.reads.len() as u64).sum(),
            texels: texels.len() as u64,
            lines: lines.len() as u64,
        }
    });
    Ok(of.collect())
}

/// Ray and traversal counts of one eye.
#[derive(Clone, Copy, Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct RayCounts {
    pub samples: u64,
    pub hits: u64,
    /// By [`RayKind`].
    #[cfg_attr(test, schemars(with = "std::collections::BTreeMap<String, u64>"))]
    #[serde(serialize_with = "by_kind")]
    pub rays: [u64; 6],
    pub steps: u64,
    pub triangle_tests: u64,
    pub alpha_tests: u64,
    pub visits: u64,
}

impl RayCounts {
    fn of(tile: &RayTile) -> Self {
        let mut counts = Self {
            samples: tile.pixels.len() as u64,
            hits: tile.pixels.iter().filter(|p| p.hit.is_some()).count() as u64,
            visits: tile.visits.len() as u64,
            ..Self::default()
        };
        for ray in &tile.rays {
            counts.rays[ray.kind as usize] += 1;
            counts.steps += u64::from(ray.steps);
            counts.triangle_tests += u64::from(ray.triangle_tests);
            counts.alpha_tests += u64::from(ray.alpha_tests);
        }
        counts
    }

    fn add(mut self, other: Self) -> Self {
        formats::add_fields!(
            self,
            other,
            samples,
            hits,
            steps,
            triangle_tests,
            alpha_tests,
            visits
        );
        self.rays = std::array::from_fn(|kind| self.rays[kind] + other.rays[kind]);
        self
    }
}

/// Counts of both eyes of a ray trace.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct EyeTotals {
    left: RayCounts,
    right: RayCounts,
}

fn by_kind<S: Serializer>(rays: &[u64; 6], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(RayKind::ALL.map(|kind| (kind.to_string(), rays[kind as usize])))
}

/// Name of a variant as the tables write it.
pub(super) fn lower(variant: &impl std::fmt::Debug) -> String {
    format!("{variant:?}").to_lowercase()
}

/// Counts of the left and of the right eye; decodes every tile.
pub(super) fn ray_counts(trace: &Raytrace) -> Result<[RayCounts; 2]> {
    let tiles: Vec<(Eye, u32)> = ray_tiles(trace.tables()).collect();
    let of_tiles: Vec<RayCounts> = tiles
        .par_iter()
        .map_init(RayTile::default, |tile, (eye, index)| {
            trace.decode_tile(*eye, *index, tile)?;
            Ok(RayCounts::of(tile))
        })
        .collect::<formats::Result<_>>()?;
    let of_eye = |wanted| {
        let own = tiles
            .iter()
            .zip(&of_tiles)
            .filter(|((eye, _), _)| *eye == wanted);
        own.fold(RayCounts::default(), |sum, (_, counts)| sum.add(*counts))
    };
    Ok([Eye::Left, Eye::Right].map(of_eye))
}
