//! The result of a replay: plain data that models fill and printers read.

use crate::memory::Client;
use crate::memory::dram::DramResult;
use formats::textrace::TraceMeta;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::Path;

/// Program and version, recorded in every result.
pub const TOOL: &str = concat!("replay ", env!("CARGO_PKG_VERSION"));

/// Schema of the object that `replay run --json` prints.
pub const RUN_SCHEMA: &str = "replay.run/2";

/// Counters of one cache level, or of a part of its traffic (a view, texture, mip level or tile).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct LevelCounters {
    /// Bilinear footprints looked up at this level.
    pub footprints: u64,
    /// Footprints with at least one missing line.
    pub footprint_misses: u64,
    /// Line look-ups: distinct lines per footprint, summed over footprints.
    pub line_lookups: u64,
    /// Lines fetched from below (primary misses).
    pub line_misses: u64,
    /// Line look-ups that missed while the line was in flight (secondary misses, timed mode only).
    pub secondary_misses: u64,
}

impl LevelCounters {
    /// Adds another part's counters.
    pub fn add(&mut self, other: &Self) {
        formats::add_fields!(
            self,
            other,
            footprints,
            footprint_misses,
            line_lookups,
            line_misses,
            secondary_misses
        );
    }
}

/// A cache level's summary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct LevelResult {
    /// `footprint_misses` over `footprints`.
    pub footprint_miss_rate: f64,
    /// `line_misses` over `line_lookups`.
    pub line_miss_rate: f64,
    /// The counters (L1: summed over cores).
    #[serde(flatten)]
    pub counters: LevelCounters,
}

impl LevelResult {
    /// Counters with their rates, which are 0 without look-ups.
    pub fn new(counters: LevelCounters) -> Self {
        let rate = |part: u64, whole: u64| part as f64 / whole.max(1) as f64;
        Self {
            footprint_miss_rate: rate(counters.footprint_misses, counters.footprints),
            line_miss_rate: rate(counters.line_misses, counters.line_lookups),
            counters,
        }
    }
}

/// The MSHRs of the L2, if their number is limited.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct MshrResult {
    /// Peak number in use.
    pub peak: u64,
    /// Misses that found all MSHRs in use.
    pub stalled_misses: u64,
    /// Total cycles that these misses waited.
    pub stall_cycles: u64,
}

impl MshrResult {
    /// Combines two caches: adds counts and takes the higher peak.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            peak: self.peak.max(other.peak),
            stalled_misses: self.stalled_misses + other.stalled_misses,
            stall_cycles: self.stall_cycles + other.stall_cycles,
        }
    }
}

fn is_zero(value: &u64) -> bool {
    *value == 0
}

/// Counts of a prefetcher of the L2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct PrefetchResult {
    /// Prefetched lines.
    pub lines: u64,
    /// Prefetched lines that were requested while they were in the cache or in flight.
    pub useful_lines: u64,
    /// Prefetches dropped because all MSHRs were in use.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub dropped_lines: u64,
    /// Useful lines that were still in flight when requested.
    pub late_lines: u64,
    /// Prefetched lines that were evicted before they were requested.
    pub evicted_lines: u64,
}

impl PrefetchResult {
    /// The sums of two prefetchers' counts.
    #[must_use]
    pub fn plus(mut self, other: Self) -> Self {
        formats::add_fields!(
            self,
            other,
            lines,
            useful_lines,
            dropped_lines,
            late_lines,
            evicted_lines
        );
        self
    }
}

/// A level below the L2.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct LowerLevelResult {
    /// `L3`, `L4`, ...
    pub name: String,
    /// Line size in bytes.
    pub line_bytes: u32,
    /// `line_misses` over `line_lookups`.
    pub line_miss_rate: f64,
    /// Line misses of the level above.
    pub line_lookups: u64,
    /// Lines fetched from below.
    pub line_misses: u64,
    /// Look-ups of a line in flight (timed and first-miss mode only).
    pub secondary_misses: u64,
}

/// Traffic of a client between chip and memory, over all frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct ClientTraffic {
    /// The client.
    pub client: Client,
    /// Bytes read.
    pub read_bytes: u64,
    /// Bytes written.
    pub write_bytes: u64,
    /// DRAM energy of these bytes in millijoules ([`Device::pj_per_byte`]).
    ///
    /// [`Device::pj_per_byte`]: crate::memory::dram::Device::pj_per_byte
    pub energy_mj: f64,
}

impl ClientTraffic {
    /// Bytes read and written.
    pub const fn bytes(&self) -> u64 {
        self.read_bytes + self.write_bytes
    }
}

/// Counts of vertex processing and binning, over all frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct GeometryCounts {
    /// Triangles of the submitted draws, over all views.
    pub triangles_submitted: u64,
    /// Triangles in at least one tile.
    pub triangles_binned: u64,
    /// Vertex shader invocations.
    pub vertices_shaded: u64,
    /// Entries of all primitive lists.
    pub list_entries: u64,
}

/// Counts of the memory system beside and below the L2. Empty for a machine of two caches and memory.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct MemoryResult {
    /// The prefetcher of the L2, if configured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prefetch: Option<PrefetchResult>,
    /// The MSHRs of the L2, if their number is limited.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub l2_mshrs: Option<MshrResult>,
    /// Lines that inclusive levels invalidated in the levels above, if levels depend on each other's evictions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub invalidated_lines: Option<u64>,
    /// The levels below the L2, if configured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lower_levels: Vec<LowerLevelResult>,
    /// The DRAM below the caches, if configured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dram: Option<DramResult>,
}

impl MemoryResult {
    /// DRAM traffic in bytes, given the line misses and the line size of the L2.
    pub fn external_bytes(&self, l2_line_misses: u64, l2_line_bytes: u32) -> u64 {
        if let Some(last) = self.lower_levels.last() {
            return last.line_misses * u64::from(last.line_bytes);
        }
        let prefetched = self.prefetch.map_or(0, |prefetch| prefetch.lines);
        (l2_line_misses + prefetched) * u64::from(l2_line_bytes)
    }
}

/// One line of text per part of the memory system that has counts.
impl fmt::Display for MemoryResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(prefetch) = &self.prefetch {
            writeln!(
                f,
                "prefetched {} lines: {} useful ({} of them late), {} evicted before their use",
                prefetch.lines, prefetch.useful_lines, prefetch.late_lines, prefetch.evicted_lines
            )?;
        }
        if let Some(mshrs) = &self.l2_mshrs {
            writeln!(
                f,
                "MSHRs of the L2: {} in use at most, {} misses waited {} cycles together",
                mshrs.peak, mshrs.stalled_misses, mshrs.stall_cycles
            )?;
        }
        if let Some(lines) = self.invalidated_lines {
            writeln!(f, "invalidated by inclusive levels: {lines} lines")?;
        }
        for level in &self.lower_levels {
            writeln!(
                f,
                "{}, {}-byte lines: {} look-ups, {} misses ({:.2} %), {} merged",
                level.name,
                level.line_bytes,
                level.line_lookups,
                level.line_misses,
                100.0 * level.line_miss_rate,
                level.secondary_misses
            )?;
        }
        self.dram.iter().try_for_each(|dram| write!(f, "{dram}"))
    }
}

/// A tile of a render pass, by its numbers in the trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileAt {
    /// Index of the render pass.
    pub pass: u32,
    /// Tile number, row by row.
    pub tile: u32,
}

/// The time that a core works on a work item.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TimelineItem {
    /// Number of the core.
    pub core: u32,
    /// Cycle in which the core takes the item.
    pub start_cycle: u64,
    /// Cycle in which the core takes its next item or finishes.
    pub end_cycle: u64,
    /// Cycles in which a footprint left the texture unit.
    pub useful_cycles: u64,
    /// Issue slots of footprints whose lines were missing.
    pub wasted_cycles: u64,
    /// Tiles of the item.
    pub tiles: Vec<TileAt>,
}

/// A line enters or leaves the L2, or one of several private ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct L2Change {
    /// Cycle of the first request after it.
    pub cycle: u64,
    /// Number of the line: address over the line size; [`EMPTY`](crate::memory::EMPTY) if the cache was emptied.
    pub line: u32,
    /// True if the line is in the cache from then on.
    pub is_there: bool,
}

/// A timed replay over time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Timeline {
    /// Work items, sorted by start and core.
    pub items: Vec<TimelineItem>,
    /// Lines fetched by the L2, prefetches included, per interval of [`Self::INTERVAL_CYCLES`].
    pub fetched_lines: Vec<u32>,
    /// By frame, changes of the L2's content in the order of time; empty unless requested. What happens between two
    /// frames is at the start of the later one. Frames after the first 2^24 changes have none.
    pub l2_changes: Vec<Vec<L2Change>>,
}

impl Timeline {
    /// Length of an interval in cycles.
    pub const INTERVAL_CYCLES: u64 = 1024;
}

/// Texture-unit figures of a timed replay, summed over cores.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct TmuResult {
    /// Cycles in which a useful footprint left the pipeline over all cycles, 0 to 1.
    pub utilization: f64,
    /// Footprint issues wasted by looping threads.
    pub wasted_issues: u64,
    /// Threads (quads) executed.
    pub threads: u64,
    /// Additional trips through the pipeline after misses.
    pub loops: u64,
}

/// First look-ups of footprints, counted by the model in which threads stop at their first miss.
/// Lines in flight count as misses, and merged requests count, so these are not traffic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct FirstLookups {
    /// `l1_misses` over footprints.
    pub l1_footprint_miss_rate: f64,
    /// `l2_misses` over `l2_lookups`.
    pub l2_line_miss_rate: f64,
    /// Footprints whose first look-up found a line absent or in flight.
    pub l1_misses: u64,
    /// Lines missing in these footprints.
    pub l2_lookups: u64,
    /// L2 look-ups of lines that were absent or in flight.
    pub l2_misses: u64,
    /// Look-ups served by a fill that its set could not hold.
    pub forwarded: u64,
}

impl FirstLookups {
    /// Computes the rates for this number of footprints.
    #[must_use]
    pub fn over(self, footprints: u64) -> Self {
        let rate = |part: u64, whole: u64| part as f64 / whole.max(1) as f64;
        Self {
            l1_footprint_miss_rate: rate(self.l1_misses, footprints),
            l2_line_miss_rate: rate(self.l2_misses, self.l2_lookups),
            ..self
        }
    }
}

/// L1 and L2 counters of a part of the traffic.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct Part {
    /// Name of the part: a texture's name, `left`, `level 3`, ...
    pub name: String,
    /// First level.
    pub l1: LevelCounters,
    /// Second level.
    pub l2: LevelCounters,
}

/// Per-tile counts of one render pass, row by row.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct TileMap {
    /// Index of the render pass in the trace.
    pub pass: u32,
    /// Tile columns and rows.
    pub tiles: [u32; 2],
    /// Covered lanes over pixels, per tile.
    pub overdraw: Vec<f32>,
    /// Footprints.
    pub footprints: Vec<u32>,
    /// Footprints with at least one L1 miss.
    pub l1_misses: Vec<u32>,
    /// Lines fetched from memory.
    pub l2_misses: Vec<u32>,
}

/// The result of replaying one trace with one configuration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct RunResult {
    /// Quads replayed.
    pub quads: u64,
    /// Covered lanes of the quads.
    pub lanes: u64,
    /// Bilinear footprints.
    pub footprints: u64,
    /// First level, summed over cores.
    pub l1: LevelResult,
    /// Second level.
    pub l2: LevelResult,
    /// DRAM traffic: lines fetched from memory, prefetches included, times the line size of the last level.
    pub external_bytes: u64,
    /// Distinct lines touched: the misses of an infinite cache, a lower bound for L2 misses.
    pub unique_lines: u64,
    /// Order-independent hash of the multiset of accesses, as hex. Checks that no access is lost.
    pub access_hash: String,
    /// Texture unit; `None` in functional mode.
    pub tmu: Option<TmuResult>,
    /// Cycles until the last core finishes; `None` in functional mode.
    pub cycles: Option<u64>,
    /// Rates as the Z2 paper probably counts them; only for the model in which threads stop at their first miss.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_lookups: Option<FirstLookups>,
    /// Counts beside and below the L2.
    #[serde(flatten)]
    pub memory: MemoryResult,
    /// Traffic of the whole frame per client, if the configuration has a `[frame]` table.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clients: Vec<ClientTraffic>,
    /// Counts of vertex processing, if the configuration has a `[frame]` table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub geometry: Option<GeometryCounts>,
    /// The replay over time, only with `--timeline`. It is not stored.
    #[serde(skip)]
    pub timeline: Option<Timeline>,
    /// Per view.
    pub by_view: Vec<Part>,
    /// Per texture, in table order.
    pub by_texture: Vec<Part>,
    /// Per mip level.
    pub by_level: Vec<Part>,
    /// Per draw, in table order, instead of per texture and level; only with `--count-by draw`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub by_draw: Vec<Part>,
    /// Per-tile maps, only with `--tiles` and in reports.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tile_maps: Vec<TileMap>,
}

impl RunResult {
    /// The kind of the parts that counts are broken down by (texture or draw), and the parts.
    pub fn parts(&self) -> (&'static str, &[Part]) {
        match self.by_draw.is_empty() {
            true => ("texture", &self.by_texture),
            false => ("draw", &self.by_draw),
        }
    }
}

/// Identifies the trace of a result.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "testing", derive(schemars::JsonSchema))]
pub struct TraceId {
    /// Name of the file without folder and extension.
    pub name: String,
    /// Scene name in the trace.
    pub scene: String,
    /// Content checksum, 8 hex digits. Captures of the same picture have the same checksum,
    /// whatever program, driver and path made them (FORMAT.md).
    pub checksum: String,
    /// Camera name in the trace.
    pub camera: String,
    /// Name of the display.
    pub display: String,
    /// Width and height of the picture of one eye in pixels.
    pub eye_size_px: [u32; 2],
    /// What figures of the trace lack, such as texture reads that were not recorded.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notices: Vec<String>,
}

impl TraceId {
    /// Identifies the trace in `file`.
    pub fn new(file: &Path, meta: &TraceMeta, content_checksum: u32) -> Self {
        let name = file.file_stem().unwrap_or_default();
        Self {
            name: name.to_string_lossy().into_owned(),
            scene: meta.scene.clone(),
            checksum: format!("{content_checksum:08x}"),
            camera: meta.camera.clone(),
            display: meta.hmd.name.clone(),
            eye_size_px: meta.hmd.eye_size_px,
            notices: notices_of(meta),
        }
    }
}

/// The short name of a scene that a trace records by name or by path.
///
/// A file is named by its stem, or by its folder if that is more specific: `crytek-sponza` for
/// `scenes/crytek-sponza/sponza.gltf`.
pub fn scene_name(scene: &str) -> &str {
    let mut parts = scene.trim_end_matches(['/', '\\']).rsplit(['/', '\\']);
    let file = parts.next().unwrap_or(scene);
    let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
    let says_more = |folder: &&str| folder.contains(stem) || stem == "scene";
    let folder = parts.next().filter(|f| !matches!(*f, "" | "." | ".."));
    folder.filter(says_more).unwrap_or(stem)
}

/// The notices of a trace: texture reads that it lacks, and frames that are no part of the answer.
pub fn notices_of(meta: &TraceMeta) -> Vec<String> {
    let program = meta.program.as_ref();
    let mut notices = program.map_or_else(Vec::new, |program| program.notices());
    if meta.plan.is_some() {
        notices.push("this is a plan of frames, which were not captured".to_owned());
    }
    if let warm @ 1.. = meta.warm_frames.len() {
        let all = meta.frames.len();
        notices.push(format!(
            "{warm} of {all} frames were captured to fill the caches for those after them; `replay sample` leaves them out, other commands count them"
        ));
    }
    notices
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_labelled_with_its_stem_or_else_with_its_folder() {
        for (scene, name) in [
            ("atrium-plain", "atrium-plain"),
            ("../scenes/crytek-sponza/sponza.gltf", "crytek-sponza"),
            ("scenes\\dabrovic-sponza\\sponza.obj", "dabrovic-sponza"),
            ("downloads/red-car/scene.gltf", "red-car"),
            ("scenes/teapot.obj", "teapot"),
            ("scenes/bmw27/bmw_55k.gltf", "bmw_55k"),
            ("../sponza.gltf", "sponza"),
            ("scene.gltf", "scene"),
            ("a.b.glb", "a.b"),
        ] {
            assert_eq!(scene_name(scene), name, "{scene}");
        }
    }
}
